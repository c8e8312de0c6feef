#pragma once
#include <lambent/bvh/bvh.hpp>
#include <lambent/bvh/leaves.hpp>
#include <lambent/bvh/primitive.hpp>
#include <lambent/bvh/triangle.hpp>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Triangles by index: their vertices are fetched from the caller's mesh when a ray gets to them.
template <TriangleSet Mesh>
class CompactTriangles {
public:
    using Scalar = typename Mesh::Scalar;
    using Block = IndexBlock;

private:
    using Stored = StoredTriangles<Scalar>;

public:
    using Query = typename Stored::Query;

    template <class Set> static constexpr bool holds = std::same_as<Set, Mesh>;

    static constexpr std::string_view kind = "triangle";

    CompactTriangles() = default;
    explicit CompactTriangles(const Mesh& mesh) : mesh_(mesh) {}

    static bool bounds(const Mesh& mesh, std::size_t i, Bounds3<Scalar>& box) { return Stored::bounds(mesh, i, box); }

    static Scalar fill(const Mesh& mesh, std::size_t i) { return Stored::fill(mesh, i); }

    static Block make_block(const Mesh&, std::span<const std::uint32_t> primitives) { return Block(primitives); }

    static bool sound(const Block&) { return true; }
    static Bounds3<Scalar> refit(const Mesh& mesh, Block& block) {
        return block.template refit<CompactTriangles>(mesh);
    }

    /// The full layout's block; lanes that cannot be hit are empty.
    TriangleBlock<Scalar> triangles(const Block& block) const {
        std::uint32_t ids[Block::lanes];
        std::size_t used = 0;
        for (const std::uint32_t id : block.primitive)
            if ((id & hidden_bit) == 0) ids[used++] = id;
        return used > 0 ? Stored::make_block(*mesh_, {ids, used}) : TriangleBlock<Scalar>::empty();
    }

    /// The full layout's blocks, made on the spot, and its test: so the same bits.
    template <detail::Query query, class Accept>
    bool meet(const Query& q, const Block* block, int count, const Accept& accept, Hit<Scalar>& hit) const {
        typename Stored::Block fetched[2];
        for (int i = 0; i < count; ++i) fetched[i] = triangles(block[i]);
        return Stored().template meet<query>(q, fetched, count, accept, hit);
    }

private:
    Kept<Mesh> mesh_;
};

} // namespace detail

/// A tree over triangles of which it keeps the indices alone, for a third of the memory of `Bvh` and some of its
/// speed; every answer has the same bits. It keeps a copy of the mesh (a view, see triangles()) and reads the
/// vertices when rays ask: the caller's containers must outlive the tree, and when vertices move, refit() follows.
///     const auto mesh = triangles(vertices, faces);
///     const auto bvh = CompactBvh<decltype(mesh)>::build(mesh);
template <class Mesh>
using CompactBvh = BasicBvh<typename Mesh::Scalar, detail::CompactTriangles<std::remove_cv_t<Mesh>>>;

} // namespace LAMBENT_ABI
} // namespace lambent
