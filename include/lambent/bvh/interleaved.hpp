#pragma once
#include <lambent/bvh/traverse.hpp>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Many rays at once: a handful of traversals side by side, each taking one step in turn, so that while one waits for
/// memory the others work. Steps of a kind run together, without branches on what the boxes said.
template <Query query, class T, class Leaves, class Accept>
class Interleaved {
public:
    static constexpr int lanes = 16;

    Interleaved(const WideTree<T, typename Leaves::Block>& tree, const Leaves& leaves, const Accept& accept)
        : tree_(tree), leaves_(leaves), accept_(accept) {}

    /// ray_of(i) -> Ray<T> for i < end; report(i, hit), once for each, in no order
    template <class RayOf, class Report>
    [[gnu::noinline]] void run(std::size_t end, const RayOf& ray_of, const Report& report) {
        Walk *at_node[lanes], *at_leaf[lanes];
        int node_count = 0, leaf_count = 0;
        std::size_t next = 0;
        const auto start = [&](Walk& walk) {
            while (next < end) {
                const std::size_t i = next++;
                const Ray<T>& ray = ray_of(i);
                if (!tree_.nodes.empty() && walk.start(ray, tree_)) {
                    walk.ray = i;
                    at_node[node_count++] = &walk;
                    return;
                }
                report(i, Hit<T>());
            }
        };
        const auto finish = [&](Walk& walk) {
            if (!walk.hit) walk.hit.t = std::numeric_limits<T>::infinity();
            report(walk.ray, walk.hit);
            start(walk);
        };
        const auto advance = [&](Walk& walk) {
            do {
                if (walk.top == 0) return finish(walk);
                --walk.top;
            } while (query == Query::closest && walk.distances[walk.top] > walk.limit);
            const std::uint32_t child = walk.children[walk.top];
            prefetch(tree_, child);
            walk.current = child;
            const bool leaf = (child & Child::leaf_bit) != 0;
            at_node[node_count] = &walk;
            node_count += leaf ? 0 : 1;
            at_leaf[leaf_count] = &walk;
            leaf_count += leaf ? 1 : 0;
        };
        for (Walk& walk : walks_) start(walk);
        while (node_count + leaf_count > 0) {
            for (int i = 0, n = std::exchange(node_count, 0); i < n; ++i) {
                Walk& walk = *at_node[i];
                walk.enter(tree_.nodes[walk.current]);
                advance(walk);
            }
            for (int i = 0, n = std::exchange(leaf_count, 0); i < n; ++i) {
                Walk& walk = *at_leaf[i];
                const auto* const blocks = tree_.blocks.data() + (walk.current & Child::index_mask);
                const int count = (walk.current & Child::second_block_bit) != 0 ? 2 : 1;
                if (leaves_.template meet<query>(walk.prepared, blocks, count, accept_, walk.hit)) {
                    if (query == Query::any) {
                        finish(walk);
                        continue;
                    }
                    walk.limit = walk.slabs.limit_of(walk.hit.t);
                }
                advance(walk);
            }
        }
    }

private:
    /// One ray under way.
    struct alignas(64) Walk {
        SlabRay<T> slabs;
        T limit;
        std::uint32_t current;
        std::uint32_t top;
        std::size_t ray;
        Hit<T> hit;
        typename Leaves::Query prepared;
        alignas(64) T distances[max_stack<T>];
        alignas(64) std::uint32_t children[max_stack<T>];

        template <class Tree>
        [[gnu::always_inline]] bool start(const Ray<T>& r, const Tree& tree) {
            if (!slabs.start(r, tree)) return false;
            limit = slabs.limit_of(r.t_max);
            hit = {};
            hit.t = r.t_max;
            prepared = typename Leaves::Query(r);
            current = 0;
            top = 0;
            return true;
        }

        /// Puts the children that the ray meets on the stack: the nearest on top, or for Query::any the first.
        [[gnu::always_inline]] void enter(const WideNode<T>& node) {
            Pack<T, node_width<T>> entry;
            const Mask<T, node_width<T>> mask = slabs.meets(node, limit, entry);
            if constexpr (query == Query::any) {
                compress_descending<node_width<T>>(bits(mask), node.child, children + top);
            } else {
                store_descending(mask, entry, node.child, distances + top, children + top);
            }
            top += std::uint32_t(std::popcount(bits(mask)));
        }
    };

    const WideTree<T, typename Leaves::Block>& tree_;
    const Leaves& leaves_;
    const Accept& accept_;
    Walk walks_[lanes];
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
