#pragma once
#include <lambent/bvh/builders.hpp>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Makes a finished tree cheaper to traverse: takes out the subtrees with the largest boxes, one by one, and puts
/// each back where the boxes of all nodes above it grow least. What is best is looked for everywhere, by branch
/// and bound, so each move makes the sum of the areas smaller. Serial: the same tree for any number of threads.
/// source  Bittner, Hapala, Havran, "Fast insertion-based optimization of bounding volume hierarchies" (2013);
///         the search from the parent upwards is that of Meister and Bittner, "Parallel reinsertion" (2018)
template <class T>
class Reinsertion {
public:
    static constexpr int passes = 2;
    static constexpr std::size_t share = 20; ///< one node of so many is moved in a pass
    static constexpr int max_visits = 1 << 11; ///< of one search; where everything overlaps there is no bound to cut by

    /// Leaves the tree as it is where the better one would be deeper than `deepest`.
    /// cost  time and memory in proportion to the triangles; about a third of the binned build's time
    static void improve(BinaryTree<T>& tree, int deepest) {
        if (tree.nodes.size() < 7) return;
        Reinsertion work(tree);
        for (int i = 0; i < passes; ++i) work.pass();
        BinaryTree<T> better = work.emit(deepest);
        if (!better.nodes.empty()) tree = std::move(better);
    }

private:
    static constexpr std::uint32_t none = 0xffffffffu;

    struct Node {
        PackBox<T> box;
        T area;
        std::uint32_t parent;
        std::uint32_t child[2]; ///< none: a leaf
        bool leaf() const { return child[0] == none; }
    };

