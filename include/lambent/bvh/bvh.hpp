#pragma once
#include <lambent/bvh/packet.hpp>
#include <lambent/bvh/builders.hpp>
#include <lambent/bvh/leaves.hpp>
#include <lambent/bvh/primitive.hpp>
#include <lambent/bvh/reinsertion.hpp>
#include <lambent/bvh/traverse.hpp>
#include <lambent/bvh/wide.hpp>
#include <lambent/core/bounds.hpp>
#include <lambent/core/parallel.hpp>
#include <lambent/core/ray.hpp>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace lambent {
inline namespace LAMBENT_ABI {

/// A bounding volume hierarchy over triangles, for rays of the same scalar type. Holds its own copy of the
/// vertices, in the order in which rays meet them: queries do not look at the mesh again. Queries are const,
/// never allocate, never throw, and may run on any number of threads.
///
/// Watertight: between triangles with bit-equal shared vertices no ray slips through, whatever the compiler
/// flags. A ray with a NaN or an infinity in its origin or direction, a NaN for a bound, or a direction of
/// length zero hits nothing.
template <class T, class LeafKind = detail::StoredTriangles<T>>
class BasicBvh {
public:
    using Scalar = T;
    using Leaves = LeafKind;

    /// An empty tree: nothing is hit.
    BasicBvh() = default;

    /// Builds on the calling thread.
    /// throws  lambent::Error on an option out of range, or on 2^30 or more triangles
    template <class Set>
        requires Leaves::template holds<Set>
    static BasicBvh build(const Set& set, const BuildOptions& options = {}) {
        SerialExecutor serial;
        return build(set, options, serial);
    }

    /// Builds on the executor's threads; the tree does not depend on their number.
    /// cost  O(n log n) time
    template <class Set, Executor E>
        requires Leaves::template holds<Set>
    static BasicBvh build(const Set& set, const BuildOptions& options, E& executor) {
        detail::BinaryTree<T> binary = detail::build_binary<Leaves>(set, options, executor);
        if (options.quality == BuildQuality::balanced) detail::Reinsertion<T>::improve(binary, detail::max_depth);
        BasicBvh bvh;
        bvh.leaves_ = Leaves(set);
        bvh.tree_ = detail::Collapse<T>(binary, options).template run<typename Leaves::Block>(
            [&](std::span<const std::uint32_t> primitives) { return Leaves::make_block(set, primitives); });
        return bvh;
    }

    /// The nearest hit with t_min <= t < t_max.
    Hit<T> intersect(const Ray<T>& ray) const { return intersect(ray, AcceptAll{}); }

    /// The nearest hit that `accept` takes.
    template <HitFilter<T> Accept>
    Hit<T> intersect(const Ray<T>& ray, const Accept& accept) const {
        return detail::traverse<detail::Query::closest>(tree_, leaves_, ray, accept);
    }

    /// Is there any hit with t_min <= t < t_max? True exactly where intersect() finds one.
    bool occluded(const Ray<T>& ray) const { return occluded(ray, AcceptAll{}); }

    /// Is there any hit that `accept` takes?
    template <HitFilter<T> Accept>
    bool occluded(const Ray<T>& ray, const Accept& accept) const {
        return bool(detail::traverse<detail::Query::any>(tree_, leaves_, ray, accept));
    }

    /// The nearest hit of each ray, to hits[i]; hits may be longer than rays. Several rays are under way at once, so
    /// that none waits for memory: for rays in no order, faster than one at a time.
    template <HitFilter<T> Accept = AcceptAll>
    void intersect(std::span<const Ray<T>> rays, std::span<Hit<T>> hits, const Accept& accept = {}) const {
        require(hits.size() >= rays.size(), [&] {
            return "intersect: room for " + std::to_string(hits.size()) + " hits, but " + std::to_string(rays.size()) + " rays";
        });
        detail::traverse_batch<detail::Query::closest, T>(tree_, leaves_, accept, rays.size(), [&](std::size_t i) -> const Ray<T>& { return rays[i]; },
                  [&](std::size_t i, const Hit<T>& hit) { hits[i] = hit; });
    }

    /// occluded[i]: whether ray i is.
    template <HitFilter<T> Accept = AcceptAll>
    void occluded(std::span<const Ray<T>> rays, std::span<bool> occluded, const Accept& accept = {}) const {
        require(occluded.size() >= rays.size(), [&] {
            return "occluded: room for " + std::to_string(occluded.size()) + " answers, but " + std::to_string(rays.size()) + " rays";
        });
        detail::traverse_batch<detail::Query::any, T>(tree_, leaves_, accept, rays.size(), [&](std::size_t i) -> const Ray<T>& { return rays[i]; },
                  [&](std::size_t i, const Hit<T>& hit) { occluded[i] = bool(hit); });
    }

    bool empty() const { return tree_.nodes.empty(); }
    /// Of all triangles in the tree.
    const Bounds3<T>& bounds() const { return tree_.bounds; }
    /// Triangles left out, since no ray could hit them: with a NaN or an infinity in a vertex, or with two
    /// vertices that coincide.
    std::size_t dropped() const { return tree_.dropped; }
    /// Triangles in the tree.
    std::size_t triangle_count() const { return tree_.primitives; }
    /// What the queries read: see statistics().
    const detail::WideTree<T, typename Leaves::Block>& tree() const { return tree_; }

private:
    detail::WideTree<T, typename Leaves::Block> tree_;
    [[no_unique_address]] Leaves leaves_;
};

using Bvh = BasicBvh<float>;

} // namespace LAMBENT_ABI
} // namespace lambent
