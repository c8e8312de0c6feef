#pragma once
#include <lambent/bvh/traverse.hpp>
#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>

/// What the ways to trace many rays together share: rays of a kind, side by side in a register's lanes, and the
/// intervals that hold all of them.
namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Which way a ray goes, by the signs of its direction and its largest axis: rays of one kind may go together.
template <class T>
struct RayKind {
    static constexpr int count = 24; ///< also the kind of a ray that hits nothing

    [[gnu::always_inline]] static int of(const Ray<T>& ray) {
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
        return usable ? int(signs | axis << 3) : count;
    }

    static const PlaneOffsets& plane(int kind) { return plane_offsets<T>[std::size_t(kind & 7)]; }
    /// Where the axes of a ray's own frame lie in ours; see ShearedRay.
    struct Axes {
        int x, y, z;
    };
    static Axes axes(int kind) {
        const int z = kind >> 3;
        return {(z + 1) % 3, (z + 2) % 3, z};
    }
};

/// The rows of a node's planes that rays of a kind enter and leave through.
template <class T>
struct NodeRows {
    const T *near[3], *far[3];

    NodeRows(const WideNode<T>& node, const PlaneOffsets& plane) {
        const auto row = [&](std::uint32_t offset) {
            return reinterpret_cast<const T*>(reinterpret_cast<const unsigned char*>(&node) + offset);
        };
        for (int k = 0; k < 3; ++k) {
            near[k] = row(plane.near[k]);
            far[k] = row(plane.far[k]);
        }
    }
};

/// How many rays go in one register. Under -ffast-math compilers divide sixteen floats with another precision than four or
/// eight, and rays would not have their own answers.
template <class T>
inline constexpr int group_lanes =
#if defined(__FAST_MATH__)
    std::min(8, native_width<T>);
#else
    native_width<T>;
#endif

/// N rays of one kind: boxes and triangles are tested against all of them at once, with the arithmetic of a single
/// ray's tests (SlabRay, ShearedRay), so with its answers to the bit.
template <class T, int N>
struct RayGroup {
    using Rays = Pack<T, N>;
    Rays origin[3], direction[3], t_min, t_max;
    Rays scale[3], near_shift[3], far_shift[3], along, from, limit; ///< as in SlabRay
    Rays slope_x, slope_y, inverse_z;                               ///< as in ShearedRay
    Rays reach; ///< from the origin to the farthest plane of the scene's box

    /// ray_of(i) for i < N
    template <class Tree, class RayOf>
    void take(const Tree& tree, int kind, const RayOf& ray_of) {
        transpose(ray_of);
        constexpr T u = std::numeric_limits<T>::epsilon() / 2, limit_scale = steepest<T>;
        const auto axes = RayKind<T>::axes(kind);
        along = abs(direction[axes.z]);
        reach = T(0);
        for (int k = 0; k < 3; ++k)
            reach = max(abs(origin[k] - Rays(tree.center[k])) + Rays(tree.half_size[k]), reach);
        for (int k = 0; k < 3; ++k) {
            const Rays o = origin[k], d = direction[k];
            scale[k] = select(abs(d) * Rays(limit_scale) > along, along / d, copysign(Rays(limit_scale), d));
            const Rays shift = -o * scale[k];
            const Rays margin = multiply_add(Rays(4 * u), abs(o), Rays(tree.margin * u) * reach) * abs(scale[k]);
            near_shift[k] = shift - margin;
            far_shift[k] = shift + margin;
        }
        from = just_before<T>(t_min * along);
        limit = just_behind<T>(t_max * along);
        // No compiler may make one reciprocal of the three: they are the single ray's to the bit, under -ffast-math too.
        const Rays dz = direction[axes.z];
        slope_x = -direction[axes.x] / opaque(dz);
        slope_y = -direction[axes.y] / opaque(dz);
        inverse_z = Rays(T(1)) / opaque(dz);
    }

    /// The planes of a node's i-th child, in all lanes.
    struct Box {
        Rays near[3], far[3];

        Box(const NodeRows<T>& rows, int i)
            : near{rows.near[0][i], rows.near[1][i], rows.near[2][i]},
              far{rows.far[0][i], rows.far[1][i], rows.far[2][i]} {}
    };

    /// Which of the rays meet the box where there is interest.
    [[gnu::always_inline]] Mask<T, N> meet(const Box& box) const {
        Rays entry = from, exit = limit;
        for (int k = 0; k < 3; ++k) {
            entry = max(multiply_add(box.near[k], scale[k], near_shift[k]), entry);
            exit = min(multiply_add(box.far[k], scale[k], far_shift[k]), exit);
        }
        return entry <= exit;
    }

