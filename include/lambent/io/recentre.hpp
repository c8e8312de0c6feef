#pragma once
#include <lambent/core/bounds.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/scene/scene.hpp>
#include <cmath>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Where a scene of these bounds should have its origin: (0, 0, 0), unless the box's farthest corner is
/// farther away than the box is long; then its centre, rounded to a grid of a 1024th of its length so that
/// the subtraction from coordinates of that size is exact.
inline Vec3d scene_origin(const Bounds3<double>& bounds) {
    if (bounds.empty()) return Vec3d(0);
    const double extent = max_component(bounds.size());
    const double farthest = max_component(max(abs(bounds.min), abs(bounds.max)));
    if (!(farthest > extent)) return Vec3d(0);
    const double grid = std::exp2(std::ceil(std::log2(std::max(extent, farthest * 0x1p-20))) - 10);
    const Vec3d center = bounds.center();
    return Vec3d(std::nearbyint(center.x / grid), std::nearbyint(center.y / grid),
                 std::nearbyint(center.z / grid)) *
           grid;
}

/// Stores world positions, gathered in double, in the scene, relative to an origin of their own.
/// `used_bounds` are the bounds of those positions that triangles use.
template <class T>
void store_positions(Scene<T>& scene, const std::vector<Vec3d>& positions,
                     const Bounds3<double>& used_bounds) {
    scene.origin = scene_origin(used_bounds);
    scene.positions.reserve(positions.size());
    for (const Vec3d& p : positions) scene.positions.push_back(Vec3<T>(p - scene.origin));
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
