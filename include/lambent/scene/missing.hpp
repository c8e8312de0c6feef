#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/scene/camera.hpp>
#include <lambent/scene/scene.hpp>
#include <algorithm>
#include <cmath>

/// What files leave out, and an image takes: light, and a camera.
namespace lambent {
inline namespace LAMBENT_ABI {

/// Daylight without a sun, for scenes that bring no light: bluish above, white at the horizon, a dim ground
/// below, so that even a white scene shows its shapes. Radiance 0.2 to 1.
inline Environment soft_sky() {
    Environment sky;
    sky.scale = Vec3f(1);
    sky.width = 1;
    sky.height = 64;
    const Vec3f zenith(0.45f, 0.65f, 1.0f), horizon(1.0f), ground(0.22f, 0.21f, 0.2f);
    for (int row = 0; row < sky.height; ++row) {
        const float y = std::cos((float(row) + 0.5f) / float(sky.height) * pi<float>); // of the direction
        const float below = std::clamp(-10 * y, 0.0f, 1.0f);
        sky.map.push_back(y > 0 ? mix(horizon, zenith, std::sqrt(y)) : mix(horizon, ground, below));
    }
    return sky;
}

/// Whether anything shines: an environment, a punctual light, a material.
template <class T>
bool has_light(const Scene<T>& scene) {
    return !scene.environment.black() || !scene.punctual_lights.empty() ||
           std::any_of(scene.materials.begin(), scene.materials.end(), [](const Material& m) { return m.emissive(); });
}

/// Puts a scene in which nothing shines under soft_sky(), and says so in its notes.
template <class T>
void add_missing_light(Scene<T>& scene) {
    if (has_light(scene)) return;
    scene.environment = soft_sky();
    scene.notes.push_back("no light in the scene: lit by a soft sky of radiance 0.2 to 1");
}

/// Gives a scene without cameras one that sees all of it, in an image of that width to height.
template <class T>
void add_missing_camera(Scene<T>& scene, double aspect = 16.0 / 9.0) {
    if (scene.cameras.empty()) scene.cameras.push_back(framing_camera(scene.bounds(), aspect));
}

} // namespace LAMBENT_ABI
} // namespace lambent
