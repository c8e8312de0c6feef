#pragma once
#include <lambent/bvh/primitive.hpp>
#include <lambent/bvh/triangle.hpp>
#include <lambent/core/bounds.hpp>
#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>

/// What lies in a tree's leaves, and how a ray meets it: one struct a kind, with
///   Scalar, Block           a block holds up to four primitives; a leaf is one or two blocks. A block's last
///                           member is primitive[4]: the caller's indices, no_primitive beyond the last; with
///                           hidden_bit, that primitive cannot be hit as it is now (see refit)
///   Leaves(), Leaves(set)   made of nothing, for the empty tree, and of the caller's primitives
///   holds<Set>              whether it can be made of such a set
///   kind                    at most eight letters: the meaning of a block's bytes, for saved trees
///   sound(block)            whether a block read from somewhere can be asked, indices aside
///   bounds(set, i, box)     false: primitive i is left out
///   make_block(set, ids)    a block of one to four of them
///   refit(set, block)       renews a block whose primitives have moved; returns the box of those that can be hit
///   Query                   what a ray needs of its own in leaves of this kind; made once a ray
///   meet<query>(q, blocks, count, accept, hit)
///                           lowers `hit` to the nearest accepted hit in [t_min, hit.t), or one at hit.t that
///                           goes_first(); true if it did. For Query::any the first one before hit.t will do
/// and where they are triangles
///   triangles(block)        the block's as a TriangleBlock, for queries that need corners
/// and, where there is need,
///   meet_both_ways<query>(q, blocks, count, hits)
///                           the same for hits[0], for rays without filter that others go on beside: with no branch on
///                           what is hit. If nothing was, hits[1] holds anything
///   fill(set, i)            of the lines through primitive i's box, the share that meet it: any-hit queries go first
///                           where that is large
///   margin()                how far outside of a box its primitives may be hit: see default_margin
///   instanced               true: hits carry an instance, and filters are told
namespace lambent {
inline namespace LAMBENT_ABI {

/// Takes every hit; costs nothing.
struct AcceptAll {
    template <class T> constexpr bool operator()(std::uint32_t, T, T, T) const { return true; }
};

namespace detail {
template <class A, class T>
concept FlatFilter = requires(const A& accept, std::uint32_t primitive, T x) {
    { accept(primitive, x, x, x) } -> std::convertible_to<bool>;
};
template <class A, class T>
concept InstanceFilter = requires(const A& accept, std::uint32_t primitive, T x, std::uint32_t instance) {
    { accept(primitive, x, x, x, instance) } -> std::convertible_to<bool>;
};
} // namespace detail

/// A filter of hits: accept(primitive, u, v, t), or accept(primitive, u, v, t, instance), is false where there is no
/// surface after all (a leaf's cut-out). Called in no particular order, for hits nearer than the nearest so far. One that
/// also has node() is called for every node that a ray of its own opens, to count them.
template <class A, class T>
concept HitFilter = detail::FlatFilter<A, T> || detail::InstanceFilter<A, T>;

/// A filter for batches that depends on the ray: for_ray(i) gives that of the batch's i-th.
template <class A, class T>
concept RayFilter = requires(const A& accept, std::size_t i) {
    { accept.for_ray(i) } -> HitFilter<T>;
};
template <class A, class T>
concept BatchFilter = HitFilter<A, T> || RayFilter<A, T>;

namespace detail {

enum class Query : std::uint8_t { closest, any };

/// The filter of a batch's i-th ray.
template <class Accept>
[[gnu::always_inline]] inline decltype(auto) filter_of(const Accept& accept, std::size_t i) {
    if constexpr (requires { accept.for_ray(i); }) return accept.for_ray(i);
    else return (accept);
}

/// Of hits at the same t the one with the lowest index is the nearest, so that no answer depends on the order in which a
/// query comes upon them. Before that of a miss, at t_max, goes none.
constexpr bool goes_first(std::uint32_t primitive, std::uint32_t other) { return primitive + 1 < other + 1; }

/// Whether a hit of `primitive` at t is nearer than the nearest so far.
template <class T>
constexpr bool comes_before(T t, std::uint32_t primitive, const Hit<T>& hit) {
    return t < hit.t || (t == hit.t && goes_first(primitive, hit.primitive));
}

/// Where a query looks for triangles: not only nearer than the nearest so far, since one beside it may go first.
template <Query query>
inline constexpr RangeEnd range_end = query == Query::any ? RangeEnd::open : RangeEnd::closed;

/// What a filter asks of the triangle test itself: its constant `rules`, see facing.hpp.
template <class Accept>
constexpr HitRules rules_of() {
    if constexpr (requires { Accept::rules; }) {
        return Accept::rules;
    } else if constexpr (requires(const Accept& accept) { accept.for_ray(0); }) {
        return rules_of<std::decay_t<decltype(std::declval<const Accept&>().for_ray(0))>>();
    } else {
        return {};
    }
}

/// Leaves whose triangles can be looked at, four at a time.
template <class Leaves>
concept HoldsTriangles = requires(const Leaves& leaves, const typename Leaves::Block& block) {
    { leaves.triangles(block) } -> std::convertible_to<const TriangleBlock<typename Leaves::Scalar>&>;
};

/// The filter for what lies in one instance: the same one, told which instance it is if it wants to know.
template <class T, class Accept>
inline decltype(auto) in_instance(const Accept& accept, std::uint32_t instance) {
    if constexpr (InstanceFilter<Accept, T>) {
        return [&accept, instance](std::uint32_t primitive, T u, T v, T t) {
            return bool(accept(primitive, u, v, t, instance));
        };
    } else {
        return (accept);
    }
}

template <class Leaves> inline constexpr bool has_instances = requires { requires Leaves::instanced; };

/// The filter as leaves of this kind call it: where there are no instances, they all are instance 0.
template <class Leaves, class Accept>
inline decltype(auto) filter_for(const Accept& accept) {
    using T = typename Leaves::Scalar;
    if constexpr (has_instances<Leaves> || FlatFilter<Accept, T>) {
        return (accept);
    } else if constexpr (RayFilter<Accept, T>) {
        static_assert(FlatFilter<decltype(accept.for_ray(0)), T>, "Bvh: the filters of rays ask for an instance; here are none");
        return (accept);
    } else {
        return in_instance<T>(accept, 0);
    }
}

/// No finite vertex is missing, and no two coincide. Triangles with three distinct vertices on a line stay in
/// the tree although they have no area: seen by a ray the three are rounded, each on its own, and the gap that
/// this can open between the two neighbours is theirs to fill.
template <class T>
inline bool can_be_hit(const std::array<Vec3<T>, 3>& p) {
    return is_finite(p[0]) && is_finite(p[1]) && is_finite(p[2]) && p[0] != p[1] && p[1] != p[2] && p[2] != p[0];
}

/// Set in a block's index where there is nothing to hit; no_primitive has it too.
inline constexpr std::uint32_t hidden_bit = 0x80000000u;

/// The caller's primitives as a tree keeps them: copied, so they had better be a view. Assignable whatever the
/// view is made of (a lambda that captures is not), and empty at first.
template <class Set>
class Kept {
public:
    Kept() = default;
    explicit Kept(const Set& set) : set_(set) {}
    Kept(const Kept&) = default;
    Kept(Kept&&) = default;
    Kept& operator=(const Kept& other) { return *this = Kept(other); }
    Kept& operator=(Kept&& other) {
        if (this == &other) return *this;
        set_.reset();
        if (other.set_) set_.emplace(std::move(*other.set_));
        return *this;
    }
    const Set& operator*() const { return *set_; }
    const Set* operator->() const { return &*set_; }

private:
    std::optional<Set> set_;
};

/// A block that holds nothing but indices of the caller's primitives: for kinds of leaves that ask those.
struct IndexBlock {
    static constexpr int lanes = 4;
    std::uint32_t primitive[lanes];

    explicit IndexBlock(std::span<const std::uint32_t> primitives) {
        std::fill(std::copy(primitives.begin(), primitives.end(), primitive), primitive + lanes, no_primitive);
    }
    IndexBlock() : IndexBlock(std::span<const std::uint32_t>()) {}

    /// Hides what Leaves::bounds() refuses; returns the box of the rest.
    template <class Leaves, class Set>
    Bounds3<typename Leaves::Scalar> refit(const Set& set) {
        Bounds3<typename Leaves::Scalar> all;
        for (std::uint32_t& id : primitive) {
            if (id == no_primitive) continue;
            Bounds3<typename Leaves::Scalar> box;
            id &= ~hidden_bit;
            if (Leaves::bounds(set, id, box)) {
                all.add(box);
            } else {
                id |= hidden_bit;
            }
        }
        return all;
    }
};

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
    static constexpr std::string_view kind = "corners";

    StoredTriangles() = default;
    template <TriangleSet Mesh> explicit StoredTriangles(const Mesh&) {}

    template <TriangleSet Mesh>
    static bool bounds(const Mesh& mesh, std::size_t i, Bounds3<T>& box) {
        const std::array<Vec3<T>, 3> p = mesh.vertices(i);
        if (!can_be_hit(p)) return false;
        for (const Vec3<T>& v : p) box.add(v);
        return true;
    }

    /// The mean over all lines: of a convex body's surface, half is seen from each side.
    template <TriangleSet Mesh>
    static T fill(const Mesh& mesh, std::size_t i) {
        const std::array<Vec3<T>, 3> p = mesh.vertices(i);
        Bounds3<T> box;
        for (const Vec3<T>& v : p) box.add(v);
        const Vec3<T> size = box.size();
        const T area = length(cross(p[1] - p[0], p[2] - p[0])) / 2;
        const T half_box = size.x * size.y + size.y * size.z + size.z * size.x;
        return area < half_box ? area / half_box : T(1);
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

    static bool sound(const Block& block) {
        for (std::size_t lane = 0; lane < Block::lanes; ++lane) {
            const bool hidden = (block.primitive[lane] & hidden_bit) != 0;
            for (std::size_t i = 0; i < 3; ++i)
                for (int axis = 0; axis < 3; ++axis) {
                    const T x = block.vertex[i][axis][lane];
                    if (!is_finite(x) || (hidden && x != block.vertex[0][axis][lane])) return false;
                }
        }
        return true;
    }

    template <TriangleSet Mesh>
    static Bounds3<T> refit(const Mesh& mesh, Block& block) {
        Bounds3<T> all;
        for (std::size_t lane = 0; lane < Block::lanes; ++lane) {
            if (block.primitive[lane] == no_primitive) continue;
            const std::uint32_t id = block.primitive[lane] & ~hidden_bit;
            Bounds3<T> box;
            const bool hidden = !bounds(mesh, id, box);
            const std::array<Vec3<T>, 3> p = hidden ? std::array<Vec3<T>, 3>{} : mesh.vertices(id);
            for (std::size_t i = 0; i < 3; ++i)
                for (int axis = 0; axis < 3; ++axis) block.vertex[i][axis][lane] = p[i][axis];
            block.primitive[lane] = hidden ? id | hidden_bit : id;
            if (!hidden) all.add(box);
        }
        return all;
    }

    const TriangleBlock<T>& triangles(const Block& block) const { return block; }

    template <detail::Query query, class Accept>
    [[gnu::always_inline]] bool meet(const Query& q, const Block* block, int count, const Accept& accept,
                                     Hit<T>& hit) const {
        if (count == 1) return meet_lanes<query, 4>(q, block, accept, hit);
        if constexpr (native_width<T> >= 8) {
            return meet_lanes<query, 8>(q, block, accept, hit);
        } else { // compilers compare packs wider than registers lane by lane
            const bool first = meet_lanes<query, 4>(q, block, accept, hit);
            if (query == detail::Query::any && first) return true;
            return meet_lanes<query, 4>(q, block + 1, accept, hit) || first;
        }
    }

    template <detail::Query query>
    static bool meet_both_ways(const Query& q, const Block* block, int count, Hit<T>* hits)
        requires(native_width<T> >= 8)
    {
        using Lanes = Pack<T, 8>;
        constexpr bool early_out = false;
        auto found = intersect<HitRules{}, 8, range_end<query>, early_out>(q.ray, block[0], block[count - 1], q.t_min,
                                                                           hits[0].t);
        if constexpr (query == detail::Query::closest) // each lane by itself: the nearest would be known too late
            found.mask = found.mask & ((found.t < Lanes(hits[0].t)) | go_first<8>(block[0], block[count - 1], hits[0].primitive));
        const Lanes t = select(found.mask, found.t, Lanes(std::numeric_limits<T>::infinity()));
        const T nearest = smallest(t);
        const unsigned lane = unsigned(std::countr_zero(bits(t == Lanes(nearest)) | 1u << 7)); // the first, if several
        alignas(64) T u[8], v[8];
        found.u.store(u);
        found.v.store(v);
        const bool hit = bits(found.mask) != 0;
        hits[hit ? 0 : 1] = {
            .t = nearest, .u = u[lane], .v = v[lane], .primitive = block[lane / 4].primitive[lane % 4]};
        return hit;
    }

private:
    /// Which of two blocks' triangles goes_first(); anything for those that cannot be hit. N is 8: a template, so that it is
    /// compiled only where a register holds so many.
    template <int N>
    [[gnu::always_inline]] static Mask<T, N> go_first(const Block& first, const Block& second, std::uint32_t other) {
        using Ids = typename VectorOf<std::int32_t, 4>::Type;
        Ids low, high;
        std::memcpy(&low, first.primitive, sizeof(low));
        std::memcpy(&high, second.primitive, sizeof(high));
        const auto ids = __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
        const Mask<float, N> before{ids + 1 < std::int32_t(other + 1)};
        if constexpr (sizeof(T) == sizeof(float)) return before;
        else return {std::uint16_t(bits(before))};
    }

    template <detail::Query query, int N, class Accept>
    [[gnu::always_inline]] static bool meet_lanes(const Query& q, const Block* block, const Accept& accept,
                                                  Hit<T>& hit) {
        const BlockHit<T, N> found =
            intersect<rules_of<Accept>(), N, range_end<query>>(q.ray, block[0], block[N / 4 - 1], q.t_min, hit.t);
        bool nearer = false;
        for (unsigned lanes = bits(found.mask); lanes != 0; lanes &= lanes - 1) {
            const int lane = std::countr_zero(lanes);
            const T t = found.t[lane];
            const std::uint32_t primitive = block[lane / 4].primitive[lane % 4];
            if (query == detail::Query::closest && !comes_before(t, primitive, hit)) continue;
            const T u = found.u[lane], v = found.v[lane];
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