    /// Where the rays meet a block's i-th triangle.
    template <HitRules rules, RangeEnd end>
    [[gnu::always_inline]] BlockHit<T, N> meet(const TriangleBlock<T>& block, int i,
                                               const typename RayKind<T>::Axes& axes) const {
        const Rays ox = origin[axes.x], oy = origin[axes.y], oz = origin[axes.z];
        Rays x[3], y[3], z[3];
        for (int v = 0; v < 3; ++v) {
            z[v] = Rays(block.vertex[v][axes.z][i]) - oz;
            x[v] = exact_multiply_add(slope_x, z[v], Rays(block.vertex[v][axes.x][i]) - ox);
            y[v] = exact_multiply_add(slope_y, z[v], Rays(block.vertex[v][axes.y][i]) - oy);
        }
        return intersect_sheared<rules, end>(x, y, z, inverse_z, t_min, t_max);
    }

private:
    /// Four rays at a time, since numbers stored one by one are slow to be loaded side by side.
    template <class RayOf>
    void transpose(const RayOf& ray_of) {
        static_assert(sizeof(Ray<T>) == 8 * sizeof(T));
        using Four = Pack<T, 4>;
        alignas(64) T numbers[8][std::size_t(N)];
        for (int i = 0; i < N; i += 4) {
            Four rows[2][4];
            for (int r = 0; r < 4; ++r) {
                const Ray<T> ray = ray_of(i + r);
                std::memcpy(&rows[0][r].v, &ray, sizeof(Four));
                std::memcpy(&rows[1][r].v, reinterpret_cast<const unsigned char*>(&ray) + sizeof(Four), sizeof(Four));
            }
            for (int half = 0; half < 2; ++half) {
                const auto& r = rows[half];
                const auto a = __builtin_shufflevector(r[0].v, r[1].v, 0, 4, 1, 5);
                const auto b = __builtin_shufflevector(r[2].v, r[3].v, 0, 4, 1, 5);
                const auto c = __builtin_shufflevector(r[0].v, r[1].v, 2, 6, 3, 7);
                const auto d = __builtin_shufflevector(r[2].v, r[3].v, 2, 6, 3, 7);
                auto* const to = numbers + 4 * half;
                Four(__builtin_shufflevector(a, b, 0, 1, 4, 5)).store(to[0] + i);
                Four(__builtin_shufflevector(a, b, 2, 3, 6, 7)).store(to[1] + i);
                Four(__builtin_shufflevector(c, d, 0, 1, 4, 5)).store(to[2] + i);
                Four(__builtin_shufflevector(c, d, 2, 3, 6, 7)).store(to[3] + i);
            }
        }
        for (int k = 0; k < 3; ++k) {
            origin[k] = Rays::load(numbers[k]);
            direction[k] = Rays::load(numbers[3 + k]);
        }
        t_min = Rays::load(numbers[6]);
        t_max = Rays::load(numbers[7]);
    }
};

/// Where rays of one kind start, how steep they are, and where of interest: intervals that hold all of them.
/// source  Boulos, Wald, Shirley, "Geometric and arithmetic culling methods for entire ray packets" (2006)
template <class T>
struct RayIntervals {
    T near_origin[3], far_origin[3], least_scale[3], most_scale[3], from, limit;
    T spread; ///< how much slopes differ, and how far origins lie apart

    template <class Tree, int N>
    RayIntervals(const Tree& tree, int kind, const RayGroup<T, N>* groups, int count) {
        constexpr T u = std::numeric_limits<T>::epsilon() / 2, inf = std::numeric_limits<T>::infinity();
        using Rays = Pack<T, N>;
        Rays least_o[3], most_o[3], least_d[3], most_d[3], least_s[3], most_s[3];
        Rays most_pad = T(0), first = inf, last = -inf;
        for (int k = 0; k < 3; ++k) {
            least_o[k] = least_d[k] = least_s[k] = inf;
            most_o[k] = most_d[k] = most_s[k] = -inf;
        }
        for (int g = 0; g < count; ++g) {
            const RayGroup<T, N>& group = groups[g];
            Rays size = T(0);
            for (int k = 0; k < 3; ++k) {
                const Rays o = group.origin[k], s = group.scale[k], slope = group.direction[k] / group.along;
                size = max(abs(o), size);
                least_o[k] = min(o, least_o[k]);
                most_o[k] = max(o, most_o[k]);
                least_s[k] = min(s, least_s[k]);
                most_s[k] = max(s, most_s[k]);
                least_d[k] = min(slope, least_d[k]);
                most_d[k] = max(slope, most_d[k]);
            }
            most_pad = max(multiply_add(Rays(12 * u), size, Rays((tree.margin + 8) * u) * group.reach), most_pad);
            first = min(group.from, first);
            last = max(group.limit, last);
        }
        const T pad = largest(most_pad), size = tree.half_size[0] + tree.half_size[1] + tree.half_size[2];
        from = smallest(first);
        limit = largest(last);
        spread = 0;
        for (int k = 0; k < 3; ++k) {
            const T o0 = smallest(least_o[k]), o1 = largest(most_o[k]);
            const bool negative = (kind >> k & 1) != 0;
            near_origin[k] = negative ? o0 - pad : o1 + pad;
            far_origin[k] = negative ? o1 + pad : o0 - pad;
            least_scale[k] = smallest(least_s[k]);
            most_scale[k] = largest(most_s[k]);
            spread = std::max(spread, std::max(largest(most_d[k]) - smallest(least_d[k]), 4 * (o1 - o0) / size));
        }
    }

    /// Which children some of the rays may meet; where the first may enter each.
    [[gnu::always_inline]] Mask<T, node_width<T>> meets(const NodeRows<T>& rows, Pack<T, node_width<T>>& entry) const {
        using Lanes = Pack<T, node_width<T>>;
        entry = from;
        Lanes exit = limit;
        for (int k = 0; k < 3; ++k) {
            const Lanes near = Lanes::load(rows.near[k]) - Lanes(near_origin[k]);
            const Lanes far = Lanes::load(rows.far[k]) - Lanes(far_origin[k]);
            const Lanes least = least_scale[k], most = most_scale[k];
            entry = max(min(near * least, near * most), entry);
            exit = min(max(far * least, far * most), exit);
        }
        return entry <= exit;
    }
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
