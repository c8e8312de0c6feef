#pragma once
#include <lambent/bvh/builders.hpp>
#include <lambent/core/bounds.hpp>
#include <lambent/core/memory.hpp>
#include <lambent/core/simd.hpp>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Children of a node: as many as a register holds numbers, four at least.
template <class T>
inline constexpr int node_width = std::max(4, native_width<T>);

namespace detail {

/// What a child is, in 32 bits: the index of a node, or that of the first of a leaf's one or two blocks.
struct Child {
    static constexpr std::uint32_t leaf_bit = 0x80000000u, second_block_bit = 0x40000000u;
    static constexpr std::uint32_t index_mask = 0x3fffffffu;
};

/// The boxes of up to `node_width` children, by plane.
template <class T>
struct alignas(64) WideNode {
    static constexpr int width = node_width<T>;
    T plane[6][std::size_t(width)]; ///< [2 · axis + (0 low, 1 high)]; unused lanes hold low = inf, high = -inf
    std::uint32_t child[std::size_t(width)];
};

/// A leaf is one or two blocks of four primitives each.
inline constexpr int block_lanes = 4;

/// By how much boxes are widened for rays: in units of rounding, half an epsilon, of the distance from a ray's origin
/// to the farthest plane of the scene's box. What it covers is said at SlabRay.
template <class T> inline constexpr T default_margin = 24;

/// A tree as the traversal reads it; node 0 is the root. Without primitives it has neither nodes nor blocks.
template <class T, class Block>
struct WideTree {
    LargeArray<WideNode<T>> nodes;
    LargeArray<Block> blocks;
    Bounds3<T> bounds;
    alignas(4 * sizeof(T)) T center[4] = {}, half_size[4] = {}; ///< of bounds, for rays' set-up
    T margin = default_margin<T>;
    std::size_t dropped = 0;
    std::size_t duplicates = 0; ///< places in leaves beyond one for each primitive; 0: no primitive is met twice
    std::size_t primitives = 0;

    /// What rays read of it.
    std::size_t bytes() const { return nodes.size() * sizeof(WideNode<T>) + blocks.size() * sizeof(Block); }

    void set_bounds(const Bounds3<T>& box) {
        bounds = box;
        for (int k = 0; k < 3; ++k) {
            center[k] = box.min[k] / 2 + box.max[k] / 2;
            half_size[k] = box.max[k] / 2 - box.min[k] / 2;
        }
    }
};

/// Makes wide nodes of a binary tree such that the expected cost of a ray is least, by dynamic programming
/// over "this subtree as at most k children of some node".
/// source  Ylitie, Karras, Laine, HPG 2017, section 3.1
template <class T>
class Collapse {
public:
    static constexpr int width = node_width<T>;
    static constexpr std::uint32_t max_leaf = 2 * block_lanes;

    Collapse(const BinaryTree<T>& tree, const BuildOptions& options)
        : tree_(tree), block_cost_(T(options.block_cost)), fast_(options.quality == BuildQuality::fast),
          plans_(tree.nodes.size()), node_split_(tree.nodes.size()) {}

    /// make_block(span of 1 to 4 primitives) -> Block
    /// fill(primitive) -> how much of the lines through its box meet the primitive itself, in [0, 1]
    template <class Block, class MakeBlock, class Fill>
    WideTree<T, Block> run(const MakeBlock& make_block, const Fill& fill) {
        WideTree<T, Block> wide;
        wide.dropped = tree_.dropped;
        wide.primitives = tree_.references.size() - tree_.duplicates;
        if (tree_.nodes.empty()) return wide;
        const PackBox<T>& root = tree_.nodes[0].box;
        wide.set_bounds({{root.lo(0), root.lo(1), root.lo(2)}, {root.hi(0), root.hi(1), root.hi(2)}});
        for (std::size_t i = plans_.size(); i-- > 0;) { // children come after their parent
            plan(i);
            plans_[i].surface = surface(i, fill);
        }
        wide.nodes.reserve(plans_.size() / 4 + 1);
        wide.blocks.reserve(plans_.size() / 2 + 1);
        emit(wide, make_block);
        wide.duplicates -= wide.primitives;
        return wide;
    }

private:
    using Costs = Pack<T, width>;

    /// cost[k]: of this subtree as at most k + 1 children. give[k]: how many of these the left half gets;
    /// 0: take the plan for one fewer.
    struct Plan {
        T cost[std::size_t(width)];
        std::uint8_t give[std::size_t(width)];
        bool leaf; ///< as one child: a leaf, not a node
        T surface; ///< half areas of boxes that would be hit as often as what is inside
    };

