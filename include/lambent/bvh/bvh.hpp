#pragma once
#include <lambent/bvh/batch.hpp>
#include <lambent/bvh/builders.hpp>
#include <lambent/bvh/leaves.hpp>
#include <lambent/bvh/primitive.hpp>
#include <lambent/bvh/refit.hpp>
#include <lambent/bvh/reinsertion.hpp>
#include <lambent/bvh/spatial_splits.hpp>
#include <lambent/bvh/traverse.hpp>
#include <lambent/bvh/wide.hpp>
#include <lambent/core/bounds.hpp>
#include <lambent/core/executor.hpp>
#include <lambent/core/ray.hpp>
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
/// vertices, in the order in which rays meet them: queries do not look at the mesh again. Other kinds of leaves hold
/// other things: CompactBvh, PrimitiveBvh, InstancedBvh. Queries are const, never allocate, never throw (but batches
/// do, on too short a span), and may run on any number of threads. They need 12 KiB of stack, batches 192.
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
        if (options.quality != BuildQuality::fast) detail::Reinsertion<T>::improve(binary, detail::max_depth);
        BasicBvh bvh;
        bvh.count_ = set.count();
        bvh.tree_ = detail::Collapse<T>(binary, options).template run<typename Leaves::Block>(
            [&](std::span<const std::uint32_t> primitives) { return Leaves::make_block(set, primitives); },
            [&](std::uint32_t primitive) {
                if constexpr (requires { Leaves::fill(set, primitive); }) return Leaves::fill(set, primitive);
                else return T(1);
            });
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

    /// The nearest hit with t_min <= t < t_max; of several at the same t the one with the lowest index, of its instance and
    /// then of its primitive. So the answer does not depend on the tree's shape, only on the ray and the primitives.
    Hit<T> intersect(const Ray<T>& ray) const { return intersect(ray, AcceptAll{}); }

    /// The nearest hit that `accept` takes.
    template <HitFilter<T> Accept>
    Hit<T> intersect(const Ray<T>& ray, const Accept& accept) const {
        check_rules<Accept>();
        return detail::traverse<detail::Query::closest>(tree_, leaves_, ray, detail::filter_for<Leaves>(accept));
    }

    /// Is there any hit with t_min <= t < t_max? True exactly where intersect() finds one.
    bool occluded(const Ray<T>& ray) const { return occluded(ray, AcceptAll{}); }

    /// Is there any hit that `accept` takes?
    template <HitFilter<T> Accept>
    bool occluded(const Ray<T>& ray, const Accept& accept) const {
        check_rules<Accept>();
        return bool(detail::traverse<detail::Query::any>(tree_, leaves_, ray, detail::filter_for<Leaves>(accept)));
    }

    /// The nearest hit of each ray, to hits[i], which may be longer than rays. To the bit what single rays answer. Rays
    /// that go the same way (a tile of a camera's) share their way through the tree, if they lie side by side in the
    /// batch; in a tree that is large for the processor's caches the others are interleaved if they go a long way, so that
    /// none waits for memory. The rest are traced one by one. A filter may have one for each ray: see RayFilter.
    /// throws  lambent::Error if hits is too short, before any is written
    template <BatchFilter<T> Accept = AcceptAll>
    void intersect(std::span<const Ray<T>> rays, std::span<Hit<T>> hits, const Accept& accept = {}) const {
        intersect(rays, hits, detail::AsIs{}, accept);
    }
    /// The same for rays of your own type: `projection` makes a Ray<T> of one.
    template <class R, RayProjection<R, T> Projection, BatchFilter<T> Accept = AcceptAll>
    void intersect(std::span<const R> rays, std::span<Hit<T>> hits, const Projection& projection,
                   const Accept& accept = {}) const {
        batch<detail::Query::closest>(rays, hits, projection, accept, [](const Hit<T>& hit) { return hit; });
    }

    /// occluded[i]: whether ray i is. As for intersect(), but that here rays with the same signs and the same largest
    /// axis go together wherever they point, where registers hold eight numbers or more: 512 neighbours at a time are
    /// sorted by that.
    template <BatchFilter<T> Accept = AcceptAll>
    void occluded(std::span<const Ray<T>> rays, std::span<bool> occluded, const Accept& accept = {}) const {
        this->occluded(rays, occluded, detail::AsIs{}, accept);
    }
    template <class R, RayProjection<R, T> Projection, BatchFilter<T> Accept = AcceptAll>
    void occluded(std::span<const R> rays, std::span<bool> occluded, const Projection& projection,
                  const Accept& accept = {}) const {
        batch<detail::Query::any>(rays, occluded, projection, accept, [](const Hit<T>& hit) { return bool(hit); });
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
    /// The caller's primitives, those left out included.
    std::size_t source_count() const { return count_; }
    /// Triangles in the tree.
    std::size_t triangle_count() const { return tree_.primitives; }
    /// What the queries read: see statistics().
    const detail::WideTree<T, typename Leaves::Block>& tree() const { return tree_; }
    /// What its leaves hold beside their blocks.
    const Leaves& leaves() const { return leaves_; }

private:
    friend struct detail::SavedTree<BasicBvh>;

    template <detail::Query query, class R, class Answer, class Projection, class Accept, class Convert>
    void batch(std::span<const R> rays, std::span<Answer> answers, const Projection& projection, const Accept& accept,
               const Convert& convert) const {
        check_rules<Accept>();
        require(answers.size() >= rays.size(), [&] {
            return "Bvh: room for " + std::to_string(answers.size()) + " answers to " + std::to_string(rays.size()) +
                   " rays";
        });
        require(rays.size() < 0xffffffffu, "Bvh: a batch of 2^32 rays or more");
        detail::traverse_batch<query, T>(
            tree_, leaves_, detail::filter_for<Leaves>(accept), rays.size(),
            [&](std::size_t i) -> decltype(auto) { return projection(rays[i]); },
            [&](std::size_t i, const Hit<T>& hit) { answers[i] = convert(hit); });
    }

    template <class Accept>
    static void check_rules() {
        static_assert(detail::rules_of<Accept>() == HitRules{} || detail::HoldsTriangles<Leaves>,
                      "CullBackFaces, CullFrontFaces and OwnEdges are for trees of triangles: "
                      "other primitives have no sides and edges that the tree knows");
    }

    void set_leaves(Leaves leaves) {
        if constexpr (requires { leaves.margin(); }) tree_.margin = leaves.margin();
        leaves_ = std::move(leaves);
    }

    detail::WideTree<T, typename Leaves::Block> tree_;
    [[no_unique_address]] Leaves leaves_;
    std::size_t count_ = 0;
};

using Bvh = BasicBvh<float>; ///< over triangles, in single precision

} // namespace LAMBENT_ABI
} // namespace lambent
