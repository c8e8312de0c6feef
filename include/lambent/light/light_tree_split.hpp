#pragma once
#include <lambent/core/bounds.hpp>
#include <lambent/light/light_bounds.hpp>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Sums over lights from which the cost of a group follows: intensity times the spread of places times the spread of
/// directions. The latter from the length of the mean normal, which is (1 + cos) / 2 of a full cone: sums
/// are quicker than cones.
template <class T>
struct LightGroup {
    Bounds3<T> box;
    Vec3<T> normals{0}; ///< each times its intensity
    T intensity = 0;
    std::size_t count = 0;

    void add(const LightBounds<T>& light) {
        box.add(light.box);
        intensity += light.intensity;
        Vec3<T> n = light.axis;
        if (light.sides == LightBounds<T>::Sides::both && n[largest_axis(n)] < 0) n = -n;
        normals += n * (light.intensity * (1 + light.cos_normals) / 2);
        ++count;
    }
    void add(const LightGroup& g) {
        box.add(g.box);
        normals += g.normals;
        intensity += g.intensity;
        count += g.count;
    }
    T cost() const {
        if (count == 0) return 0;
        const T mean = std::min(length(normals) / intensity, T(1));
        const T solid_angle = 2 - 2 * mean + T(0.5); // of the normals, and some for the cosine around them
        const Vec3<T> d = box.size();
        return intensity * solid_angle * dot(d, d);
    }
};

template <class T, int width>
struct LightSplit {
    std::array<std::size_t, std::size_t(width)> size{}; ///< of consecutive groups
    std::size_t count = 0;
};

/// Cuts a group in two and orders it accordingly; returns the first part's size. Where centres coincide, or on request,
/// in halves.
template <class T>
std::size_t cut_lights(std::span<const LightBounds<T>> lights, std::span<std::uint32_t> order, bool shaped) {
    constexpr int bins = 16;
    Bounds3<T> centers;
    for (const std::uint32_t i : order) centers.add(lights[i].box.center());
    const Vec3<T> extent = centers.size();
    const int longest = largest_axis(extent);
    T best_cost = std::numeric_limits<T>::infinity();
    int best_axis = -1, best_bin = 0;
    const auto bin_of = [&](std::uint32_t i, int axis) {
        const T along = (lights[i].box.center()[axis] - centers.min[axis]) / extent[axis];
        return std::clamp(int(along * bins), 0, bins - 1);
    };
    for (int axis = 0; axis < 3 && shaped; ++axis) {
        if (!(extent[axis] > 0)) continue;
        std::array<LightGroup<T>, bins> binned;
        for (const std::uint32_t i : order) binned[std::size_t(bin_of(i, axis))].add(lights[i]);
        std::array<T, bins> right{};
        LightGroup<T> sum;
        for (std::size_t b = bins; b-- > 1;) {
            sum.add(binned[b]);
            right[b] = sum.cost();
        }
        sum = {};
        for (std::size_t b = 1; b < bins; ++b) {
            sum.add(binned[b - 1]);
            if (sum.count == 0 || sum.count == order.size()) continue;
            const T cost = (sum.cost() + right[b]) * (extent[longest] / extent[axis]); // against thin slabs
            if (cost < best_cost) best_cost = cost, best_axis = axis, best_bin = int(b);
        }
    }
    if (best_axis >= 0) {
        const auto middle = std::partition(order.begin(), order.end(),
                                           [&](std::uint32_t i) { return bin_of(i, best_axis) < best_bin; });
        const auto size = std::size_t(middle - order.begin());
        if (size > 0 && size < order.size()) return size;
    }
    const auto half = std::ptrdiff_t(order.size() / 2);
    std::nth_element(order.begin(), order.begin() + half, order.end(), [&](std::uint32_t a, std::uint32_t b) {
        const T x = lights[a].box.center()[longest], y = lights[b].box.center()[longest];
        return x < y || (x == y && a < b);
    });
    return std::size_t(half);
}

/// Cuts lights into up to `width` groups, always the dearest one next.
template <class T, int width>
LightSplit<T, width> split_lights(std::span<const LightBounds<T>> lights, std::span<std::uint32_t> order, bool shaped) {
    LightSplit<T, width> split;
    std::array<T, std::size_t(width)> cost{};
    const auto cost_of = [&](std::span<const std::uint32_t> group) {
        if (group.size() < 2) return T(-1);
        if (!shaped) return T(group.size());
        LightGroup<T> sum;
        for (const std::uint32_t i : group) sum.add(lights[i]);
        return sum.cost();
    };
    split.size[0] = order.size();
    split.count = 1;
    cost[0] = cost_of(order);
    while (split.count < width) {
        const auto dearest = std::size_t(std::max_element(cost.begin(), cost.begin() + std::ptrdiff_t(split.count)) - cost.begin());
        if (cost[dearest] < 0) break; // single lights all of them
        std::size_t first = 0;
        for (std::size_t i = 0; i < dearest; ++i) first += split.size[i];
        const auto group = order.subspan(first, split.size[dearest]);
        const std::size_t left = cut_lights(lights, group, shaped);
        for (std::size_t i = split.count; i > dearest + 1; --i) {
            split.size[i] = split.size[i - 1];
            cost[i] = cost[i - 1];
        }
        split.size[dearest + 1] = group.size() - left;
        split.size[dearest] = left;
        cost[dearest] = cost_of(group.first(left));
        cost[dearest + 1] = cost_of(group.subspan(left));
        ++split.count;
    }
    return split;
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
