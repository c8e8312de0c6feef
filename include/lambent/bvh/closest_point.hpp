#pragma once
#include <lambent/bvh/bvh.hpp>
#include <lambent/bvh/once.hpp>
#include <lambent/bvh/walk.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/ray.hpp>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

namespace lambent {
inline namespace LAMBENT_ABI {

/// The point of a triangle that is closest to some other point; converts to false where there was none.
template <class T>
struct ClosestPoint {
    std::uint32_t primitive = no_primitive;           ///< index into the caller's triangles
    Vec3<T> point{0};                                 ///< on the triangle
    T distance = std::numeric_limits<T>::infinity();  ///< from the point that was asked about
    T u = 0, v = 0;                                   ///< weights of the triangle's second and third vertex

    explicit operator bool() const { return primitive != no_primitive; }
};

namespace detail {

template <class T>
struct Pack3 {
    Pack<T, 4> x, y, z;
    friend Pack3 operator-(const Pack3& a, const Pack3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    friend Pack3 operator*(const Pack3& a, Pack<T, 4> s) { return {a.x * s, a.y * s, a.z * s}; }
};

template <class T>
inline Pack<T, 4> dot(const Pack3<T>& a, const Pack3<T>& b) {
    return multiply_add(a.x, b.x, multiply_add(a.y, b.y, a.z * b.z));
}

template <class T>
inline Pack3<T> pack_cross(const Pack3<T>& a, const Pack3<T>& b) {
    return {difference_of_products(a.y, b.z, a.z, b.y), difference_of_products(a.z, b.x, a.x, b.z),
            difference_of_products(a.x, b.y, a.y, b.x)};
}

template <class T>
inline Pack<T, 4> largest_component(const Pack3<T>& a) {
    return max(max(a.x, -a.x), max(max(a.y, -a.y), max(a.z, -a.z)));
}

/// Of four triangles, the points closest to one point.
template <class T>
struct BlockPoints {
    Pack<T, 4> squared_distance, u, v;
};

/// The nearest of the points closest on each edge, and of the foot of the perpendicular if it lies within. Each of
/// these is a point of the triangle whatever the rounding, so triangles of any shape do, those without area too.
template <class T>
inline BlockPoints<T> closest_points(const TriangleBlock<T>& block, const Vec3<T>& p) {
    using Lanes = Pack<T, 4>;
    const Lanes zero = T(0), one = T(1);
    const auto corner = [&](int i) {
        return Pack3<T>{Lanes::load(block.vertex[i][0]), Lanes::load(block.vertex[i][1]),
                        Lanes::load(block.vertex[i][2])};
    };
    const Pack3<T> origin{p.x, p.y, p.z};
    const Pack3<T> a = corner(0) - origin, b = corner(1) - origin, c = corner(2) - origin;
    Pack3<T> ab = corner(1) - corner(0), bc = corner(2) - corner(1), ca = corner(0) - corner(2);
    Lanes size = max(largest_component(ab), max(largest_component(bc), largest_component(ca)));
    size = select(size >= Lanes(std::numeric_limits<T>::min()), size, one);
    const Lanes inverse = one / size; // edges of about 1: no product of theirs over- or underflows unless it may
    ab = ab * inverse;
    bc = bc * inverse;
    ca = ca * inverse;

    BlockPoints<T> best;
    const auto weighted = [&](Lanes wa, Lanes wb, Lanes wc) {
        const auto mean = [&](Lanes x, Lanes y, Lanes z) {
            return multiply_add(wa, x, multiply_add(wb, y, wc * z));
        };
        return Pack3<T>{mean(a.x, b.x, c.x), mean(a.y, b.y, c.y), mean(a.z, b.z, c.z)};
    };
    const auto square_of = [](const Pack3<T>& q) { return dot(q, q); };
    const auto along = [&](const Pack3<T>& from, const Pack3<T>& edge) { // where on the edge, in [0, 1]
        const Lanes length = dot(edge, edge) * size;
        const Lanes t = select(length > zero, -dot(from, edge) / length, zero);
        return max(min(t, one), zero);
    };
    const auto offer = [&](Mask<T, 4> valid, Lanes distance, Lanes u, Lanes v) {
        const Mask<T, 4> nearer = valid & (distance < best.squared_distance);
        best.squared_distance = select(nearer, distance, best.squared_distance);
        best.u = select(nearer, u, best.u);
        best.v = select(nearer, v, best.v);
    };
    const Lanes on_ab = along(a, ab), on_bc = along(b, bc), on_ca = along(c, ca);
    best = {square_of(weighted(one - on_ab, on_ab, zero)), on_ab, zero};
    const Mask<T, 4> always = zero == zero;
    offer(always, square_of(weighted(zero, one - on_bc, on_bc)), one - on_bc, on_bc);
    offer(always, square_of(weighted(on_ca, zero, one - on_ca)), zero, one - on_ca);

    // The weights of the foot grow with q along two gradients in the plane, and q with the weights: taken in three
    // steps, each from where the last one got to, because in a thin triangle one step alone is off by a rounding
    // times its length over its height.
    constexpr T epsilon = std::numeric_limits<T>::epsilon();
    const Pack3<T> normal = pack_cross(ab, bc);
    const Lanes square = dot(normal, normal);
    const Mask<T, 4> has_area = square > Lanes(epsilon * epsilon); // or else it is its edges
    const Lanes scale = one / select(has_area, square * size, one);
    const Pack3<T> along_b = pack_cross(ca, normal) * scale, along_c = pack_cross(ab, normal) * scale;
    Lanes wb = zero, wc = zero;
    Pack3<T> q = a;
    for (int step = 0; step < 3; ++step) {
        wb += dot(q, along_b);
        wc += dot(q, along_c);
        q = weighted(one - wb - wc, wb, wc);
    }
    const Lanes wa = one - wb - wc;
    offer(has_area & (min(wa, min(wb, wc)) >= zero), square_of(q), wb, wc);
    return best;
}

/// Squared distances from a point to a node's boxes, a little less than they are, so that rounding hides none.
template <class T>
inline Pack<T, node_width<T>> squared_distances(const WideNode<T>& node, const Vec3<T>& p) {
    using Lanes = Pack<T, node_width<T>>;
    Lanes sum = T(0);
    for (int k = 0; k < 3; ++k) {
        const Lanes at = p[k];
        const Lanes out = max(max(Lanes::load(node.plane[2 * k]) - at, at - Lanes::load(node.plane[2 * k + 1])),
                              Lanes(T(0)));
        sum = multiply_add(out, out, sum);
    }
    return sum * Lanes(1 - 8 * std::numeric_limits<T>::epsilon());
}

/// p, from which nothing but a number may come, and a distance of at least 0.
template <class T>
inline bool usable(const Vec3<T>& p, T distance) {
    return is_finite(p) && !is_nan(distance) && distance >= 0;
}

/// No square of a number with a root of at most x is larger.
template <class T>
inline T square_above(T x) {
    return x * x * (1 + 4 * std::numeric_limits<T>::epsilon());
}

template <class T>
inline ClosestPoint<T> closest_point_of(const TriangleBlock<T>& block, int lane, const BlockPoints<T>& found) {
    const T u = found.u[lane], v = found.v[lane], w = 1 - u - v;
    ClosestPoint<T> result{.primitive = block.primitive[lane],
                           .distance = std::sqrt(found.squared_distance[lane]), .u = u, .v = v};
    for (int k = 0; k < 3; ++k)
        result.point[k] = w * block.vertex[0][k][lane] + u * block.vertex[1][k][lane] + v * block.vertex[2][k][lane];
    return result;
}

} // namespace detail

/// The point of the surface closest to p, at most max_distance away; of equally close ones, any.
/// accuracy  a few roundings of the distance between p and the triangle's farthest vertex
/// range     sizes and distances within 2^-60 ... 2^60 in float: their squares must not vanish or overflow. A p
///           with a NaN or an infinity, or a max_distance that is negative or NaN, finds nothing.
/// cost      O(log n) near the surface, more where much of it is equally far; does not allocate
/// source    the regions of Ericson, Real-Time Collision Detection (2005), 5.1.5, without their branches
template <class T, class Leaves>
ClosestPoint<T> closest_point(const BasicBvh<T, Leaves>& bvh, const Vec3<T>& p,
                              std::type_identity_t<T> max_distance = std::numeric_limits<T>::infinity()) {
    static_assert(detail::HoldsTriangles<Leaves>, "closest_point: this tree's leaves hold no triangles");
    ClosestPoint<T> nearest;
    if (!detail::usable(p, max_distance)) return nearest;
    T limit = detail::square_above(max_distance);
    detail::walk_nearest_first<T>(
        bvh,
        [&](const detail::WideNode<T>& node, T* keys) { detail::squared_distances(node, p).store(keys); },
        [&] { return limit; },
        [&](const typename Leaves::Block& held) {
            const TriangleBlock<T>& block = bvh.leaves().triangles(held);
            const detail::BlockPoints<T> found = detail::closest_points(block, p);
            for (unsigned near = bits(found.squared_distance <= Pack<T, 4>(limit)); near != 0; near &= near - 1) {
                const int lane = std::countr_zero(near);
                const T d = found.squared_distance[lane];
                if ((block.primitive[lane] & detail::hidden_bit) != 0 || !(std::sqrt(d) <= max_distance)) continue;
                if (nearest && !(d < limit)) continue;
                limit = d;
                nearest = detail::closest_point_of(block, lane, found);
            }
            return true;
        });
    return nearest;
}

/// Calls f(ClosestPoint) for every triangle at most `radius` away from p, exactly once, in no order, with the
/// triangle's point closest to p. f returns nothing; or a bool, of which false ends the query.
/// range, accuracy  those of closest_point()
template <class T, class Leaves, class F>
void for_each_within(const BasicBvh<T, Leaves>& bvh, const Vec3<T>& p, std::type_identity_t<T> radius, F&& f) {
    static_assert(detail::HoldsTriangles<Leaves>, "for_each_within: this tree's leaves hold no triangles");
    if (!detail::usable(p, radius)) return;
    const T limit = detail::square_above(radius);
    detail::Once once(bvh.tree().duplicates > 0);
    detail::walk(
        bvh,
        [&](const detail::WideNode<T>& node) {
            return bits(detail::squared_distances(node, p) <= Pack<T, node_width<T>>(limit)) &
                   detail::used_lanes(node);
        },
        [&](const typename Leaves::Block& held) {
            const TriangleBlock<T>& block = bvh.leaves().triangles(held);
            const detail::BlockPoints<T> found = detail::closest_points(block, p);
            for (unsigned near = bits(found.squared_distance <= Pack<T, 4>(limit)); near != 0; near &= near - 1) {
                const int lane = std::countr_zero(near);
                if ((block.primitive[lane] & detail::hidden_bit) != 0 ||
                    !(std::sqrt(found.squared_distance[lane]) <= radius))
                    continue;
                if (!once.first(block.primitive[lane])) continue;
                if (!detail::goes_on(f, detail::closest_point_of(block, lane, found))) return false;
            }
            return true;
        });
}

} // namespace LAMBENT_ABI
} // namespace lambent
