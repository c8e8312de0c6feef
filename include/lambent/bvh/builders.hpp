#pragma once
#include <lambent/bvh/binary_tree.hpp>
#include <lambent/core/bounds.hpp>
#include <lambent/core/error.hpp>
#include <lambent/core/executor.hpp>
#include <lambent/core/memory.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/ray.hpp>
#include <lambent/core/simd.hpp>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// What a build is worth. In Sponza `balanced` took a third longer than `fast`, and rays visited a quarter fewer nodes;
/// `best` took three times as long, and rays visited a tenth fewer nodes and a third fewer leaf blocks again.
enum class BuildQuality : std::uint8_t {
    fast,     ///< binned splits
    balanced, ///< and then the largest subtrees moved to better places
    best,     ///< and triangles that boxes fit badly cut at planes: they then lie in several leaves. For sets other
              ///< than of triangles the same as balanced
};

/// How a tree is made. The defaults are what the benchmarks are run with.
struct BuildOptions {
    BuildQuality quality = BuildQuality::balanced;
    int bins = 16;         ///< split candidates an axis, in [2, 32]
    float block_cost = 1;  ///< of testing four triangles, in node visits; > 0
};

namespace detail {

/// Leaves::bounds(set, i, box) is false for a primitive that is to be left out.
template <class Leaves, class Set, class E>
LargeArray<Reference<typename Leaves::Scalar>> make_references(const Set& set, E& executor) {
    using T = typename Leaves::Scalar;
    const std::size_t n = set.count();
    LargeArray<Reference<T>> references(n);
    executor.parallel_for(n, 1 << 14, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            Reference<T>& r = references[i];
            Bounds3<T> box;
            if (!Leaves::bounds(set, i, box)) {
                r.name = no_primitive;
                continue;
            }
            for (int k = 0; k < 3; ++k) {
                r.lo[k] = box.min[k];
                r.minus_hi[k] = -box.max[k];
            }
            r.set_primitive(i);
        }
    });
    std::erase_if(references, [](const Reference<T>& r) { return r.name == no_primitive; });
    return references;
}

/// A plane between bins of centres.
template <class T>
struct ObjectPlane {
    Pack<T, 4> origin, scale; ///< of the bins
    int axis = -1, bin = 0;   ///< bins up to and with this one go left; axis -1: no plane parts the centres
    T cost = std::numeric_limits<T>::max();
};

/// The two sides of a split.
template <class T>
struct Halves {
    PackBox<T> box[2], centers[2];
    std::uint32_t count[2] = {};
};

/// Triangles are tested four at a time; between whole blocks a fraction still counts, for what splits further down
/// can make of it.
template <class X>
inline X blocks(X count) {
    return (count + X(3)) * X(0.25f);
}

/// Every primitive stays whole. Another policy: SpatialSplits.
struct NoSplits {
    static constexpr bool possible = false;
};

/// Top-down splits by the surface-area heuristic over equally spaced bins of the centres. References are moved
/// from one of two buffers to the other at every split; those of leaves end up in the first.
/// source  Wald, "On fast construction of SAH-based bounding volume hierarchies" (2007)
template <class T, class Splits>
class BinnedBuilder {
public:
    static constexpr std::uint32_t leaf_size = 4;  ///< one block; the collapse joins leaves where that pays
    /// Below it ranges are halved: never deeper than 64 + 28, as there are at most 2^30 references, cut ones included.
    static constexpr int max_binned_depth = 64;

    /// A node still to be split, its box known. Its references lie in buffer[which][first, first + count), and those
    /// that are made of them may lie in [low, high).
    struct Range {
        PackBox<T> centers;
        std::uint32_t node, first, count, low, high;
        int depth, which;
    };

    BinnedBuilder(const BuildOptions& options, Reference<T>* references, Reference<T>* spare, const Splits& splits)
        : bins_(options.bins), buffer_{references, spare}, splits_(splits) {}

    /// Appends the tree below the range's node.
    void build(LargeArray<BinaryNode<T>>& nodes, const Range& root) {
        std::vector<Range> stack{root};
        while (!stack.empty()) {
            const Range range = stack.back();
            stack.pop_back();
            Range children[2];
            if (!split(nodes, range, children)) continue;
            stack.push_back(children[1]);
            stack.push_back(children[0]);
        }
    }

