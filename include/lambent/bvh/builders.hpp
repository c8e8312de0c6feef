#pragma once
#include <lambent/core/bounds.hpp>
#include <lambent/core/error.hpp>
#include <lambent/core/parallel.hpp>
#include <lambent/core/ray.hpp>
#include <lambent/core/simd.hpp>
#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// What a build is worth: in a building `balanced` took about a third longer than `fast`, and rays a tenth less.
enum class BuildQuality : std::uint8_t {
    fast,     ///< binned splits
    balanced, ///< and then the largest subtrees moved to better places
};

/// How a tree is made. The defaults are what the benchmarks are run with.
struct BuildOptions {
    BuildQuality quality = BuildQuality::balanced;
    int bins = 16;         ///< split candidates an axis, in [2, 32]
    float block_cost = 1;  ///< of testing four triangles, in node visits; > 0
};

namespace detail {

/// A box with room for a fourth, unused lane.
template <class T>
struct PackBox {
    Pack<T, 4> lo = std::numeric_limits<T>::infinity();
    Pack<T, 4> hi = -std::numeric_limits<T>::infinity();

    void add(const PackBox& b) {
        lo = min(lo, b.lo);
        hi = max(hi, b.hi);
    }
    T half_area() const {
        const Pack<T, 4> d = hi - lo;
        return d[0] * d[1] + d[1] * d[2] + d[2] * d[0];
    }
};

/// What the builder moves about in place of a triangle.
template <class T>
struct alignas(4 * sizeof(T)) Reference {
    T lo[3];
    std::uint32_t primitive;
    T hi[3];
    std::uint32_t unused = 0;

    PackBox<T> box() const { return {part(0), part(1)}; }
    /// Twice the centre; half of each, so that the sum is finite.
    Pack<T, 4> center() const { return part(0) * Pack<T, 4>(T(0.5)) + part(1) * Pack<T, 4>(T(0.5)); }

private:
    Pack<T, 4> part(int i) const { // the fourth lane is whatever follows the three
        Pack<T, 4> p;
        std::memcpy(&p.v, reinterpret_cast<const unsigned char*>(this) + i * int(4 * sizeof(T)), 4 * sizeof(T));
        p.set(3, 0);
        return p;
    }
};

/// A node of the binary tree from which the wide one is made. Its triangles are references [first, first +
/// count), whether it is a leaf or not; its children, if it has any, are nodes left and left + 1.
template <class T>
struct BinaryNode {
    PackBox<T> box;
    std::uint32_t first = 0, count = 0;
    std::uint32_t left = 0; ///< 0: a leaf
};

template <class T>
struct BinaryTree {
    std::vector<BinaryNode<T>> nodes;
    std::vector<Reference<T>> references;
    std::size_t dropped = 0;
};

/// Leaves::bounds(set, i, box) is false for a primitive that is to be left out.
template <class Leaves, class Set, class E>
std::vector<Reference<typename Leaves::Scalar>> make_references(const Set& set, E& executor) {
    using T = typename Leaves::Scalar;
    const std::size_t n = set.count();
    std::vector<Reference<T>> references(n);
    executor.parallel_for(n, 1 << 14, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            Reference<T>& r = references[i];
            Bounds3<T> box;
            if (!Leaves::bounds(set, i, box)) {
                r.primitive = no_primitive;
                continue;
            }
            for (int k = 0; k < 3; ++k) {
                r.lo[k] = box.min[k];
                r.hi[k] = box.max[k];
            }
            r.primitive = std::uint32_t(i);
        }
    });
    std::erase_if(references, [](const Reference<T>& r) { return r.primitive == no_primitive; });
    return references;
}

/// Top-down splits by the surface-area heuristic over equally spaced bins of the centres.
/// source  Wald, "On fast construction of SAH-based bounding volume hierarchies" (2007)
template <class T>
class BinnedBuilder {
public:
    static constexpr std::uint32_t leaf_size = 4;  ///< one block; the collapse joins leaves where that pays
    static constexpr int max_binned_depth = 64;    ///< below it ranges are halved: never deeper than 64 + 32

    explicit BinnedBuilder(const BuildOptions& options) : bins_(options.bins) {}

