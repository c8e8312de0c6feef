#pragma once
#include <lambent/bvh/bvh.hpp>
#include <lambent/bvh/leaves.hpp>
#include <lambent/bvh/refit.hpp>
#include <lambent/core/affine.hpp>
#include <lambent/core/bounds.hpp>
#include <lambent/core/error.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/ray.hpp>
#include <lambent/core/simd.hpp>
#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// A tree put somewhere in the world, as often as you like: the tree is not copied, and must stay where it is.
template <class Tree>
struct Instance {
    const Tree* tree = nullptr;
    Affine<typename Tree::Scalar> to_world{};
    std::uint32_t mask = 0xffffffffu; ///< a ray sees it if its RayMask has a bit of these; without one it always does
};

/// A filter by which a ray sees only instances whose mask has a bit in common with `mask`; what it meets there,
/// `accept` decides. Trees without instances know no masks.
///     top.intersect(ray, RayMask{camera_bit})
template <class Accept = AcceptAll>
struct RayMask {
    std::uint32_t mask = 0xffffffffu;
    Accept accept{};

    template <class... Args>
        requires std::invocable<const Accept&, Args...>
    bool operator()(Args... args) const {
        return accept(args...);
    }
};
template <class Accept> RayMask(std::uint32_t, Accept) -> RayMask<Accept>;
RayMask(std::uint32_t) -> RayMask<>;

namespace detail {

/// The inverse of a matrix of entries at most 2, in columns; false if it has none. Cofactors with exact signs over
/// the determinant, and then Newton's steps whose residual is computed in twice the precision.
inline bool invert(const Vec3<double> (&m)[3], Vec3<double> (&inverse)[3]) {
    Vec3<double> rows[3] = {robust_cross(m[1], m[2]), robust_cross(m[2], m[0]), robust_cross(m[0], m[1])};
    const double determinant = glm::dot(m[0], rows[0]);
    for (int k = 0; k < 3; ++k) {
        for (int j = 0; j < 3; ++j) inverse[k][j] = rows[j][k] / determinant;
        if (!is_finite(inverse[k])) return false;
    }
    for (int step = 0; step < 2; ++step) {
        Vec3<double> better[3];
        for (int k = 0; k < 3; ++k) {
            Vec3<double> residual;
            for (int i = 0; i < 3; ++i) {
                CompensatedSum<double> sum;
                sum.add(i == k ? 1 : 0);
                for (int j = 0; j < 3; ++j) {
                    const double product = opaque(m[j][i] * inverse[k][j]);
                    sum.add(-product);
                    sum.add(-product_error(m[j][i], inverse[k][j], product));
                }
                residual[i] = sum.value();
            }
            better[k] = inverse[k] + inverse[0] * residual.x + inverse[1] * residual.y + inverse[2] * residual.z;
        }
        for (int k = 0; k < 3; ++k)
            if (is_finite(better[k])) inverse[k] = better[k];
    }
    return true;
}

/// Greatest sum of magnitudes in a row: how far a vector with components of at most 1 can get.
inline double row_norm(const Vec3<double> (&m)[3]) {
    return max_component(glm::abs(m[0]) + glm::abs(m[1]) + glm::abs(m[2]));
}

/// An instance as rays need it. World and object are tied at their centres, which are rounded once and for all, so
/// that an object far away in its own coordinates or in the world loses nothing to cancellation:
/// world = world_center + M · (object − object_center).
template <class Tree>
struct PlacedTree {
    using T = typename Tree::Scalar;
    const Tree* tree = nullptr;
    T to_object[3][4]{}; ///< columns of the inverse of M; the fourth component is 0
    T object_center[4]{};
    Vec3<T> world_center{0};
    std::uint32_t mask = 0;

    /// The same ray in the object's space; its direction keeps its length there, so that t means the same. In the same
    /// roundings wherever it is inlined, so that all kinds of queries agree.
    Ray<T> to_object_space(const Ray<T>& ray) const {
        const Pack<T, 4> origin = times(ray.origin - world_center) + Pack<T, 4>::load(object_center);
        const Pack<T, 4> direction = times(ray.direction);
        return {{origin[0], origin[1], origin[2]}, {direction[0], direction[1], direction[2]}, ray.t_min, ray.t_max};
    }

private:
    Pack<T, 4> times(const Vec3<T>& v) const {
        using Lanes = Pack<T, 4>;
        const Lanes z = opaque(Lanes::load(to_object[2]) * Lanes(v.z));
        const Lanes yz = opaque(multiply_add(Lanes::load(to_object[1]), Lanes(v.y), z));
        return opaque(multiply_add(Lanes::load(to_object[0]), Lanes(v.x), yz));
    }
};

} // namespace detail

/// Instances made ready for an InstancedBvh; does not look at the caller's list again.
template <class Tree>
class InstanceSet {
public:
    using Scalar = typename Tree::Scalar;

