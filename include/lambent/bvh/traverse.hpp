#pragma once
#include <lambent/bvh/leaves.hpp>
#include <lambent/bvh/wide.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/ray.hpp>
#include <lambent/core/simd_order.hpp>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// The 2^30 triangles at most of a tree lie at most 64 + 28 splits below its root (see BinnedBuilder; Reinsertion
/// keeps to it), a wide node spans at least one split, and visiting one leaves at most width - 1 entries on the stack.
inline constexpr int max_depth = 64 + 28;

/// Byte offsets from a node of the planes through which a ray enters and leaves, by axis.
struct PlaneOffsets {
    std::uint32_t near[3], far[3];
};
/// By the signs of the ray's direction, one bit an axis.
template <class T>
inline constexpr std::array<PlaneOffsets, 8> plane_offsets = [] {
    std::array<PlaneOffsets, 8> table{};
    constexpr std::uint32_t plane = sizeof(T) * std::uint32_t(node_width<T>);
    for (std::uint32_t signs = 0; signs < 8; ++signs)
        for (std::uint32_t k = 0; k < 3; ++k) {
            table[signs].near[k] = (2 * k + (signs >> k & 1u)) * plane;
            table[signs].far[k] = (2 * k + (~signs >> k & 1u)) * plane;
        }
    return table;
}();

/// Room for the rounding of distances, and for their tags, which change less than `node_width` units in the last place.
template <class T>
inline constexpr T distance_slack = T(2 * node_width<T> + 4) * std::numeric_limits<T>::epsilon();
/// Of one distance T, or of a Pack of them.
template <class T, class X>
[[gnu::always_inline]] inline X just_before(X distance) {
    using std::abs;
    return distance - abs(distance) * X(distance_slack<T>);
}
template <class T, class X>
[[gnu::always_inline]] inline X just_behind(X distance) {
    using std::abs;
    return distance + (abs(distance) * X(distance_slack<T>) + X(std::numeric_limits<T>::min()));
}

/// Beyond it slabs count a direction as parallel: see SlabRay.
template <class T>
inline constexpr T steepest = T(sizeof(T) == 4 ? 1ull << 24 : 1ull << 50);

/// A ray as boxes are tested with: distances count along its largest axis, where the direction is then ±1, so
/// that nothing here depends on the direction's length.
///
/// A box is entered at plane · scale + near_shift and left at plane · scale + far_shift, one fma each. The
/// shifts hold the ray's origin and a margin. It covers, in units of position and with u the rounding unit:
/// 7u · reach for the triangle test (vertices moved and sheared, weights, t), where reach is the distance from
/// the origin to the farthest plane of the scene's box; 4u · reach for rounding here; 2u · |origin| for the
/// product in the shift. So a box is never missed whose triangle the triangle test would report, at that t.
/// A direction's component below 1 / steepest of the largest is taken as that, sign of zero included: over the
/// distance to the scene's far side this moves the ray by u (in double 8u) · reach, which the margin covers too, and no
/// plane times scale is ever 0 · inf.
template <class T>
struct SlabRay {
    static constexpr int width = node_width<T>;
    using Lanes = Pack<T, width>;
    using Constant = std::conditional_t<loads_spread<T>, T, Lanes>;
    Constant scale[4], near_shift[4], far_shift[4], from; // of x, y, z and nothing
    const PlaneOffsets* plane;
    T along; ///< t times this is a distance along the largest axis

    SlabRay() = default;

