#pragma once
#include <lambent/bvh/bvh.hpp>
#include <lambent/bvh/leaves.hpp>
#include <lambent/core/bounds.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/ray.hpp>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Primitives of your own that a tree can be built over: curves, patches, distance fields, other people's objects.
///     using Scalar = float;                                  or double
///     std::size_t count() const;
///     Bounds3<Scalar> bounds(std::size_t i) const;           a box around all of primitive i; it is left out of the
///                                                            tree if its box is empty or not finite
///     Hit<Scalar> intersect(std::size_t i, const Ray<Scalar>& ray) const;
///                                                            its nearest hit with ray.t_min <= t < ray.t_max, or
///                                                            Hit{}. Sets t, u and v, of which the last two mean
///                                                            what you like; the tree fills in the primitive
/// and, if there is something faster to say to shadow rays,
///     bool occluded(std::size_t i, const Ray<Scalar>& ray) const;   true exactly where intersect() hits
/// A hit that is reported outside of the primitive's box may be lost. Rounding is allowed for: the box is met with
/// a margin of about ten units in the last place of the distance to the farthest corner of the scene.
/// The calls are made from any number of threads, with rays of finite origin and direction, in no order.
template <class P>
concept PrimitiveSet = std::floating_point<typename P::Scalar> &&
                       requires(const P& set, std::size_t i, const Ray<typename P::Scalar>& ray) {
                           { set.count() } -> std::convertible_to<std::size_t>;
                           { set.bounds(i) } -> std::convertible_to<Bounds3<typename P::Scalar>>;
                           { set.intersect(i, ray) } -> std::convertible_to<Hit<typename P::Scalar>>;
                       };

namespace detail {

template <class Set>
struct ScalarOfPrimitives {
    static_assert(PrimitiveSet<Set>,
                  "PrimitiveBvh: a set of primitives needs `using Scalar = float;` (or double), `std::size_t count() "
                  "const`, `Bounds3<Scalar> bounds(std::size_t i) const` and `Hit<Scalar> intersect(std::size_t i, "
                  "const Ray<Scalar>& ray) const`; the compiler names below what this one lacks");
    using Type = typename Set::Scalar;
};

/// Primitives by index: the caller's set is asked where a ray meets them.
template <class Set>
class OwnPrimitives {
public:
    using Scalar = typename Set::Scalar;
    using Block = IndexBlock;

    struct Query {
        Ray<Scalar> ray;

        Query() = default;
        explicit Query(const Ray<Scalar>& r) : ray(r) {}
    };

    template <class S> static constexpr bool holds = std::same_as<S, Set>;

    static constexpr std::string_view kind = "own";

    OwnPrimitives() = default;
    explicit OwnPrimitives(const Set& set) : set_(set) {}

    static bool bounds(const Set& set, std::size_t i, Bounds3<Scalar>& box) {
        box = set.bounds(i);
        return is_finite(box.min) && is_finite(box.max) && !box.empty();
    }

    static Block make_block(const Set&, std::span<const std::uint32_t> primitives) { return Block(primitives); }

    static bool sound(const Block&) { return true; }
    static Bounds3<Scalar> refit(const Set& set, Block& block) { return block.template refit<OwnPrimitives>(set); }

    template <detail::Query query, class Accept>
    bool meet(const Query& q, const Block* block, int count, const Accept& accept, Hit<Scalar>& hit) const {
        Ray<Scalar> ray = q.ray;
        bool nearer = false;
        for (const Block* const end = block + count; block != end; ++block)
            for (const std::uint32_t primitive : block->primitive) {
                if ((primitive & hidden_bit) != 0) continue;
                ray.t_max = query == detail::Query::any ? hit.t : next_up(hit.t); // one beside it may go first
                if (meet_one<query>(ray, primitive, accept, hit)) {
                    if constexpr (query == detail::Query::any) return true;
                    nearer = true;
                }
            }
        return nearer;
    }

private:
    template <detail::Query query, class Accept>
    bool meet_one(Ray<Scalar> ray, std::uint32_t primitive, const Accept& accept, Hit<Scalar>& hit) const {
        constexpr bool shadow = query == detail::Query::any && std::same_as<Accept, AcceptAll> &&
                                requires { { set_->occluded(primitive, ray) } -> std::convertible_to<bool>; };
        if constexpr (shadow) {
            if (!set_->occluded(primitive, ray)) return false;
            hit.primitive = primitive;
            return true;
        } else {
            for (;;) {
                const Hit<Scalar> found = set_->intersect(primitive, ray);
                if (!is_finite(found.t) || found.t < ray.t_min || found.t >= ray.t_max) return false;
                if (query == detail::Query::closest && !comes_before(found.t, primitive, hit)) return false;
                if (accept(primitive, found.u, found.v, found.t)) {
                    hit = {.t = found.t, .u = found.u, .v = found.v, .primitive = primitive};
                    return true;
                }
                ray.t_min = next_up(found.t); // behind a hit that is none, the primitive may have another
            }
        }
    }

    Kept<Set> set_;
};

} // namespace detail

/// A tree over primitives of your own, by the concept PrimitiveSet. It keeps a copy of the set, which had better be
/// a view, and asks it whenever a ray comes near.
template <class Set>
using PrimitiveBvh = BasicBvh<typename detail::ScalarOfPrimitives<std::remove_cv_t<Set>>::Type,
                              detail::OwnPrimitives<std::remove_cv_t<Set>>>;

} // namespace LAMBENT_ABI
} // namespace lambent
