#pragma once
#include <lambent/bvh/traverse.hpp>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Up to 64 rays that go much the same way, through the tree as one: a node's children are tested against all rays at
/// once, by intervals; leaves and their triangles against eight rays at a time, with the arithmetic of a single ray's
/// test, so with its answers to the bit.
/// source  interval tests: Boulos, Wald, Shirley, "Geometric and arithmetic culling methods for entire ray packets"
///         (2006), and Wald et al. (2007)
template <Query query, class T, class Accept>
class Packet {
public:
    static constexpr int capacity = 64;
    using Tree = WideTree<T, TriangleBlock<T>>;

    Packet(const Tree& tree, const Accept& accept) : tree_(tree), accept_(accept) {}

    /// Which way a ray goes: rays of one kind, 0 to kinds - 1, may share a packet; `kinds` for a ray that hits nothing.
    static constexpr int kinds = 24;
    [[gnu::always_inline]] static int kind(const Ray<T>& ray) {
        using Bits = FloatBits<T>;
        const auto magnitude = [](T x) { return std::bit_cast<typename Bits::Type>(x) & ~Bits::sign; };
        const auto x = magnitude(ray.direction.x), y = magnitude(ray.direction.y), z = magnitude(ray.direction.z);
        const auto o = std::max(magnitude(ray.origin.x), std::max(magnitude(ray.origin.y), magnitude(ray.origin.z)));
        const auto largest = std::max(x, std::max(y, z));
        const unsigned axis = unsigned(std::countr_zero(unsigned(x == largest) | unsigned(y == largest) << 1 | 4u));
        const auto negative = [](T v) {
            return unsigned(std::bit_cast<typename Bits::Type>(v) >> (8 * sizeof(T) - 1));
        };
        const Vec3<T>& d = ray.direction;
        const unsigned signs = negative(d.x) | negative(d.y) << 1 | negative(d.z) << 2;
        const bool bounded = magnitude(ray.t_min) <= Bits::exponent && magnitude(ray.t_max) <= Bits::exponent;
        const bool usable = bounded && o < Bits::exponent && largest < Bits::exponent &&
                            largest >= magnitude(std::numeric_limits<T>::min());
        return usable ? int(signs | axis << 3) : kinds;
    }

    /// Whether a few of the rays go so much the same way that it is worth looking at all.
    template <class RayOf>
    static bool promising(const std::uint32_t* indices, int count, int kind, const RayOf& ray_of) {
        const int kz = kind >> 3;
        const auto component = [](const Vec3<T>& v, int k) { return k == 0 ? v.x : k == 1 ? v.y : v.z; };
        const auto slope = [&](int i) {
            const Vec3<T> d = ray_of(indices[i]).direction;
            return d / std::abs(component(d, kz));
        };
        const Vec3<T> first = slope(0);
        for (int i = 1; i <= 4; ++i) {
            const Vec3<T> difference = slope(i * (count - 1) / 4) - first;
            if (!(max_component(glm::abs(difference)) <= widest)) return false;
        }
        return true;
    }

    /// Takes `count` rays of one kind; false, and nothing done, if they are too different for it to pay.
    template <class RayOf>
    [[gnu::noinline]] bool gather(const std::uint32_t* indices, int count, int kind, const RayOf& ray_of) {
        kind_ = kind;
        groups_ = (count + lanes - 1) / lanes;
        for (int i = 0; i < groups_ * lanes; ++i) {
            const Ray<T>& ray = ray_of(indices[std::min(i, count - 1)]); // what is missing is filled with the last
            origin_[0][i] = ray.origin.x;
            origin_[1][i] = ray.origin.y;
            origin_[2][i] = ray.origin.z;
            direction_[0][i] = ray.direction.x;
            direction_[1][i] = ray.direction.y;
            direction_[2][i] = ray.direction.z;
            t_min_[i] = ray.t_min;
            t_[i] = ray.t_max;
        }
        return prepare();
    }

    [[gnu::noinline]] void run() {
        using Lanes = Pack<T, width>;
        const PlaneOffsets& plane = plane_offsets<T>[std::size_t(kind_ & 7)];
        alignas(64) T distances[max_stack<T>];
        alignas(64) std::uint32_t children[max_stack<T>], parents[max_stack<T>];
        std::size_t top = 0;
        std::uint32_t current = 0;
        for (;;) {
            const WideNode<T>& node = tree_.nodes[current];
            const auto at = [&](std::uint32_t offset, T origin) {
                Lanes planes;
                std::memcpy(&planes.v, reinterpret_cast<const unsigned char*>(&node) + offset, sizeof(planes.v));
                return planes - Lanes(origin);
            };
            Lanes entry = from_, exit = limit_;
            for (int k = 0; k < 3; ++k) {
                const Lanes near = at(plane.near[k], near_origin_[k]), far = at(plane.far[k], far_origin_[k]);
                const Lanes least = least_scale_[k], most = most_scale_[k];
                entry = max(min(near * least, near * most), entry);
                exit = min(max(far * least, far * most), exit);
            }
            const Mask<T, width> mask = entry <= exit;
            const Lanes order = sorted_descending(select(mask, tagged(entry), Lanes(T(-0.0))));
            order.store(distances + top);
            look_up(order, node.child, children + top);
            for (int i = 0; i < width; ++i) parents[top + std::size_t(i)] = current;
            top += std::size_t(std::popcount(bits(mask)));
            for (;;) {
                if (top == 0) return;
                --top;
                if (distances[top] > limit_) continue;
                current = children[top];
                if ((current & Child::leaf_bit) == 0) break;
                const auto lane = std::bit_cast<typename FloatBits<T>::Type>(distances[top]) & (width - 1);
                if (meet_leaf(current, tree_.nodes[parents[top]], int(lane), plane) && !update_limit()) return;
            }
        }
    }

