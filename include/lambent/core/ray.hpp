#pragma once
#include <lambent/core/vec.hpp>
#include <concepts>
#include <cstdint>
#include <limits>

namespace lambent {
inline namespace LAMBENT_ABI {

/// A half-open piece of a line: the points origin + t · direction with t_min <= t < t_max.
/// The direction need not be of unit length; t counts in units of it.
template <class T>
struct Ray {
    Vec3<T> origin{0};
    Vec3<T> direction{0, 0, 1};
    T t_min = 0;
    T t_max = std::numeric_limits<T>::infinity();
};

using Rayf = Ray<float>; ///< in single precision
using Rayd = Ray<double>; ///< in double precision

/// Makes a Ray<T> of the caller's own ray type R, where one is asked for; rays then stay in the caller's arrays.
///     const auto as_ray = [](const MyRay& r) { return Rayf{r.from, r.to - r.from, 0, 1}; };
template <class P, class R, class T>
concept RayProjection = requires(const P& projection, const R& ray) {
    { projection(ray) } -> std::convertible_to<Ray<T>>;
};

inline constexpr std::uint32_t no_primitive = 0xffffffffu; ///< the primitive of a miss

/// Where a ray met a primitive. A miss is a Hit that converts to false.
template <class T>
struct Hit {
    T t = std::numeric_limits<T>::infinity(); ///< in units of |direction|
    T u = 0;                                  ///< barycentric weight of the triangle's second vertex
    T v = 0;                                  ///< barycentric weight of its third vertex
    std::uint32_t primitive = no_primitive;   ///< index into the caller's primitives
    std::uint32_t instance = 0;               ///< index into the caller's instances; 0 without instancing

    explicit operator bool() const { return primitive != no_primitive; }
};

} // namespace LAMBENT_ABI
} // namespace lambent
