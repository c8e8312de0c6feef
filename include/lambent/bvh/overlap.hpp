#pragma once
#include <lambent/bvh/bvh.hpp>
#include <lambent/bvh/once.hpp>
#include <lambent/bvh/walk.hpp>
#include <lambent/core/bounds.hpp>
#include <lambent/core/numerics.hpp>
#include <bit>
#include <cstdint>
#include <limits>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// A box as triangles are tested with.
template <class T>
struct OverlapBox {
    Bounds3<T> box;
    Vec3<T> center, half; ///< center ± half holds the box, rounding included

    /// Of the caller's box what the tree's triangles can lie in; so infinite sides do.
    OverlapBox(const Bounds3<T>& wanted, const Bounds3<T>& tree) {
        for (int k = 0; k < 3; ++k) {
            if (is_nan(wanted.min[k]) || is_nan(wanted.max[k])) return; // stays empty
        }
        box.min = glm::max(wanted.min, tree.min);
        box.max = glm::min(wanted.max, tree.max);
        for (int k = 0; k < 3; ++k) {
            center[k] = box.min[k] / 2 + box.max[k] / 2;
            half[k] = glm::max(box.max[k] - center[k], center[k] - box.min[k]);
            half[k] += half[k] * 4 * std::numeric_limits<T>::epsilon();
        }
    }

    Mask<T, node_width<T>> meets(const WideNode<T>& node) const {
        using Lanes = Pack<T, node_width<T>>;
        const auto on = [&](int k) {
            return (Lanes::load(node.plane[2 * k]) <= Lanes(box.max[k])) &
                   (Lanes::load(node.plane[2 * k + 1]) >= Lanes(box.min[k]));
        };
        return on(0) & on(1) & on(2);
    }
};

/// Which of four triangles the box meets: those that none of thirteen axes separates from it. By the box's own axes
/// exactly; by the others with room for every rounding on the way, so that no triangle is lost.
/// source  Akenine-Möller, "Fast 3D triangle-box overlap testing", JGT 6:1 (2001)
template <class T>
inline Mask<T, 4> meets(const OverlapBox<T>& query, const TriangleBlock<T>& block) {
    using Lanes = Pack<T, 4>;
    constexpr T u = std::numeric_limits<T>::epsilon() / 2;
    const auto magnitude = [](Lanes x) { return max(x, -x); };
    Lanes v[3][3], half[3]; // vertices from the box's centre: [vertex][axis]
    Lanes reach = T(0);
    Mask<T, 4> met = reach == reach;
    for (int k = 0; k < 3; ++k) {
        Lanes corner[3], farthest = query.half[k];
        for (int i = 0; i < 3; ++i) {
            corner[i] = Lanes::load(block.vertex[i][k]);
            v[i][k] = corner[i] - Lanes(query.center[k]);
            farthest = max(farthest, magnitude(v[i][k]));
        }
        met = met & (min(corner[0], min(corner[1], corner[2])) <= Lanes(query.box.max[k])) &
              (max(corner[0], max(corner[1], corner[2])) >= Lanes(query.box.min[k]));
        half[k] = multiply_add(farthest, Lanes(4 * u), Lanes(query.half[k])); // v was rounded, and will be again
        reach = max(reach, farthest);
    }
    if (bits(met) == 0) return met;
    // Within a box of size 1, where no product overflows.
    const Lanes scale = Lanes(T(1)) / select(reach >= Lanes(std::numeric_limits<T>::min()), reach, Lanes(T(1)));
    Lanes room[3]; // the largest coordinate along each axis, of box or triangle
    for (int k = 0; k < 3; ++k) {
        half[k] *= scale;
        room[k] = half[k];
        for (int i = 0; i < 3; ++i) {
            v[i][k] *= scale;
            room[k] = max(room[k], magnitude(v[i][k]));
        }
    }
    Lanes edge[3][3];
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) edge[i][k] = v[(i + 1) % 3][k] - v[i][k];

    for (int i = 0; i < 3; ++i) // axes: an edge × one of the box's; two corners of the edge fall on one point
        for (int k = 0; k < 3; ++k) {
            const int m = (k + 1) % 3, n = (k + 2) % 3;
            const Lanes em = edge[i][m], en = edge[i][n];
            const auto at = [&](const Lanes* p) { return en * p[m] - em * p[n]; };
            const Lanes one = at(v[i]), other = at(v[(i + 2) % 3]);
            const Lanes size_m = magnitude(em), size_n = magnitude(en);
            const Lanes radius = size_n * half[m] + size_m * half[n];
            const Lanes rounding = (size_n * room[m] + size_m * room[n]) * Lanes(16 * u);
            const Lanes limit = radius + rounding;
            met = met & (min(one, other) <= limit) & (max(one, other) >= -limit);
        }

    Lanes plane = T(0), radius = T(0), rounding = T(0); // the last axis: the triangle's normal
    for (int k = 0; k < 3; ++k) {
        const int m = (k + 1) % 3, n = (k + 2) % 3;
        const Lanes normal = edge[0][m] * edge[1][n] - edge[0][n] * edge[1][m];
        const Lanes products = magnitude(edge[0][m] * edge[1][n]) + magnitude(edge[0][n] * edge[1][m]);
        plane += normal * v[0][k];
        radius += magnitude(normal) * half[k];
        rounding += products * room[k];
    }
    return met & (magnitude(plane) <= radius + rounding * Lanes(32 * u));
}

