// contributing: begin
#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/material/bsdf.hpp>
#include <lambent/sampling/warp.hpp>
#include <algorithm>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Diffuse reflection of a surface of rough, matte facets: flatter than Lambert's. Drawn with the cosine.
/// source  Oren, Nayar: Generalization of Lambert's reflectance model, SIGGRAPH 1994, the qualitative model
template <class T>
struct OrenNayar {
    using Scalar = T;
    Vec3<T> albedo{0}; ///< in [0, 1]; of the facets
    T sigma = 0;       ///< standard deviation of the facets' slope angle, radians; 0 is Lambert's

    Vec3<T> eval(const Vec3<T>& wo, const Vec3<T>& wi) const {
        if (!(wi.z > 0) || !(wo.z > 0)) return Vec3<T>(0);
        const T s2 = sigma * sigma, a = 1 - s2 / (2 * (s2 + T(0.33))), b = T(0.45) * s2 / (s2 + T(0.09));
        // cos(phi_i - phi_o) sin(theta_i) sin(theta_o), and the larger angle's cosine under the smaller one's tangent
        const T across = wi.x * wo.x + wi.y * wo.y;
        return albedo * inv_pi<T> * (a + b * std::max(T(0), across) / std::max(wi.z, wo.z));
    }
    T pdf(const Vec3<T>& /*wo*/, const Vec3<T>& wi) const { return wi.z > 0 ? wi.z * inv_pi<T> : T(0); }
    BsdfSample<T> sample(const Vec3<T>& wo, T /*pick*/, const Vec2<T>& u) const {
        const Vec3<T> wi = square_to_cosine_hemisphere(u);
        return {wi, eval(wo, wi) * pi<T>, pdf(wo, wi)};
    }
};

static_assert(Bsdf<OrenNayar<float>>);

} // namespace LAMBENT_ABI
} // namespace lambent
// contributing: end
