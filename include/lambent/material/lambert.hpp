#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec.hpp>
#include <lambent/material/bsdf.hpp>
#include <lambent/sampling/warp.hpp>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Ideal diffuse reflection: f = albedo / π above the surface, 0 below. Drawn with the cosine, so that every
/// sample weighs the albedo.
template <class T>
struct Lambert {
    using Scalar = T;
    Vec3<T> albedo{0}; ///< in [0, 1]

    Vec3<T> eval(const Vec3<T>& /*wo*/, const Vec3<T>& wi) const {
        return wi.z > 0 ? albedo * inv_pi<T> : Vec3<T>(0);
    }
    T pdf(const Vec3<T>& /*wo*/, const Vec3<T>& wi) const { return wi.z > 0 ? wi.z * inv_pi<T> : T(0); }
    BsdfSample<T> sample(const Vec3<T>& wo, T /*pick*/, const Vec2<T>& u) const {
        const Vec3<T> wi = square_to_cosine_hemisphere(u);
        return {wi, albedo, pdf(wo, wi)};
    }
};

static_assert(Bsdf<Lambert<float>>);

} // namespace LAMBENT_ABI
} // namespace lambent