    /// Of a leaf's primitives, which lie side by side, no more than the box. Fast builds don't look at them: half of
    /// its box is what a right triangle fills.
    template <class Fill>
    T surface(std::size_t index, const Fill& fill) const {
        const BinaryNode<T>& node = tree_.nodes[index];
        T sum = 0;
        if (node.left != 0) {
            sum = plans_[node.left].surface + plans_[node.left + 1].surface;
        } else if (fast_) {
            sum = node.box.half_area() * T(node.count) / 2;
        } else {
            for (std::uint32_t i = node.first; i < node.first + node.count; ++i)
                sum += tree_.references[i].box().half_area() * fill(tree_.references[i].primitive());
        }
        return node.count > max_leaf ? sum : std::min(node.box.half_area(), sum);
    }
    /// How soon any-hit queries had better look into this child: how likely a ray through its box is to hit something
    /// there, times the root of how many rays come by, for what many do is foreseen.
    /// source    Nah and Manocha, "SATO: Surface Area Traversal Order for Shadow Ray Tracing", CGF 33:6 (2014), who go by
    ///           the surface inside alone
    /// measured  speed against smallest boxes first, eight scenes: ao 1.03, shadow rays 1.06, to a sun 1.17, between
    ///           points 1.05, to the scene's middle .98; worst .86
    T urgency(std::uint32_t child) const {
        const T area = tree_.nodes[child].box.half_area(), surface = plans_[child].surface;
        if (!(area > 0)) return 0;
        const T hit = plans_[child].leaf ? std::min(T(1), surface / area) : 1 - std::exp(-surface / area);
        return hit * std::sqrt(area);
    }

    void plan(std::size_t index) {
        const BinaryNode<T>& node = tree_.nodes[index];
        Plan& plan = plans_[index];
        const T area = node.box.half_area();
        std::uint32_t primitives[max_leaf];
        const std::uint32_t count = tree_.duplicates == 0 ? node.count : distinct(node, primitives);
        const T as_leaf = count <= max_leaf ? area * block_cost_ * T((count + 3) / 4)
                                            : std::numeric_limits<T>::infinity();
        if (node.left == 0) {
            plan.leaf = true;
            for (int k = 0; k < width; ++k) {
                plan.cost[k] = as_leaf;
                plan.give[k] = 0;
            }
            return;
        }
        const Plan& left = plans_[node.left];
        const Plan& right = plans_[node.left + 1];
        Costs cost = std::numeric_limits<T>::infinity(), give = T(1);
        share<1>(left, Costs::load(right.cost), cost, give);
        node_split_[index] = std::uint8_t(give[width - 1]);
        const T as_node = cost[width - 1] + area;
        plan.leaf = count <= max_leaf && as_leaf <= as_node;
        cost.set(0, plan.leaf ? as_leaf : as_node);
        // Where fewer children cost no more, fewer it is.
        const Costs fewer = least_so_far<1>(shifted<1>(cost));
        min(cost, fewer).store(plan.cost);
        give = select(fewer <= cost, Costs(T(0)), give);
        for (int k = 1; k < width; ++k) plan.give[k] = std::uint8_t(give[k]);
        plan.give[0] = 0;
    }

    /// The value `by` lanes lower; infinity where there is none.
    template <int by>
    [[gnu::always_inline]] static Costs shifted(Costs a) {
        const Costs inf = std::numeric_limits<T>::infinity();
        return [&]<int... i>(std::integer_sequence<int, i...>) {
            return Costs(__builtin_shufflevector(a.v, inf.v, (i < by ? width : i - by)...));
        }(std::make_integer_sequence<int, width>{});
    }
    /// Lane k: the least of lanes 0 to k, given that of the `by` lanes up to each.
    template <int by>
    [[gnu::always_inline]] static Costs least_so_far(Costs a) {
        if constexpr (by < width) {
            return least_so_far<2 * by>(min(a, shifted<by>(a)));
        } else {
            return a;
        }
    }
    /// Lane k: the least cost of k + 1 children, of which the left half gets at least `l`, and how many it gets.
    template <int l>
    [[gnu::always_inline]] static void share(const Plan& left, Costs right, Costs& cost, Costs& give) {
        if constexpr (l < width) {
            const Costs here = Costs(left.cost[l - 1]) + shifted<l>(right);
            const auto better = here < cost;
            cost = select(better, here, cost);
            give = select(better, Costs(T(l)), give);
            share<l + 1>(left, right, cost, give);
        }
    }

