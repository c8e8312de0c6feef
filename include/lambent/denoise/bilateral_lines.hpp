#pragma once
#include <algorithm>
#include <cstddef>
#include <lambent/core/executor.hpp>
#include <lambent/denoise/bilateral_weights.hpp>
#include <lambent/film/region.hpp>
#include <vector>

/// One pass of the separable cross-bilateral filter, along rows or along columns.
namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

enum class LineDirection { rows, columns };
enum class WeightUse { once, twice }; ///< twice: the weight of a pair serves both of its pixels

/// What of a line is filtered, and which of its pixels are taps.
struct LineRange {
    int first, last, tap_first, tap_last;
};

/// A register's width of neighbouring lines, side by side: lane l of pack i is pixel i of line l. So all taps
/// are aligned loads, and a line's result does not depend on how wide a register is. Holds the part of the
/// lines that is being filtered, with what it reaches.
template <class T>
class LineStrip {
public:
    using P = FeaturePack<T>;

    /// `kernel` has an odd size.
    LineStrip(WeightUse use, const LineRange& range, const std::vector<T>& kernel, const FeatureList<T>& features)
        : use_(use), range_(range), spatial_(squared_distances(kernel)), center_(kernel[kernel.size() / 2]),
          channels_(features.channels()), radius_(int(kernel.size()) / 2), pair_(features, radius_ + 1),
          memory_(std::size_t(capacity()) * std::size_t(P::width * (PackedPixels<T>::numbers(features) + 4)), T(0)),
          sums_{memory_.data(), 4 * P::width}, pixels_{sums_.values(capacity()),
                                                       P::width * PackedPixels<T>::numbers(features)} {
        restart();
    }

    /// Where to start: with `twice`, pixels before the first give to it though their own sums are not wanted.
    int start() const { return twice() ? std::max(range_.tap_first, range_.first - radius_) : range_.first; }
    /// The most pixels that filter() takes at once; even.
    int step() const { return std::max(twice() ? 128 : 64, 2 * radius_); }

    void restart() {
        base_ = imported_ = std::max(range_.tap_first, start() - behind());
        std::fill(sums_.values(0), sums_.values(capacity()), T(0));
    }
    /// The pixels that have to be written to pixels(i) before `filter(from, to)`: [imported(), the result).
    int make_room(int from, int to) {
        forget(std::max(base_, from - behind()));
        return std::max(imported_, std::min(range_.tap_last, to + radius_));
    }
    int imported() const { return imported_; }
    PackedPixels<T> pixels(int i) const { return {pixels_.values(i - base_), pixels_.step}; }

    /// Filters pixels [from, to), those after the last ones, whose taps lie before `imported`. store(i, sum,
    /// usable) takes the sums of pixel i.
    template <class Store>
    void filter(int from, int to, int imported, Store&& store) {
        pixels_.drop_non_finite(channels_, imported_ - base_, imported - base_);
        imported_ = imported;
        for (int i = from; i < to; i += 2)
            if (twice())
                filter_pairs(i, std::min(i + 2, to), store);
            else
                filter_each(i, std::min(i + 2, to), store);
    }

private:
    bool twice() const { return use_ == WeightUse::twice; }
    int capacity() const { return behind() + step() + radius_ + 1; }
    int behind() const { return twice() ? 0 : radius_; } ///< how many pixels back a pixel looks

    /// Moves the pixels from `first` on to the front.
    void forget(int first) {
        if (first == base_) return;
        const int by = first - base_, kept = imported_ - first;
        for (const auto& packs : {sums_, pixels_})
            std::copy(packs.values(by), packs.values(by + kept), packs.values(0));
        std::fill(sums_.values(kept), sums_.values(capacity()), T(0));
        base_ = first;
    }

    WeightedSum<T> center(int i, WeightedSum<T> sum = {}) const {
        sum.add(P(center_), pixels_.value(i - base_));
        return sum;
    }
    /// Weighs the taps [a_first, a_last) of pixel a, and [b_first, b_last) of a + 1.
    void weigh(int a, int a_first, int a_last, int b_first, int b_last) {
        pair_.weigh(pixels_, a - base_, pixels_, {a_first - base_, a_last - base_, b_first - base_, b_last - base_},
                    spatial_.data() + radius_ + (a_first - a), spatial_.data() + radius_ + (b_first - a - 1));
    }

