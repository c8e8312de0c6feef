#pragma once
#include <lambent/core/config.hpp>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

/// The door to GLM, but for matrices (matrix.hpp): its vectors under our names, and the few functions it lacks. `dot`, `cross`,
/// `length`, `normalize`, `min`, `max`, `abs` and `mix` of vectors are GLM's own, found by argument lookup.
namespace lambent {
inline namespace LAMBENT_ABI {

template <class T> using Vec2 = glm::vec<2, T>; ///< 2 components of type T
template <class T> using Vec3 = glm::vec<3, T>; ///< 3 components of type T
template <class T> using Vec4 = glm::vec<4, T>; ///< 4 components of type T

using Vec2f = Vec2<float>; ///< 2 components in single precision
using Vec3f = Vec3<float>; ///< 3 components in single precision
using Vec4f = Vec4<float>; ///< 4 components in single precision
using Vec2d = Vec2<double>; ///< 2 components in double precision
using Vec3d = Vec3<double>; ///< 3 components in double precision
using Vec4d = Vec4<double>; ///< 4 components in double precision
using UVec3 = glm::vec<3, std::uint32_t>; ///< such as a triangle's indices

/// The largest component.
template <class T>
constexpr T max_component(const Vec3<T>& v) {
    return glm::max(v.x, glm::max(v.y, v.z));
}

/// The smallest component.
template <class T>
constexpr T min_component(const Vec3<T>& v) {
    return glm::min(v.x, glm::min(v.y, v.z));
}

/// Index (0, 1 or 2) of the component of largest magnitude; the first of equals.
template <class T>
constexpr int largest_axis(const Vec3<T>& v) {
    const T x = v.x < 0 ? -v.x : v.x, y = v.y < 0 ? -v.y : v.y, z = v.z < 0 ? -v.z : v.z;
    return x >= y ? (x >= z ? 0 : 2) : (y >= z ? 1 : 2);
}

/// Relative luminance of linear Rec.709 radiance.
template <class T>
constexpr T luminance(const Vec3<T>& rgb) {
    return T(0.2126) * rgb.x + T(0.7152) * rgb.y + T(0.0722) * rgb.z;
}

/// Whether there is no light at all.
template <class T>
constexpr bool is_black(const Vec3<T>& rgb) {
    return rgb.x == 0 && rgb.y == 0 && rgb.z == 0;
}

} // namespace LAMBENT_ABI
} // namespace lambent