    explicit Reinsertion(const BinaryTree<T>& tree) : tree_(tree), nodes_(tree.nodes.size()) {
        nodes_[0].parent = none;
        for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
            const BinaryNode<T>& from = tree.nodes[i];
            Node& node = nodes_[i];
            node.box = from.box;
            node.area = from.box.half_area();
            node.child[0] = node.child[1] = none;
            if (from.left == 0) continue;
            for (std::uint32_t k = 0; k < 2; ++k) {
                node.child[k] = from.left + k;
                nodes_[from.left + k].parent = i;
            }
        }
    }

    void pass() {
        std::vector<std::uint32_t> largest;
        largest.reserve(nodes_.size());
        for (std::uint32_t i = 1; i < nodes_.size(); ++i) largest.push_back(i);
        const auto larger = [this](std::uint32_t a, std::uint32_t b) {
            return nodes_[a].area > nodes_[b].area || (nodes_[a].area == nodes_[b].area && a < b);
        };
        const auto end = largest.begin() + std::ptrdiff_t(std::max<std::size_t>(largest.size() / share, 1));
        std::nth_element(largest.begin(), end, largest.end(), larger);
        largest.erase(end, largest.end());
        std::sort(largest.begin(), largest.end(), larger);
        for (const std::uint32_t node : largest)
            if (const std::uint32_t place = best_place(node); place != none) move(node, place);
    }

    std::uint32_t sibling(std::uint32_t node) const {
        const Node& parent = nodes_[nodes_[node].parent];
        return parent.child[parent.child[0] == node ? 1 : 0];
    }

    /// Beside which node the sum of the areas gets smallest; none: where it is.
    std::uint32_t best_place(std::uint32_t node) {
        const std::uint32_t parent = nodes_[node].parent;
        if (nodes_[parent].parent == none) return none; // the root stays
        const PackBox<T> box = nodes_[node].box;
        const T area = nodes_[node].area;
        int visits = 0;
        T most = 0;
        std::uint32_t place = none;
        T gain = nodes_[parent].area; // what is saved before the node is put back below the pivot
        PackBox<T> rest = nodes_[sibling(node)].box; // what is left of the pivot
        std::uint32_t below = sibling(node), pivot = parent;
        for (;;) {
            open_.push_back({gain, below});
            while (!open_.empty()) {
                const auto [saved, at] = open_.back();
                open_.pop_back();
                if (!(saved - area > most) || ++visits > max_visits) continue;
                const Node& candidate = nodes_[at];
                PackBox<T> both = candidate.box;
                both.add(box);
                const T merged = both.half_area();
                if (saved - merged > most && at != sibling(node)) {
                    most = saved - merged;
                    place = at;
                }
                const T left = saved + candidate.area - merged;
                if (candidate.leaf() || !(left - area > most)) continue;
                open_.push_back({left, candidate.child[1]});
                open_.push_back({left, candidate.child[0]});
            }
            if (pivot != parent) {
                rest.add(nodes_[below].box);
                gain += nodes_[pivot].area - rest.half_area();
            }
            if (nodes_[pivot].parent == none) break;
            below = sibling(pivot);
            pivot = nodes_[pivot].parent;
        }
        return most > nodes_[0].area * T(1e-7) ? place : none; // less is rounding
    }

    /// Takes the node's parent along: it becomes the parent of the node and of `place`.
    void move(std::uint32_t node, std::uint32_t place) {
        const std::uint32_t parent = nodes_[node].parent, other = sibling(node), above = nodes_[parent].parent;
        replace(above, parent, other);
        refit(above);
        const std::uint32_t top = nodes_[place].parent;
        replace(top, place, parent);
        nodes_[parent].child[0] = place;
        nodes_[parent].child[1] = node;
        nodes_[place].parent = parent;
        refit(parent);
    }

    void replace(std::uint32_t parent, std::uint32_t old, std::uint32_t now) {
        nodes_[parent].child[nodes_[parent].child[0] == old ? 0 : 1] = now;
        nodes_[now].parent = parent;
    }

    void refit(std::uint32_t node) {
        for (; node != none; node = nodes_[node].parent) {
            Node& n = nodes_[node];
            n.box = nodes_[n.child[0]].box;
            n.box.add(nodes_[n.child[1]].box);
            n.area = n.box.half_area();
        }
    }

    /// In the builder's form, children after their parents; empty where it is too deep.
    BinaryTree<T> emit(int deepest) const {
        struct Task {
            std::uint32_t from, to;
            int depth;
        };
        BinaryTree<T> result;
        result.dropped = tree_.dropped;
        result.duplicates = tree_.duplicates;
        result.nodes.reserve(nodes_.size());
        result.references.reserve(tree_.references.size());
        result.nodes.emplace_back();
        std::vector<Task> stack{{0, 0, 0}};
        while (!stack.empty()) {
            const Task task = stack.back();
            stack.pop_back();
            const Node& from = nodes_[task.from];
            result.nodes[task.to].box = from.box;
            result.nodes[task.to].first = std::uint32_t(result.references.size());
            if (from.leaf()) {
                const BinaryNode<T>& leaf = tree_.nodes[task.from];
                const auto first = tree_.references.begin() + std::ptrdiff_t(leaf.first);
                result.references.insert(result.references.end(), first, first + std::ptrdiff_t(leaf.count));
                result.nodes[task.to].count = leaf.count;
                continue;
            }
            if (task.depth == deepest) return {};
            const std::uint32_t left = std::uint32_t(result.nodes.size());
            result.nodes[task.to].left = left;
            result.nodes.resize(left + 2);
            stack.push_back({from.child[1], left + 1, task.depth + 1});
            stack.push_back({from.child[0], left, task.depth + 1});
        }
        for (std::size_t i = result.nodes.size(); i-- > 0;) {
            BinaryNode<T>& node = result.nodes[i];
            if (node.left != 0) node.count = result.nodes[node.left].count + result.nodes[node.left + 1].count;
        }
        return result;
    }

    const BinaryTree<T>& tree_;
    std::vector<Node> nodes_;
    std::vector<std::pair<T, std::uint32_t>> open_;
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