    /// Appends the tree over references [first, first + count) below `nodes[root]`, whose range is set.
    void build(std::vector<BinaryNode<T>>& nodes, std::vector<Reference<T>>& references, std::uint32_t root,
               int depth) {
        struct Task {
            std::uint32_t node;
            int depth;
        };
        std::vector<Task> stack{{root, depth}};
        while (!stack.empty()) {
            const Task task = stack.back();
            stack.pop_back();
            if (!split(nodes, references, task.node, task.depth)) continue;
            const std::uint32_t left = nodes[task.node].left;
            stack.push_back({left + 1, task.depth + 1});
            stack.push_back({left, task.depth + 1});
        }
    }

    /// Sets the node's box, and makes its two children unless it is a leaf.
    bool split(std::vector<BinaryNode<T>>& nodes, std::vector<Reference<T>>& references, std::uint32_t index,
               int depth) {
        const std::uint32_t first = nodes[index].first, count = nodes[index].count;
        Reference<T>* const begin = references.data() + first;
        Reference<T>* const end = begin + count;
        PackBox<T> box, centers;
        for (const Reference<T>* r = begin; r != end; ++r) {
            const Pack<T, 4> c = r->center();
            box.add(r->box());
            centers.add({c, c});
        }
        nodes[index].box = box;
        if (count <= leaf_size) return false;

        Reference<T>* middle = depth < max_binned_depth ? partition_by_bins(begin, end, centers) : nullptr;
        if (middle == nullptr) middle = halve(begin, end, centers);
        const std::uint32_t left = std::uint32_t(nodes.size());
        nodes[index].left = left;
        const std::uint32_t left_count = std::uint32_t(middle - begin);
        nodes.push_back({.box = {}, .first = first, .count = left_count, .left = 0});
        nodes.push_back({.box = {}, .first = first + left_count, .count = count - left_count, .left = 0});
        return true;
    }

private:
    static constexpr int max_bins = 32;

    struct Binning {
        Pack<T, 4> origin, scale;
        int last;

        int of(Pack<T, 4> center, int axis) const {
            const T x = (center[axis] - origin[axis]) * scale[axis];
            return x > 0 ? (x < T(last) ? int(x) : last) : 0; // NaN goes to 0
        }
    };

    /// Returns nullptr where no plane parts the centres.
    Reference<T>* partition_by_bins(Reference<T>* begin, Reference<T>* end, const PackBox<T>& centers) {
        const int bins = std::min(bins_, 4 + int((end - begin) / 4)); // few triangles need few bins
        Binning binning{centers.lo, (T(bins) * T(0.9999)) / (centers.hi - centers.lo), bins - 1};
        for (int axis = 0; axis < 3; ++axis)
            if (!(centers.hi[axis] > centers.lo[axis]) || !is_finite(binning.scale[axis])) binning.scale.set(axis, 0);
        for (int axis = 0; axis < 3; ++axis)
            for (int i = 0; i < bins; ++i) {
                boxes_[axis][i] = {};
                counts_[axis][i] = 0;
            }
        for (const Reference<T>* r = begin; r != end; ++r) {
            const PackBox<T> box = r->box();
            const Pack<T, 4> c = r->center();
            for (int axis = 0; axis < 3; ++axis) {
                const int bin = binning.of(c, axis);
                boxes_[axis][bin].add(box);
                ++counts_[axis][bin];
            }
        }
        int best_axis = -1, best_bin = 0;
        T best_cost = std::numeric_limits<T>::infinity();
        for (int axis = 0; axis < 3; ++axis) {
            if (!(binning.scale[axis] > 0)) continue;
            std::array<T, max_bins> right_cost;
            PackBox<T> box;
            std::uint32_t count = 0;
            for (int i = bins - 1; i > 0; --i) {
                box.add(boxes_[axis][i]);
                count += counts_[axis][i];
                right_cost[std::size_t(i)] = count == 0 ? 0 : box.half_area() * blocks(count);
            }
            box = {};
            count = 0;
            const std::uint32_t total = std::uint32_t(end - begin);
            for (int i = 0; i + 1 < bins; ++i) {
                box.add(boxes_[axis][i]);
                count += counts_[axis][i];
                if (count == 0 || count == total) continue;
                const T cost = box.half_area() * blocks(count) + right_cost[std::size_t(i + 1)];
                if (cost < best_cost) {
                    best_cost = cost;
                    best_axis = axis;
                    best_bin = i;
                }
            }
        }
        if (best_axis < 0) return nullptr;
        return std::partition(begin, end,
                              [&](const Reference<T>& r) { return binning.of(r.center(), best_axis) <= best_bin; });
    }