    /// Makes the node's two children unless it is a leaf.
    bool split(LargeArray<BinaryNode<T>>& nodes, const Range& range, Range* children) {
        Reference<T>* const from = buffer_[range.which] + range.first;
        Reference<T>* const end = from + range.count;
        if (range.count <= leaf_size) {
            if (range.which == 1) std::copy(from, end, buffer_[0] + range.first);
            return false;
        }
        Halves<T> halves;
        const bool moved = range.depth < max_binned_depth && move(nodes[range.node].box, range, halves);
        if (!moved) halve(from, end, range.centers, halves);
        // Left ones lie at the low end of the other buffer's range and right ones at its high end; or all where they
        // were. What is free is shared out by their numbers.
        const int which = moved ? 1 - range.which : range.which;
        const std::uint32_t* const count = halves.count;
        std::uint32_t first[2] = {range.low, range.high - count[1]}, border = range.low + count[0];
        if (moved) {
            border += std::uint32_t(std::uint64_t(first[1] - border) * count[0] / (count[0] + count[1]));
        } else {
            first[0] = range.first;
            first[1] = border = range.first + count[0];
        }
        const std::uint32_t left = std::uint32_t(nodes.size()), limits[3] = {range.low, border, range.high};
        nodes[range.node].left = left;
        for (std::uint32_t k = 0; k < 2; ++k) {
            nodes.push_back({.box = halves.box[k], .first = first[k], .count = count[k], .left = 0});
            children[k] = {halves.centers[k], left + k,       first[k], count[k], limits[k], limits[k + 1],
                           range.depth + 1,   which};
        }
        return true;
    }

private:
    static constexpr int max_bins = 32;
    using Lanes = Pack<T, 4>;
    using Counts = Pack<std::int32_t, 4>;

    struct Bin {
        PackBox<T> box[3]; ///< by axis
        Counts count = 0;
    };

    /// To the other buffer, by the cheapest plane; false where there is none.
    bool move(const PackBox<T>& box, const Range& range, Halves<T>& halves) {
        const Reference<T>* const from = buffer_[range.which] + range.first;
        const Reference<T>* const end = from + range.count;
        Reference<T>* const to = buffer_[1 - range.which];
        const ObjectPlane<T> plane = find_plane(from, end, range.centers, halves);
        if constexpr (Splits::possible) {
            if (splits_.split(from, end, to + range.low, to + range.high, box, plane.cost, halves)) return true;
        }
        if (plane.axis < 0) return false;
        partition(from, end, to + range.low, to + range.high, plane, halves);
        return true;
    }

    /// Which of the bins along each axis a centre is in, before the fraction is cut off; 0 for NaN. The same bits
    /// wherever it is compiled in: children's boxes are put together from bins.
    static Lanes bin_of(Lanes center, const ObjectPlane<T>& plane) {
        const Lanes offset = opaque(opaque(center) - plane.origin);
        return opaque(max(offset * plane.scale, Lanes(T(0))));
    }

    /// What lies on one side of a plane along each axis.
    struct Side {
        PackBox<T> box[3];
        Counts count = 0;

        /// The cost with one more bin, by axis.
        Lanes add(const Bin& bin) {
            Lanes size[3] = {T(0), T(0), T(0)};
            for (int axis = 0; axis < 3; ++axis) {
                box[axis].add(bin.box[axis]);
                const Lanes d = box[axis].minus_size(); // the signs cancel
                for (int k = 0; k < 3; ++k) size[k].set(axis, d[k]);
            }
            count += bin.count;
            return (size[0] * size[1] + (size[0] + size[1]) * size[2]) * blocks(convert<T>(count));
        }
    };

