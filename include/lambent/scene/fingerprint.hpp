#pragma once
#include <lambent/core/content_hash.hpp>
#include <lambent/scene/scene.hpp>
#include <cstdint>

namespace lambent {
inline namespace LAMBENT_ABI {

/// A hash of all that a scene's pixels depend on; not of names, notes and cameras. Equal for equal scenes in
/// memory, wherever their files lie. The bindings name every field: a new one has to be placed here as well.
template <class T>
std::uint64_t fingerprint(const Scene<T>& scene) {
    ContentHash hash;
    hash.add(scene.positions);
    hash.add(scene.normals);
    hash.add(scene.texcoords);
    hash.add(scene.colors);
    hash.add(scene.triangles);
    hash.add(scene.triangle_materials);
    hash.add(scene.origin);
    for (const Sphere<T>& sphere : scene.spheres) {
        const auto& [center, radius, material] = sphere;
        hash.add(center);
        hash.add(radius);
        hash.add(material);
    }
    for (const Material& m : scene.materials) {
        const auto& [base_color, emission, base_color_texture, emission_texture, alpha_texture, alpha, alpha_cutoff,
                     alpha_mode, double_sided, name] = m;
        hash.add(base_color);
        hash.add(emission);
        hash.add(base_color_texture);
        hash.add(emission_texture);
        hash.add(alpha_texture);
        hash.add(alpha);
        hash.add(alpha_cutoff);
        hash.add(alpha_mode);
        hash.add(double_sided);
    }
    for (const Texture& t : scene.textures) {
        const auto& [width, height, rgba, color_space, wrap_u, wrap_v, filter, name] = t;
        hash.add(width);
        hash.add(height);
        hash.add(rgba);
        hash.add(color_space);
        hash.add(wrap_u);
        hash.add(wrap_v);
        hash.add(filter);
    }
    for (const PunctualLight& light : scene.punctual_lights) {
        const auto& [kind, position, direction, intensity, inner_cone_cos, outer_cone_cos] = light;
        hash.add(kind);
        hash.add(position);
        hash.add(direction);
        hash.add(intensity);
        hash.add(inner_cone_cos);
        hash.add(outer_cone_cos);
    }
    const auto& [scale, width, height, map, rotation] = scene.environment;
    hash.add(scale);
    hash.add(width);
    hash.add(height);
    hash.add(map);
    hash.add(rotation);
    return hash.value();
}

} // namespace LAMBENT_ABI
} // namespace lambent
