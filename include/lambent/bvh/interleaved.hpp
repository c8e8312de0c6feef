#pragma once
#include <lambent/bvh/traverse.hpp>
#include <algorithm>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Asks for the node's or the first block's cache lines, without a branch on which it is.
template <class T, class Block>
[[gnu::always_inline]] inline void prefetch(const WideTree<T, Block>& tree, std::uint32_t child) {
    const char* const first[2] = {reinterpret_cast<const char*>(tree.nodes.data()),
                                  reinterpret_cast<const char*>(tree.blocks.data())};
    static constexpr std::size_t size[2] = {sizeof(WideNode<T>), sizeof(Block)};
    const std::size_t leaf = (child & Child::leaf_bit) != 0;
    const char* const p = first[leaf] + (child & Child::index_mask) * size[leaf];
    for (std::size_t at = 0; at < std::max(size[0], size[1]); at += 64) __builtin_prefetch(p + at);
}

/// Many rays at once: a handful of traversals side by side, each taking one step in turn, so that while one waits for
/// memory the others work. Steps of a kind run together, as far as can be without branches on what was met, which the
/// processor could not foresee and would lose the others' work to.
template <Query query, class T, class Leaves, class Accept>
class Interleaved {
public:
    static constexpr int lanes = 24;

    Interleaved(const WideTree<T, typename Leaves::Block>& tree, const Leaves& leaves, const Accept& accept)
        : tree_(tree), leaves_(leaves), accept_(accept) {}

    /// The rays index_of(i) for i < end: ray_of(index) -> Ray<T>; report(index, hit), once for each, in no order. Returns
    /// how many nodes and leaves they looked into, all together.
    template <class IndexOf, class RayOf, class Report>
    [[gnu::noinline]] std::size_t run(std::size_t end, const IndexOf& index_of, const RayOf& ray_of, const Report& report) {
        Walk *nodes[2][lanes], *leaves[2][lanes]; // who is at one: in this round, and in the next
        Walk **at_node = nodes[0], **at_leaf = leaves[0];
        int node_count = 0, leaf_count = 0;
        std::size_t next = 0, steps = 0;
        const auto start = [&](Walk& walk) {
            while (next < end) {
                const std::size_t i = index_of(next++);
                const Ray<T>& ray = ray_of(i);
                if (!tree_.nodes.empty() && walk.start(ray, tree_)) {
                    walk.ray = i;
                    at_node[node_count++] = &walk;
                    return;
                }
                report(i, Hit<T>());
            }
        };
        const auto go_on = [&](Walk& walk) {
            if (!walk.leave()) {
                if (!walk.hit()) walk.hits[0].t = std::numeric_limits<T>::infinity();
                report(walk.ray, walk.hit());
                return start(walk);
            }
            prefetch(tree_, walk.current);
            const bool leaf = (walk.current & Child::leaf_bit) != 0;
            at_node[node_count] = &walk;
            node_count += leaf ? 0 : 1;
            at_leaf[leaf_count] = &walk;
            leaf_count += leaf ? 1 : 0;
        };
        for (Walk& walk : walks_) start(walk);
        while (node_count + leaf_count > 0) {
            for (int i = 0; i < node_count; ++i) at_node[i]->enter(tree_);
            for (int i = 0; i < leaf_count; ++i) at_leaf[i]->meet(tree_, leaves_, accept_);
            Walk* const* const was_at_node = std::exchange(at_node, nodes[at_node == nodes[0]]);
            Walk* const* const was_at_leaf = std::exchange(at_leaf, leaves[at_leaf == leaves[0]]);
            const int were_at_node = std::exchange(node_count, 0), were_at_leaf = std::exchange(leaf_count, 0);
            for (int i = 0; i < were_at_node; ++i) go_on(*was_at_node[i]);
            for (int i = 0; i < were_at_leaf; ++i) go_on(*was_at_leaf[i]);
            steps += std::size_t(were_at_node + were_at_leaf);
        }
        return steps;
    }

private:
    using Tree = WideTree<T, typename Leaves::Block>;
    static constexpr int width = node_width<T>;

    /// One ray under way.
    struct alignas(64) Walk {
        SlabRay<T> slabs;
        T limit;
        std::uint32_t current;
        std::uint32_t top;
        std::size_t ray;
        Hit<T> hits[2]; ///< the nearest, and room for what is none: see leaves.hpp
        typename Leaves::Query prepared;
        alignas(64) T distances[max_stack<T>];
        alignas(64) std::uint32_t children[max_stack<T>];

        const Hit<T>& hit() const { return hits[0]; }

        [[gnu::always_inline]] bool start(const Ray<T>& r, const Tree& tree) {
            if (!slabs.start(r, tree)) return false;
            limit = slabs.limit_of(r.t_max);
            hits[0] = {};
            hits[0].t = r.t_max;
            prepared = typename Leaves::Query(r);
            current = 0;
            top = 0;
            return true;
        }

        /// Puts the node's children that the ray meets on the stack: the nearest on top, or for Query::any the first.
        [[gnu::always_inline]] void enter(const Tree& tree) {
            const WideNode<T>& node = tree.nodes[current];
            Pack<T, width> entry;
            const Mask<T, width> mask = slabs.meets(node, limit, entry);
            if constexpr (query == Query::any) {
                compress_descending<width>(bits(mask), node.child, children + top);
            } else {
                store_descending(mask, entry, node.child, distances + top, children + top);
            }
            top += std::uint32_t(std::popcount(bits(mask)));
        }

        [[gnu::always_inline]] void meet(const Tree& tree, const Leaves& leaves, const Accept& accept) {
            const auto* const blocks = tree.blocks.data() + (current & Child::index_mask);
            const int count = (current & Child::second_block_bit) != 0 ? 2 : 1;
            bool found;
            if constexpr (both_ways) {
                found = leaves.template meet_both_ways<query>(prepared, blocks, count, hits);
            } else {
                found = leaves.template meet<query>(prepared, blocks, count, filter_of(accept, ray), hits[0]);
            }
            if constexpr (query == Query::any) {
                top = found ? 0 : top;
            } else {
                limit = slabs.limit_of(hits[0].t);
            }
        }

        /// Goes to the topmost child that is near enough; false if there is none.
        [[gnu::always_inline]] bool leave() {
            do {
                if (top == 0) return false;
                --top;
            } while (query == Query::closest && distances[top] > limit);
            current = children[top];
            return true;
        }

        static constexpr bool both_ways =
            std::same_as<Accept, AcceptAll> && requires(const Leaves& leaves, Walk& walk) {
                leaves.template meet_both_ways<query>(walk.prepared, nullptr, 1, walk.hits);
            };
    };

    const WideTree<T, typename Leaves::Block>& tree_;
    const Leaves& leaves_;
    const Accept& accept_;
    Walk walks_[lanes];
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