    /// Fills in the halves' boxes.
    ObjectPlane<T> find_plane(const Reference<T>* begin, const Reference<T>* end, const PackBox<T>& centers,
                              Halves<T>& halves) {
        const int bins = std::min(bins_, 4 + int((end - begin) / 4)); // few triangles need few bins
        const Lanes low = centers.low(), size = -centers.minus_size();
        ObjectPlane<T> plane{low, (T(bins) * T(0.9999)) / size};
        for (int axis = 0; axis < 4; ++axis)
            if (axis == 3 || !(size[axis] > 0) || !is_finite(plane.scale[axis])) plane.scale.set(axis, 0);
        plane.origin.set(3, 0);
        for (int i = 0; i < bins; ++i)
            bin_[i] = {};
        for (const Reference<T>* r = begin; r != end; ++r) {
            const PackBox<T> box = r->box();
            const auto index = convert<std::int32_t>(bin_of(box.center().low(), plane));
            for (int axis = 0; axis < 3; ++axis) {
                Bin& bin = bin_[std::uint32_t(index[axis])];
                bin.box[axis].add(box);
                bin.count.v[axis] += 1;
            }
        }
        Side side;
        Lanes right_cost[max_bins]; // lanes are axes
        for (int i = bins - 1; i > 0; --i) right_cost[i] = side.add(bin_[i]);
        side = {};
        Lanes best_cost = std::numeric_limits<T>::max(), best_bin = T(0); // a side without references costs infinity
        for (int i = 0; i + 1 < bins; ++i) {
            const Lanes cost = side.add(bin_[i]) + right_cost[i + 1];
            best_bin = select(cost < best_cost, Lanes(T(i)), best_bin);
            best_cost = min(cost, best_cost);
        }
        for (int axis = 0; axis < 3; ++axis)
            if (best_cost[axis] < plane.cost) {
                plane.cost = best_cost[axis];
                plane.axis = axis;
                plane.bin = int(best_bin[axis]);
            }
        if (plane.axis >= 0)
            for (int i = 0; i < bins; ++i) halves.box[i <= plane.bin ? 0 : 1].add(bin_[i].box[plane.axis]);
        return plane;
    }

    /// To `to`, left ones from the front and right ones from the back. Sides first, then moves: a load waits until
    /// the addresses of all stores before it are known, so these must not hang on long computations.
    static void partition(const Reference<T>* begin, const Reference<T>* end, Reference<T>* to, Reference<T>* to_end,
                          const ObjectPlane<T>& plane, Halves<T>& halves) {
        constexpr int chunk = 64;
        const PackBox<T> neutral[2] = {PackBox<T>(T(0)), {}}; // what is added to a centre for its side: 0 or infinity
        Reference<T>* left = to;
        Reference<T>* right = to_end - 1;
        const Lanes limit = T(plane.bin + 1);
        PackBox<T> left_centers, right_centers;
        while (begin != end) {
            const int n = int(std::min<std::ptrdiff_t>(chunk, end - begin));
            std::uint64_t sides = 0;
            for (int i = 0; i < n; ++i) {
                const Lanes bin = bin_of(begin[i].box().center().low(), plane);
                sides |= std::uint64_t((bits(bin < limit) >> plane.axis) & 1u) << i;
            }
            for (int i = 0; i < n; ++i, sides >>= 1) {
                const std::size_t goes_left = sides & 1;
                const PackBox<T> box = begin[i].box(), c = box.center();
                box.store(goes_left != 0 ? left : right);
                left_centers.add(c + neutral[1 - goes_left]);
                right_centers.add(c + neutral[goes_left]);
                left += goes_left;
                right -= 1 - goes_left;
            }
            begin += n;
        }
        halves.centers[0] = left_centers;
        halves.centers[1] = right_centers;
        halves.count[0] = std::uint32_t(left - to);
        halves.count[1] = std::uint32_t(to_end - 1 - right);
    }

    /// Equal halves along the widest axis: always succeeds, also on a million copies of one triangle.
    static void halve(Reference<T>* begin, Reference<T>* end, const PackBox<T>& centers, Halves<T>& halves) {
        const Lanes d = -centers.minus_size();
        const int axis = d[0] >= d[1] ? (d[0] >= d[2] ? 0 : 2) : (d[1] >= d[2] ? 1 : 2);
        Reference<T>* const middle = begin + (end - begin) / 2;
        std::nth_element(begin, middle, end, [axis](const Reference<T>& a, const Reference<T>& b) {
            const T ca = a.box().center().lo(axis), cb = b.box().center().lo(axis);
            return ca < cb || (ca == cb && a.name < b.name);
        });
        halves = {};
        for (Reference<T>* r = begin; r != end; ++r) {
            const int side = r < middle ? 0 : 1;
            halves.box[side].add(r->box());
            halves.centers[side].add(r->box().center());
            ++halves.count[side];
        }
    }

