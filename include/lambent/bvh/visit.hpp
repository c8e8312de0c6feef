#pragma once
#include <lambent/bvh/bvh.hpp>
#include <lambent/bvh/once.hpp>
#include <lambent/bvh/walk.hpp>
#include <lambent/core/bounds.hpp>
#include <bit>
#include <concepts>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <utility>

namespace lambent {
inline namespace LAMBENT_ABI {

/// A query of your own:
///     enter(box) const      bool: go into this box? Or a number: how soon; the lowest go first
///     visit(primitive)      a primitive in a box that was entered; returns nothing, or false to end the walk
/// and, beside an enter() that returns numbers, if you like,
///     limit() const         boxes with more than this are left out, as it is when their turn comes
template <class V, class T>
concept BvhVisitor = requires(V& visitor, const Bounds3<T>& box, std::uint32_t primitive) {
    { visitor.enter(box) } -> std::convertible_to<double>;
    visitor.visit(primitive);
};

namespace detail {

template <class T>
inline Bounds3<T> child_box(const WideNode<T>& node, int lane) {
    Bounds3<T> box;
    for (int k = 0; k < 3; ++k) {
        box.min[k] = node.plane[2 * k][lane];
        box.max[k] = node.plane[2 * k + 1][lane];
    }
    return box;
}

} // namespace detail

/// Walks the tree as the visitor says; primitives of any kind, each at most once. The boxes nest, and hold what is
/// in them (in a tree with spatial splits: the part of it that is not in others). A primitive is not tested against
/// anything: that is for visit() to do.
///
/// What a camera sees:
///     struct Frustum {
///         std::array<Vec4f, 6> planes; // xyz points inwards
///         std::vector<std::uint32_t> visible;
///         bool enter(const Bounds3<float>& box) const {
///             for (const Vec4f& p : planes) {
///                 const float radius = dot(abs(Vec3f(p)), box.size()) / 2;
///                 if (dot(Vec3f(p), box.center()) + p.w < -radius) return false;
///             }
///             return true;
///         }
///         void visit(std::uint32_t primitive) { visible.push_back(primitive); }
///     };
///     Frustum frustum{planes, {}};
///     traverse(bvh, frustum);
/// Nearest first, as in a search for the k nearest: enter() returns the box's distance, limit() the largest that is
/// still of interest, and visit() lowers it. tests/bvh/visit_test.cpp has both.
/// cost  a call of enter() for each child of a node that is opened; does not allocate, but in a tree with spatial
///       splits beyond 32 primitives
template <class T, class Leaves, BvhVisitor<T> Visitor>
void traverse(const BasicBvh<T, Leaves>& bvh, Visitor&& visitor) {
    using Key = std::remove_cvref_t<decltype(visitor.enter(std::declval<const Bounds3<T>&>()))>;
    detail::Once once(bvh.tree().duplicates > 0);
    const auto visit = [&](const typename Leaves::Block& block) {
        for (const std::uint32_t primitive : block.primitive) {
            if ((primitive & detail::hidden_bit) != 0 || !once.first(primitive)) continue;
            const auto call = [&](std::uint32_t p) { return visitor.visit(p); };
            if (!detail::goes_on(call, primitive)) return false;
        }
        return true;
    };
    if constexpr (std::same_as<Key, bool>) {
        const auto entered = [&](const detail::WideNode<T>& node) {
            unsigned lanes = 0;
            for (unsigned used = detail::used_lanes(node); used != 0; used &= used - 1) {
                const int lane = std::countr_zero(used);
                if (visitor.enter(detail::child_box(node, lane))) lanes |= 1u << lane;
            }
            return lanes;
        };
        detail::walk(bvh, entered, visit);
    } else {
        const auto keys = [&](const detail::WideNode<T>& node, Key* out) {
            for (unsigned used = detail::used_lanes(node); used != 0; used &= used - 1) {
                const int lane = std::countr_zero(used);
                out[lane] = visitor.enter(detail::child_box(node, lane));
            }
        };
        const auto limit = [&] {
            if constexpr (requires { visitor.limit(); }) {
                return visitor.limit();
            } else {
                return std::numeric_limits<Key>::has_infinity ? std::numeric_limits<Key>::infinity()
                                                              : std::numeric_limits<Key>::max();
            }
        };
        detail::walk_nearest_first<Key>(bvh, keys, limit, visit);
    }
}

} // namespace LAMBENT_ABI
} // namespace lambent
