#pragma once
#include <lambent/bvh/node.hpp>
#include <lambent/core/bounds.hpp>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {

template <class T>
struct BuildItem {
    Bounds3<T> box;
    Vec3<T> center;
    std::uint32_t primitive;
};

/// A binary tree by binned surface-area heuristic, nodes in depth-first order. A node is a leaf when count > 0.
template <class T>
struct BinaryNode {
    Bounds3<T> box;
    std::uint32_t first = 0; ///< of a leaf: its first item; of a node: its right child (the left one follows it)
    std::uint32_t count = 0;
};

/// source  Wald, "On fast construction of SAH-based bounding volume hierarchies", RT 2007
template <class T>
class BinnedBuilder {
public:
    static constexpr std::uint32_t bins = 16, max_leaf = 8, block = 4;
    /// Below this depth the median splits: at most 32 levels more, as there are at most 2^32 items.
    static constexpr std::uint32_t heuristic_depth = 48, max_depth = heuristic_depth + 32;

    explicit BinnedBuilder(std::span<BuildItem<T>> items) : items_(items) {
        if (!items_.empty()) {
            nodes_.reserve(items_.size());
            build();
        }
    }
    std::vector<BinaryNode<T>> take() { return std::move(nodes_); }

private:
    struct Task {
        std::uint32_t first, count, depth, parent;
    };
    static constexpr std::uint32_t no_parent = 0xffffffffu;

    void build() {
        std::vector<Task> tasks{{0, std::uint32_t(items_.size()), 0, no_parent}};
        while (!tasks.empty()) {
            const Task task = tasks.back();
            tasks.pop_back();
            const auto index = std::uint32_t(nodes_.size());
            if (task.parent != no_parent) nodes_[task.parent].first = index;
            BinaryNode<T> node;
            Bounds3<T> centers;
            for (const BuildItem<T>& item : items_.subspan(task.first, task.count)) {
                node.box.add(item.box);
                centers.add(item.center);
            }
            const std::uint32_t left = split(task, node.box, centers);
            if (left == 0) {
                node.first = task.first;
                node.count = task.count;
                nodes_.push_back(node);
                continue;
            }
            nodes_.push_back(node);
            tasks.push_back({task.first + left, task.count - left, task.depth + 1, index});
            tasks.push_back({task.first, left, task.depth + 1, no_parent});
        }
    }

    static T blocks_of(std::uint32_t count) { return T((count + block - 1) / block); }

    /// Reorders the task's items and says how many go left; 0 = make a leaf.
    std::uint32_t split(const Task& task, const Bounds3<T>& box, const Bounds3<T>& centers) {
        if (task.count <= 1) return 0;
        const auto items = items_.subspan(task.first, task.count);
        T best_cost = std::numeric_limits<T>::infinity(), best_plane = 0;
        int best_axis = -1;
        if (task.depth < heuristic_depth) {
            for (int axis = 0; axis < 3; ++axis) {
                const T low = centers.min[axis], extent = centers.max[axis] - low;
                if (!(extent > 0)) continue;
                const T scale = T(bins) * (1 - 4 * std::numeric_limits<T>::epsilon()) / extent;
                if (!is_finite(scale)) continue;
                find_plane(items, axis, low, scale, best_cost, best_axis, best_plane);
            }
        }
        const T area = box.half_area();
        const T leaf_cost = blocks_of(task.count) * area;
        // A node step costs about as much as a block of four triangles.
        if (task.count <= max_leaf && (best_axis < 0 || best_cost + area >= leaf_cost)) return 0;
        if (best_axis >= 0) {
            const T low = centers.min[best_axis];
            const T scale = T(bins) * (1 - 4 * std::numeric_limits<T>::epsilon()) /
                            (centers.max[best_axis] - low);
            const auto middle = std::partition(items.begin(), items.end(), [&](const BuildItem<T>& item) {
                return T(bin_of(item.center[best_axis], low, scale)) < best_plane;
            });
            const auto left = std::uint32_t(middle - items.begin());
            if (left > 0 && left < task.count) return left;
        }
        // Centroids that coincide, or a degenerate tree: by number, along the longest axis.
        const int axis = largest_axis(centers.size());
        const std::uint32_t left = task.count / 2;
        std::nth_element(items.begin(), items.begin() + left, items.end(),
                         [&](const BuildItem<T>& a, const BuildItem<T>& b) {
                             return a.center[axis] != b.center[axis] ? a.center[axis] < b.center[axis]
                                                                     : a.primitive < b.primitive;
                         });
        return left;
    }

    static std::uint32_t bin_of(T center, T low, T scale) {
        return std::min(bins - 1, std::uint32_t((center - low) * scale));
    }

    static void find_plane(std::span<const BuildItem<T>> items, int axis, T low, T scale, T& best_cost, int& best_axis,
                           T& best_plane) {
        std::array<Bounds3<T>, bins> boxes{};
        std::array<std::uint32_t, bins> counts{};
        for (const BuildItem<T>& item : items) {
            const std::uint32_t b = bin_of(item.center[axis], low, scale);
            boxes[b].add(item.box);
            ++counts[b];
        }
        std::array<T, bins> right_cost{};
        Bounds3<T> box;
        std::uint32_t count = 0;
        for (std::uint32_t b = bins - 1; b > 0; --b) {
            box.add(boxes[b]);
            count += counts[b];
            right_cost[b] = count > 0 ? box.half_area() * blocks_of(count) : T(-1);
        }
        box = {};
        count = 0;
        for (std::uint32_t b = 1; b < bins; ++b) {
            box.add(boxes[b - 1]);
            count += counts[b - 1];
            if (count == 0 || right_cost[b] < 0) continue;
            const T cost = box.half_area() * blocks_of(count) + right_cost[b];
            if (cost < best_cost) {
                best_cost = cost;
                best_axis = axis;
                best_plane = T(b);
            }
        }
    }

    std::span<BuildItem<T>> items_;
    std::vector<BinaryNode<T>> nodes_;
};

} // namespace detail

} // namespace LAMBENT_ABI
} // namespace lambent
