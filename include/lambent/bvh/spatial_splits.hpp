#pragma once
#include <lambent/bvh/builders.hpp>
#include <lambent/bvh/primitive.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/simd.hpp>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Cuts triangles at planes where their boxes would overlap too much otherwise: each part is a reference of its own,
/// with the box of what lies on its side. For BinnedBuilder.
///
/// No surface is lost: the exact parts of a triangle lie inside of the boxes of its references. Cutting rounds; so
/// boxes of parts are widened by more than what cutting can be off, and then cut to the box that is divided. A ray
/// meets a part's box at the distance that the triangle test reports: that distance is, up to the margin of SlabRay,
/// the depth of a point of the triangle, namely of the one with the weights that the test computed.
/// source  Stich, Friedrich, Dietrich, "Spatial splits in bounding volume hierarchies" (2009)
template <class Set>
class SpatialSplits {
public:
    using T = typename Set::Scalar;
    static constexpr bool possible = true;

    /// box  of all triangles
    SpatialSplits(const Set& set, const PackBox<T>& box) : set_(&set), scene_area_(box.half_area()) {}

    /// Places for n references and what is made of them; no more than 2^30, so that depths stay bounded as they are.
    static std::uint32_t room(std::uint32_t n) {
        return std::uint32_t(std::min<std::uint64_t>(n + n / 2ull, 1u << 30));
    }

    /// Where a plane in space is cheaper than `cost`, moves the references [begin, end) to the two ends of [to,
    /// to_end) and fills in the halves; else returns false with the halves as they were.
    /// box     of the references
    /// halves  of the best split without cuts; their boxes tell whether there is something to gain
    bool split(const Reference<T>* begin, const Reference<T>* end, Reference<T>* to, Reference<T>* to_end,
               const PackBox<T>& box, T cost, Halves<T>& halves) {
        const std::uint32_t count = std::uint32_t(end - begin);
        if (count < least_count || to_end - to == end - begin) return false;
        if (cost < std::numeric_limits<T>::max()) {
            PackBox<T> overlap = halves.box[0];
            overlap.intersect(halves.box[1]);
            const T least = std::max(scene_area_ * least_of_scene, box.half_area() * least_of_node);
            if (overlap.empty() || !(overlap.half_area() > least)) return false;
        }
        const Plane plane = find_plane(begin, end, box);
        if (plane.axis < 0 || !(plane.cost < cost * least_gain) || plane.count[0] >= count || plane.count[1] >= count ||
            std::ptrdiff_t(plane.count[0]) + std::ptrdiff_t(plane.count[1]) > to_end - to)
            return false;
        Halves<T> result;
        divide(begin, end, to, to_end, plane, result);
        if (result.count[0] == 0 || result.count[1] == 0) return false;
        halves = result;
        return true;
    }

private:
    // Measured in three buildings: rays are as fast as with all cuts that pay by the heuristic, at a third of the
    // build's time and half the duplicates.
    static constexpr std::uint32_t least_count = 8;
    static constexpr T least_of_scene = T(3e-4), least_of_node = T(0.2); ///< overlap, as shares of their areas
    static constexpr T least_gain = T(0.95);
    static constexpr int max_bins = 16;
    using Lanes = Pack<T, 4>;
    using Corners = std::array<Lanes, 3>;

    struct Bin {
        PackBox<T> box;
        std::uint32_t enter = 0, leave = 0; ///< references whose first, whose last bin it is
    };

    /// Bins of equal size along each axis; an axis with scale 0 has one bin only.
    struct Binning {
        Lanes origin, scale, size, last;

        /// By axis, before the fraction is cut off. The same bits wherever it is compiled in: numbers are counted
        /// before references are moved.
        Lanes of(Lanes x) const { return min(opaque(max(opaque(x - origin) * scale, Lanes(T(0)))), last); }
        /// Between bin and bin + 1.
        T plane(int axis, int bin) const { return origin[axis] + T(bin + 1) * size[axis]; }
    };

    struct Plane {
        Binning binning;
        int axis = -1, bin = 0; ///< references wholly in bins up to this one go left
        T cost = std::numeric_limits<T>::max();
        PackBox<T> box[2];
        std::uint32_t count[2] = {};
    };

    static PackBox<T> united(PackBox<T> a, const PackBox<T>& b) {
        a.add(b);
        return a;
    }
    static Lanes lanes(const Vec3<T>& v) {
        Lanes p = T(0);
        for (int k = 0; k < 3; ++k) p.set(k, v[k]);
        return p;
    }

    static PackBox<T> point(Lanes p) { return {p, -p}; }

