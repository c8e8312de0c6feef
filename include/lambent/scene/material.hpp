#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec.hpp>
#include <lambent/scene/texture.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

namespace lambent {
inline namespace LAMBENT_ABI {

/// opaque: there is a surface. mask: where alpha reaches the cutoff. blend: with the chance alpha.
enum class AlphaMode : std::uint8_t { opaque, mask, blend };

/// What a surface is made of, as plain data: glTF's metallic-roughness model and its extensions, by their names and in
/// their units. Every factor is multiplied by its texture, where there is one. The default is Lambert's: `specular` 0.
struct Material {
    std::string name;
    Vec3f base_color{0.8f};                ///< linear reflectance in [0, 1]; of metals the reflection's colour
    Texture base_color_texture;            ///< its alpha multiplies `alpha`
    float alpha = 1;                       ///< coverage, in [0, 1]
    float alpha_cutoff = 0.5f;             ///< of AlphaMode::mask
    Texture alpha_texture;                 ///< coverage in an image of its own (MTL map_d): its red channel
    AlphaMode alpha_mode = AlphaMode::opaque;
    bool double_sided = false; ///< emits from both sides; every surface reflects on both
    bool front_only = false;   ///< cameras see through its back side, as rasterisers have it; light meets both sides

    float metallic = 0, roughness = 1;     ///< roughness = √alpha of the microfacets
    Texture metallic_roughness_texture;    ///< green: roughness, blue: metallic
    Texture normal_texture;                ///< tangent space, 2 · rgb - 1
    float normal_scale = 1;                ///< of its x and y

    Vec3f emission{0};                     ///< linear radiance, from the front side; from both where double_sided
    Texture emission_texture;

    float ior = 1.5f;                      ///< index of refraction
    float specular = 0;                    ///< strength of the dielectric highlight, in [0, 1]; glTF's default is 1
    Texture specular_texture;              ///< alpha
    Vec3f specular_color{1};               ///< of its reflection at normal incidence
    Texture specular_color_texture;
    float transmission = 0;                ///< share of the diffuse light that goes through, in [0, 1]
    Texture transmission_texture;          ///< red
    float thickness = 0;                   ///< 0: a thin sheet; else the surface bounds a volume
    Vec3f attenuation_color{1};            ///< what is left of white light after attenuation_distance in the volume
    float attenuation_distance = std::numeric_limits<float>::infinity(); ///< metres
    float clearcoat = 0, clearcoat_roughness = 0;
    Texture clearcoat_texture;             ///< red
    Texture clearcoat_roughness_texture;   ///< green
    Vec3f sheen_color{0};
    float sheen_roughness = 0;
    Texture sheen_color_texture;
    Texture sheen_roughness_texture;       ///< alpha
    bool unlit = false;                    ///< shows its base colour whatever the light

    bool emissive() const { return max_component(emission) > 0; }
    /// Whether it is Lambert's everywhere: factors of 0 make textures idle.
    bool diffuse() const {
        return metallic <= 0 && specular <= 0 && transmission <= 0 && clearcoat <= 0 && is_black(sheen_color);
    }

    /// Whether light may go straight through it: a clear sheet, or one that does not refract.
    bool may_be_pane() const {
        const bool textured = bool(metallic_roughness_texture);
        return transmission > 0 && (metallic < 1 || textured) &&
               ((!(thickness > 0) && (roughness < 0.01f || textured)) || std::abs(ior - 1) < 1e-3f);
    }

    /// Calls f(texture) for every texture slot.
    template <class M, class F>
    static void for_each_texture(M& m, F&& f) {
        f(m.base_color_texture), f(m.alpha_texture), f(m.metallic_roughness_texture), f(m.normal_texture);
        f(m.emission_texture), f(m.specular_texture), f(m.specular_color_texture), f(m.transmission_texture);
        f(m.clearcoat_texture), f(m.clearcoat_roughness_texture), f(m.sheen_color_texture);
        f(m.sheen_roughness_texture);
    }
};

} // namespace LAMBENT_ABI
} // namespace lambent
