#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <lambent/core/vec.hpp>
#include <lambent/material/albedo_table.hpp>
#include <lambent/material/delta.hpp>
#include <lambent/material/fresnel.hpp>
#include <lambent/material/ggx.hpp>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// What a clear boundary of GGX facets of this roughness (√alpha) reflects and lets through, as energy, of all of what
/// comes from a direction at this cosine, if light meets one facet only, where facets mirror `strength` times what
/// Fresnel's equations say and let through the rest. `eta` is the index of the other side over that of this one, taken
/// to be within [1/4, 4]. Within a percent, but for 5 % at grazing angles inside of glass that hardly refracts. Computed
/// at the first call, which takes some fifty milliseconds; later ones interpolate.
inline Vec2f glass_albedo(float cosine, float roughness, float eta, float strength) {
    // By the amplitude that is mirrored at normal incidence, which treats both sides alike; denser where indices are all
    // but equal, since total reflection sets in there.
    constexpr int slices = 33;
    constexpr double most = 0.6;
    // In the order: mirrored at full strength; let through by facets that mirror nothing; what they'd have mirrored of it.
    static const std::vector<AlbedoTable<Vec3f, 12>> tables = [] {
        std::vector<AlbedoTable<Vec3f, 12>> made;
        for (int k = 0; k < slices; ++k) {
            const double x = 2.0 * k / (slices - 1) - 1, amplitude = most * x * std::abs(x);
            const double index = (1 + amplitude) / (1 - amplitude);
            made.emplace_back([index](double mu, double root) {
                const Ggx<double> facets{root * root};
                const Vec3d wo(std::sqrt((1 - mu) * (1 + mu)), 0, mu);
                const double so = facets.stretched(wo);
                const auto share = [&](double z, const Vec3d& wi) { // of what meets the facet, not masked by others
                    return 4 * z * Ggx<double>::visibility(mu, so, z, facets.stretched(wi)) /
                           Ggx<double>::visible_factor(wo, so);
                };
                constexpr int n = 144, step = 89; // as in ggx_albedo()
                Vec3d sum(0);
                for (int i = 0; i < n; ++i) {
                    const Vec3d m = facets.sample_visible(wo, Vec2d((i * step % n + 0.5) / (2 * n), (i + 0.5) / n));
                    const double facing = std::min(1.0, dot(wo, m));
                    double cos_other = 0, back = 0, through = 0;
                    const double reflectance = dielectric_reflectance(facing, index, cos_other);
                    if (const Vec3d wi = mirrored(wo, m); wi.z > 0) back = share(wi.z, wi);
                    if (cos_other > 0)
                        if (const Vec3d wi = refracted(wo, m, facing, cos_other, index); wi.z < 0)
                            through = share(-wi.z, wi);
                    sum += Vec3d(reflectance * back, through, reflectance * through) / double(n);
                }
                return Vec3f(sum);
            });
        }
        return made;
    }();
    const float amplitude = (eta - 1) / (eta + 1) / float(most);
    const float x = std::copysign(std::sqrt(std::min(std::abs(amplitude), 1.0f)), amplitude);
    const float place = (1 + x) * (float(slices - 1) / 2);
    const std::size_t k = std::size_t(std::min(int(place), slices - 2));
    const float t = place - float(k);
    const Vec3f v = tables[k].at(cosine, roughness) * (1 - t) + tables[k + 1].at(cosine, roughness) * t;
    return {strength * v.x, v.y - strength * v.z};
}

} // namespace LAMBENT_ABI
} // namespace lambent
