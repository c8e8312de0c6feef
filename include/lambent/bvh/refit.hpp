#pragma once
#include <lambent/bvh/leaves.hpp>
#include <lambent/bvh/wide.hpp>
#include <lambent/core/bounds.hpp>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// The box of one of a node's children, and whether there is such a child.
template <class T>
inline bool read_box(const WideNode<T>& node, int lane, Bounds3<T>& box) {
    for (int k = 0; k < 3; ++k) {
        box.min[k] = node.plane[2 * k][lane];
        box.max[k] = node.plane[2 * k + 1][lane];
    }
    return !box.empty();
}

template <class T>
inline void write_box(WideNode<T>& node, int lane, const Bounds3<T>& box) {
    for (int k = 0; k < 3; ++k) {
        node.plane[2 * k][lane] = box.min[k];
        node.plane[2 * k + 1][lane] = box.max[k];
    }
}

/// Renews blocks and boxes in place: first the blocks side by side, then the nodes from the last to the first, since
/// children come after their parents. A child in which nothing can be hit any longer shrinks to a point: an empty box
/// would be taken for a place without a child.
template <class Leaves, class Set, class E>
void refit(WideTree<typename Leaves::Scalar, typename Leaves::Block>& tree, const Set& set, E& executor) {
    using T = typename Leaves::Scalar;
    if (tree.nodes.empty()) return;
    std::vector<Bounds3<T>> block_boxes(tree.blocks.size()), node_boxes(tree.nodes.size());
    executor.parallel_for(tree.blocks.size(), 1 << 12, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) block_boxes[i] = Leaves::refit(set, tree.blocks[i]);
    });
    for (std::size_t i = tree.nodes.size(); i-- > 0;) {
        WideNode<T>& node = tree.nodes[i];
        Bounds3<T> boxes[std::size_t(node_width<T>)], old;
        for (int lane = 0; lane < node_width<T>; ++lane) {
            if (!read_box(node, lane, old)) continue;
            const std::uint32_t child = node.child[lane], index = child & Child::index_mask;
            boxes[lane] = (child & Child::leaf_bit) == 0 ? node_boxes[index] : block_boxes[index];
            if ((child & Child::leaf_bit) != 0 && (child & Child::second_block_bit) != 0)
                boxes[lane].add(block_boxes[index + 1]);
            node_boxes[i].add(boxes[lane]);
        }
        for (int lane = 0; lane < node_width<T>; ++lane) {
            if (!read_box(node, lane, old)) continue;
            if (boxes[lane].empty()) boxes[lane].add(node_boxes[i].empty() ? old.min : node_boxes[i].min);
            write_box(node, lane, boxes[lane]);
        }
    }
    Bounds3<T> all = node_boxes[0];
    if (all.empty()) read_box(tree.nodes[0], 0, all);
    tree.set_bounds(all);
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
