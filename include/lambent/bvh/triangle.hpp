#pragma once
#include <lambent/core/ray.hpp>
#include <lambent/core/simd.hpp>
#include <cstddef>
#include <cstdint>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Four triangles side by side, with their vertices, not their edges: two triangles that share an edge then
/// compute it from the same numbers. Lanes beyond the last triangle hold one whose vertices coincide, which
/// no ray can hit.
template <class T>
struct alignas(4 * sizeof(T)) TriangleBlock {
    static constexpr int lanes = 4;
    T vertex[3][3][lanes]; ///< [vertex][axis][lane]
    std::uint32_t primitive[lanes];
};

/// A ray in the frame in which it starts at the origin and runs along its largest axis: x and y are sheared
/// along z. Made once a ray.
template <class T>
struct ShearedRay {
    int kx, ky, kz;       ///< where the frame's axes lie in ours
    Pack<T, 4> origin[3]; ///< by the frame's axes
    Pack<T, 4> shear_x, shear_y;
    Pack<T, 4> inverse_z; ///< 1 / direction[kz]

    explicit ShearedRay(const Ray<T>& ray)
        : kz(largest_axis(ray.direction)) {
        kx = kz == 2 ? 0 : kz + 1;
        ky = kx == 2 ? 0 : kx + 1;
        origin[0] = ray.origin[kx];
        origin[1] = ray.origin[ky];
        origin[2] = ray.origin[kz];
        const T z = ray.direction[kz];
        shear_x = ray.direction[kx] / z;
        shear_y = ray.direction[ky] / z;
        inverse_z = T(1) / z;
    }
};

/// Which side of a triangle can be hit. Front is the side from which its vertices run counter-clockwise.
enum class Side : std::uint8_t { both, front, back };

/// Whose an edge is that two triangles share: both report a hit there, or exactly one of them does.
enum class Edges : std::uint8_t { shared, owned };

/// What else decides whether a triangle is hit; known to the compiler, so that what isn't asked for costs nothing.
struct HitRules {
    Side side = Side::both;
    Edges edges = Edges::shared;
    friend bool operator==(const HitRules&, const HitRules&) = default;
};

namespace detail {
/// Whether the triangle holds a point next to the origin, by (e, e²) for an e > 0 smaller than anything: then no
/// point lies on an edge, and where triangles meet, exactly one of them holds it, whichever way they are oriented.
/// The edge function w = a × b of an edge through the origin grows towards that point as a.y - b.y does, or if
/// those are equal as b.x - a.x. Comparisons alone, so this is exact.
/// source  Edelsbrunner, Mücke, "Simulation of simplicity", ACM TOG 9 (1990)
template <class T>
inline Mask<T, 4> holds_next_to_origin(const Pack<T, 4>* x, const Pack<T, 4>* y, Pack<T, 4> w0, Pack<T, 4> w1,
                                       Pack<T, 4> w2) {
    const Pack<T, 4> zero = T(0);
    const auto positive = [&](Pack<T, 4> w, int a, int b) {
        return (w > zero) | ((w == zero) & ((y[a] > y[b]) | ((y[a] == y[b]) & (x[b] > x[a]))));
    };
    const Mask<T, 4> p0 = positive(w0, 2, 1), p1 = positive(w1, 0, 2), p2 = positive(w2, 1, 0);
    return (p0 & p1 & p2) | ~(p0 | p1 | p2);
}
} // namespace detail

/// Where a ray meets four triangles.
template <class T>
struct BlockHit {
    Mask<T, 4> mask; ///< lanes with a hit, t_min <= t < t_max
    Pack<T, 4> t;
    Pack<T, 4> u, v; ///< barycentric weights of vertices 1 and 2
};

/// The watertight ray/triangle test: a ray that passes between two triangles with a common edge, or through
/// the common vertex of a closed fan, hits one of them. Two things make it so, under any compiler flags:
/// every vertex is moved into the ray's frame by the same three operations whichever triangle it belongs to,
/// and the edge functions have the exact sign for the vertices so moved. A point of the closed triangle,
/// edges included, is a hit; a triangle seen exactly edge-on is none (its neighbours are).
/// range   coordinates relative to the ray's origin within 2^-50 ... 2^60 in float: the products must not
///         vanish or overflow
/// source  Woop, Benthin, Wald, JCGT 2:1 (2013). We differ: the sign is exact by an fma-faithful difference
///         of products, where theirs holds only if the compiler fuses nothing.
template <HitRules rules = HitRules{}, class T>
inline BlockHit<T> intersect(const ShearedRay<T>& ray, const TriangleBlock<T>& block, Pack<T, 4> t_min,
                             Pack<T, 4> t_max) {
    using Lanes = Pack<T, 4>;
    Lanes x[3], y[3], z[3];
    for (int i = 0; i < 3; ++i) {
        z[i] = Lanes::load(block.vertex[i][ray.kz]) - ray.origin[2];
        x[i] = negated_multiply_add(ray.shear_x, z[i], Lanes::load(block.vertex[i][ray.kx]) - ray.origin[0]);
        y[i] = negated_multiply_add(ray.shear_y, z[i], Lanes::load(block.vertex[i][ray.ky]) - ray.origin[1]);
    }
    const Lanes w0 = difference_of_products(x[2], y[1], y[2], x[1]);
    const Lanes w1 = difference_of_products(x[0], y[2], y[0], x[2]);
    const Lanes w2 = difference_of_products(x[1], y[0], y[1], x[0]);

    BlockHit<T> hit;
    const Lanes zero = T(0);
    const Lanes least = min(w0, min(w1, w2)), most = max(w0, max(w1, w2));
    hit.mask = (least >= zero) ^ (most <= zero); // both where all three vanish: edge-on
    if constexpr (rules.side != Side::both) { // the frame is seen along its z, or against it
        const Mask<T, 4> front = (most > zero) ^ (ray.inverse_z < zero);
        hit.mask = hit.mask & (rules.side == Side::front ? front : ~front);
    }
    if (bits(hit.mask) == 0) return hit;
    if constexpr (rules.edges == Edges::owned) {
        if (bits(hit.mask & ((least == zero) | (most == zero))) != 0)
            hit.mask = hit.mask & detail::holds_next_to_origin(x, y, w0, w1, w2);
    }
    // Weights first, and no compiler may divide later: their products with the depth could overflow. A mean of the
    // depths with weights of one sign never leaves the triangle, however thin it is seen.
    const Lanes determinant = w0 + w1 + w2;
    hit.u = opaque(w1 / determinant);
    hit.v = opaque(w2 / determinant);
    const Lanes depth =
        multiply_add(opaque(w0 / determinant), z[0], multiply_add(hit.u, z[1], hit.v * z[2]));
    hit.t = depth * ray.inverse_z;
    hit.mask = hit.mask & (hit.t >= t_min) & (hit.t < t_max);
    return hit;
}

} // namespace LAMBENT_ABI
} // namespace lambent
