#pragma once
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/bilateral_weights.hpp>
#include <lambent/film/region.hpp>
#include <algorithm>
#include <cstddef>
#include <vector>

/// One pass of the separable cross-bilateral filter, along rows or along columns.
namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

enum class LineDirection { rows, columns };
enum class WeightUse { once, twice }; ///< twice: the weight of a pair serves both of its pixels

/// A register's width of neighbouring lines, side by side: lane l of pack i is pixel i of line l. So all taps
/// are aligned loads, and a line's result does not depend on how wide a register is. Holds as much of the lines at a
/// time as stays in the second cache.
template <class T>
class LineStrip {
public:
    using P = FeaturePack<T>;

    /// `kernel` has an odd size.
    LineStrip(const std::vector<T>& kernel, const FeatureList<T>& features)
        : kernel_(kernel), channels_(features.channels()), radius_(int(kernel.size()) / 2), step_(std::max(128, 2 * radius_)),
          capacity_(step_ + 2 * radius_ + 1), pair_(features, radius_ + 1), planes_(plane_stride<T>(capacity_)),
          memory_(std::size_t(PackedPixels<T>::planes(features) + 4) * planes_, T(0)),
          pixels_{memory_.data() + 4 * planes_, std::ptrdiff_t(planes_)}, sums_{memory_.data(), std::ptrdiff_t(planes_)} {}

    /// Filters pixels [first, last) with taps from [tap_first, tap_last). import(pixels, i, count) writes `count` pixels
    /// from i on of all lines; store(i, sum, usable) takes the sums of pixel i.
    template <class Import, class Store>
    void filter(WeightUse use, int first, int last, int tap_first, int tap_last, Import&& import, Store&& store) {
        const bool twice = use == WeightUse::twice;
        // With `twice`, pixels before the first give to it though their own sums are not wanted.
        const int start = twice ? std::max(tap_first, first - radius_) : first;
        base_ = imported_ = std::max(tap_first, start - (twice ? 0 : radius_));
        std::fill_n(memory_.begin(), 4 * planes_, T(0));
        for (int from = start; from < last; from += step_) {
            const int to = std::min(last, from + step_);
            forget(std::max(base_, from - (twice ? 0 : radius_)));
            const int needed = std::min(tap_last, to + radius_);
            if (needed > imported_) {
                import(PackedPixels<T>{pixels_.values(imported_ - base_), pixels_.stride}, imported_, needed - imported_);
                pixels_.drop_non_finite(channels_, imported_ - base_, needed - base_);
                imported_ = needed;
            }
            for (int i = from; i < to; i += 2)
                if (twice) filter_pairs(i, std::min(i + 2, to), first, tap_last, store);
                else filter_each(i, std::min(i + 2, to), tap_first, tap_last, store);
        }
    }

private:
    /// Moves the pixels from `first` on to the front.
    void forget(int first) {
        if (first == base_) return;
        const std::ptrdiff_t by = std::ptrdiff_t(first - base_) * P::width, kept = std::ptrdiff_t(imported_ - first) * P::width;
        for (T* plane = memory_.data(); plane != memory_.data() + memory_.size(); plane += planes_) {
            std::copy(plane + by, plane + by + kept, plane);
            if (plane < pixels_.data) std::fill(plane + kept, plane + planes_, T(0));
        }
        base_ = first;
    }

    WeightedSum<T> center(int i, WeightedSum<T> sum = {}) const {
        sum.add(P(kernel_[std::size_t(radius_)]), pixels_.value(i - base_));
        return sum;
    }
    /// Weighs the taps [a_first, a_last) of pixel a, and [b_first, b_last) of a + 1.
    void weigh(int a, int a_first, int a_last, int b_first, int b_last) {
        pair_.weigh(pixels_, a - base_, pixels_, {a_first - base_, a_last - base_, b_first - base_, b_last - base_},
                    kernel_.data() + radius_ + (a_first - a), kernel_.data() + radius_ + (b_first - a - 1));
    }

    /// Pixels a and, if it is before `end`, a + 1: all their neighbours.
    template <class Store>
    void filter_each(int a, int end, int tap_first, int tap_last, Store&& store) {
        const int b = a + 1;
        const bool both = b < end;
        WeightedSum<T> sum_a, sum_b;
        const int left_a = std::max(tap_first, a - radius_), left_b = both ? std::max(tap_first, b - radius_) : a;
        weigh(a, left_a, a, left_b, both ? b : a);
        pair_.gather(pixels_, sum_a, sum_b);
        sum_a = center(a, sum_a);
        if (both) sum_b = center(b, sum_b);
        const int right_a = std::min(tap_last, a + radius_ + 1);
        weigh(a, a + 1, right_a, both ? b + 1 : right_a, both ? std::min(tap_last, b + radius_ + 1) : right_a);
        pair_.gather(pixels_, sum_a, sum_b);
        store(a, sum_a, pixels_.usable(a - base_));
        if (both) store(b, sum_b, pixels_.usable(b - base_));
    }

