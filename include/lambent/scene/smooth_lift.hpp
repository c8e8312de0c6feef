#pragma once
#include <lambent/core/vec.hpp>
#include <array>
#include <cstddef>

namespace lambent {
inline namespace LAMBENT_ABI {

/// From a point of a triangle, as far as a smooth surface through the triangle's vertices and normals would lie above it:
/// the point is carried onto the tangent plane of each vertex that it lies under, and the results are mixed by its
/// barycentric coordinates. 0 where the surface is flat or hollow; `normals` need not be of unit length, those that don't
/// look to the side of `facing` are left out.
/// source  Hanika, "Hacking the shadow terminator", Ray Tracing Gems II, chapter 4 (2021)
template <class T>
Vec3<T> smooth_lift(const Vec3<T>& point, const std::array<Vec3<T>, 3>& vertices, const std::array<Vec3<T>, 3>& normals,
                    const Vec3<T>& barycentric, const Vec3<T>& facing) {
    Vec3<T> lift(0);
    for (std::size_t i = 0; i < 3; ++i) {
        const Vec3<T>& n = normals[i];
        const T below = dot(vertices[i] - point, n), length2 = dot(n, n);
        if (below > 0 && dot(n, facing) > 0 && length2 > T(1e-12)) lift += n * (barycentric[int(i)] * below / length2);
    }
    return lift;
}

} // namespace LAMBENT_ABI
} // namespace lambent
