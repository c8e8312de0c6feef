#pragma once
#include <cmath>
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec.hpp>
#include <lambent/material/albedo_table.hpp>
#include <lambent/material/fresnel.hpp>
#include <lambent/material/ggx.hpp>

namespace lambent {
inline namespace LAMBENT_ABI {

/// What GGX facets of this roughness (√alpha) reflect in all of what comes from a direction at this cosine, if light
/// meets one facet only: with Schlick's Fresnel it is f0 · x + f90 · y, and x + y where every facet is a mirror. Within
/// half a percent, but for roughness below 0.2 at cosines below its square, where it may be off by 5 %. Computed at the
/// first call, which takes some milliseconds; later ones interpolate.
/// source  the split of Karis, Real Shading in Unreal Engine 4 (2013)
inline Vec2f ggx_albedo(float cosine, float roughness) {
    static const AlbedoTable<Vec2f> table([](double mu, double root) {
        const Ggx<double> facets{root * root};
        const Vec3d wo(std::sqrt((1 - mu) * (1 + mu)), 0, mu);
        const double so = facets.stretched(wo), factor = facets.bounded_factor(wo, so);
        constexpr int n = 377, step = 233; // Fibonacci's lattice, over half of the azimuths: the others mirror them
        Vec2d sum(0);
        for (int i = 0; i < n; ++i) {
            const Vec3d m = facets.sample_bounded(wo, Vec2d((i * step % n + 0.5) / (2 * n), (i + 0.5) / n));
            const double facing = dot(wo, m);
            const Vec3d wi = 2 * facing * m - wo;
            if (!(wi.z > 0)) continue;
            const double weight = Ggx<double>::visibility(mu, so, wi.z, facets.stretched(wi)) * wi.z / factor;
            const double grazing = schlick_weight(facing);
            sum += Vec2d(1 - grazing, grazing) * (weight / n);
        }
        return Vec2f(sum);
    });
    return table.at(cosine, roughness);
}

} // namespace LAMBENT_ABI
} // namespace lambent
