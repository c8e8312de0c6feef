#pragma once
#include <cmath>
#include <lambent/core/vec.hpp>

namespace lambent {
inline namespace LAMBENT_ABI {

/// (1 - cosine)⁵, the weight of Schlick's f90.
template <class T>
T schlick_weight(T cosine) {
    const T m = glm::max(T(0), 1 - cosine), m2 = m * m;
    return m2 * m2 * m;
}

/// Schlick's reflectance at a cosine in [0, 1], from f0 at normal incidence to f90 at grazing angles.
/// source  Schlick, Computer Graphics Forum 13:3 (1994); with f90 as in glTF 2.0, appendix B
template <class T>
Vec3<T> schlick(const Vec3<T>& f0, T f90, T cosine) {
    return f0 + (Vec3<T>(f90) - f0) * schlick_weight(cosine);
}

/// Reflectance of unpolarised light at a smooth boundary, at a cosine in [0, 1] on the side that it comes from; `eta`
/// is the index of the other side over that of this one. 1 in total reflection. `cos_other` gets the refracted ray's
/// cosine.
template <class T>
T dielectric_reflectance(T cosine, T eta, T& cos_other) {
    const T sin2 = glm::max(T(0), (1 - cosine) * (1 + cosine)) / (eta * eta);
    cos_other = 0;
    if (sin2 >= 1) return 1;
    cos_other = std::sqrt(1 - sin2);
    const T parallel = (eta * cosine - cos_other) / (eta * cosine + cos_other);
    const T perpendicular = (cosine - eta * cos_other) / (cosine + eta * cos_other);
    return (parallel * parallel + perpendicular * perpendicular) / 2;
}

/// Reflectance at normal incidence.
template <class T>
T dielectric_f0(T ior) {
    const T r = (ior - 1) / (ior + 1);
    return r * r;
}

} // namespace LAMBENT_ABI
} // namespace lambent
