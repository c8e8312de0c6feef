#pragma once
#include <lambent/bvh/ray_group.hpp>
#include <lambent/bvh/traverse.hpp>
#include <algorithm>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// The nearest hits of up to 64 rays that go much the same way, through the tree as one: a node's children are tested
/// against all rays at once, by intervals; leaves and their triangles against as many at a time as a register holds.
/// source  Wald, Boulos, Shirley, "Ray tracing deformable scenes using dynamic bounding volume hierarchies" (2007)
template <class T, class Accept>
class Packet {
public:
    static constexpr int capacity = 64;
    using Tree = WideTree<T, TriangleBlock<T>>;

    Packet(const Tree& tree, const Accept& accept) : tree_(tree), accept_(accept) {}

    /// Whether a few of the rays go so much the same way that it is worth looking at all.
    template <class RayOf>
    static bool promising(const std::uint32_t* indices, int count, int kind, const RayOf& ray_of) {
        const int kz = RayKind<T>::axes(kind).z;
        const auto slope = [&](int i) {
            const Vec3<T> d = ray_of(indices[i]).direction;
            return d / std::abs(d[kz]);
        };
        const Vec3<T> first = slope(0);
        for (int i = 1; i <= 4; ++i) {
            const Vec3<T> difference = slope(i * (count - 1) / 4) - first;
            if (!(max_component(glm::abs(difference)) <= widest)) return false;
        }
        return true;
    }

    /// The nearest hits of `count` rays of one kind; false, and nothing done, if they are too different for it to pay.
    template <class RayOf>
    [[gnu::noinline]] bool run(const std::uint32_t* indices, int count, int kind, const RayOf& ray_of) {
        axes_ = RayKind<T>::axes(kind);
        indices_ = indices;
        count_ = count;
        group_count_ = (count + lanes - 1) / lanes;
        for (int g = 0; g < group_count_; ++g) // what is missing is filled with the last
            groups_[g].take(tree_, kind, [&](int i) -> decltype(auto) {
                return ray_of(indices[std::min(g * lanes + i, count - 1)]);
            });
        RayIntervals<T> all(tree_, kind, groups_, group_count_);
        if (!(all.spread <= widest)) return false;
        std::fill(id_, id_ + group_count_, Rays(std::bit_cast<T>(typename FloatBits<T>::Type(no_primitive))));
        go_through(all, RayKind<T>::plane(kind));
        return true;
    }

    /// The i-th ray's hit.
    Hit<T> hit(int i) const {
        Hit<T> h;
        h.primitive = primitive(i);
        if (!h) return h;
        h.t = groups_[i / lanes].t_max[i % lanes];
        h.u = u_[i / lanes][i % lanes];
        h.v = v_[i / lanes][i % lanes];
        return h;
    }

private:
    static constexpr int width = node_width<T>;
    static constexpr int lanes = group_lanes<T>;
    using Rays = Pack<T, lanes>;

    /// Beyond such a spread of slopes the intervals hold too much.
    static constexpr T widest = T(0.25);

    [[gnu::noinline]] void go_through(RayIntervals<T>& all, const PlaneOffsets& plane) {
        using Lanes = Pack<T, width>;
        alignas(64) T distances[max_stack<T>];
        alignas(64) std::uint32_t children[max_stack<T>], parents[max_stack<T>];
        std::size_t top = 0;
        std::uint32_t current = 0;
        for (;;) {
            const WideNode<T>& node = tree_.nodes[current];
            Lanes entry;
            const Mask<T, width> mask = all.meets(NodeRows<T>(node, plane), entry);
            store_descending(mask, entry, node.child, distances + top, children + top);
            for (int i = 0; i < width; ++i) parents[top + std::size_t(i)] = current;
            top += std::size_t(std::popcount(bits(mask)));
            for (;;) {
                if (top == 0) return;
                --top;
                if (distances[top] > all.limit) continue;
                current = children[top];
                if ((current & Child::leaf_bit) == 0) break;
                const auto lane = std::bit_cast<typename FloatBits<T>::Type>(distances[top]) & (width - 1);
                if (meet_leaf(current, NodeRows<T>(tree_.nodes[parents[top]], plane), int(lane))) update(all.limit);
            }
        }
    }

