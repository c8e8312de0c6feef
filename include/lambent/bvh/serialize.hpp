#pragma once
#include <lambent/bvh/bvh.hpp>
#include <lambent/bvh/refit.hpp>
#include <lambent/core/content_hash.hpp>
#include <lambent/core/error.hpp>
#include <lambent/core/numerics.hpp>
#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// What a saved tree begins with; nodes and blocks follow as they lie in memory, a block without its padding.
struct SavedHeader {
    char magic[8] = {'l', 'a', 'm', 'b', 'v', 'h', '\r', '\n'};
    std::uint32_t byte_order = 0x01020304u;
    std::uint32_t version = 1;
    char kind[8] = {}; ///< of the leaves
    std::uint32_t scalar_bytes = 0, node_width = 0, node_bytes = 0, block_bytes = 0;
    std::uint64_t count = 0, primitives = 0, dropped = 0, nodes = 0, blocks = 0;
    double bounds[6] = {};
    std::uint64_t checksum = 0; ///< of all that stands before, and of all that follows
};
static_assert(sizeof(SavedHeader) == 136 && std::is_trivially_copyable_v<SavedHeader>);

inline std::uint64_t checksum(const SavedHeader& header, std::span<const std::byte> rest) {
    ContentHash hash;
    hash.add_bytes(&header, offsetof(SavedHeader, checksum));
    hash.add_bytes(rest.data(), rest.size());
    return hash.value();
}

/// The parts of a tree, taken apart and put together.
template <class Tree>
struct SavedTree {
    using T = typename Tree::Scalar;
    using Leaves = typename Tree::Leaves;
    using Block = typename Leaves::Block;
    using Node = WideNode<T>;
    static_assert(std::is_trivially_copyable_v<Node> && std::is_trivially_copyable_v<Block>);
    static constexpr std::size_t block_bytes = offsetof(Block, primitive) + sizeof(Block::primitive);

    /// All that does not depend on the tree: what a build can read.
    static SavedHeader header() {
        SavedHeader h;
        std::copy_n(Leaves::kind.data(), Leaves::kind.size(), h.kind);
        static_assert(Leaves::kind.size() <= sizeof(h.kind));
        h.scalar_bytes = sizeof(T);
        h.node_width = std::uint32_t(node_width<T>);
        h.node_bytes = sizeof(Node);
        h.block_bytes = block_bytes;
        return h;
    }

    static std::vector<std::byte> save(const Tree& bvh) {
        const auto& tree = bvh.tree_;
        SavedHeader h = header();
        h.count = bvh.count_;
        h.primitives = tree.primitives;
        h.dropped = tree.dropped;
        h.nodes = tree.nodes.size();
        h.blocks = tree.blocks.size();
        for (int k = 0; k < 3; ++k) {
            h.bounds[k] = double(tree.bounds.min[k]);
            h.bounds[3 + k] = double(tree.bounds.max[k]);
        }
        std::vector<std::byte> bytes(sizeof h + h.nodes * sizeof(Node) + h.blocks * block_bytes);
        std::byte* to = bytes.data() + sizeof h;
        const auto put = [&](const void* from, std::size_t size) {
            std::memcpy(to, from, size);
            to += size;
        };
        for (const Node& node : tree.nodes) put(&node, sizeof(Node));
        for (const Block& block : tree.blocks) put(&block, block_bytes);
        h.checksum = checksum(h, std::span<const std::byte>(bytes).subspan(sizeof h));
        std::memcpy(bytes.data(), &h, sizeof h);
        return bytes;
    }

    static Tree load(std::span<const std::byte> bytes, Leaves leaves) {
        const SavedHeader h = read_header(bytes);
        Tree bvh;
        auto& tree = bvh.tree_;
        tree.nodes.resize(h.nodes); // no more than the bytes hold
        tree.blocks.resize(h.blocks);
        const std::byte* from = bytes.data() + sizeof h;
        const auto get = [&](void* to, std::size_t size) {
            std::memcpy(to, from, size);
            from += size;
        };
        for (Node& node : tree.nodes) get(&node, sizeof(Node));
        for (Block& block : tree.blocks) get(&block, block_bytes);
        tree.primitives = h.primitives;
        tree.dropped = h.dropped;
        if (h.nodes > 0)
            tree.set_bounds({{T(h.bounds[0]), T(h.bounds[1]), T(h.bounds[2])},
                             {T(h.bounds[3]), T(h.bounds[4]), T(h.bounds[5])}});
        check_nodes(tree);
        check_blocks(tree, h.count);
        bvh.set_leaves(std::move(leaves));
        bvh.count_ = h.count;
        return bvh;
    }

private:
    static std::string text(const char (&kind)[8]) {
        std::string s;
        for (std::size_t i = 0; i < sizeof kind && kind[i] != 0; ++i)
            s += kind[i] >= ' ' && kind[i] <= '~' ? kind[i] : '?';
        return s;
    }