    int bins_;
    Reference<T>* buffer_[2];
    Splits splits_;
    Bin bin_[max_bins];
};

/// Closes the gaps between the leaves' references. As children come after their parents, sums go up and places down.
template <class T>
void compact(BinaryTree<T>& tree, std::size_t primitives) {
    for (std::size_t i = tree.nodes.size(); i-- > 0;) {
        BinaryNode<T>& node = tree.nodes[i];
        if (node.left != 0) node.count = tree.nodes[node.left].count + tree.nodes[node.left + 1].count;
    }
    LargeArray<Reference<T>> references(tree.nodes[0].count);
    std::vector<std::uint32_t> place(tree.nodes.size(), 0);
    for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
        BinaryNode<T>& node = tree.nodes[i];
        if (node.left == 0) {
            const Reference<T>* const from = tree.references.data() + node.first;
            std::copy(from, from + node.count, references.data() + place[i]);
        } else {
            place[node.left] = place[i];
            place[node.left + 1] = place[i] + tree.nodes[node.left].count;
        }
        node.first = place[i];
    }
    tree.duplicates = references.size() - primitives;
    tree.references = std::move(references);
}

/// Builds the upper part of the tree, then the parts below it side by side; which is which depends on the
/// triangles alone, so the tree is the same for any number of threads.
/// make_splits(n, box) makes the policy for n references in a box
template <class Leaves, class Set, class E, class MakeSplits>
BinaryTree<typename Leaves::Scalar> build_binary(const Set& set, const BuildOptions& options, E& executor,
                                                 const MakeSplits& make_splits) {
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

    PackBox<T> box, centers;
    for (const Reference<T>& r : tree.references) {
        box.add(r.box());
        centers.add(r.box().center());
    }
    const auto splits = make_splits(box);
    using Builder = BinnedBuilder<T, std::remove_cvref_t<decltype(splits)>>;
    using Range = typename Builder::Range;
    std::uint32_t room = n;
    if constexpr (decltype(splits)::possible) room = splits.room(n);
    tree.references.resize(room);
    LargeArray<Reference<T>> spare(room);
    LargeArray<BinaryNode<T>>& nodes = tree.nodes;
    nodes.reserve(n);
    nodes.push_back({.box = box, .first = 0, .count = n, .left = 0});

    const auto make_builder = [&] { return Builder(options, tree.references.data(), spare.data(), splits); };
    Builder builder = make_builder();
    const std::uint32_t part_size = std::max<std::uint32_t>(n / 32, 4096);
    struct Part {
        Range range;
        LargeArray<BinaryNode<T>> nodes; ///< nodes[0] stands for the range's node
    };
    std::vector<Part> parts;
    std::vector<Range> open{{centers, 0, 0, n, 0, room, 0, 0}};
    while (!open.empty()) {
        const Range range = open.back();
        open.pop_back();
        Range children[2];
        if (range.count <= part_size) {
            parts.push_back({range, {}});
        } else if (builder.split(nodes, range, children)) {
            open.push_back(children[1]);
            open.push_back(children[0]);
        }
    }
    if (executor.concurrency() == 1) {
        for (const Part& part : parts) builder.build(nodes, part.range);
    } else {
        executor.parallel_for(parts.size(), 1, [&](std::size_t begin, std::size_t end) {
            Builder part_builder = make_builder();
            for (std::size_t i = begin; i < end; ++i) {
                Part& part = parts[i];
                part.nodes.push_back(nodes[part.range.node]);
                Range range = part.range;
                range.node = 0;
                part_builder.build(part.nodes, range);
            }
        });
        for (const Part& part : parts) { // as if each had been appended in turn
            const std::uint32_t offset = std::uint32_t(nodes.size()) - 1;
            for (std::size_t i = 0; i < part.nodes.size(); ++i) {
                BinaryNode<T> node = part.nodes[i];
                if (node.left != 0) node.left += offset;
                if (i == 0) {
                    nodes[part.range.node] = node;
                } else {
                    nodes.push_back(node);
                }
            }
        }
    }
    if constexpr (decltype(splits)::possible) compact(tree, n);
    return tree;
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