    /// False, and nothing else set, for a ray that hits nothing: with a NaN, an infinite origin or direction, or none.
    template <class Tree>
    [[gnu::always_inline]] bool start(const Ray<T>& ray, const Tree& tree) {
        using Four = Pack<T, 4>;
        constexpr T u = std::numeric_limits<T>::epsilon() / 2;
        const auto spread = [](T x, T y, T z) { return Four(typename Four::Vector{x, y, z, 0}); };
        const Four o = spread(ray.origin.x, ray.origin.y, ray.origin.z);
        const Four d = spread(ray.direction.x, ray.direction.y, ray.direction.z);
        const Four size = abs(d), ends = spread(ray.t_min, ray.t_max, 0);
        along = std::max(size[0], std::max(size[1], size[2]));
        if (!all(is_finite(o) & is_finite(d) & ~is_nan(ends))) return false;
        if (!(along >= std::numeric_limits<T>::min())) return false;

        const Four reaches = abs(o - Four::load(tree.center)) + Four::load(tree.half_size);
        const T reach = std::max(reaches[0], std::max(reaches[1], reaches[2]));
        const Four s = select(size * Four(steepest<T>) > Four(along), Four(along) / d, copysign(Four(steepest<T>), d));
        const Four margin = multiply_add(Four(4 * u), abs(o), Four(tree.margin * u * reach)) * abs(s);
        const Four shift = -o * s, near = shift - margin, far = shift + margin;
        plane = &plane_offsets<T>[bits(s < Four(T(0))) & 7u];
        if constexpr (loads_spread<T>) {
            s.store(scale);
            near.store(near_shift);
            far.store(far_shift);
        } else {
            for (int k = 0; k < 3; ++k) {
                scale[k] = s[k];
                near_shift[k] = near[k];
                far_shift[k] = far[k];
            }
        }
        from = just_before<T>(T(ray.t_min * along));
        return true;
    }

    /// The last distance at which boxes are of interest, for hits before t.
    T limit_of(T t) const { return just_behind<T>(T(t * along)); }

    /// Which children the ray meets up to `limit`; where it enters each.
    [[gnu::always_inline]] Mask<T, width> meets(const WideNode<T>& node, T limit, Lanes& entry) const {
        const auto at = [&](std::uint32_t offset, int k, const Constant* shift) {
            Lanes lanes;
            std::memcpy(&lanes.v, reinterpret_cast<const unsigned char*>(&node) + offset, sizeof(lanes.v));
            return multiply_add(lanes, Lanes(scale[k]), Lanes(shift[k]));
        };
        entry = max(max(at(plane->near[0], 0, near_shift), at(plane->near[1], 1, near_shift)),
                    max(at(plane->near[2], 2, near_shift), Lanes(from)));
        const Lanes exit = min(min(at(plane->far[0], 0, far_shift), at(plane->far[1], 1, far_shift)),
                               min(at(plane->far[2], 2, far_shift), Lanes(limit)));
        return entry <= exit;
    }
};

/// Hides from the compiler what `object` holds, so that it stays in memory.
template <class Object>
[[gnu::always_inline]] inline void keep_in_memory(Object& object) {
    asm volatile("" : "+m"(object));
}

/// Entries of a traversal's stack, and room for one more node's to be stored as a whole.
template <class T>
inline constexpr std::size_t max_stack = std::size_t(max_depth * (node_width<T> - 1) + node_width<T>);

/// values[lane], but by a jump that the processor foresees: it then goes on with the next node before it knows the
/// lane. The asm statements keep the compiler from making one load of all.
template <int N>
[[gnu::always_inline]] inline std::uint32_t foreseen(const std::uint32_t* values, int lane) {
    std::uint32_t r;
    static_assert(N == 4 || N == 8 || N == 16);
    switch (lane) {
    case 0: r = values[0]; asm volatile("# 0" : "+r"(r)); return r;
    case 1: r = values[1]; asm volatile("# 1" : "+r"(r)); return r;
    case 2: r = values[2]; asm volatile("# 2" : "+r"(r)); return r;
    case 3: r = values[3]; asm volatile("# 3" : "+r"(r)); return r;
    case 4: r = values[4 % N]; asm volatile("# 4" : "+r"(r)); return r;
    case 5: r = values[5 % N]; asm volatile("# 5" : "+r"(r)); return r;
    case 6: r = values[6 % N]; asm volatile("# 6" : "+r"(r)); return r;
    case 7: r = values[7 % N]; asm volatile("# 7" : "+r"(r)); return r;
    case 8: r = values[8 % N]; asm volatile("# 8" : "+r"(r)); return r;
    case 9: r = values[9 % N]; asm volatile("# 9" : "+r"(r)); return r;
    case 10: r = values[10 % N]; asm volatile("# 10" : "+r"(r)); return r;
    case 11: r = values[11 % N]; asm volatile("# 11" : "+r"(r)); return r;
    case 12: r = values[12 % N]; asm volatile("# 12" : "+r"(r)); return r;
    case 13: r = values[13 % N]; asm volatile("# 13" : "+r"(r)); return r;
    case 14: r = values[14 % N]; asm volatile("# 14" : "+r"(r)); return r;
    case 15: r = values[15 % N]; asm volatile("# 15" : "+r"(r)); return r;
    default: __builtin_unreachable();
    }
}

