#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/core/ray.hpp>
#include <lambent/core/vec.hpp>
#include <lambent/core/vec_lanes.hpp>
#include <lambent/core/vec_packs.hpp>
#include <lambent/material/standard.hpp>
#include <cstdint>
#include <limits>

namespace lambent {
inline namespace LAMBENT_ABI {

/// What an integrator needs to know of the point where a ray met a surface.
template <class T>
struct Surface {
    Vec3<T> position{0};         ///< relative to the scene's origin
    Vec3<T> position_error{0};   ///< bound on its rounding error, an axis each
    Vec3<T> geometric_normal{0}; ///< unit, on the viewer's side
    Vec3<T> shading_normal{0};   ///< unit, on the same side
    Vec3<T> lift{0};             ///< from position to where the smooth surface lies that the shading normals tell of:
                                 ///< rays that a facet is in the way of leave from there
    Vec3<T> wo{0};               ///< unit, to the viewer
    Vec3<T> albedo{0};           ///< linear reflectance in [0, 1]
    Vec3<T> emission{0};         ///< radiance towards the viewer
    StandardPoint<T> point;      ///< how light scatters, for scenes that have no BSDF of their own
    Vec3<T> extinction{0};       ///< per unit of length, of the volume behind the front side
    T distance = 0;              ///< from the ray's origin
    bool front = true;           ///< seen from the front side
    std::uint32_t material = 0;
};

/// The point from which a ray may leave a surface in `direction` without meeting it again: moved along the
/// normal by as much as the position may be wrong, then rounded away. No absolute epsilon, any scale.
/// source  Pharr, Jakob, Humphreys, Physically Based Rendering, 4th edition, 6.8.6
template <class T>
inline Vec3<T> leave_surface(const Vec3<T>& position, const Vec3<T>& error, const Vec3<T>& normal,
                             const Vec3<T>& direction) {
    const Lanes3<T> n = to_lanes(normal), p = to_lanes(position);
    const T distance = dot(abs(n), to_lanes(error));
    const Lanes3<T> offset = Lanes3<T>(dot(to_lanes(direction), n) < 0 ? -distance : distance) * n, moved = p + offset;
    // Farther by |p| · epsilon, which is one or two units in the last place: without branches, unlike next_up().
    const Lanes3<T> farther = moved + copysign(moved * Lanes3<T>(std::numeric_limits<T>::epsilon()), offset);
    return to_vec(select(offset == Lanes3<T>(T(0)), moved, farther));
}

/// The same for several points.
template <class T, int N>
[[gnu::always_inline]] inline Vec3Pack<T, N> leave_surface(const Vec3Pack<T, N>& p, const Vec3Pack<T, N>& error,
                                                           const Vec3Pack<T, N>& n, const Vec3Pack<T, N>& direction) {
    using P = Pack<T, N>;
    const P distance = dot_xzy(abs(n), error), along = select(dot_xzy(direction, n) < P(T(0)), -distance, distance);
    const auto move = [along](P at, P normal) {
        const P offset = along * normal, moved = at + offset;
        const P farther = moved + copysign(moved * P(std::numeric_limits<T>::epsilon()), offset);
        return select(offset == P(0), moved, farther);
    };
    return {move(p.x, n.x), move(p.y, n.y), move(p.z, n.z)};
}

/// How a ray may leave a surface: from its position; from where its lift leads; or not at all.
enum class Exit : std::uint8_t { none, position, lift };

/// The ray that leaves `surface` in unit direction wi.
template <class T>
inline Ray<T> spawn_ray(const Surface<T>& surface, const Vec3<T>& wi, Exit exit = Exit::position) {
    if (exit == Exit::lift) return {.origin = surface.position + surface.lift, .direction = wi};
    return {.origin = leave_surface(surface.position, surface.position_error, surface.geometric_normal, wi),
            .direction = wi};
}

/// The ray from `surface` up to just before `target`, whose own error and normal keep the ray off the
/// surface that target lies on.
template <class T>
inline Ray<T> spawn_ray_to(const Surface<T>& surface, const Vec3<T>& target, const Vec3<T>& target_error,
                           const Vec3<T>& target_normal, Exit exit = Exit::position) {
    const Vec3<T> way = target - surface.position;
    const Vec3<T> from = spawn_ray(surface, way, exit).origin;
    const Vec3<T> to = leave_surface(target, target_error, target_normal, -way);
    return {.origin = from, .direction = to - from, .t_max = 1 - 4 * std::numeric_limits<T>::epsilon()};
}

} // namespace LAMBENT_ABI
} // namespace lambent