    std::uint32_t primitive(int ray) const {
        return std::uint32_t(std::bit_cast<typename FloatBits<T>::Type>(id_[ray / lanes][ray % lanes]));
    }

    void update(T& limit) const {
        Rays last = -std::numeric_limits<T>::infinity();
        for (int g = 0; g < group_count_; ++g) last = max(groups_[g].limit, last);
        limit = largest(last);
    }

    /// True if some ray's hit has changed.
    bool meet_leaf(std::uint32_t child, const NodeRows<T>& rows, int lane) {
        const typename RayGroup<T, lanes>::Box box(rows, lane);
        int active[std::size_t(capacity / lanes)], count = 0;
        for (int g = 0; g < group_count_; ++g) {
            active[count] = g;
            count += any(groups_[g].meet(box)) ? 1 : 0;
        }
        if (count == 0) return false;
        bool changed = false;
        const auto* block = tree_.blocks.data() + (child & Child::index_mask);
        const int blocks = (child & Child::second_block_bit) != 0 ? 2 : 1;
        for (int b = 0; b < blocks; ++b)
            for (int i = 0; i < block_lanes && block[b].primitive[i] != no_primitive; ++i)
                for (int a = 0; a < count; ++a) changed |= meet_triangle(block[b], i, active[a]);
        return changed;
    }

    [[gnu::always_inline]] bool meet_triangle(const TriangleBlock<T>& block, int i, int g) {
        RayGroup<T, lanes>& group = groups_[g];
        const BlockHit<T, lanes> found = group.template meet<rules_of<Accept>(), RangeEnd::closed>(block, i, axes_);
        if (!any(found.mask)) return false;
        const typename FloatBits<T>::Type id = block.primitive[i];
        if constexpr (std::same_as<Accept, AcceptAll>) {
            if (!any(found.mask & (found.t == group.t_max))) { // none for goes_first() to tell: all are nearer
                group.t_max = select(found.mask, found.t, group.t_max);
                group.limit = select(found.mask, just_behind<T>(found.t * group.along), group.limit);
                u_[g] = select(found.mask, found.u, u_[g]);
                v_[g] = select(found.mask, found.v, v_[g]);
                id_[g] = select(found.mask, Rays(std::bit_cast<T>(id)), id_[g]);
                return true;
            }
        }
        bool changed = false;
        for (unsigned hits = bits(found.mask); hits != 0; hits &= hits - 1) {
            const int l = std::countr_zero(hits), ray = g * lanes + l;
            if (!(found.t[l] < group.t_max[l]) && !goes_first(block.primitive[i], primitive(ray))) continue;
            const std::size_t index = indices_[std::min(ray, count_ - 1)];
            if (!filter_of(accept_, index)(block.primitive[i], found.u[l], found.v[l], found.t[l])) continue;
            group.t_max.set(l, found.t[l]);
            group.limit.set(l, just_behind<T>(found.t[l] * group.along[l]));
            u_[g].set(l, found.u[l]);
            v_[g].set(l, found.v[l]);
            id_[g].set(l, std::bit_cast<T>(id));
            changed = true;
        }
        return changed;
    }

    const Tree& tree_;
    const Accept& accept_;
    typename RayKind<T>::Axes axes_{};
    const std::uint32_t* indices_ = nullptr;
    int count_ = 0, group_count_ = 0;
    RayGroup<T, lanes> groups_[std::size_t(capacity / lanes)];
    Rays u_[std::size_t(capacity / lanes)], v_[std::size_t(capacity / lanes)];
    Rays id_[std::size_t(capacity / lanes)]; ///< of primitives, as the bits of a T
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
