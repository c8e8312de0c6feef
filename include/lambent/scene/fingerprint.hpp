#pragma once
#include <lambent/core/content_hash.hpp>
#include <lambent/scene/scene.hpp>
#include <cstdint>
#include <type_traits>

namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {
template <class V>
void add_to(ContentHash& hash, const V& value) {
    if constexpr (std::is_same_v<V, Texture>) {
        const auto& [image, color_space, wrap_u, wrap_v, filter, set, row_u, row_v, shift] = value;
        const auto add = [&](const auto&... fields) { (hash.add(fields), ...); };
        add(image, color_space, wrap_u, wrap_v, filter, set, row_u, row_v, shift);
    } else {
        hash.add(value);
    }
}
} // namespace detail

/// A hash of all that a scene's pixels depend on; not of names, notes and cameras. Equal for equal scenes in
/// memory, wherever their files lie. The bindings name every field: a new one has to be placed here as well.
template <class T>
std::uint64_t fingerprint(const Scene<T>& scene) {
    ContentHash hash;
    const auto add_all = [&](const auto&... values) { (detail::add_to(hash, values), ...); };
    add_all(scene.positions, scene.normals, scene.tangents, scene.texcoords, scene.texcoords1, scene.colors,
            scene.triangles, scene.triangle_materials, scene.origin, scene.compensated);
    for (const Sphere<T>& sphere : scene.spheres) {
        const auto& [center, radius, material] = sphere;
        add_all(center, radius, material);
    }
    for (const Material& m : scene.materials) {
        const auto& [name, base_color, base_color_texture, alpha, alpha_cutoff, alpha_texture, alpha_mode, double_sided,
                     front_only, metallic, roughness, metallic_roughness_texture, normal_texture, normal_scale, emission,
                     emission_texture, ior, specular, specular_texture, specular_color, specular_color_texture,
                     transmission, transmission_texture, thickness, attenuation_color, attenuation_distance, clearcoat,
                     clearcoat_roughness, clearcoat_texture, clearcoat_roughness_texture, sheen_color, sheen_roughness,
                     sheen_color_texture, sheen_roughness_texture, unlit] = m;
        add_all(base_color, base_color_texture, alpha, alpha_cutoff, alpha_texture, alpha_mode, double_sided, front_only,
                metallic, roughness, metallic_roughness_texture, normal_texture, normal_scale, emission, emission_texture, ior,
                specular, specular_texture, specular_color, specular_color_texture, transmission, transmission_texture,
                thickness, attenuation_color, attenuation_distance, clearcoat, clearcoat_roughness, clearcoat_texture,
                clearcoat_roughness_texture, sheen_color, sheen_roughness, sheen_color_texture, sheen_roughness_texture,
                unlit);
    }
    for (const Image& i : scene.images) {
        const auto& [width, height, rgba, name] = i;
        add_all(width, height, rgba);
    }
    for (const PunctualLight& light : scene.punctual_lights) {
        const auto& [kind, position, direction, intensity, inner_cone_cos, outer_cone_cos] = light;
        add_all(kind, position, direction, intensity, inner_cone_cos, outer_cone_cos);
    }
    const auto& [scale, width, height, map, rotation] = scene.environment;
    add_all(scale, width, height, map, rotation);
    return hash.value();
}

} // namespace LAMBENT_ABI
} // namespace lambent