    /// The i-th ray's hit.
    Hit<T> hit(int i) const {
        Hit<T> h;
        h.primitive = primitive_[i];
        if (!h) return h;
        h.t = t_[i];
        h.u = u_[i];
        h.v = v_[i];
        return h;
    }

private:
    static constexpr int lanes = 8, width = node_width<T>;
    using Rays = Pack<T, lanes>;
    using RayMask = Mask<T, lanes>;

    static Rays load(const T* from, int group) { return Rays::load(from + group * lanes); }

    /// Constants of SlabRay and ShearedRay, and the intervals that hold all rays'.
    bool prepare() {
        constexpr T u = std::numeric_limits<T>::epsilon() / 2, limit = steepest<T>;
        constexpr T inf = std::numeric_limits<T>::infinity();
        kz_ = kind_ >> 3;
        kx_ = (kz_ + 1) % 3;
        ky_ = (kz_ + 2) % 3;
        Rays least_o[3], most_o[3], least_d[3], most_d[3], least_s[3], most_s[3];
        Rays most_pad = T(0), first = inf, last = -inf;
        for (int k = 0; k < 3; ++k) {
            least_o[k] = least_d[k] = least_s[k] = inf;
            most_o[k] = most_d[k] = most_s[k] = -inf;
        }
        for (int g = 0; g < groups_; ++g) {
            const Rays along = abs(load(direction_[kz_], g));
            Rays reach = T(0), size_o = T(0);
            for (int k = 0; k < 3; ++k) {
                const Rays o = load(origin_[k], g), d = load(direction_[k], g);
                reach = max(abs(o - Rays(tree_.center[k])) + Rays(tree_.half_size[k]), reach);
                size_o = max(abs(o), size_o);
                const Rays s = select(abs(d) * Rays(limit) > along, along / d, copysign(Rays(limit), d));
                s.store(scale_[k] + g * lanes);
                least_o[k] = min(o, least_o[k]);
                most_o[k] = max(o, most_o[k]);
                least_s[k] = min(s, least_s[k]);
                most_s[k] = max(s, most_s[k]);
                const Rays slope = d / along;
                least_d[k] = min(slope, least_d[k]);
                most_d[k] = max(slope, most_d[k]);
            }
            for (int k = 0; k < 3; ++k) {
                const Rays s = load(scale_[k], g), shift = -load(origin_[k], g) * s;
                const Rays size = abs(load(origin_[k], g));
                const Rays margin = multiply_add(Rays(4 * u), size, Rays(tree_.margin * u) * reach) * abs(s);
                (shift - margin).store(near_shift_[k] + g * lanes);
                (shift + margin).store(far_shift_[k] + g * lanes);
            }
            most_pad = max(multiply_add(Rays(12 * u), size_o, Rays((tree_.margin + 8) * u) * reach), most_pad);
            const Rays from = just_before<T>(load(t_min_, g) * along), to = just_behind<T>(load(t_, g) * along);
            along.store(along_ + g * lanes);
            from.store(from_of_ + g * lanes);
            to.store(limit_of_ + g * lanes);
            first = min(from, first);
            last = max(to, last);
            const Rays dz = load(direction_[kz_], g);
            (-load(direction_[kx_], g) / dz).store(slope_x_ + g * lanes);
            (-load(direction_[ky_], g) / dz).store(slope_y_ + g * lanes);
            (Rays(T(1)) / dz).store(inverse_z_ + g * lanes);
            for (int i = 0; i < lanes; ++i) primitive_[g * lanes + i] = no_primitive;
        }
        const T pad = largest(most_pad);
        from_ = smallest(first);
        limit_ = largest(last);
        T spread = 0;
        for (int k = 0; k < 3; ++k) {
            const T o0 = smallest(least_o[k]), o1 = largest(most_o[k]);
            least_scale_[k] = smallest(least_s[k]);
            most_scale_[k] = largest(most_s[k]);
            const bool negative = (kind_ >> k & 1) != 0;
            near_origin_[k] = negative ? o0 - pad : o1 + pad;
            far_origin_[k] = negative ? o1 + pad : o0 - pad;
            const T size = tree_.half_size[0] + tree_.half_size[1] + tree_.half_size[2];
            spread = std::max(spread, std::max(largest(most_d[k]) - smallest(least_d[k]), 4 * (o1 - o0) / size));
        }
        return spread <= widest;
    }
    /// Beyond such a spread of slopes the intervals hold too much. Any-hit rays have to be the closer together, since
    /// all of a packet go on until the last has hit.
    static constexpr T widest = query == Query::any ? T(0.0625) : T(0.25);

