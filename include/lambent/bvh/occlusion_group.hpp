#pragma once
#include <lambent/bvh/leaves.hpp>
#include <lambent/bvh/ray_group.hpp>
#include <lambent/bvh/traverse.hpp>
#include <algorithm>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Occlusion rays of one kind, one a lane: they go through the tree together. What none of them can meet is found by
/// intervals, the rest of a node's children and the triangles of leaves are tested against all of them at once; where
/// few are left, each goes on by itself. They may start and point anywhere: what they share of the way is saved.
template <class T, class Accept>
class OcclusionGroup {
public:
    static constexpr int lanes = group_lanes<T>;
    static constexpr bool pays = lanes >= 8; ///< whether a register holds rays enough
    using Leaves = StoredTriangles<T>;
    using Tree = WideTree<T, TriangleBlock<T>>;

    OcclusionGroup(const Tree& tree, const Leaves& leaves, const Accept& accept)
        : tree_(tree), leaves_(leaves), accept_(accept) {}

    /// A bit for each of the rays ray_of(indices[i]), i < count, count <= lanes, that is occluded.
    template <class RayOf>
    [[gnu::noinline]] unsigned run(const std::uint32_t* indices, int count, int kind, const RayOf& ray_of) {
        indices_ = indices;
        // What is missing is filled with the last.
        group_.take(tree_, kind, [&](int i) -> decltype(auto) { return ray_of(indices[std::min(i, count - 1)]); });
        const RayIntervals<T> all(tree_, kind, &group_, 1);
        const PlaneOffsets& plane = RayKind<T>::plane(kind);
        const auto axes = RayKind<T>::axes(kind);
        std::uint32_t children[max_stack<T>], wanted_by[max_stack<T>];
        std::size_t top = 1;
        children[0] = 0;
        wanted_by[0] = (1u << count) - 1;
        occluded_ = 0;
        while (top > 0) {
            --top;
            const std::uint32_t child = children[top];
            const unsigned active = wanted_by[top] & ~occluded_;
            if (std::popcount(active) <= few) {
                for (unsigned left = active; left != 0; left &= left - 1) {
                    const int i = std::countr_zero(left);
                    const std::size_t ray = indices[i];
                    occluded_ |= unsigned(bool(traverse<Query::any>(tree_, leaves_, ray_of(ray), filter_of(accept_, ray), child)))
                                 << i;
                }
                alone_ += unsigned(std::popcount(active));
            } else if ((child & Child::leaf_bit) != 0) {
                meet_leaf(child, active, axes);
            } else {
                const WideNode<T>& node = tree_.nodes[child];
                const NodeRows<T> rows(node, plane);
                Pack<T, node_width<T>> entry;
                unsigned near = bits(all.meets(rows, entry));
                while (near != 0) { // the first lane last, so that it is visited first: the likeliest to be hit
                    const int i = 31 - std::countl_zero(near);
                    near ^= 1u << i;
                    children[top] = node.child[i];
                    wanted_by[top] = bits(group_.meet(Box(rows, i))) & active;
                    top += wanted_by[top] != 0 ? 1 : 0;
                }
            }
        }
        return occluded_;
    }

    /// How many subtrees rays went through by themselves since this was asked last.
    unsigned take_alone() { return std::exchange(alone_, 0u); }

private:
    using Group = RayGroup<T, lanes>;
    using Box = typename Group::Box;
    static constexpr int few = 2; ///< rays, for which a step costs more than it does by themselves

    void meet_leaf(std::uint32_t child, unsigned active, const typename RayKind<T>::Axes& axes) {
        const auto* block = tree_.blocks.data() + (child & Child::index_mask);
        const int blocks = (child & Child::second_block_bit) != 0 ? 2 : 1;
        for (int b = 0; b < blocks; ++b)
            for (int i = 0; i < block_lanes && block[b].primitive[i] != no_primitive; ++i) {
                const auto found = group_.template meet<rules_of<Accept>(), RangeEnd::open>(block[b], i, axes);
                unsigned hits = bits(found.mask) & active;
                if constexpr (!std::same_as<Accept, AcceptAll>)
                    for (unsigned left = hits; left != 0; left &= left - 1) {
                        const int l = std::countr_zero(left);
                        if (!filter_of(accept_, indices_[l])(block[b].primitive[i], found.u[l], found.v[l], found.t[l]))
                            hits ^= 1u << l;
                    }
                occluded_ |= hits;
                active &= ~occluded_;
                if (active == 0) return;
            }
    }

    const Tree& tree_;
    const Leaves& leaves_;
    const Accept& accept_;
    Group group_;
    const std::uint32_t* indices_ = nullptr;
    unsigned occluded_ = 0, alone_ = 0;
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