    Corners corners(const Reference<T>& r) const {
        const std::array<Vec3<T>, 3> p = set_->vertices(r.primitive());
        return {lanes(p[0]), lanes(p[1]), lanes(p[2])};
    }

    /// The boxes of what of `box` and its triangle lies on either side of the plane; at least one is not empty.
    static void cut(const Corners& p, const PackBox<T>& box, int axis, T plane, PackBox<T>* parts) {
        parts[0] = parts[1] = {};
        PackBox<T> crossings;
        for (int i = 0; i < 3; ++i) {
            const Lanes a = p[std::size_t(i)], b = p[i == 2 ? 0u : std::size_t(i + 1)];
            const T from = a[axis], to = b[axis];
            if (from <= plane) parts[0].add(point(a));
            if (from >= plane) parts[1].add(point(a));
            if ((from < plane && plane < to) || (to < plane && plane < from)) {
                Lanes c = a + (b - a) * Lanes((plane - from) / (to - from));
                c.set(axis, plane);
                crossings.add(point(c));
            }
        }
        // A crossing is off by 6 rounding units of its edge's extent and one of its own size, also where a division
        // becomes a product and products are fused.
        constexpr T eps = std::numeric_limits<T>::epsilon();
        const Lanes low = min(p[0], min(p[1], p[2])), high = max(p[0], max(p[1], p[2]));
        const Lanes margin = (high - low) * Lanes(8 * eps) + max(-low, high) * Lanes(2 * eps);
        crossings = crossings + PackBox<T>(-margin, -margin);
        for (int side = 0; side < 2; ++side) {
            parts[side].add(crossings);
            parts[side].intersect(box);
        }
        if (parts[0].empty() && parts[1].empty()) parts[0] = box;
    }

    /// Adds to the bins from `first` to `last` along an axis what of `box` and its triangle lies in each; roughly:
    /// costs hang on it, and nothing else.
    void chop(const Corners& p, const PackBox<T>& box, const Binning& binning, int axis, int first, int last) {
        PackBox<T>* const part = part_;
        for (int k = first; k <= last; ++k) part[k] = {};
        const T origin = binning.origin[axis], scale = binning.scale[axis], size = binning.size[axis];
        for (int i = 0; i < 3; ++i) {
            Lanes a = p[std::size_t(i)], b = p[i == 2 ? 0u : std::size_t(i + 1)];
            if (b[axis] < a[axis]) std::swap(a, b);
            const auto bin_of = [&](T x) {
                const T bin = (x - origin) * scale;
                return bin > T(first - 1) ? (bin < T(last + 1) ? int(bin) : last + 1) : first - 1;
            };
            const int from = bin_of(a[axis]), to = bin_of(b[axis]);
            if (from >= first && from <= last) part[from].add(point(a));
            if (to >= first && to <= last) part[to].add(point(b));
            if (from == to) continue;
            const Lanes slope = (b - a) * Lanes(T(1) / (b[axis] - a[axis]));
            for (int k = from; k < to; ++k) {
                const PackBox<T> c = point(a + slope * Lanes(origin + T(k + 1) * size - a[axis]));
                if (k >= first) part[k].add(c);
                if (k < last) part[k + 1].add(c);
            }
        }
        for (int k = first; k <= last; ++k) {
            part[k].intersect(box);
            if (!part[k].empty()) bin_[axis][k].box.add(part[k]);
        }
    }

