#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/simd.hpp>
#include <lambent/light/light_bounds.hpp>
#include <lambent/light/light_tree_split.hpp>
#include <lambent/sampling/hash.hpp>
#include <algorithm>
#include <bit>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Picks one of many lights for a point, by a bound on what each may contribute there: by intensity, distance,
/// the light's orientation and the surface's. A tree of eight-wide nodes, whose children are weighed together.
/// A light that can contribute is never left out.
/// source  Conty Estevez, Kulla, HPG 2018; distance and cone terms as in Pharr, Jakob, Humphreys, Physically Based
///         Rendering, 4th edition, 12.6.3. We differ: eight children at a time instead of two.
template <class T>
class LightTree {
public:
    /// A light that was chosen.
    struct Sample {
        std::uint32_t index = 0;
        T probability = 0; ///< pmf() of it; 0 where no light can contribute
        T u = 0;           ///< the part of u not yet used, in [0, 1)
    };

    LightTree() = default;

    /// One light each; those of no intensity are never picked. throws lambent::Error on more than 2^30
    /// cost  O(n log n); 60 bytes a light
    explicit LightTree(std::span<const LightBounds<T>> lights) {
        require(lights.size() <= (std::size_t(1) << 30),
                [&] { return "LightTree: " + std::to_string(lights.size()) + " lights, 2^30 are the most"; });
        trails_.assign(lights.size(), no_trail);
        std::vector<std::uint32_t> order;
        for (std::uint32_t i = 0; i < lights.size(); ++i)
            if (lights[i].intensity > 0) order.push_back(i);
        if (order.empty()) return;
        for (const std::uint32_t i : order) brightest_ = std::max(brightest_, lights[i].intensity);
        nodes_.reserve(order.size() / 4 + 1);
        build(lights, order, 0, 0);
    }

    bool empty() const { return nodes_.empty(); }
    std::size_t node_count() const { return nodes_.size(); }

    /// A light for `point` on a surface of unit `normal`, from whose side light is wanted; normal 0: from any side.
    /// u in [0, 1).
    Sample sample(const Vec3<T>& point, const Vec3<T>& normal, T u) const {
        Sample s;
        if (empty()) return s;
        T probability = 1;
        for (std::uint32_t node = 0;;) {
            const P shares = weigh(nodes_[node], point, normal);
            const T total = sum(shares);
            if (!(total > 0)) return s;
            T weights[width];
            shares.store(weights);
            const T target = u * total;
            T below = 0;
            unsigned left = bits(shares > P(T(0)));
            int lane = std::countr_zero(left); // the last one that starts at or before the target, and has a share
            while ((left &= left - 1) != 0 && below + weights[lane] <= target) {
                below += weights[lane];
                lane = std::countr_zero(left);
            }
            probability *= weights[lane] / total;
            u = std::clamp((target - below) / weights[lane], T(0), one_minus_epsilon<T>);
            const std::uint32_t child = nodes_[node].children[lane];
            if ((child & leaf_bit) == 0) {
                node = child;
                continue;
            }
            s.index = child & ~leaf_bit;
            s.probability = probability;
            s.u = u;
            return s;
        }
    }

    /// The chance that sample() picks this light for this point.
    T pmf(const Vec3<T>& point, const Vec3<T>& normal, std::uint32_t light) const {
        std::uint64_t trail = trails_[light];
        if (trail == no_trail) return 0;
        T probability = 1;
        for (std::uint32_t node = 0;; trail >>= lane_bits) {
            const P shares = weigh(nodes_[node], point, normal);
            const auto lane = int(trail & (width - 1));
            if (!(shares[lane] > 0)) return 0;
            probability *= shares[lane] / sum(shares);
            const std::uint32_t child = nodes_[node].children[lane];
            if ((child & leaf_bit) != 0) return probability;
            node = child;
        }
    }

private:
    static constexpr int width = 8, lane_bits = 3;
    static constexpr std::uint32_t leaf_bit = 0x80000000u;
    static constexpr std::uint64_t no_trail = ~std::uint64_t(0); // deeper than any tree
    using P = Pack<T, width>;

    /// Bounds of eight children, a lane each; an empty lane has no intensity.
    struct alignas(64) Node {
        T center[3][width], radius2[width]; ///< sphere around the box
        T axis[3][width], cos_normals[width], sin_normals[width], cos_emission[width];
        T intensity[width];                 ///< below 0 of lights that shine both ways
        std::uint32_t children[width];      ///< a node, or with leaf_bit a light
    };