/// visit(primitive) is false to stop. Returns whether it was never stopped.
template <class T, class Leaves, class Visit>
bool walk_overlaps(const BasicBvh<T, Leaves>& bvh, const Bounds3<T>& box, Visit&& visit) {
    const OverlapBox<T> query(box, bvh.bounds());
    if (query.box.empty()) return true;
    return walk(bvh, [&](const WideNode<T>& node) { return bits(query.meets(node)); },
                [&](const typename Leaves::Block& held) {
                    const TriangleBlock<T>& block = bvh.leaves().triangles(held);
                    for (unsigned met = bits(meets(query, block)); met != 0; met &= met - 1) {
                        const std::uint32_t primitive = block.primitive[std::countr_zero(met)];
                        if ((primitive & hidden_bit) == 0 && !visit(primitive)) return false;
                    }
                    return true;
                });
}

} // namespace detail

/// Calls f(primitive) for every triangle that has a point in the closed box, exactly once, in no order: touching
/// counts, and so does lying within. f returns nothing; or a bool, of which false ends the query. Infinite sides are
/// allowed; a box that is empty or has a NaN meets nothing.
/// accuracy  conservative: no triangle is lost; one may be reported whose distance from the box is a rounding error
///           of the largest coordinate of either, seen from the box's middle
/// cost      O(log n) and what is reported; does not allocate, but in a tree with spatial splits beyond 32 triangles
template <class T, class Leaves, class F>
void for_each_overlap(const BasicBvh<T, Leaves>& bvh, const Bounds3<T>& box, F&& f) {
    static_assert(detail::HoldsTriangles<Leaves>, "for_each_overlap: this tree's leaves hold no triangles");
    detail::Once once(bvh.tree().duplicates > 0);
    detail::walk_overlaps(bvh, box, [&](std::uint32_t primitive) {
        return !once.first(primitive) || detail::goes_on(f, primitive);
    });
}

/// Does any triangle meet the closed box? True exactly where for_each_overlap() reports one.
template <class T, class Leaves>
bool overlaps(const BasicBvh<T, Leaves>& bvh, const Bounds3<T>& box) {
    static_assert(detail::HoldsTriangles<Leaves>, "overlaps: this tree's leaves hold no triangles");
    return !detail::walk_overlaps(bvh, box, [](std::uint32_t) { return false; });
}

} // namespace LAMBENT_ABI
} // namespace lambent