    Plane find_plane(const Reference<T>* begin, const Reference<T>* end, const PackBox<T>& box) {
        const int bins = std::min(max_bins, 4 + int((end - begin) / 4));
        Plane best;
        Binning& binning = best.binning;
        binning.origin = box.low();
        const Lanes extent = -box.minus_size();
        binning.size = extent * Lanes(T(1) / T(bins));
        binning.scale = Lanes(T(bins)) / extent;
        binning.last = T(bins - 1);
        for (int axis = 0; axis < 4; ++axis)
            if (axis == 3 || !(extent[axis] > 0) || !is_finite(binning.scale[axis])) binning.scale.set(axis, 0);
        binning.origin.set(3, 0);
        for (int axis = 0; axis < 3; ++axis)
            for (int i = 0; i < bins; ++i) bin_[axis][i] = {};
        for (const Reference<T>* r = begin; r != end; ++r) {
            const PackBox<T> whole = r->box();
            const auto first = convert<std::int32_t>(binning.of(whole.low())),
                       last = convert<std::int32_t>(binning.of(-whole.minus_high()));
            Corners p{};
            bool known = false;
            for (int axis = 0; axis < 3; ++axis) {
                const int from = first[axis], to = last[axis];
                ++bin_[axis][from].enter;
                ++bin_[axis][to].leave;
                if (from == to) {
                    bin_[axis][from].box.add(whole);
                } else {
                    if (!known) p = corners(*r);
                    known = true;
                    chop(p, whole, binning, axis, from, to);
                }
            }
        }
        for (int axis = 0; axis < 3; ++axis) {
            if (!(binning.scale[axis] > 0)) continue;
            std::array<PackBox<T>, max_bins> right;
            PackBox<T> side;
            for (int i = bins - 1; i > 0; --i) {
                side.add(bin_[axis][i].box);
                right[std::size_t(i)] = side;
            }
            side = {};
            std::uint32_t count[2] = {0, std::uint32_t(end - begin)};
            for (int i = 0; i + 1 < bins; ++i) {
                side.add(bin_[axis][i].box);
                count[0] += bin_[axis][i].enter;
                count[1] -= bin_[axis][i].leave;
                const PackBox<T>& other = right[std::size_t(i + 1)];
                if (count[0] == 0 || count[1] == 0) continue;
                const T cost = side.half_area() * blocks(T(count[0])) + other.half_area() * blocks(T(count[1]));
                if (!(cost < best.cost)) continue;
                best.axis = axis;
                best.bin = i;
                best.cost = cost;
                best.box[0] = side;
                best.box[1] = other;
                best.count[0] = count[0];
                best.count[1] = count[1];
            }
        }
        return best;
    }

    /// A reference across the plane is cut, or left whole on one side where that is cheaper.
    void divide(const Reference<T>* begin, const Reference<T>* end, Reference<T>* to, Reference<T>* to_end,
                const Plane& plane, Halves<T>& halves) const {
        Reference<T>* left = to;
        Reference<T>* right = to_end;
        const auto put = [&](const Reference<T>& r, const PackBox<T>& box, int side) {
            Reference<T>& place = side == 0 ? *left++ : *--right;
            box.store(&place);
            place.name = r.name;
            place.unused = 0;
            halves.box[side].add(box);
            halves.centers[side].add(box.center());
        };
        PackBox<T> sides[2] = {plane.box[0], plane.box[1]};
        T count[2] = {T(plane.count[0]), T(plane.count[1])};
        const T position = plane.binning.plane(plane.axis, plane.bin);
        const unsigned axis_bit = 1u << plane.axis;
        const Lanes limit = T(plane.bin + 1);
        for (const Reference<T>* r = begin; r != end; ++r) {
            const PackBox<T> box = r->box();
            if ((bits(plane.binning.of(-box.minus_high()) < limit) & axis_bit) != 0) {
                put(*r, box, 0);
            } else if ((bits(plane.binning.of(box.low()) < limit) & axis_bit) == 0) {
                put(*r, box, 1);
            } else {
                PackBox<T> parts[2];
                cut(corners(*r), box, plane.axis, position, parts);
                const T area[2] = {sides[0].half_area(), sides[1].half_area()};
                const T both = area[0] * blocks(count[0]) + area[1] * blocks(count[1]);
                const T only_left =
                    united(sides[0], box).half_area() * blocks(count[0]) + area[1] * blocks(count[1] - 1);
                const T only_right =
                    area[0] * blocks(count[0] - 1) + united(sides[1], box).half_area() * blocks(count[1]);
                if (parts[1].empty() || (only_left <= both && only_left <= only_right)) {
                    sides[0].add(box);
                    count[1] -= 1;
                    put(*r, box, 0);
                } else if (parts[0].empty() || only_right <= both) {
                    sides[1].add(box);
                    count[0] -= 1;
                    put(*r, box, 1);
                } else {
                    put(*r, parts[0], 0);
                    put(*r, parts[1], 1);
                }
            }
        }
        halves.count[0] = std::uint32_t(left - to);
        halves.count[1] = std::uint32_t(to_end - right);
    }

    const Set* set_;
    T scene_area_;
    Bin bin_[3][max_bins];
    PackBox<T> part_[max_bins];
};

/// The binary tree of a set by the quality asked for.
template <class Leaves, class Set, class E>
BinaryTree<typename Leaves::Scalar> build_binary(const Set& set, const BuildOptions& options, E& executor) {
    using T = typename Leaves::Scalar;
    if constexpr (TriangleSet<Set>) {
        if (options.quality == BuildQuality::best)
            return build_binary<Leaves>(set, options, executor,
                                        [&](const PackBox<T>& box) { return SpatialSplits<Set>(set, box); });
    }
    return build_binary<Leaves>(set, options, executor, [](const PackBox<T>&) { return NoSplits{}; });
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
