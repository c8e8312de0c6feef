#pragma once
#include <lambent/bvh/bvh.hpp>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
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

/// cost  a walk over the whole tree, and a sort of its primitives' indices
template <class T, class Leaves>
BvhStatistics statistics(const BasicBvh<T, Leaves>& bvh) {
    using detail::Child;
    const auto& tree = bvh.tree();
    constexpr int width = node_width<T>;
    BvhStatistics s;
    s.nodes = tree.nodes.size();
    s.blocks = tree.blocks.size();
    std::vector<std::uint32_t> ids; // as many as there are, not as many as a loaded tree says its source had
    for (const auto& block : tree.blocks)
        std::copy_if(std::begin(block.primitive), std::end(block.primitive), std::back_inserter(ids),
                     [](std::uint32_t id) { return id != no_primitive; });
    const std::size_t places = ids.size();
    const auto primitive = [](std::uint32_t id) { return id & ~detail::hidden_bit; };
    std::sort(ids.begin(), ids.end(), [&](auto a, auto b) { return primitive(a) < primitive(b); });
    ids.erase(std::unique(ids.begin(), ids.end(), [&](auto a, auto b) { return primitive(a) == primitive(b); }),
              ids.end());
    s.triangles = ids.size();
    s.duplicates = places - s.triangles;
    s.hidden =
        std::size_t(std::count_if(ids.begin(), ids.end(), [](auto id) { return (id & detail::hidden_bit) != 0; }));
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