    static SavedHeader read_header(std::span<const std::byte> bytes) {
        const auto number = [](auto n) { return std::to_string(n); };
        SavedHeader h;
        const SavedHeader ours = header();
        require(bytes.size() >= sizeof h,
                [&] { return "load: " + number(bytes.size()) + " bytes are too few for a tree"; });
        std::memcpy(&h, bytes.data(), sizeof h);
        require(std::memcmp(h.magic, ours.magic, sizeof h.magic) == 0, "load: these bytes are not a saved tree");
        require(h.byte_order == ours.byte_order, "load: the tree was saved on a machine of the other byte order");
        require(h.version == ours.version, [&] {
            return "load: the tree has version " + number(h.version) + ", and this library reads " +
                   number(ours.version);
        });
        require(std::memcmp(h.kind, ours.kind, sizeof h.kind) == 0, [&] {
            return "load: the tree's leaves hold '" + text(h.kind) + "', and '" + text(ours.kind) + "' are wanted";
        });
        require(h.scalar_bytes == ours.scalar_bytes, [&] {
            return "load: the tree's numbers have " + number(h.scalar_bytes) + " bytes, and " +
                   number(ours.scalar_bytes) + " are wanted";
        });
        require(h.node_width == ours.node_width, [&] {
            return "load: the tree's nodes have " + number(h.node_width) + " children, and this build reads " +
                   number(ours.node_width) + ": it was saved by a build for other instructions (AVX-512 has 16 floats a "
                   "node, AVX 8, SSE and NEON 4)";
        });
        require(h.node_bytes == ours.node_bytes && h.block_bytes == ours.block_bytes, [&] {
            return "load: nodes of " + number(h.node_bytes) + " and blocks of " + number(h.block_bytes) +
                   " bytes are not " + number(ours.node_bytes) + " and " + number(ours.block_bytes);
        });
        constexpr std::uint64_t most = Child::index_mask;
        require(h.count <= most && h.dropped <= h.count && h.nodes <= most && h.blocks <= most &&
                    (h.nodes == 0) == (h.blocks == 0),
                [&] {
                    return "load: " + number(h.count - h.dropped) + " of " + number(h.count) + " primitives in " +
                           number(h.nodes) + " nodes and " + number(h.blocks) + " blocks is impossible";
                });
        const std::uint64_t size = sizeof h + h.nodes * h.node_bytes + h.blocks * h.block_bytes; // far below 2^64
        require(bytes.size() == size, [&] {
            return "load: a tree of " + number(h.nodes) + " nodes and " + number(h.blocks) + " blocks takes " +
                   number(size) + " bytes, not " + number(bytes.size());
        });
        require(h.checksum == checksum(h, bytes.subspan(sizeof h)), "load: the tree is damaged: wrong checksum");
        return h;
    }

