#pragma once
#include <lambent/bvh/leaves.hpp>
#include <lambent/bvh/wide.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/ray.hpp>
#include <bit>
#include <cmath>
#include <cstddef>
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>

namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {

/// The 2^30 triangles at most of a tree lie at most 64 + 28 splits below its root (see BinnedBuilder; Reinsertion
/// keeps to it), a wide node spans at least one split, and visiting one leaves at most width - 1 entries on the stack.
inline constexpr int max_depth = 64 + 28;

/// A ray as boxes are tested with: distances count along its largest axis, where the direction is then ±1, so
/// that nothing here depends on the direction's length.
///
/// A box is entered at plane · scale + near_shift and left at plane · scale + far_shift, one fma each. The
/// shifts hold the ray's origin and a margin. It covers, in units of position and with u the rounding unit:
/// 7u · reach for the triangle test (vertices moved and sheared, weights, t), where reach is the distance from
/// the origin to the farthest plane of the scene's box; 4u · reach for rounding here; 2u · |origin| for the
/// product in the shift. So a box is never missed whose triangle the triangle test would report, at that t.
/// A direction's component below 2^-50 of the largest is taken as that, sign of zero included: over the
/// distance to the scene's far side this moves the ray by less than the margin, and no plane times scale is
/// ever 0 · inf.
template <class T>
struct SlabRay {
    static constexpr int width = node_width<T>;
    using Lanes = Pack<T, width>;
    Lanes scale[3], near_shift[3], far_shift[3];
    std::uint32_t near_plane[3]; ///< byte offsets from the node
    std::uint32_t far_plane[3];
    T along; ///< t times this is a distance along the largest axis

    [[gnu::always_inline]] SlabRay(const Ray<T>& ray, const Bounds3<T>& bounds) {
        using Four = Pack<T, 4>;
        constexpr T u = std::numeric_limits<T>::epsilon() / 2, limit = T(1ull << 50);
        const Four o = spread(ray.origin), d = spread(ray.direction);
        const Four from_origin = max(abs(spread(bounds.min) - o), abs(spread(bounds.max) - o));
        const T reach = std::max(from_origin[0], std::max(from_origin[1], from_origin[2]));
        const Four size = abs(d);
        along = std::max(size[0], std::max(size[1], size[2]));
        const Four s = select(size * Four(limit) > Four(along), Four(along) / d, copysign(Four(limit), d));
        const Four shift = -o * s;
        const Four margin = multiply_add(Four(4 * u), abs(o), Four(24 * u * reach)) * abs(s);
        const Four near = shift - margin, far = shift + margin;
        const unsigned negative = bits(s < Four(T(0)));
        for (int k = 0; k < 3; ++k) {
            scale[k] = s[k];
            near_shift[k] = near[k];
            far_shift[k] = far[k];
            constexpr std::uint32_t plane = sizeof(T) * std::uint32_t(width);
            near_plane[k] = (2 * std::uint32_t(k) + (negative >> k & 1u)) * plane;
            far_plane[k] = (2 * std::uint32_t(k) + (~negative >> k & 1u)) * plane;
        }
    }

    /// Which children the ray meets between `from` and `to`; where it enters each.
    [[gnu::always_inline]] Mask<T, width> meets(const WideNode<T>& node, Lanes from, Lanes to, Lanes& entry) const {
        const auto at = [&](const std::uint32_t* plane, int k, const Lanes* shift) {
            const auto* const p = reinterpret_cast<const unsigned char*>(&node) + plane[k];
            Lanes lanes;
            std::memcpy(&lanes.v, p, sizeof(lanes.v));
            return multiply_add(lanes, scale[k], shift[k]);
        };
        entry = max(max(at(near_plane, 0, near_shift), at(near_plane, 1, near_shift)),
                    max(at(near_plane, 2, near_shift), from));
        const Lanes exit = min(min(at(far_plane, 0, far_shift), at(far_plane, 1, far_shift)),
                               min(at(far_plane, 2, far_shift), to));
        return entry <= exit;
    }

private:
    static Pack<T, 4> spread(const Vec3<T>& v) { return typename Pack<T, 4>::Vector{v.x, v.y, v.z, 0}; }
};

/// Finite, of a usable length, with bounds that are numbers; everything else hits nothing.
template <class T>
[[gnu::always_inline]] inline bool usable(const Ray<T>& ray, T along) {
    using Bits = typename Mask<T, 8>::Vector;
    using Lane = typename Mask<T, 8>::Lane;
    constexpr Lane magnitude = std::numeric_limits<Lane>::max(), infinite = Lane(FloatBits<T>::exponent);
    typename Pack<T, 8>::Vector all = {ray.origin.x,    ray.origin.y,    ray.origin.z, ray.t_min,
                                       ray.direction.x, ray.direction.y, ray.direction.z, ray.t_max};
    constexpr Lane f = infinite - 1;
    const Bits most = {f, f, f, infinite, f, f, f, infinite};
    const Mask<T, 8> wrong{(Bits(all) & magnitude) > most};
    return bits(wrong) == 0 && along >= std::numeric_limits<T>::min();
}

/// values[lane], but by a jump that the processor foresees: it then goes on with the next node before it knows the lane.
template <int N>
[[gnu::always_inline]] inline std::uint32_t foreseen(const std::uint32_t* values, int lane) {
    std::uint32_t r;
    switch (lane) {
    case 0: r = values[0]; asm volatile("# 0" : "+r"(r)); return r;
    case 1: r = values[1]; asm volatile("# 1" : "+r"(r)); return r;
    case 2: r = values[2]; asm volatile("# 2" : "+r"(r)); return r;
    case 3: r = values[3]; asm volatile("# 3" : "+r"(r)); return r;
    case 4: r = values[4 % N]; asm volatile("# 4" : "+r"(r)); return r;
    case 5: r = values[5 % N]; asm volatile("# 5" : "+r"(r)); return r;
    case 6: r = values[6 % N]; asm volatile("# 6" : "+r"(r)); return r;
    default: r = values[7 % N]; asm volatile("# 7" : "+r"(r)); return r;
    }
}
/// The one loop behind every query of a single ray. Returns the nearest hit, or for Query::any some hit.
/// leaves  what lies in the leaves, and how a ray meets it: see leaves.hpp
template <Query query, class T, class Leaves, class Accept>
[[gnu::noinline]] Hit<T> traverse(const WideTree<T, typename Leaves::Block>& tree, const Leaves& leaves, const Ray<T>& ray,
                       const Accept& accept) {
    constexpr int width = node_width<T>;
    using Lanes = Pack<T, width>;
    using Block = typename Leaves::Block;

    Hit<T> hit;
    if (tree.nodes.empty()) return hit;
    const SlabRay<T> slabs(ray, tree.bounds);
    if (!usable(ray, slabs.along)) return hit;
    typename Leaves::Query prepared(ray);
    asm volatile("" : "+m"(prepared)); // registers are for boxes: leaves read it from memory
    // Of the distances' rounding, and of their tags': these change less than `width` units in the last place.
    constexpr T slack = T(2 * width + 4) * std::numeric_limits<T>::epsilon(), least = std::numeric_limits<T>::min();
    const T start = ray.t_min * slabs.along;
    const Lanes from = start - std::abs(start) * slack;
    const auto limit_of = [&](T t) {
        const T distance = t * slabs.along;
        return distance + (std::abs(distance) * slack + least);
    };
    T limit = limit_of(ray.t_max); // hits beyond are of no interest
    hit.t = ray.t_max;

    const WideNode<T>* const nodes = tree.nodes.data();
    const Block* const blocks = tree.blocks.data();
    constexpr std::size_t size = std::size_t(max_depth * (width - 1) + width);
    alignas(64) T distances[query == Query::any ? 1 : size];
    alignas(64) std::uint32_t children[size];
    std::size_t top = 0;
    std::uint32_t current = 0;
    const auto lane_of = [](T tagged) { return int(std::bit_cast<typename FloatBits<T>::Type>(tagged) & (width - 1)); };
    [[maybe_unused]] const auto prefetch = [&](std::uint32_t child) {
        const char* const p = (child & Child::leaf_bit) != 0 ? reinterpret_cast<const char*>(blocks + (child & Child::index_mask)) : reinterpret_cast<const char*>(nodes + child);
        __builtin_prefetch(p);
        __builtin_prefetch(p + 64);
        __builtin_prefetch(p + 128);
        __builtin_prefetch(p + 192);
    };
    const auto push = [&](T distance, std::uint32_t child) {
        distances[top] = distance;
        children[top++] = child;
        prefetch(child);
    };
    for (;;) {
        while ((current & Child::leaf_bit) == 0) {
            const WideNode<T>& node = nodes[current];
            Lanes entry;
            const Mask<T, width> mask = slabs.meets(node, from, limit, entry);
            unsigned met = bits(mask);
            if (met == 0) goto next;
            if constexpr (query == Query::any) {
                int lane = std::countr_zero(met);
                met &= met - 1;
                current = foreseen<width>(node.child, lane);
                while (met != 0) {
                    lane = std::countr_zero(met);
                    children[top++] = node.child[lane];
                    prefetch(node.child[lane]);
                    met &= met - 1;
                }
            } else {
                if ((met & (met - 1)) == 0) {
                    current = foreseen<width>(node.child, std::countr_zero(met));
                    continue;
                }
                const unsigned rest = met & (met - 1);
                if ((rest & (rest - 1)) == 0) { // two: a branch on which is nearer, for it is often foreseen
                    T keys[std::size_t(width)];
                    entry.store(keys);
                    const int a = std::countr_zero(met), b = std::countr_zero(rest);
                    if (keys[a] < keys[b]) {
                        push(keys[b], node.child[b]);
                        current = foreseen<width>(node.child, a);
                    } else {
                        push(keys[a], node.child[a]);
                        current = foreseen<width>(node.child, b);
                    }
                    continue;
                }
                const Lanes order = sorted_descending(select(mask, tagged(entry), Lanes(T(-0.0))));
                order.store(distances + top);
                look_up(order, node.child, children + top);
                top += std::size_t(std::popcount(met)) - 1;
                current = foreseen<width>(node.child, lane_of(distances[top]));
                prefetch(children[top - 1]);
            }
        }
        {
            const Block* const first = blocks + (current & Child::index_mask);
            const int count = (current & Child::second_block_bit) != 0 ? 2 : 1;
            if (leaves.template meet<query>(prepared, first, count, accept, hit)) {
                if constexpr (query == Query::any) return hit;
                limit = limit_of(hit.t);
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
        if constexpr (query == Query::closest) prefetch(children[top - (top > 0)]);
    }
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
