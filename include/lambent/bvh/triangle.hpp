#pragma once
#include <lambent/core/ray.hpp>
#include <lambent/core/simd.hpp>
#include <algorithm>
#include <bit>
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

    static TriangleBlock empty() {
        TriangleBlock block{};
        for (std::uint32_t& id : block.primitive) id = no_primitive;
        return block;
    }
};

/// A ray in the frame in which it starts at the origin and runs along its largest axis: x and y are sheared
/// along z. Made once a ray.
template <class T>
struct ShearedRay {
    int kx, ky, kz; ///< where the frame's axes lie in ours
    T origin[4];    ///< by the frame's axes; the fourth lanes hold nothing
    T slopes[4];    ///< -direction[kx] / direction[kz], -direction[ky] / direction[kz], 1 / direction[kz]

    ShearedRay() = default;
    [[gnu::always_inline]] explicit ShearedRay(const Ray<T>& ray) {
        using Four = Pack<T, 4>;
        using Vector = typename Four::Vector;
        const Four o = Vector{ray.origin.x, ray.origin.y, ray.origin.z, 0}; // as SlabRay sees them: made once
        const Four d = Vector{ray.direction.x, ray.direction.y, ray.direction.z, 0}, size = abs(d);
        const T largest = std::max(size[0], std::max(size[1], size[2]));
        kz = std::countr_zero(bits(size >= Four(largest)) | 4u); // without branches: directions are hard to foresee
        static constexpr int axes[3][4] = {{1, 2, 0, 3}, {2, 0, 1, 3}, {0, 1, 2, 3}};
        kx = axes[kz][0];
        ky = axes[kz][1];
        permute(o, axes[kz]).store(origin);
        const Vector frame = permute(d, axes[kz]).v, ones = Vector{1, 1, 1, 1};
        const Four over = Vector(__builtin_shufflevector(-frame, ones, 0, 1, 6, 7));
        const Four under = Vector(__builtin_shufflevector(frame, frame, 2, 2, 2, 2));
        (over / under).store(slopes);
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
template <class T, int N>
inline Mask<T, N> holds_next_to_origin(const Pack<T, N>* x, const Pack<T, N>* y) {
    // The products anew: where coordinates are tiny they lose bits or vanish, so all are multiplied by a power of two.
    constexpr T tiny = T(sizeof(T) == 4 ? 0x1p-20 : 0x1p-300), up = T(sizeof(T) == 4 ? 0x1p40 : 0x1p600);
    Pack<T, N> size = T(0), sx[3], sy[3];
    for (int i = 0; i < 3; ++i) size = max(max(abs(x[i]), abs(y[i])), size);
    const Pack<T, N> zero = T(0), scale = select(size < Pack<T, N>(tiny), Pack<T, N>(up), Pack<T, N>(T(1)));
    for (int i = 0; i < 3; ++i) {
        sx[i] = x[i] * scale;
        sy[i] = y[i] * scale;
    }
    const auto positive = [&](int a, int b) {
        const Pack<T, N> w = difference_of_products(sx[a], sy[b], sy[a], sx[b]);
        return (w > zero) | ((w == zero) & ((y[a] > y[b]) | ((y[a] == y[b]) & (x[b] > x[a]))));
    };
    const Mask<T, N> p0 = positive(2, 1), p1 = positive(0, 2), p2 = positive(1, 0);
    return (p0 & p1 & p2) | ~(p0 | p1 | p2);
}
} // namespace detail

/// Whether a range t_min <= t < t_max is as that says, or has t_max as well.
enum class RangeEnd : std::uint8_t { open, closed };

/// Where rays meet triangles: one ray and the triangles of a block or of two, or several rays and one triangle.
template <class T, int N>
struct BlockHit {
    Mask<T, N> mask; ///< lanes with a hit
    Pack<T, N> t;
    Pack<T, N> u, v; ///< barycentric weights of vertices 1 and 2
};

/// The watertight ray/triangle test: a ray that passes between two triangles with a common edge, or through
/// the common vertex of a closed fan, hits one of them. Two things make it so, under any compiler flags:
/// every vertex is moved into the ray's frame by the same three operations whichever triangle it belongs to,
/// and the edge functions have the exact sign for the vertices so moved. A point of the closed triangle,
/// edges included, is a hit; a triangle seen exactly edge-on is none (its neighbours are).
/// end        whether a hit at t_max itself is one
/// early_out  false: goes through to the end also where nothing is hit, for callers who cannot foresee that
/// range   coordinates relative to the ray's origin within 2^-50 ... 2^60 in float: the products must not
///         vanish or overflow
/// source  Woop, Benthin, Wald, JCGT 2:1 (2013). We differ: the sign is exact by an fma-faithful difference
///         of products, where theirs holds only if the compiler fuses nothing.
template <HitRules rules, RangeEnd end, bool early_out = true, class T, int N>
[[gnu::always_inline]] inline BlockHit<T, N> intersect_sheared(const Pack<T, N>* x, const Pack<T, N>* y,
                                                               const Pack<T, N>* z, Pack<T, N> inverse_z,
                                                               Pack<T, N> t_min, Pack<T, N> t_max) {
    using Lanes = Pack<T, N>;
    const Lanes w0 = difference_of_products(x[2], y[1], y[2], x[1]);
    const Lanes w1 = difference_of_products(x[0], y[2], y[0], x[2]);
    const Lanes w2 = difference_of_products(x[1], y[0], y[1], x[0]);

    BlockHit<T, N> hit;
    const Lanes zero = T(0);
    const Lanes least = min(w0, min(w1, w2)), most = max(w0, max(w1, w2));
    hit.mask = (least >= zero) ^ (most <= zero); // both where all three vanish: edge-on
    if constexpr (rules.side != Side::both) { // the frame is seen along its z, or against it
        const Mask<T, N> front = (most > zero) ^ (inverse_z < zero);
        hit.mask = hit.mask & (rules.side == Side::front ? front : ~front);
    }
    if (early_out && bits(hit.mask) == 0) return hit;
    if constexpr (rules.edges == Edges::owned) {
        if (bits(hit.mask & ((least == zero) | (most == zero))) != 0)
            hit.mask = hit.mask & detail::holds_next_to_origin(x, y);
    }
    // Weights first, and no compiler may divide later: their products with the depth could overflow. A mean of the
    // depths with weights of one sign never leaves the triangle, however thin it is seen. Nor may one divide here and
    // multiply by a reciprocal there: all queries then give the same bits, also under -ffast-math.
    const Lanes determinant = opaque(w0 + w1) + w2;
    hit.u = opaque(w1 / opaque(determinant));
    hit.v = opaque(w2 / opaque(determinant));
    const Lanes depth =
        multiply_add(opaque(w0 / opaque(determinant)), z[0], multiply_add(hit.u, z[1], hit.v * z[2]));
    hit.t = depth * inverse_z;
    hit.mask = hit.mask & (hit.t >= t_min) & (end == RangeEnd::open ? hit.t < t_max : hit.t <= t_max);
    return hit;
}

/// One ray and, with N = 4, the triangles of the first block; with N = 8 those of both, with as many instructions where
/// registers are that wide.
template <HitRules rules, int N, RangeEnd end = RangeEnd::open, bool early_out = true, class T>
[[gnu::always_inline]] inline BlockHit<T, N> intersect(const ShearedRay<T>& ray, const TriangleBlock<T>& first,
                                                       const TriangleBlock<T>& second, T t_min, T t_max) {
    using Lanes = Pack<T, N>;
    const auto load = [&](int i, int axis) {
        if constexpr (N == 4) {
            return Lanes::load(first.vertex[i][axis]);
        } else {
            return join(Pack<T, 4>::load(first.vertex[i][axis]), Pack<T, 4>::load(second.vertex[i][axis]));
        }
    };
    const Lanes origin_x = ray.origin[0], origin_y = ray.origin[1], origin_z = ray.origin[2];
    const Lanes slope_x = ray.slopes[0], slope_y = ray.slopes[1];
    Lanes x[3], y[3], z[3];
    for (int i = 0; i < 3; ++i) {
        z[i] = load(i, ray.kz) - origin_z;
        x[i] = exact_multiply_add(slope_x, z[i], load(i, ray.kx) - origin_x);
        y[i] = exact_multiply_add(slope_y, z[i], load(i, ray.ky) - origin_y);
    }
    return intersect_sheared<rules, end, early_out>(x, y, z, Lanes(ray.slopes[2]), Lanes(t_min), Lanes(t_max));
}

} // namespace LAMBENT_ABI
} // namespace lambent