    /// Sound boxes, and children that form a tree: every node and block is reached exactly once, from a node before
    /// it, within the depth for which traversal has a stack.
    static void check_nodes(const WideTree<T, Block>& tree) {
        std::vector<std::uint8_t> depth(tree.nodes.size()), reached(tree.blocks.size());
        static_assert(max_depth < 255);
        if (!depth.empty()) depth[0] = 1;
        for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
            const auto wrong = [&](const char* what) { fail("load: node " + std::to_string(i) + " " + what); };
            if (depth[i] == 0) wrong("is nobody's child");
            if (depth[i] > max_depth) wrong("lies too deep");
            const Node& node = tree.nodes[i];
            for (int lane = 0; lane < node_width<T>; ++lane) {
                if (is_unused(node, lane)) continue;
                Bounds3<T> box;
                const bool ordered = read_box(node, lane, box);
                if (!is_finite(box.min) || !is_finite(box.max) || !ordered) wrong("has a box that is none");
                if (i == 0 && !contains(tree.bounds, box)) wrong("is larger than the tree's bounds");
                const std::uint32_t child = node.child[lane];
                if ((child & Child::leaf_bit) == 0) {
                    if (child <= i || child >= tree.nodes.size()) wrong("has a child out of range");
                    if (depth[child] != 0) wrong("has another node's child");
                    depth[child] = std::uint8_t(depth[i] + 1);
                } else {
                    const std::size_t first = child & Child::index_mask;
                    const std::size_t end = first + ((child & Child::second_block_bit) != 0 ? 2 : 1);
                    if (end > tree.blocks.size()) wrong("has a leaf out of range");
                    for (std::size_t block = first; block < end; ++block)
                        if (reached[block]++ != 0) wrong("has another node's leaf");
                }
            }
        }
        for (std::size_t i = 0; i < reached.size(); ++i)
            if (reached[i] == 0) fail("load: block " + std::to_string(i) + " lies in no leaf");
    }

    /// Also counts the duplicates, which are not saved.
    static void check_blocks(WideTree<T, Block>& tree, std::uint64_t count) {
        std::size_t lanes = 0;
        for (std::size_t i = 0; i < tree.blocks.size(); ++i) {
            for (const std::uint32_t id : tree.blocks[i].primitive) {
                if (id == no_primitive) continue;
                ++lanes;
                require((id & ~hidden_bit) < count, [&] {
                    return "load: block " + std::to_string(i) + " refers to primitive " +
                           std::to_string(id & ~hidden_bit) + " of " + std::to_string(count);
                });
            }
            require(Leaves::sound(tree.blocks[i]),
                    [&] { return "load: block " + std::to_string(i) + " holds impossible primitives"; });
        }
        require(tree.primitives <= lanes, [&] {
            return "load: " + std::to_string(tree.primitives) + " primitives, but only " + std::to_string(lanes) +
                   " places in leaves";
        });
        tree.duplicates = lanes - tree.primitives;
    }

    static bool is_unused(const Node& node, int lane) {
        constexpr T inf = std::numeric_limits<T>::infinity();
        const auto is = [](T x, T y) { // also under -ffast-math
            using Bits = typename FloatBits<T>::Type;
            return std::bit_cast<Bits>(x) == std::bit_cast<Bits>(y);
        };
        for (int k = 0; k < 3; ++k)
            if (!is(node.plane[2 * k][lane], inf) || !is(node.plane[2 * k + 1][lane], -inf)) return false;
        return node.child[lane] == Child::leaf_bit;
    }

    static bool contains(const Bounds3<T>& outer, const Bounds3<T>& inner) {
        bool inside = is_finite(outer.min) && is_finite(outer.max);
        for (int k = 0; k < 3; ++k) inside = inside && outer.min[k] <= inner.min[k] && inner.max[k] <= outer.max[k];
        return inside;
    }
};

} // namespace detail

/// The tree as bytes, for load(). Compact trees and those over primitives of your own are saved without the
/// primitives.
/// cost  one pass; as many bytes as statistics() counts
template <class T, class Leaves>
std::vector<std::byte> save(const BasicBvh<T, Leaves>& bvh) {
    return detail::SavedTree<BasicBvh<T, Leaves>>::save(bvh);
}

/// The tree that was saved: the same bits, so the same answers. Trees travel between builds of this library with the
/// same version of the format, byte order and node width.
///     const Bvh bvh = load<Bvh>(bytes);
/// Whatever the bytes are, the result answers queries in bounded time and reads nothing beyond its arrays; by a
/// checksum it is also, but for malice, what was saved.
/// throws  lambent::Error saying what is wrong with them
/// cost    one pass
template <class Tree>
    requires std::is_empty_v<typename Tree::Leaves>
Tree load(std::span<const std::byte> bytes) {
    return detail::SavedTree<Tree>::load(bytes, {});
}

/// The same for trees that look at the caller's primitives: they have to be those of the build.
/// throws  lambent::Error also if there are not as many
///     const auto bvh = load<CompactBvh<decltype(mesh)>>(bytes, mesh);
template <class Tree, class Set>
    requires Tree::Leaves::template holds<Set>
Tree load(std::span<const std::byte> bytes, const Set& set) {
    Tree bvh = detail::SavedTree<Tree>::load(bytes, typename Tree::Leaves(set));
    require(set.count() == bvh.source_count(), [&] {
        return "load: the tree was built over " + std::to_string(bvh.source_count()) + " primitives, not " +
               std::to_string(set.count());
    });
    return bvh;
}

} // namespace LAMBENT_ABI
} // namespace lambent