    /// Bound on the contribution of each child, up to a common factor.
    /// An angle less another, not below 0, is worked out by its cosine and sine.
    static P weigh(const Node& node, const Vec3<T>& point, const Vec3<T>& normal) {
        const P zero(T(0)), one(T(1));
        const P x = P(point.x) - P::load(node.center[0]), y = P(point.y) - P::load(node.center[1]),
                z = P(point.z) - P::load(node.center[2]); // from the light to the point
        const P distance2 = multiply_add(x, x, multiply_add(y, y, z * z)), radius2 = P::load(node.radius2);
        const auto inside = distance2 <= radius2;
        const P per_length = one / sqrt(max(distance2, P(std::numeric_limits<T>::min())));
        const P sin2_size = min(radius2 * per_length * per_length, one); // of the angle that the sphere fills
        const P sin_size = sqrt(sin2_size), cos_size = sqrt(one - sin2_size);

        const P intensity = P::load(node.intensity), axis_x = P::load(node.axis[0]), axis_y = P::load(node.axis[1]),
                axis_z = P::load(node.axis[2]);
        P cosine = multiply_add(x, axis_x, multiply_add(y, axis_y, z * axis_z)) * per_length;
        cosine = max(min(cosine, one), -one);
        cosine = select(intensity < zero, abs(cosine), cosine);
        const P sine = sqrt(one - cosine * cosine);
        const P cos_normals = P::load(node.cos_normals), sin_normals = P::load(node.sin_normals);
        const auto among_normals = cosine >= cos_normals;
        const P cos_from = select(among_normals, one, multiply_add(cosine, cos_normals, sine * sin_normals));
        const P sin_from = select(among_normals, zero, sine * cos_normals - cosine * sin_normals);
        const P cos_least = multiply_add(cos_from, cos_size, sin_from * sin_size);
        const P emitted = select(inside | (cos_from >= cos_size), one, cos_least);
        const P dark = P::load(node.cos_emission);

        P weight = abs(intensity) / max(max(distance2, radius2), P(T(1e-24))) * emitted;
        weight = select((emitted > zero) & (emitted > dark), weight, zero);
        if (!is_black(normal)) {
            P cos_in = multiply_add(x, P(-normal.x), multiply_add(y, P(-normal.y), z * P(-normal.z))) * per_length;
            cos_in = max(min(cos_in, one), -one);
            const P sin_in = sqrt(one - cos_in * cos_in);
            const P received = select(inside | (cos_in >= cos_size), one, multiply_add(cos_in, cos_size, sin_in * sin_size));
            weight = select(received > zero, weight * received, zero);
        }
        return weight;
    }

    /// Makes the node of these lights and all below it, which come after it. Returns its bounds.
    LightBounds<T> build(std::span<const LightBounds<T>> lights, std::span<std::uint32_t> order, std::uint64_t trail,
                         int level) {
        const auto index = std::uint32_t(nodes_.size());
        nodes_.push_back({});
        LightBounds<T> all;
        std::size_t first = 0;
        const auto groups = detail::split_lights<T, width>(lights, order, level < last_shaped_level);
        for (std::size_t lane = 0; lane < groups.count; ++lane) {
            const auto group = order.subspan(first, groups.size[lane]);
            first += group.size();
            const std::uint64_t here = trail | std::uint64_t(lane) << (lane_bits * level);
            std::uint32_t child = leaf_bit | group[0];
            LightBounds<T> bounds = lights[group[0]];
            if (group.size() > 1) {
                child = std::uint32_t(nodes_.size());
                bounds = build(lights, group, here, level + 1);
            } else {
                trails_[group[0]] = here;
            }
            set_lane(nodes_[index], lane, bounds, child);
            all = unite(all, bounds);
        }
        return all;
    }

    void set_lane(Node& node, std::size_t lane, const LightBounds<T>& b, std::uint32_t child) const {
        const Vec3<T> center = b.box.center(), half = b.box.size() / T(2);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            node.center[axis][lane] = center[int(axis)];
            node.axis[axis][lane] = b.axis[int(axis)];
        }
        node.radius2[lane] = dot(half, half) * (1 + gamma_bound<T>(16));
        node.cos_normals[lane] = b.cos_normals;
        node.sin_normals[lane] = safe_sqrt(1 - b.cos_normals * b.cos_normals);
        node.cos_emission[lane] = b.cos_emission;
        const T intensity = std::max(b.intensity / brightest_, T(1e-20)); // so that no weight overflows or vanishes
        node.intensity[lane] = b.sides == LightBounds<T>::Sides::both ? -intensity : intensity;
        node.children[lane] = child;
    }

    /// From this level on groups are of equal size, so that a trail has room for any number of lights.
    static constexpr int last_shaped_level = 10;

    T brightest_ = 0;
    std::vector<Node> nodes_;
    std::vector<std::uint64_t> trails_; ///< of each light: the lanes on the way to it, the root's lowest
};

} // namespace LAMBENT_ABI
} // namespace lambent