/// The one loop behind every query of a single ray. Returns the nearest hit, or for Query::any some hit.
/// leaves  what lies in the leaves, and how a ray meets it: see leaves.hpp
/// from    the child below which to look (see Child); all of the tree by default
template <Query query, class T, class Leaves, class Accept>
[[gnu::noinline]] Hit<T> traverse(const WideTree<T, typename Leaves::Block>& tree, const Leaves& leaves,
                                  const Ray<T>& ray, const Accept& accept, std::uint32_t from = 0) {
    constexpr int width = node_width<T>;
    using Lanes = Pack<T, width>;
    using Block = typename Leaves::Block;

    Hit<T> hit;
    SlabRay<T> slabs;
    if (tree.nodes.empty() || !slabs.start(ray, tree)) return hit;
    typename Leaves::Query prepared(ray);
    T limit = slabs.limit_of(ray.t_max);
    hit.t = ray.t_max;

    const WideNode<T>* const nodes = tree.nodes.data();
    const Block* const blocks = tree.blocks.data();
    alignas(64) T distances[query == Query::any ? 1 : max_stack<T>];
    alignas(64) std::uint32_t children[max_stack<T>];
    std::size_t top = 0;
    std::uint32_t current = from;
    const auto lane_of = [](T tagged) { return int(std::bit_cast<typename FloatBits<T>::Type>(tagged) & (width - 1)); };
    for (;;) {
        while ((current & Child::leaf_bit) == 0) {
            const WideNode<T>& node = nodes[current];
            if constexpr (requires { accept.node(); }) accept.node();
            Lanes entry;
            const Mask<T, width> mask = slabs.meets(node, limit, entry);
            const unsigned met = bits(mask);
            if (met == 0) goto next;
            const unsigned rest = met & (met - 1);
            const std::size_t more = std::size_t(std::popcount(rest));
            if constexpr (query == Query::any) {
                // The lowest lane goes first. Where registers can do it, without a branch on how many the others are.
                if constexpr (width > 4) {
                    compress_descending<width>(rest, node.child, children + top);
                    top += more;
                } else {
                    for (unsigned left = rest; left != 0;) {
                        const int lane = 31 - std::countl_zero(left);
                        left ^= 1u << lane;
                        children[top++] = node.child[lane];
                    }
                }
                current = foreseen<width>(node.child, std::countr_zero(met));
            } else if (rest == 0) {
                current = foreseen<width>(node.child, std::countr_zero(met));
            } else if (width == 4 && more == 1) { // without wide registers sorting takes longer than a branch
                T keys[std::size_t(width)];
                entry.store(keys);
                const int a = std::countr_zero(met), b = std::countr_zero(rest);
                const bool a_first = keys[a] < keys[b];
                distances[top] = a_first ? keys[b] : keys[a];
                children[top++] = node.child[a_first ? b : a];
                current = foreseen<width>(node.child, a_first ? a : b);
            } else {
                store_descending(mask, entry, node.child, distances + top, children + top);
                top += more;
                current = foreseen<width>(node.child, lane_of(distances[top]));
            }
        }
        {
            const Block* const first = blocks + (current & Child::index_mask);
            const int count = (current & Child::second_block_bit) != 0 ? 2 : 1;
            keep_in_memory(prepared); // registers are for boxes
            if (leaves.template meet<query>(prepared, first, count, accept, hit)) {
                if constexpr (query == Query::any) return hit;
                limit = slabs.limit_of(hit.t);
            }
        }
    next:
        do {
            if (top == 0) {
                if (!hit) hit.t = std::numeric_limits<T>::infinity();
                return hit;
            }
            --top;
        } while (query == Query::closest && distances[top] > limit);
        current = children[top];
    }
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
