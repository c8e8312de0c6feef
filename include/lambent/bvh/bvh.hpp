#pragma once
#include <lambent/bvh/builders.hpp>
#include <lambent/bvh/leaves.hpp>
#include <lambent/bvh/primitive.hpp>
#include <lambent/bvh/refit.hpp>
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
#include <utility>

namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {
template <class Tree> struct SavedTree; // see serialize.hpp
}

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
        bvh.count_ = set.count();
        bvh.tree_ = detail::Collapse<T>(binary, options).template run<typename Leaves::Block>(
            [&](std::span<const std::uint32_t> primitives) { return Leaves::make_block(set, primitives); });
        bvh.set_leaves(Leaves(set));
        return bvh;
    }

    /// Fits the tree to primitives that have moved: the same ones, in the same order. It keeps its shape, so that after
    /// large movements a new one is faster for rays; answers are the same. Those left out by build() stay left out;
    /// those that cannot be hit as they are now (see dropped()) are passed over until a later refit.
    /// throws  lambent::Error if there are not as many as at the build
    /// cost    O(n), less than a tenth of a build
    template <class Set>
        requires Leaves::template holds<Set>
    void refit(const Set& set) {
        SerialExecutor serial;
        refit(set, serial);
    }
    template <class Set, Executor E>
        requires Leaves::template holds<Set>
    void refit(const Set& set, E& executor) {
        require(set.count() == count_, [&] {
            return "refit: " + std::to_string(set.count()) + " primitives, but the tree was built over " +
                   std::to_string(count_);
        });
        set_leaves(Leaves(set));
        detail::refit<Leaves>(tree_, set, executor);
    }

    /// The nearest hit with t_min <= t < t_max.
    Hit<T> intersect(const Ray<T>& ray) const { return intersect(ray, AcceptAll{}); }

    /// The nearest hit that `accept` takes.
    template <HitFilter<T> Accept>
    Hit<T> intersect(const Ray<T>& ray, const Accept& accept) const {
        return detail::traverse<detail::Query::closest>(tree_, leaves_, ray, detail::filter_for<Leaves>(accept));
    }

    /// Is there any hit with t_min <= t < t_max? True exactly where intersect() finds one.
    bool occluded(const Ray<T>& ray) const { return occluded(ray, AcceptAll{}); }

    /// Is there any hit that `accept` takes?
    template <HitFilter<T> Accept>
    bool occluded(const Ray<T>& ray, const Accept& accept) const {
        return bool(detail::traverse<detail::Query::any>(tree_, leaves_, ray, detail::filter_for<Leaves>(accept)));
    }

    bool empty() const { return tree_.nodes.empty(); }
    /// Of all triangles in the tree.
    const Bounds3<T>& bounds() const { return tree_.bounds; }
    /// Triangles left out, since no ray could hit them: with a NaN or an infinity in a vertex, or with two
    /// vertices that coincide.
    std::size_t dropped() const { return tree_.dropped; }
    /// The caller's primitives, those left out included.
    std::size_t source_count() const { return count_; }
    /// Triangles in the tree.
    std::size_t triangle_count() const { return tree_.primitives; }
    /// What the queries read: see statistics().
    const detail::WideTree<T, typename Leaves::Block>& tree() const { return tree_; }

private:
    friend struct detail::SavedTree<BasicBvh>;

    void set_leaves(Leaves leaves) {
        if constexpr (requires { leaves.margin(); }) tree_.margin = leaves.margin();
        leaves_ = std::move(leaves);
    }

    detail::WideTree<T, typename Leaves::Block> tree_;
    [[no_unique_address]] Leaves leaves_;
    std::size_t count_ = 0;
};

using Bvh = BasicBvh<float>;

} // namespace LAMBENT_ABI
} // namespace lambent
