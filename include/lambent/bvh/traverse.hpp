#pragma once
#include <lambent/bvh/leaves.hpp>
#include <lambent/bvh/wide.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/ray.hpp>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

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
    int near_plane[3]; ///< index into WideNode::plane; the far one is its neighbour
    T along;           ///< t times this is a distance along the largest axis

    SlabRay(const Ray<T>& ray, const Bounds3<T>& bounds, T units = default_margin<T>) {
        constexpr T u = std::numeric_limits<T>::epsilon() / 2;
        along = std::abs(ray.direction[largest_axis(ray.direction)]);
        const Vec3<T> farthest =
            glm::max(glm::abs(bounds.min - ray.origin), glm::abs(bounds.max - ray.origin));
        const T reach = max_component(farthest);
        for (int k = 0; k < 3; ++k) {
            const T d = ray.direction[k];
            constexpr T limit = T(1ull << 50);
            const T s = std::abs(d) * limit > along ? along / d : std::copysign(limit, d);
            const T shift = -ray.origin[k] * s;
            const T margin = (units * u * reach + 4 * u * std::abs(ray.origin[k])) * std::abs(s);
            scale[k] = s;
            near_shift[k] = shift - margin;
            far_shift[k] = shift + margin;
            near_plane[k] = 2 * k + (s < 0 ? 1 : 0);
        }
    }

    /// Which children the ray meets between `from` and `to`; where it enters each.
    Mask<T, width> meets(const WideNode<T>& node, Lanes from, Lanes to, Lanes& entry) const {
        const auto at = [&](int plane, int k, const Lanes* shift) {
            return multiply_add(Lanes::load(node.plane[plane]), scale[k], shift[k]);
        };
        entry = max(max(at(near_plane[0], 0, near_shift), at(near_plane[1], 1, near_shift)),
                    max(at(near_plane[2], 2, near_shift), from));
        const Lanes exit = min(min(at(near_plane[0] ^ 1, 0, far_shift), at(near_plane[1] ^ 1, 1, far_shift)),
                               min(at(near_plane[2] ^ 1, 2, far_shift), to));
        return entry <= exit;
    }
};

/// Finite, of a usable length, with bounds that are numbers; everything else hits nothing.
template <class T>
inline bool usable(const Ray<T>& ray) {
    const auto is_nan = [](T x) {
        using Bits = FloatBits<T>;
        return (std::bit_cast<typename Bits::Type>(x) & ~Bits::sign) > Bits::exponent;
    };
    return is_finite(ray.origin) && is_finite(ray.direction) && !is_nan(ray.t_min) && !is_nan(ray.t_max) &&
           max_component(glm::abs(ray.direction)) >= std::numeric_limits<T>::min();
}

/// The one loop behind every query of a single ray. Returns the nearest hit, or for Query::any some hit.
/// leaves  what lies in the leaves, and how a ray meets it: see leaves.hpp
template <Query query, class T, class Leaves, class Accept>
inline Hit<T> traverse(const WideTree<T, typename Leaves::Block>& tree, const Leaves& leaves, const Ray<T>& ray,
                       const Accept& accept) {
    constexpr int width = node_width<T>;
    using Lanes = Pack<T, width>;
    using Block = typename Leaves::Block;
    struct Entry {
        T distance;
        std::uint32_t child;
    };

    Hit<T> hit;
    if (tree.nodes.empty() || !usable(ray)) return hit;
    const SlabRay<T> slabs(ray, tree.bounds, tree.margin);
    const typename Leaves::Query prepared(ray);
    constexpr T slack = 4 * std::numeric_limits<T>::epsilon();
    const T start = ray.t_min * slabs.along;
    const Lanes from = start - std::abs(start) * slack;
    const auto limit_of = [&](T t) {
        const T distance = t * slabs.along;
        return distance + std::abs(distance) * slack;
    };
    T limit = limit_of(ray.t_max); // hits beyond are of no interest
    hit.t = ray.t_max;

    const WideNode<T>* const nodes = tree.nodes.data();
    const Block* const blocks = tree.blocks.data();
    Entry stack[std::size_t(max_depth * (width - 1) + 1)];
    Entry* top = stack;
    std::uint32_t current = 0;
    for (;;) {
        while ((current & Child::leaf_bit) == 0) {
            const WideNode<T>& node = nodes[current];
            Lanes entry;
            unsigned met = bits(slabs.meets(node, from, limit, entry));
            if (met == 0) goto next;
            int lane = std::countr_zero(met);
            met &= met - 1;
            current = node.child[lane];
            if (met == 0) continue;
            if constexpr (query == Query::any) {
                do {
                    lane = std::countr_zero(met);
                    *top++ = {0, node.child[lane]};
                    met &= met - 1;
                } while (met != 0);
            } else {
                T distances[std::size_t(width)];
                entry.store(distances);
                Entry nearest{distances[lane], current};
                lane = std::countr_zero(met);
                met &= met - 1;
                Entry other{distances[lane], node.child[lane]};
                if (other.distance < nearest.distance) std::swap(nearest, other);
                Entry* const base = top;
                *top++ = other;
                while (met != 0) { // the stack stays sorted, the nearest on top
                    lane = std::countr_zero(met);
                    met &= met - 1;
                    other = {distances[lane], node.child[lane]};
                    if (other.distance < nearest.distance) std::swap(nearest, other);
                    Entry* place = top++;
                    for (; place != base && place[-1].distance < other.distance; --place) *place = place[-1];
                    *place = other;
                }
                current = nearest.child;
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
            if (top == stack) {
                if (!hit) hit.t = std::numeric_limits<T>::infinity();
                return hit;
            }
            --top;
        } while (query == Query::closest && top->distance > limit);
        current = top->child;
    }
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