    /// Instances without anything in them, of an empty tree or scaled by exactly 0, are left out of the tree.
    /// throws  lambent::Error naming the first instance without a tree, with a transform that is not finite, reaches
    ///         out of the scalar's range, or flattens space: its condition, the product of the maps' norms there and
    ///         back, may not pass 2^20 in float and 2^49 in double, beyond which no digit of a hit is certain
    explicit InstanceSet(std::span<const Instance<Tree>> instances)
        : placed_(instances.size()), bounds_(instances.size()) {
        for (std::size_t i = 0; i < instances.size(); ++i) place(instances[i], i);
    }
    explicit InstanceSet(const std::vector<Instance<Tree>>& instances)
        : InstanceSet(std::span<const Instance<Tree>>(instances)) {}

    std::size_t count() const { return placed_.size(); }
    /// In the world; empty if there is nothing to hit.
    const Bounds3<Scalar>& bounds(std::size_t i) const { return bounds_[i]; }
    std::span<const detail::PlacedTree<Tree>> placed() const { return placed_; }
    /// Of the worst transform, at least 1.
    double condition() const { return condition_; }

private:
    using T = Scalar;
    static constexpr double max_condition = 1 / (16.0 * double(std::numeric_limits<T>::epsilon()) / 2);

    void place(const Instance<Tree>& instance, std::size_t i) {
        const auto refuse = [&](const std::string& why) { fail("instance " + std::to_string(i) + " " + why); };
        if (instance.tree == nullptr) refuse("has no tree");
        Vec3<double> m[3], inverse[3];
        double largest = 0;
        for (int k = 0; k < 3; ++k) {
            m[k] = Vec3<double>(instance.to_world.column[k]);
            if (!is_finite(m[k])) refuse("has a transform that is not finite");
            largest = std::max(largest, max_component(glm::abs(m[k])));
        }
        const Vec3<double> translation(instance.to_world.translation);
        if (!is_finite(translation)) refuse("has a transform that is not finite");
        if (largest == 0 || instance.tree->empty()) return;

        const double scale = std::ldexp(1.0, std::ilogb(largest));
        for (Vec3<double>& column : m) column /= scale;
        if (!detail::invert(m, inverse)) refuse("has a transform that flattens space");
        const double condition = detail::row_norm(m) * detail::row_norm(inverse);
        if (!(condition <= max_condition))
            refuse("has a transform that flattens space: its condition " + std::to_string(condition) +
                   " is more than " + std::to_string(max_condition));
        for (Vec3<double>& column : m) column *= scale;

        detail::PlacedTree<Tree> p;
        p.tree = instance.tree;
        p.mask = instance.mask;
        const Bounds3<T>& object = instance.tree->bounds();
        const Vec3<T> object_center = object.min / T(2) + object.max / T(2);
        const Vec3<double> c(object_center);
        p.world_center = Vec3<T>(m[0] * c.x + m[1] * c.y + m[2] * c.z + translation);
        bool in_range = is_finite(p.world_center);
        for (int k = 0; k < 3; ++k) {
            p.object_center[k] = object_center[k];
            const Vec3<T> column(inverse[k] / scale);
            in_range = in_range && is_finite(column) && !is_black(column);
            for (int j = 0; j < 3; ++j) p.to_object[k][j] = column[j];
        }
        const Bounds3<T> world = box_in_world(*instance.tree, p, m);
        if (!in_range || !is_finite(world.min) || !is_finite(world.max))
            refuse("has a transform that reaches out of the numbers' range");
        placed_[i] = p;
        bounds_[i] = world;
        condition_ = std::max(condition_, condition);
    }

    /// Around what the root's children become, one by one: that is tighter than around the whole. Rounded outwards, and
    /// wider by what adding the object's centre can shift a ray.
    static Bounds3<T> box_in_world(const Tree& tree, const detail::PlacedTree<Tree>& p, const Vec3<double> (&m)[3]) {
        constexpr double u = double(std::numeric_limits<T>::epsilon()) / 2, ud = 0x1p-53;
        const Vec3<double> object_center(p.object_center[0], p.object_center[1], p.object_center[2]);
        const double shift = 2 * u * detail::row_norm(m) * max_component(glm::abs(object_center));
        Bounds3<T> world, child;
        for (int lane = 0; lane < node_width<T>; ++lane) {
            if (!detail::read_box(tree.tree().nodes[0], lane, child)) continue;
            const Vec3<double> middle = Vec3<double>(child.min) / 2.0 + Vec3<double>(child.max) / 2.0;
            const Vec3<double> half = Vec3<double>(child.max) / 2.0 - Vec3<double>(child.min) / 2.0;
            const Vec3<double> from_center = middle - object_center;
            Vec3<double> center(p.world_center), reach(shift);
            for (int k = 0; k < 3; ++k) {
                center += m[k] * from_center[k];
                const double rounding = 16 * ud * (half[k] + std::abs(from_center[k]) + std::abs(middle[k]));
                reach += glm::abs(m[k]) * (half[k] + rounding);
            }
            reach += glm::abs(Vec3<double>(p.world_center)) * 16.0 * ud;
            for (int k = 0; k < 3; ++k) {
                world.min[k] = std::min(world.min[k], next_down(T(center[k] - reach[k])));
                world.max[k] = std::max(world.max[k], next_up(T(center[k] + reach[k])));
            }
        }
        return world;
    }