    /// Pixels a and a + 1 weigh their neighbours after them, take from these and give to them. Those before have given
    /// already, in the order in which filter_each takes: both give the same bits.
    template <class Store>
    void filter_pairs(int a, int end, int first, int tap_last, Store&& store) {
        const int b = a + 1;
        const bool both = b < end;
        const int after_a = std::min(tap_last, a + radius_ + 1), from_a = std::min(after_a, std::max(b, first));
        const int after_b = both ? std::min(tap_last, b + radius_ + 1) : after_a;
        const int from_b = both ? std::min(after_b, std::max(b + 1, first)) : after_a;
        weigh(a, from_a, after_a, from_b, after_b);
        pair_.scatter(pixels_, a - base_, sums_);
        WeightedSum<T> sum_a = center(a, sums_.value(a - base_)), sum_b;
        if (both) sum_b = center(b, sums_.value(b - base_));
        pair_.gather(pixels_, sum_a, sum_b);
        if (a >= first) store(a, sum_a, pixels_.usable(a - base_));
        if (both && b >= first) store(b, sum_b, pixels_.usable(b - base_));
    }

    const std::vector<T>& kernel_;
    int channels_, radius_, step_, capacity_;
    PairOfPacks<T> pair_;
    std::ptrdiff_t planes_;
    LargeArray<T> memory_; ///< the sums' planes, then the pixels'
    PackedPixels<T> pixels_, sums_;
    int base_ = 0, imported_ = 0; ///< the pixel at the front, and the one after the last
};

/// Filters `window` of a width × height image along its lines. load(x, y) gives the homogeneous pixel;
/// store(x, y, mean, filtered) takes the mean, see store_means. Threads own whole lines, so nothing is shared and any
/// number of them gives the same bits.
template <class T, Executor E, class Load, class Store>
void filter_lines(LineDirection direction, WeightUse use, int width, int height, const PixelWindow& window,
                  const std::vector<T>& kernel, const FeatureList<T>& features, E& executor, Load&& load, Store&& store) {
    using P = FeaturePack<T>;
    const bool rows = direction == LineDirection::rows;
    const int line_begin = rows ? window.y0 : window.x0, lines = rows ? window.height() : window.width();
    const int first = rows ? window.x0 : window.y0, last = rows ? window.x1 : window.y1;
    const int radius = int(kernel.size()) / 2;
    const int tap_first = std::max(0, first - radius), tap_last = std::min(rows ? width : height, last + radius);
    const int strips = (lines + P::width - 1) / P::width;
    executor.parallel_for(std::size_t(strips), std::size_t((64 + P::width - 1) / P::width),
                          [&](std::size_t begin, std::size_t end) {
        LineStrip<T> strip(kernel, features);
        for (std::size_t index = begin; index < end; ++index) {
            const int line = line_begin + int(index) * P::width, count = std::min(P::width, line_begin + lines - line);
            const auto put = [&](const PackedPixels<T>& to, int x, int y, int at) {
                const Homogeneous<T> value = load(x, y);
                for (std::size_t c = 0; c < 4; ++c) to.values(0)[std::ptrdiff_t(c) * to.stride + at] = value[c];
            };
            const auto import = [&](const PackedPixels<T>& to, int i, int pixels) {
                constexpr int block = 32; // pixels of all lines before the next ones, so that they meet in the cache
                if (rows)
                    for (int from = 0; from < pixels; from += block)
                        for (int l = 0; l < count; ++l) {
                            const int run = std::min(block, pixels - from);
                            features.import(i + from, line + l, run, to.features(from) + l, P::width, to.stride);
                            for (int k = from; k < from + run; ++k) put(to, i + k, line + l, k * P::width + l);
                        }
                else
                    for (int k = 0; k < pixels; ++k) {
                        features.import(line, i + k, count, to.features(k), 1, to.stride);
                        for (int l = 0; l < count; ++l) put(to, line + l, i + k, k * P::width + l);
                    }
            };
            strip.filter(use, first, last, tap_first, tap_last, import, [&](int i, const WeightedSum<T>& sum, const T* usable) {
                store_means(sum, usable, count, [&](int l, const Vec3<T>& mean, bool filtered) {
                    store(rows ? i : line + l, rows ? line + l : i, mean, filtered);
                });
            });
        }
    });
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
