#pragma once
#include <lambent/bvh/bvh.hpp>

#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// What a tree is like, whatever primitives lie in it; what the tree asks the caller for is not counted. A box's chance
/// of being met by a ray that meets the root's is the ratio of their areas.
struct BvhStatistics {
    std::size_t nodes = 0, leaves = 0, blocks = 0;
    std::size_t triangles = 0;  ///< primitives of any kind in the tree, each counted once
    std::size_t duplicates = 0; ///< places in leaves beyond each primitive's first: what spatial splits cost
    std::size_t hidden = 0;     ///< of the triangles, those that cannot be hit since the last refit
    std::size_t dropped = 0;    ///< left out at the build
    int depth = 0;             ///< nodes on the longest way down
    double node_visits = 0;    ///< expected of such a ray, without regard to hits
    double block_tests = 0;    ///< the same
    double sah_cost = 0;       ///< node_visits + block_tests
    double node_fill = 0;      ///< mean share of the children's places that are taken, in [0, 1]
    double block_fill = 0;     ///< mean share of the blocks' lanes that hold a primitive, in [0, 1]
    std::size_t node_bytes = 0, block_bytes = 0; ///< of what the queries read

    double bytes_per_triangle() const {
        return triangles == 0 ? 0.0 : double(node_bytes + block_bytes) / double(triangles);
    }
};

/// cost  a walk over the whole tree
template <class T, class Leaves>
BvhStatistics statistics(const BasicBvh<T, Leaves>& bvh) {
    using detail::Child;
    const auto& tree = bvh.tree();
    constexpr int width = node_width<T>;
    BvhStatistics s;
    s.nodes = tree.nodes.size();
    s.blocks = tree.blocks.size();
    std::vector<bool> seen(bvh.source_count());
    for (const auto& block : tree.blocks)
        for (const std::uint32_t id : block.primitive) {
            if (id == no_primitive) continue;
            const std::size_t primitive = id & ~detail::hidden_bit;
            if (seen[primitive]) {
                ++s.duplicates;
                continue;
            }
            seen[primitive] = true;
            ++s.triangles;
            s.hidden += std::size_t((id & detail::hidden_bit) != 0);
        }
    s.dropped = tree.dropped;
    s.node_bytes = s.nodes * sizeof(detail::WideNode<T>);
    s.block_bytes = s.blocks * sizeof(typename Leaves::Block);
    if (bvh.empty()) return s;

    const double root_area = double(tree.bounds.half_area());
    const auto chance = [&](double area) { return root_area > 0 ? area / root_area : 1.0; };
    std::size_t children = 0;
    std::vector<std::pair<std::uint32_t, int>> stack{{0u, 1}};
    s.node_visits = 1;
    while (!stack.empty()) {
        const auto [index, depth] = stack.back();
        stack.pop_back();
        if (depth > s.depth) s.depth = depth;
        const detail::WideNode<T>& node = tree.nodes[index];
        for (int lane = 0; lane < width; ++lane) {
            if (!(node.plane[0][lane] <= node.plane[1][lane])) continue;
            ++children;
            const double x = double(node.plane[1][lane]) - double(node.plane[0][lane]),
                         y = double(node.plane[3][lane]) - double(node.plane[2][lane]),
                         z = double(node.plane[5][lane]) - double(node.plane[4][lane]);
            const double p = chance(x * y + y * z + z * x);
            const std::uint32_t child = node.child[lane];
            if ((child & Child::leaf_bit) == 0) {
                s.node_visits += p;
                stack.push_back({child, depth + 1});
            } else {
                ++s.leaves;
                s.block_tests += p * ((child & Child::second_block_bit) != 0 ? 2 : 1);
            }
        }
    }
    s.sah_cost = s.node_visits + s.block_tests;
    s.node_fill = double(children) / double(s.nodes * std::size_t(width));
    s.block_fill = double(s.triangles + s.duplicates) / double(s.blocks * std::size_t(detail::block_lanes));
    return s;
}

} // namespace LAMBENT_ABI
} // namespace lambent
