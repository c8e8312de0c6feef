#pragma once
#include <lambent/bvh/bvh.hpp>
#include <lambent/bvh/once.hpp>
#include <cstdint>
#include <type_traits>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// A filter that hands every hit on and takes none, so that the query goes on; it takes the one at which f stops.
template <class T, class Accept, class F>
struct HandOn {
    static constexpr HitRules rules = rules_of<Accept>();
    const Accept& accept;
    F& f;
    Once& once;

    bool operator()(std::uint32_t primitive, T u, T v, T t) const {
        if (!accept(primitive, u, v, t) || !once.first(primitive)) return false;
        return !goes_on(f, Hit<T>{.t = t, .u = u, .v = v, .primitive = primitive});
    }
};

} // namespace detail

/// Calls f(hit) for every hit of the ray with t_min <= t < t_max, exactly once for each triangle, in no order. f
/// returns nothing; or a bool, of which false ends the query.
///     int hits = 0;
///     for_each_hit(bvh, ray, [&](const Hit<float>&) { ++hits; });
/// The triangle is closed, so a ray through an edge meets all triangles at that edge, and one through a vertex all
/// around it: where hits are counted to tell inside from outside, hand in own_edges (bvh/facing.hpp).
/// cost  does not allocate, but in a tree with spatial splits for a ray with more than 32 hits
template <class T, class Leaves, HitFilter<T> Accept, class F>
void for_each_hit(const BasicBvh<T, Leaves>& bvh, const Ray<T>& ray, const Accept& accept, F&& f) {
    detail::Once once(bvh.tree().duplicates > 0);
    bvh.occluded(ray, detail::HandOn<T, Accept, std::remove_reference_t<F>>{accept, f, once});
}

/// The same, of all hits.
template <class T, class Leaves, class F>
void for_each_hit(const BasicBvh<T, Leaves>& bvh, const Ray<T>& ray, F&& f) {
    for_each_hit(bvh, ray, AcceptAll{}, f);
}

} // namespace LAMBENT_ABI
} // namespace lambent