    /// Pixels a and, if it is before `end`, a + 1: all their neighbours.
    template <class Store>
    void filter_each(int a, int end, Store&& store) {
        const int tap_first = range_.tap_first, tap_last = range_.tap_last;
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

    /// Pixels a and a + 1 weigh their neighbours after them, take from these and give to them. Those before
    /// have given already, in the order in which filter_each takes: both give the same bits.
    template <class Store>
    void filter_pairs(int a, int end, Store&& store) {
        const int first = range_.first, tap_last = range_.tap_last;
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

    WeightUse use_;
    LineRange range_;
    std::vector<T> spatial_; ///< squared distances
    T center_;               ///< the weight of a pixel for itself
    int channels_, radius_;
    PairOfPacks<T> pair_;
    LargeArray<T> memory_;
    PackedPixels<T> sums_, pixels_;
    int base_ = 0, imported_ = 0; ///< the pixel at the front, and the one after the last
};

/// Filters `window` of a width × height image along its lines. load(x, y) gives the homogeneous pixel,
/// prefetch(x, y) asks for one that is wanted later; store(x, y, mean, filtered) takes the mean, see
/// store_means. Threads own whole lines, so nothing is shared and any number of them gives the same bits.
template <class T, Executor E, class Load, class Prefetch, class Store>
void filter_lines(LineDirection direction, WeightUse use, int width, int height, const PixelWindow& window,
                  const std::vector<T>& kernel, const FeatureList<T>& features, E& executor, Load&& load,
                  Prefetch&& prefetch, Store&& store) {
    using P = FeaturePack<T>;
    const bool rows = direction == LineDirection::rows;
    const int line_begin = rows ? window.y0 : window.x0, lines = rows ? window.height() : window.width();
    const int first = rows ? window.x0 : window.y0, last = rows ? window.x1 : window.y1;
    const int radius = int(kernel.size()) / 2;
    const int tap_first = std::max(0, first - radius), tap_last = std::min(rows ? width : height, last + radius);
    const LineRange range{first, last, tap_first, tap_last};
    // Strips side by side go on together: their pixels share cache lines and pages.
    constexpr int together = std::max(1, 32 / P::width);
    executor.parallel_for(
        std::size_t((lines + P::width - 1) / P::width), std::size_t(together), [&](std::size_t begin, std::size_t end) {
            std::vector<LineStrip<T>> strips;
            strips.reserve(end - begin); // they hold pointers into themselves
            for (std::size_t i = begin; i < end; ++i) strips.emplace_back(use, range, kernel, features);
            const auto line_of = [&](std::size_t strip) { return line_begin + int(begin + strip) * P::width; };
            const auto count_of = [&](std::size_t strip) {
                return std::min(P::width, line_begin + lines - line_of(strip));
            };
            const auto import = [&](int x, int y, int count, Ahead ahead, const PackedPixels<T>& to, int lane,
                                    std::ptrdiff_t step) {
                features.import(x, y, count, ahead, to.features(0) + lane, step);
                for (int i = 0; i < count; ++i) {
                    if (i % prefetch_every == 0) prefetch(x + i + ahead.x, y + ahead.y);
                    const Homogeneous<T> value = load(x + i, y);
                    for (int c = 0; c < 4; ++c) to.values(0)[c * P::width + lane + i * step] = value[std::size_t(c)];
                }
            };
            const int step = strips[0].step();
            for (int from = strips[0].start(); from < last; from += step) {
                const int to = std::min(last, from + step), imported = strips[0].imported();
                int needed = imported;
                for (auto& strip : strips) needed = strip.make_room(from, to);
                constexpr int block = 32; // pixels of all lines before the next ones, so that they meet in the cache
                if (rows)
                    for (int x = imported; x < needed; x += block)
                        for (std::size_t s = 0; s < strips.size(); ++s)
                            for (int l = 0; l < count_of(s); ++l)
                                import(x, line_of(s) + l, std::min(block, needed - x), {block, 0}, strips[s].pixels(x),
                                       l, strips[s].pixels(x).step);
                else
                    for (int y = imported; y < needed; ++y)
                        for (std::size_t s = 0; s < strips.size(); ++s)
                            import(line_of(s), y, count_of(s), {0, 16}, strips[s].pixels(y), 0, 1);
                for (std::size_t s = 0; s < strips.size(); ++s)
                    strips[s].filter(from, to, needed, [&](int i, const WeightedSum<T>& sum, const T* usable) {
                        store_means(sum, usable, count_of(s), [&](int l, const Vec3<T>& mean, bool filtered) {
                            store(rows ? i : line_of(s) + l, rows ? line_of(s) + l : i, mean, filtered);
                        });
                    });
            }
        });
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
