#include "scenes.hpp"
#include <lambent/core/numerics.hpp>
#include <lambent/sampling/hash.hpp>
#include <lambent/sampling/warp.hpp>
#include <array>
#include <cmath>

using namespace lambent;

namespace {

Camera seen_from(const Vec3d& eye, double vertical_fov) {
    Camera camera;
    camera.eye = eye;
    camera.target = {0, 0, 0};
    camera.vertical_fov = vertical_fov;
    return camera;
}

Vec3f random_direction(std::uint64_t key) {
    return square_to_uniform_sphere(Vec2f(to_unit<float>(derive_key(key, 0)), to_unit<float>(derive_key(key, 1))));
}

/// The corners of a square across `direction`.
std::array<Vec3f, 4> ring(const Vec3f& center, const Vec3f& direction, float radius) {
    const Vec3f axis = std::abs(direction.x) < 0.9f ? Vec3f(1, 0, 0) : Vec3f(0, 1, 0);
    const Vec3f a = radius * normalize(cross(direction, axis)), b = cross(direction, a);
    return {center + a, center + b, center - a, center - b};
}

} // namespace

BenchScene blob(int faces) {
    BenchScene scene{{}, seen_from({0, 0.5, 3}, Camera{}.vertical_fov)};
    scene.soup.name = "blob";
    const int rings = int(std::sqrt(double(faces) / 4)), segments = 2 * rings;
    const auto at = [&](int ring, int segment) {
        const double theta = pi<double> * ring / rings, phi = 2 * pi<double> * (segment % segments) / segments;
        const Vec3d d(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi));
        return Vec3f(d * (1 + 0.15 * std::sin(7 * d.x) * std::sin(9 * d.y) * std::sin(8 * d.z + 1)));
    };
    for (int r = 0; r < rings; ++r)
        for (int s = 0; s < segments; ++s) {
            const Vec3f a = at(r, s), b = at(r + 1, s), c = at(r + 1, s + 1), d = at(r, s + 1);
            if (r + 1 < rings) scene.soup.add(a, b, c);
            if (r > 0) scene.soup.add(a, c, d);
        }
    return scene;
}

BenchScene hair(int strands) {
    constexpr int segments = 24;
    constexpr float ball = 0.3f, radius = 0.0015f, step = 0.05f, curl = 0.55f;
    BenchScene scene{{}, seen_from({0, 0.3, 2.6}, 45)};
    scene.soup.name = "hair";
    for (int strand = 0; strand < strands; ++strand) {
        const std::uint64_t key = derive_key(7, std::uint64_t(strand));
        Vec3f direction = random_direction(derive_key(key, 0)), position = ball * direction;
        std::array<Vec3f, 4> from = ring(position, direction, radius);
        for (int segment = 1; segment <= segments; ++segment) {
            position += step * direction;
            direction = normalize(direction + curl * random_direction(derive_key(key, std::uint64_t(segment))));
            const std::array<Vec3f, 4> to = ring(position, direction, radius);
            for (std::size_t i = 0; i < 4; ++i) {
                const std::size_t j = (i + 1) % 4;
                scene.soup.add(from[i], from[j], to[j]);
                scene.soup.add(from[i], to[j], to[i]);
            }
            from = to;
        }
    }
    return scene;
}
