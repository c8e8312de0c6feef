#pragma once
#include <cmath>
#include <lambent/core/numerics.hpp>
#include <lambent/core/sincos.hpp>
#include <lambent/core/vec.hpp>
#include <limits>

/// Maps from the unit square to shapes, each beside its density. They keep areas, and neighbours
/// neighbours, so that well-spread points stay so. u lies in [0, 1)²; the axis of every shape is +z;
/// directions have unit length; densities are over solid angle, or over area for disk and triangle. Disk, cosine-weighted
/// hemisphere and triangle take Packs of floats as well.
namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {
/// A point of the disk, and its distance from the centre with less rounding than its length has.
template <class T>
struct DiskPoint {
    Vec2<T> p;
    T radius; ///< in [0, 1), never 1
};

/// source  Shirley, Chiu, "A low distortion map between disk and square", JGT 2:3 (1997)
template <class T>
inline DiskPoint<T> concentric_disk(const Vec2<T>& u) {
    using std::abs;
    using S = ScalarOf<T>;
    constexpr S half_step = std::numeric_limits<S>::epsilon() / 2; // u = 0 must not reach the rim either
    const T a = T(S(2)) * u.x - T(S(1)) + T(half_step), b = T(S(2)) * u.y - T(S(1)) + T(half_step);
    const auto a_is_larger = abs(a) > abs(b);
    const T r = select(a_is_larger, a, b), other = select(a_is_larger, b, a);
    const T angle = T(pi<S> / 4) * (other / select(r == T(S(0)), T(S(1)), r)); // 0 in the middle, where both are
    const SineCosine<T> turn = sincos_of_octant(angle);
    const T along = r * turn.cosine, across = r * turn.sine;
    return {{select(a_is_larger, along, across), select(a_is_larger, across, along)}, abs(r)};
}
} // namespace detail

/// Uniform on the unit disk.
template <class T>
inline Vec2<T> square_to_disk(const Vec2<T>& u) {
    return detail::concentric_disk(u).p;
}
/// Density of square_to_disk() by area.
template <class T>
constexpr T disk_pdf() {
    return inv_pi<T>;
}

/// Cosine-weighted on the hemisphere around +z. The density of what it returns is never 0.
template <class T>
inline Vec3<T> square_to_cosine_hemisphere(const Vec2<T>& u) {
    using std::sqrt;
    const T one(ScalarOf<T>(1));
    const detail::DiskPoint<T> d = detail::concentric_disk(u);
    return {d.p.x, d.p.y, sqrt((one - d.radius) * (one + d.radius))};
}
/// Density of square_to_cosine_hemisphere() by solid angle.
template <class T>
constexpr T cosine_hemisphere_pdf(T cos_theta) {
    return cos_theta > 0 ? cos_theta * inv_pi<T> : T(0);
}

/// Uniform on the hemisphere around +z.
template <class T>
inline Vec3<T> square_to_uniform_hemisphere(const Vec2<T>& u) {
    const detail::DiskPoint<T> d = detail::concentric_disk(u);
    const T r2 = d.radius * d.radius;
    const T stretch = std::sqrt(2 - r2);
    return {d.p.x * stretch, d.p.y * stretch, (1 - d.radius) * (1 + d.radius)};
}
/// Density of square_to_uniform_hemisphere() by solid angle.
template <class T>
constexpr T uniform_hemisphere_pdf() {
    return inv_pi<T> / 2;
}

/// Uniform on the whole sphere.
template <class T>
inline Vec3<T> square_to_uniform_sphere(const Vec2<T>& u) {
    const T radius = 2 * std::sqrt(u.x * (1 - u.x));
    const SineCosine<T> phi = sincos_of_turn(u.y);
    return {radius * phi.cosine, radius * phi.sine, 1 - 2 * u.x};
}
/// Density of square_to_uniform_sphere() by solid angle.
template <class T>
constexpr T uniform_sphere_pdf() {
    return inv_pi<T> / 4;
}

/// 1 − cos of a cone's half angle (at most 90°) from the square of its sine, with full precision also where
/// the cosine rounds to 1. For a sphere seen from outside sin² is radius² / distance².
template <class T>
inline T one_minus_cos(T sin2_theta_max) {
    return sin2_theta_max / (1 + safe_sqrt(1 - sin2_theta_max));
}

/// Uniform in the cone around +z whose half angle, at most 90°, has this squared sine, in (0, 1].
template <class T>
inline Vec3<T> square_to_uniform_cone(const Vec2<T>& u, T sin2_theta_max) {
    const detail::DiskPoint<T> d = detail::concentric_disk(u);
    const T full_height = one_minus_cos(sin2_theta_max);
    const T height = d.radius * d.radius * full_height; // of the cap above the sample
    const T stretch = std::sqrt(full_height * (2 - height));
    return {d.p.x * stretch, d.p.y * stretch, 1 - height};
}
/// Density inside the cone.
template <class T>
inline T uniform_cone_pdf(T sin2_theta_max) {
    return inv_pi<T> / (2 * one_minus_cos(sin2_theta_max));
}

/// Uniform on a triangle: the barycentric weights of its second and third vertex, as in Hit.
/// source  Heitz, "A low-distortion map between triangle and square" (2019)
template <class T>
constexpr Vec2<T> square_to_triangle(const Vec2<T>& u) {
    const auto upper = u.y > u.x;
    const T half(ScalarOf<T>(0.5)), x = u.x * half, y = u.y * half;
    return {select(upper, x, u.x - y), select(upper, u.y - x, y)};
}
/// Density of square_to_triangle() by area.
template <class T>
constexpr T triangle_pdf(T area) {
    return 1 / area;
}

} // namespace LAMBENT_ABI
} // namespace lambent
