#pragma once
#include <lambent/core/vec.hpp>
#include <lambent/io/mtl.hpp>
#include <algorithm>
#include <cmath>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// A surface in the parameters of glTF's metallic-roughness material and its extensions. Colours are linear.
struct MtlSurface {
    Vec3f base_color{0.8f};  ///< in [0, 1]
    Vec3f emission{0};       ///< radiance, >= 0
    float alpha = 1;         ///< coverage in [0, 1]: below 1 what lies behind shows between
    float metallic = 0;      ///< in [0, 1]
    float roughness = 1;     ///< in [0, 1]; the microfacets' width is its square
    float ior = 1.5f;        ///< >= 1
    float specular = 0;      ///< in [0, 1], the highlight's strength: reflectance at grazing angles
    Vec3f specular_color{1}; ///< reflectance at normal incidence over the one of `ior`
    float transmission = 0;  ///< 1: glass, tinted by base_color
    float clearcoat = 0, clearcoat_roughness = 0;
    Vec3f sheen_color{0};
    float sheen_roughness = 0.5f;
};

/// A Phong exponent as the roughness of a microfacet distribution with a highlight as wide: α² = 2 / (Ns + 2), and
/// α = roughness².
/// source  Walter, Marschner, Li, Torrance, Microfacet models for refraction, EGSR 2007, §5.2
inline float roughness_of_exponent(float shininess) { return std::pow(2 / (std::max(shininess, 0.0f) + 2), 0.25f); }

/// The surface that a material of an MTL file means, without its textures.
///
/// illum 0-2, 10  Lambert with Kd. Model 2, or no illum, with Ks > 0 adds a dielectric highlight of reflectance
///                F0 = 0.08 Ks, as wide as Ns says. Ks is no reflectance: in the format's formula Ks cos^Ns carries
///                2 Ks / (Ns + 1) of the light, 0.18 to 0.02 for the usual exponents of 10 to 100; and Blender's
///                exporter writes its `specular` there, which stands for 0.08 of itself. Ni is not looked at: many files
///                say 1.
/// illum 3, 5, 8  a mirror of reflectance Ks over Lambert with Kd: a metal of colour Kd + Ks, at most 1, to the part
///                that Ks has in the sum (luminances). Rough by Ns, if that is given; a sharp mirror else.
/// illum 4, 6, 7, 9  clear glass of index Ni (1.5 when absent or below 1), tinted by Tf (colourless when absent). Kd,
///                Ks, Ns and d are not looked at.
/// d or Tr        coverage, but for glass
/// Ke             radiance
/// Pr Pm          a metallic-roughness surface of Kd, in place of what an illum without glass makes of Ks and Ns, with
///                index Ni where that is above 1, else 1.5; of glass, Pr is the roughness
/// Ps Pc Pcr      sheen (white), coat and its roughness; they add to any of the above
/// ignored        Ka (there is no ambient light), Kt, Km, sharpness, aniso, anisor, illum's shadow and ray tracing
///                switches (all surfaces cast shadows and reflect what there is)
inline MtlSurface surface_of(const MtlMaterial& m) {
    const auto unit = [](float x) { return std::clamp(x, 0.0f, 1.0f); };
    Vec3f specular = clamp(m.specular.value_or(Vec3f(0)), Vec3f(0), Vec3f(1));
    if (max_component(specular) < 1e-6f) specular = Vec3f(0); // so small that ratios of it would overflow
    const int model = m.illumination.value_or(is_black(specular) ? 1 : 2);
    const bool mirror = model == 3 || model == 5 || model == 8;
    const bool glass = model == 4 || model == 6 || model == 7 || model == 9;
    const bool physical = m.roughness || m.metallic || !m.roughness_map.file.empty() || !m.metallic_map.file.empty();

    MtlSurface s;
    s.base_color = clamp(m.diffuse, Vec3f(0), Vec3f(1));
    s.emission = max(m.emission.value_or(Vec3f(0)), Vec3f(0));
    if (m.shininess) s.roughness = roughness_of_exponent(*m.shininess);
    if (glass) {
        s.transmission = 1;
        s.base_color = clamp(m.filter.value_or(Vec3f(1)), Vec3f(0), Vec3f(1));
        s.specular = 1;
        s.ior = m.index && *m.index >= 1 ? *m.index : 1.5f;
        s.roughness = unit(m.roughness.value_or(0.0f));
    } else if (physical) {
        s.metallic = unit(m.metallic.value_or(m.metallic_map.file.empty() ? 0.0f : 1.0f));
        if (m.roughness || !m.roughness_map.file.empty()) s.roughness = unit(m.roughness.value_or(1.0f));
        s.specular = 1;
        if (m.index && *m.index > 1) s.ior = *m.index;
    } else if (mirror && !is_black(specular)) {
        const float reflected = luminance(specular);
        s.metallic = reflected / (reflected + luminance(s.base_color));
        s.base_color = min(s.base_color + specular, Vec3f(1));
        if (!m.shininess) s.roughness = 0;
    } else if (model == 2) {
        s.specular = unit(2 * max_component(specular)); // F0 = 0.04 · specular · specular_color at an index of 1.5
        if (s.specular > 0) s.specular_color = specular * (2 / s.specular);
    }
    if (!glass) s.alpha = m.opacity;
    s.sheen_color = Vec3f(unit(m.sheen.value_or(0.0f)));
    s.clearcoat = unit(m.clearcoat.value_or(0.0f));
    s.clearcoat_roughness = unit(m.clearcoat_roughness.value_or(0.0f));
    return s;
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
