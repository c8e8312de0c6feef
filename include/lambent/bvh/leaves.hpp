#pragma once
#include <lambent/bvh/primitive.hpp>
#include <lambent/bvh/triangle.hpp>
#include <lambent/core/bounds.hpp>
#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>

/// What lies in a tree's leaves, and how a ray meets it: one struct a kind, with
///   Scalar, Block           a block holds up to four primitives; a leaf is one or two blocks
///   Leaves(set)             made of the caller's primitives
///   holds<Set>              whether it can be made of such a set
///   bounds(set, i, box)     false: primitive i is left out
///   make_block(set, ids)    a block of one to four of them
///   Query                   what a ray needs of its own in leaves of this kind; made once a ray
///   meet<query>(q, blocks, count, accept, hit)
///                           lowers `hit` to the nearest accepted hit in [t_min, hit.t); true if it did.
///                           For Query::any the first one will do.
namespace lambent {
inline namespace LAMBENT_ABI {

/// Takes every hit; costs nothing.
struct AcceptAll {
    template <class T> constexpr bool operator()(std::uint32_t, T, T, T) const { return true; }
};

/// A filter of hits: accept(primitive, u, v, t) is false where there is no surface after all (a leaf's cut-out).
/// Called in no particular order, for hits nearer than the nearest so far.
template <class A, class T>
concept HitFilter = requires(const A& accept, std::uint32_t primitive, T x) {
    { accept(primitive, x, x, x) } -> std::convertible_to<bool>;
};

namespace detail {

enum class Query : std::uint8_t { closest, any };

/// No finite vertex is missing, and no two coincide. Triangles with three distinct vertices on a line stay in
/// the tree although they have no area: seen by a ray the three are rounded, each on its own, and the gap that
/// this can open between the two neighbours is theirs to fill.
template <class T>
inline bool can_be_hit(const std::array<Vec3<T>, 3>& p) {
    return is_finite(p[0]) && is_finite(p[1]) && is_finite(p[2]) && p[0] != p[1] && p[1] != p[2] && p[2] != p[0];
}

/// Triangles, their vertices copied into the leaves: nothing else is read.
template <class T>
struct StoredTriangles {
    using Scalar = T;
    using Block = TriangleBlock<T>;

    struct Query {
        ShearedRay<T> ray;
        T t_min;

        Query() = default;
        [[gnu::always_inline]] explicit Query(const Ray<T>& r) : ray(r), t_min(r.t_min) {}
    };

    template <class Set> static constexpr bool holds = TrianglesOf<Set, T>;
    static constexpr bool has_packets = true;

    StoredTriangles() = default;
    template <TriangleSet Mesh> explicit StoredTriangles(const Mesh&) {}

    template <TriangleSet Mesh>
    static bool bounds(const Mesh& mesh, std::size_t i, Bounds3<T>& box) {
        const std::array<Vec3<T>, 3> p = mesh.vertices(i);
        if (!can_be_hit(p)) return false;
        for (const Vec3<T>& v : p) box.add(v);
        return true;
    }

    template <TriangleSet Mesh>
    static Block make_block(const Mesh& mesh, std::span<const std::uint32_t> primitives) {
        Block block;
        for (std::size_t lane = 0; lane < Block::lanes; ++lane) {
            const bool used = lane < primitives.size();
            const std::array<Vec3<T>, 3> p = mesh.vertices(primitives[used ? lane : 0]);
            for (std::size_t i = 0; i < 3; ++i)
                for (int axis = 0; axis < 3; ++axis)
                    block.vertex[i][axis][lane] = p[used ? i : 0][axis]; // unused: three equal vertices
            block.primitive[lane] = used ? primitives[lane] : no_primitive;
        }
        return block;
    }

    template <detail::Query query, class Accept>
    [[gnu::always_inline]] bool meet(const Query& q, const Block* block, int count, const Accept& accept, Hit<T>& hit) const {
        return count == 1 ? meet_lanes<query, 4>(q, block, accept, hit) : meet_lanes<query, 8>(q, block, accept, hit);
    }

private:
    template <detail::Query query, int N, class Accept>
    [[gnu::always_inline]] static bool meet_lanes(const Query& q, const Block* block, const Accept& accept, Hit<T>& hit) {
        const BlockHit<T, N> found = intersect<N>(q.ray, block, q.t_min, hit.t);
        bool nearer = false;
        for (unsigned lanes = bits(found.mask); lanes != 0; lanes &= lanes - 1) {
            const int lane = std::countr_zero(lanes);
            const T t = found.t[lane];
            if (!(t < hit.t)) continue; // an earlier lane is nearer
            const T u = found.u[lane], v = found.v[lane];
            const std::uint32_t primitive = block[lane / 4].primitive[lane % 4];
            if (!accept(primitive, u, v, t)) continue;
            hit = {.t = t, .u = u, .v = v, .primitive = primitive};
            if constexpr (query == detail::Query::any) return true;
            nearer = true;
        }
        return nearer;
    }
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
