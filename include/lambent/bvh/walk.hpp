#pragma once
#include <lambent/bvh/bvh.hpp>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Lanes of a node that hold a child, a bit each.
template <class T>
inline unsigned used_lanes(const WideNode<T>& node) {
    using Lanes = Pack<T, node_width<T>>;
    return bits(Lanes::load(node.plane[0]) <= Lanes::load(node.plane[1]));
}

/// Calls visit(block) for the blocks of a leaf; false stops.
template <class Block, class Visit>
inline bool visit_leaf(const Block* blocks, std::uint32_t child, Visit& visit) {
    const Block* const first = blocks + (child & Child::index_mask);
    return visit(*first) && ((child & Child::second_block_bit) == 0 || visit(first[1]));
}

/// Goes down, in no order, to the children whose bits meets(node) sets; calls visit(block) in the leaves, which is
/// false to stop. Returns whether it was never stopped.
template <class T, class Leaves, class Meets, class Visit>
bool walk(const BasicBvh<T, Leaves>& bvh, Meets&& meets, Visit&& visit) {
    const auto& tree = bvh.tree();
    if (tree.nodes.empty()) return true;
    std::uint32_t stack[std::size_t(max_depth * (node_width<T> - 1) + 1)];
    std::uint32_t* top = stack;
    *top++ = 0;
    while (top != stack) {
        const std::uint32_t child = *--top;
        if ((child & Child::leaf_bit) != 0) {
            if (!visit_leaf(tree.blocks.data(), child, visit)) return false;
            continue;
        }
        const WideNode<T>& node = tree.nodes[child];
        for (unsigned met = meets(node); met != 0; met &= met - 1)
            *top++ = node.child[std::countr_zero(met)];
    }
    return true;
}

/// The same, the lowest keys first: keys(node, out) writes those of the children, and children with a key above
/// limit() are left out, as the limit is when their turn comes. Keys of lanes without a child are not looked at.
template <class Key, class T, class Leaves, class Keys, class Limit, class Visit>
bool walk_nearest_first(const BasicBvh<T, Leaves>& bvh, Keys&& keys, Limit&& limit, Visit&& visit) {
    struct Entry {
        Key key;
        std::uint32_t child;
    };
    constexpr int width = node_width<T>;
    const auto& tree = bvh.tree();
    if (tree.nodes.empty()) return true;
    Entry stack[std::size_t(max_depth * (width - 1) + 1)];
    Entry* top = stack;
    std::uint32_t child = 0;
    for (;;) {
        if ((child & Child::leaf_bit) != 0) {
            if (!visit_leaf(tree.blocks.data(), child, visit)) return false;
        } else {
            const WideNode<T>& node = tree.nodes[child];
            Key key[std::size_t(width)];
            keys(node, key);
            Entry* const base = top;
            for (unsigned met = used_lanes(node); met != 0; met &= met - 1) {
                const int lane = std::countr_zero(met);
                if (!(key[lane] <= limit())) continue;
                Entry* place = top++;
                for (; place != base && place[-1].key < key[lane]; --place) *place = place[-1];
                *place = {key[lane], node.child[lane]};
            }
        }
        do {
            if (top == stack) return true;
            --top;
        } while (!(top->key <= limit()));
        child = top->child;
    }
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