    std::vector<detail::PlacedTree<Tree>> placed_;
    std::vector<Bounds3<T>> bounds_;
    double condition_ = 1;
};
template <class Tree> InstanceSet(const std::vector<Instance<Tree>>&) -> InstanceSet<Tree>;
template <class Tree> InstanceSet(std::span<const Instance<Tree>>) -> InstanceSet<Tree>;

namespace detail {

template <class A> inline constexpr bool is_ray_mask = false;
template <class A> inline constexpr bool is_ray_mask<RayMask<A>> = true;

/// Trees within a tree.
template <class Tree>
class Instances {
public:
    using Scalar = typename Tree::Scalar;
    using Block = IndexBlock;
    static_assert(!has_instances<typename Tree::Leaves>, "InstancedBvh: instances of instances are not supported");

    struct Query {
        Ray<Scalar> ray;

        Query() = default;
        explicit Query(const Ray<Scalar>& r) : ray(r) {}
    };

    template <class S> static constexpr bool holds = std::same_as<S, InstanceSet<Tree>>;
    static constexpr std::string_view kind = "instance";
    static constexpr bool instanced = true;

    Instances() = default;
    explicit Instances(const InstanceSet<Tree>& set)
        : placed_(set.placed().begin(), set.placed().end()), condition_(Scalar(set.condition())) {}

    /// A ray is moved into the object's space with 10 rounding errors of its reach, counted in the world by up to the
    /// transform's condition, and the test there adds 7 of the same kind.
    Scalar margin() const { return default_margin<Scalar> + 20 * condition_; }

    static bool bounds(const InstanceSet<Tree>& set, std::size_t i, Bounds3<Scalar>& box) {
        box = set.bounds(i);
        return !box.empty();
    }

    static Block make_block(const InstanceSet<Tree>&, std::span<const std::uint32_t> ids) { return Block(ids); }
    static bool sound(const Block&) { return true; }
    static Bounds3<Scalar> refit(const InstanceSet<Tree>& set, Block& block) {
        return block.template refit<Instances>(set);
    }

    template <detail::Query query, class Accept>
    bool meet(const Query& q, const Block* block, int count, const Accept& accept, Hit<Scalar>& hit) const {
        bool nearer = false;
        for (const Block* const end = block + count; block != end; ++block)
            for (const std::uint32_t id : block->primitive) {
                if ((id & hidden_bit) != 0) continue;
                const PlacedTree<Tree>& placed = placed_[id];
                bool found = false;
                if constexpr (is_ray_mask<Accept>) {
                    if ((placed.mask & accept.mask) == 0) continue;
                    found = meet_one<query>(placed, q.ray, id, accept.accept, hit);
                } else {
                    found = meet_one<query>(placed, q.ray, id, accept, hit);
                }
                if (found && query == detail::Query::any) return true;
                nearer = nearer || found;
            }
        return nearer;
    }

private:
    template <detail::Query query, class Accept>
    static bool meet_one(const PlacedTree<Tree>& placed, Ray<Scalar> ray, std::uint32_t id, const Accept& accept,
                         Hit<Scalar>& hit) {
        if constexpr (query == detail::Query::any) ray.t_max = hit.t;
        else ray.t_max = next_up(hit.t); // one beside it may go first
        ray = placed.to_object_space(ray);
        const auto& filter = in_instance<Scalar>(accept, id);
        if constexpr (query == detail::Query::any) {
            if (!placed.tree->occluded(ray, filter)) return false;
            hit.primitive = 0; // some one
        } else {
            const Hit<Scalar> found = placed.tree->intersect(ray, filter);
            if (!found || !(found.t < hit.t || (hit && id < hit.instance))) return false;
            hit = found;
        }
        hit.instance = id;
        return true;
    }

    std::vector<PlacedTree<Tree>> placed_;
    Scalar condition_ = 1;
};

} // namespace detail

/// A tree over instances of other trees, of one type: two levels, with any invertible transforms. Hits carry the
/// caller's index of the instance and the primitive's index in the object; a filter may take the instance as a fifth
/// argument, and RayMask chooses among them. What is watertight in its own space is watertight here, since a ray enters
/// it as one ray. When objects or transforms change: build anew, or refit(InstanceSet(...)).
///     const std::vector<Instance<Bvh>> list = {{&chair, Affine<float>::from(matrix)}, ...};
///     const auto top = InstancedBvh<Bvh>::build(InstanceSet(list));
///     if (const auto hit = top.intersect(ray)) n = list[hit.instance].to_world.normal(normal in the object);
template <class Tree>
using InstancedBvh = BasicBvh<typename Tree::Scalar, detail::Instances<Tree>>;

} // namespace LAMBENT_ABI
} // namespace lambent