    /// The children that `node` makes of `slots` places.
    void gather(std::uint32_t node, int slots, bool open, std::uint32_t* children, int& count) const {
        int give = open ? node_split_[node] : plans_[node].give[slots - 1];
        while (!open && give == 0 && slots > 1) give = plans_[node].give[--slots - 1];
        if (!open && slots == 1) {
            children[count++] = node;
            return;
        }
        const std::uint32_t left = tree_.nodes[node].left;
        gather(left, give, false, children, count);
        gather(left + 1, slots - give, false, children, count);
    }

    /// Depth first, so that a node's first child usually follows it in memory.
    template <class Block, class MakeBlock>
    void emit(WideTree<T, Block>& wide, const MakeBlock& make_block) const {
        struct Task {
            std::uint32_t binary, parent;
            int lane;
        };
        std::vector<Task> stack;
        const auto add_node = [&](std::uint32_t binary) {
            const std::uint32_t index = std::uint32_t(wide.nodes.size());
            WideNode<T>& node = wide.nodes.emplace_back();
            std::uint32_t children[std::size_t(width)];
            int count = 0;
            if (plans_[binary].leaf) {
                children[count++] = binary; // a root that is a leaf still gets a node
            } else {
                gather(binary, width, true, children, count);
            }
            T keys[std::size_t(width)]; // any-hit queries go by the lanes' order
            for (int i = 0; i < count; ++i) {
                const std::uint32_t child = children[i];
                const T key = urgency(child);
                int k = i;
                for (; k > 0 && (key > keys[k - 1] || (key == keys[k - 1] && child < children[k - 1])); --k) {
                    keys[k] = keys[k - 1];
                    children[k] = children[k - 1];
                }
                keys[k] = key;
                children[k] = child;
            }
            for (int lane = 0; lane < width; ++lane) {
                const PackBox<T> box = lane < count ? tree_.nodes[children[lane]].box : PackBox<T>{};
                for (int axis = 0; axis < 3; ++axis) {
                    node.plane[2 * axis][lane] = box.lo(axis);
                    node.plane[2 * axis + 1][lane] = box.hi(axis);
                }
                node.child[lane] = Child::leaf_bit;
            }
            for (int lane = count; lane-- > 0;) stack.push_back({children[lane], index, lane});
            return index;
        };
        add_node(0);
        while (!stack.empty()) {
            const Task task = stack.back();
            stack.pop_back();
            const std::uint32_t child = plans_[task.binary].leaf ? add_leaf(wide, make_block, tree_.nodes[task.binary])
                                                                 : add_node(task.binary);
            wide.nodes[task.parent].child[task.lane] = child;
        }
    }

    template <class Block, class MakeBlock>
    std::uint32_t add_leaf(WideTree<T, Block>& wide, const MakeBlock& make_block, const BinaryNode<T>& node) const {
        const std::uint32_t index = std::uint32_t(wide.blocks.size());
        std::uint32_t primitives[max_leaf] = {};
        const std::uint32_t count = distinct(node, primitives);
        for (std::uint32_t first = 0; first < count; first += block_lanes)
            wide.blocks.push_back(make_block(std::span<const std::uint32_t>(
                primitives + first, std::min<std::uint32_t>(block_lanes, count - first))));
        wide.duplicates += count;
        return index | Child::leaf_bit | (count > block_lanes ? Child::second_block_bit : 0);
    }

    /// The node's primitives, each once and in ascending order, since of hits at the same t the lowest index counts; returns
    /// their number, or more than max_leaf where they are too many.
    std::uint32_t distinct(const BinaryNode<T>& node, std::uint32_t* primitives) const {
        if (node.count > (tree_.duplicates == 0 ? max_leaf : 2 * max_leaf)) return max_leaf + 1;
        std::uint32_t count = 0;
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
            const std::uint32_t primitive = tree_.references[i].primitive();
            if (tree_.duplicates != 0 && std::find(primitives, primitives + count, primitive) != primitives + count)
                continue;
            if (count == max_leaf) return max_leaf + 1;
            std::uint32_t at = count++;
            for (; at > 0 && primitives[at - 1] > primitive; --at) primitives[at] = primitives[at - 1];
            primitives[at] = primitive;
        }
        return count;
    }

    const BinaryTree<T>& tree_;
    T block_cost_;
    bool fast_;
    LargeArray<Plan> plans_;
    std::vector<std::uint8_t> node_split_; ///< how many of a node's own `width` children its left half makes
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