    /// Equal halves along the widest axis: always succeeds, also on a million copies of one triangle.
    static Reference<T>* halve(Reference<T>* begin, Reference<T>* end, const PackBox<T>& centers) {
        const Pack<T, 4> d = centers.hi - centers.lo;
        const int axis = d[0] >= d[1] ? (d[0] >= d[2] ? 0 : 2) : (d[1] >= d[2] ? 1 : 2);
        Reference<T>* const middle = begin + (end - begin) / 2;
        std::nth_element(begin, middle, end, [axis](const Reference<T>& a, const Reference<T>& b) {
            const T ca = a.center()[axis], cb = b.center()[axis];
            return ca < cb || (ca == cb && a.primitive < b.primitive);
        });
        return middle;
    }

    /// Triangles are tested four at a time; between whole blocks a fraction still counts, for what splits
    /// further down can make of it.
    static T blocks(std::uint32_t count) { return T(count + 3) / 4; }

    int bins_;
    PackBox<T> boxes_[3][max_bins];
    std::uint32_t counts_[3][max_bins] = {};
};

/// Builds the upper part of the tree, then the parts below it side by side; which is which depends on the
/// triangles alone, so the tree is the same for any number of threads.
template <class Leaves, class Set, class E>
BinaryTree<typename Leaves::Scalar> build_binary(const Set& set, const BuildOptions& options, E& executor) {
    using T = typename Leaves::Scalar;
    require(options.bins >= 2 && options.bins <= 32,
            [&] { return "BuildOptions: bins is " + std::to_string(options.bins) + ", not in [2, 32]"; });
    require(options.block_cost > 0, "BuildOptions: block_cost must be > 0");
    require(set.count() < (1u << 30),
            [&] { return "Bvh: " + std::to_string(set.count()) + " primitives are not fewer than 2^30"; });

    BinaryTree<T> tree;
    tree.references = make_references<Leaves>(set, executor);
    tree.dropped = set.count() - tree.references.size();
    const std::uint32_t n = std::uint32_t(tree.references.size());
    if (n == 0) return tree;

    struct Part {
        std::uint32_t node;
        int depth;
        std::vector<BinaryNode<T>> nodes; ///< nodes[0] stands for `node`
    };
    const std::uint32_t part_size = std::max<std::uint32_t>(n / 32, 4096);
    std::vector<Part> parts;
    std::vector<BinaryNode<T>>& nodes = tree.nodes;
    nodes.reserve(n);
    nodes.push_back({.box = {}, .first = 0, .count = n, .left = 0});
    BinnedBuilder<T> builder(options);
    std::vector<std::pair<std::uint32_t, int>> open{{0u, 0}};
    while (!open.empty()) {
        const auto [node, depth] = open.back();
        open.pop_back();
        if (nodes[node].count <= part_size) {
            parts.push_back({node, depth, {}});
        } else if (builder.split(nodes, tree.references, node, depth)) {
            open.push_back({nodes[node].left + 1, depth + 1});
            open.push_back({nodes[node].left, depth + 1});
        }
    }
    executor.parallel_for(parts.size(), 1, [&](std::size_t begin, std::size_t end) {
        BinnedBuilder<T> part_builder(options);
        for (std::size_t i = begin; i < end; ++i) {
            Part& part = parts[i];
            part.nodes.reserve(nodes[part.node].count);
            part.nodes.push_back(nodes[part.node]);
            part_builder.build(part.nodes, tree.references, 0, part.depth);
        }
    });
    for (const Part& part : parts) {
        const std::uint32_t offset = std::uint32_t(nodes.size()) - 1; // part node 1 goes to the next free place
        for (std::size_t i = 0; i < part.nodes.size(); ++i) {
            BinaryNode<T> node = part.nodes[i];
            if (node.left != 0) node.left += offset;
            if (i == 0) {
                nodes[part.node] = node;
            } else {
                nodes.push_back(node);
            }
        }
    }
    return tree;
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
