#pragma once
#include <lambent/core/vec.hpp>
#include <lambent/material/bsdf.hpp>
#include <lambent/material/fresnel.hpp>

namespace lambent {
inline namespace LAMBENT_ABI {

/// wo mirrored at the facet of unit normal m.
template <class T>
Vec3<T> mirrored(const Vec3<T>& wo, const Vec3<T>& m) {
    return 2 * dot(wo, m) * m - wo;
}

/// wo refracted at the facet of unit normal m, which it sees at `cosine` and leaves behind at `cos_other`, as
/// dielectric_reflectance() gives it; unit but for rounding.
template <class T>
Vec3<T> refracted(const Vec3<T>& wo, const Vec3<T>& m, T cosine, T cos_other, T eta) {
    return (cosine / eta - cos_other) * m - wo / eta;
}

/// An exact mirror.
template <class T>
struct Mirror {
    using Scalar = T;
    Vec3<T> reflectance{1}; ///< in [0, 1], at every angle

    static constexpr bool only_delta() { return true; }
    Vec3<T> eval(const Vec3<T>& /*wo*/, const Vec3<T>& /*wi*/) const { return Vec3<T>(0); }
    T pdf(const Vec3<T>& /*wo*/, const Vec3<T>& /*wi*/) const { return 0; }
    BsdfSample<T> sample(const Vec3<T>& wo, T /*pick*/, const Vec2<T>& /*u*/) const {
        if (!(wo.z > 0)) return {};
        return {.wi = {-wo.x, -wo.y, wo.z}, .weight = reflectance, .pdf = 1, .eta_scale = 1, .delta = true};
    }
};

/// An exact boundary between two clear media: mirrors by Fresnel's equations, refracts what is left by Snell's law.
/// Chosen by the reflectance, so that energy never weighs anything but 1.
template <class T>
struct Dielectric {
    using Scalar = T;
    T eta = T(1.5); ///< index of the side below over that of the viewer's, > 0

    static constexpr bool only_delta() { return true; }
    static constexpr bool transmits() { return true; }
    Vec3<T> eval(const Vec3<T>& /*wo*/, const Vec3<T>& /*wi*/) const { return Vec3<T>(0); }
    T pdf(const Vec3<T>& /*wo*/, const Vec3<T>& /*wi*/) const { return 0; }
    BsdfSample<T> sample(const Vec3<T>& wo, T pick, const Vec2<T>& /*u*/) const {
        if (!(wo.z > 0)) return {};
        T cos_other = 0;
        const T reflectance = dielectric_reflectance(glm::min(wo.z, T(1)), eta, cos_other);
        if (pick < reflectance)
            return {
                .wi = {-wo.x, -wo.y, wo.z}, .weight = Vec3<T>(1), .pdf = reflectance, .eta_scale = 1, .delta = true};
        const T eta2 = eta * eta;
        return {.wi = {-wo.x / eta, -wo.y / eta, -cos_other},
                .weight = Vec3<T>(1 / eta2),
                .pdf = 1 - reflectance,
                .eta_scale = eta2,
                .delta = true};
    }
};

static_assert(Bsdf<Mirror<float>> && Bsdf<Dielectric<float>>);

} // namespace LAMBENT_ABI
} // namespace lambent
