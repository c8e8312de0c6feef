#pragma once
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
        check_rules<Accept>();
        return detail::traverse<detail::Query::closest>(tree_, leaves_, ray, accept);
    }

    /// Is there any hit with t_min <= t < t_max? True exactly where intersect() finds one.
    bool occluded(const Ray<T>& ray) const { return occluded(ray, AcceptAll{}); }

    /// Is there any hit that `accept` takes?
    template <HitFilter<T> Accept>
    bool occluded(const Ray<T>& ray, const Accept& accept) const {
        check_rules<Accept>();
        return bool(detail::traverse<detail::Query::any>(tree_, leaves_, ray, accept));
    }

    /// The same for rays of your own type: `projection` makes a Ray<T> of one.
    template <class R, RayProjection<R, T> Projection>
    Hit<T> intersect(const R& ray, const Projection& projection) const {
        return intersect(Ray<T>(projection(ray)));
    }
    template <class R, RayProjection<R, T> Projection, HitFilter<T> Accept>
    Hit<T> intersect(const R& ray, const Projection& projection, const Accept& accept) const {
        return intersect(Ray<T>(projection(ray)), accept);
    }
    template <class R, RayProjection<R, T> Projection>
    bool occluded(const R& ray, const Projection& projection) const {
        return occluded(Ray<T>(projection(ray)));
    }
    template <class R, RayProjection<R, T> Projection, HitFilter<T> Accept>
    bool occluded(const R& ray, const Projection& projection, const Accept& accept) const {
        return occluded(Ray<T>(projection(ray)), accept);
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
    /// What its leaves hold beside their blocks.
    const Leaves& leaves() const { return leaves_; }

private:
    template <class Accept>
    static void check_rules() {
        static_assert(detail::rules_of<Accept>() == HitRules{} || detail::HoldsTriangles<Leaves>,
                      "CullBackFaces, CullFrontFaces and OwnEdges are for trees of triangles: "
                      "other primitives have no sides and edges that the tree knows");
    }

    detail::WideTree<T, typename Leaves::Block> tree_;
    [[no_unique_address]] Leaves leaves_;
};

using Bvh = BasicBvh<float>;

} // namespace LAMBENT_ABI
} // namespace lambent