    static T largest(Rays a) {
        T x = a[0];
        for (int i = 1; i < lanes; ++i) x = std::max(x, a[i]);
        return x;
    }
    static T smallest(Rays a) {
        T x = a[0];
        for (int i = 1; i < lanes; ++i) x = std::min(x, a[i]);
        return x;
    }

    /// False when all rays are done.
    bool update_limit() {
        Rays last = -std::numeric_limits<T>::infinity();
        for (int g = 0; g < groups_; ++g) last = max(load(limit_of_, g), last);
        limit_ = largest(last);
        return limit_ >= from_;
    }

    /// True if some ray's hit has changed.
    bool meet_leaf(std::uint32_t child, const WideNode<T>& node, int lane, const PlaneOffsets& offsets) {
        const auto plane = [&](std::uint32_t offset) {
            return Rays(reinterpret_cast<const T*>(reinterpret_cast<const unsigned char*>(&node) + offset)[lane]);
        };
        const Rays near[3] = {plane(offsets.near[0]), plane(offsets.near[1]), plane(offsets.near[2])};
        const Rays far[3] = {plane(offsets.far[0]), plane(offsets.far[1]), plane(offsets.far[2])};
        int active[capacity / lanes], count = 0;
        for (int g = 0; g < groups_; ++g) {
            Rays entry = load(from_of_, g), exit = load(limit_of_, g);
            for (int k = 0; k < 3; ++k) {
                entry = max(multiply_add(near[k], load(scale_[k], g), load(near_shift_[k], g)), entry);
                exit = min(multiply_add(far[k], load(scale_[k], g), load(far_shift_[k], g)), exit);
            }
            active[count] = g;
            count += any(entry <= exit) ? 1 : 0;
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

    /// The test of triangle.hpp, with rays in the lanes.
    [[gnu::always_inline]] bool meet_triangle(const TriangleBlock<T>& block, int lane, int group) {
        const Rays ox = load(origin_[kx_], group), oy = load(origin_[ky_], group), oz = load(origin_[kz_], group);
        const Rays slope_x = load(slope_x_, group), slope_y = load(slope_y_, group);
        Rays x[3], y[3], z[3];
        for (int i = 0; i < 3; ++i) {
            z[i] = Rays(block.vertex[i][kz_][lane]) - oz;
            x[i] = exact_multiply_add(slope_x, z[i], Rays(block.vertex[i][kx_][lane]) - ox);
            y[i] = exact_multiply_add(slope_y, z[i], Rays(block.vertex[i][ky_][lane]) - oy);
        }
        const BlockHit<T, lanes> found = intersect_sheared<rules_of<Accept>(), T, lanes>(
            x, y, z, load(inverse_z_, group), load(t_min_, group), load(t_, group));
        unsigned hits = bits(found.mask);
        if (hits == 0) return false;
        bool changed = false;
        for (; hits != 0; hits &= hits - 1) {
            const int l = std::countr_zero(hits), i = group * lanes + l;
            if (!accept_(block.primitive[lane], found.u[l], found.v[l], found.t[l])) continue;
            t_[i] = found.t[l];
            u_[i] = found.u[l];
            v_[i] = found.v[l];
            primitive_[i] = block.primitive[lane];
            if constexpr (query == Query::any) {
                limit_of_[i] = t_[i] = -std::numeric_limits<T>::infinity(); // nothing is before that
            } else {
                limit_of_[i] = just_behind<T>(found.t[l] * along_[i]);
            }
            changed = true;
        }
        return changed;
    }

    const Tree& tree_;
    const Accept& accept_;
    int kind_ = 0, kx_ = 0, ky_ = 0, kz_ = 0, groups_ = 0;
    T near_origin_[3], far_origin_[3], least_scale_[3], most_scale_[3], from_, limit_;
    alignas(64) T origin_[3][capacity], direction_[3][capacity], t_min_[capacity];
    alignas(64) T scale_[3][capacity], near_shift_[3][capacity], far_shift_[3][capacity];
    alignas(64) T along_[capacity], from_of_[capacity], limit_of_[capacity];
    alignas(64) T slope_x_[capacity], slope_y_[capacity], inverse_z_[capacity];
    alignas(64) T t_[capacity], u_[capacity], v_[capacity];
    std::uint32_t primitive_[capacity];
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
