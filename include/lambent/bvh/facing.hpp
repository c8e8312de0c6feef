#pragma once
#include <lambent/bvh/leaves.hpp>
#include <cstdint>

/// Filters that the triangle test itself obeys. They go wherever a HitFilter does, and around one:
///     bvh.intersect(ray, front_faces_only)
///     bvh.occluded(ray, CullBackFaces{alpha_test})
///     for_each_hit(bvh, ray, OwnEdges{CullFrontFaces{alpha_test}}, count)
/// A triangle's front is the side from which its vertices run counter-clockwise: rays with dot(direction,
/// geometric_normal) < 0 come from there.
namespace lambent {
inline namespace LAMBENT_ABI {

/// Takes hits on the front alone, and of these what `accept` takes.
/// cost  two operations a block of four triangles
template <class Accept = AcceptAll>
struct CullBackFaces {
    static_assert(detail::rules_of<Accept>().side != Side::back, "CullBackFaces of CullFrontFaces leaves nothing");
    static constexpr HitRules rules{Side::front, detail::rules_of<Accept>().edges};
    [[no_unique_address]] Accept accept{};

    template <class T>
    constexpr bool operator()(std::uint32_t primitive, T u, T v, T t) const {
        return accept(primitive, u, v, t);
    }
};
template <class Accept> CullBackFaces(Accept) -> CullBackFaces<Accept>;

/// Takes hits on the back alone, and of these what `accept` takes.
template <class Accept = AcceptAll>
struct CullFrontFaces {
    static_assert(detail::rules_of<Accept>().side != Side::front, "CullFrontFaces of CullBackFaces leaves nothing");
    static constexpr HitRules rules{Side::back, detail::rules_of<Accept>().edges};
    [[no_unique_address]] Accept accept{};

    template <class T>
    constexpr bool operator()(std::uint32_t primitive, T u, T v, T t) const {
        return accept(primitive, u, v, t);
    }
};
template <class Accept> CullFrontFaces(Accept) -> CullFrontFaces<Accept>;

/// Where a ray passes through an edge or a vertex that triangles share with the same bits, one of them alone takes
/// the hit, by a rule that needs neither neighbours nor one orientation: the ray counts as passing next to it, always
/// on the same side. A ray through a closed mesh meets it an even number of times along the whole line, however many
/// vertices it goes through, and from within an odd number of times in front of it; no ray slips through.
/// At a silhouette, seen from outside, that is both triangles or none. The border of an open mesh is hit on one side
/// of it and missed on the other.
/// range  as the triangle test's; where a program flushes denormals to zero (as -ffast-math makes it), coordinates
///        below about 2^-40 lose the exactness that this rests on: closest and any hits stay watertight, but an edge
///        may have two owners or none
/// cost  two operations a block that is hit; more only where an edge is hit exactly
template <class Accept = AcceptAll>
struct OwnEdges {
    static constexpr HitRules rules{detail::rules_of<Accept>().side, Edges::owned};
    [[no_unique_address]] Accept accept{};

    template <class T>
    constexpr bool operator()(std::uint32_t primitive, T u, T v, T t) const {
        return accept(primitive, u, v, t);
    }
};
template <class Accept> OwnEdges(Accept) -> OwnEdges<Accept>;

inline constexpr CullBackFaces<> front_faces_only{}; ///< without a filter of its own
inline constexpr CullFrontFaces<> back_faces_only{}; ///< without a filter of its own
inline constexpr OwnEdges<> own_edges{}; ///< without a filter of its own

} // namespace LAMBENT_ABI
} // namespace lambent
