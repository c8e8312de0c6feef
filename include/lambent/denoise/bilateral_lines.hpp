#pragma once
#include <algorithm>
#include <cstddef>
#include <lambent/core/executor.hpp>
#include <lambent/denoise/bilateral_weights.hpp>
#include <lambent/film/region.hpp>
#include <array>
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
          memory_(std::size_t(capacity()) * std::size_t(P::width * (PackedPixels<T>::numbers(features) + (twice() ? 4 : 0)))),
          pixels_{memory_.data(), P::width * PackedPixels<T>::numbers(features)},
          sums_{pixels_.values(capacity()), 4 * P::width} {
        base_ = imported_ = std::max(range_.tap_first, start() - behind());
        if (twice()) std::fill(sums_.values(0), sums_.values(capacity()), T(0));
    }

    /// Where to start: with `twice`, pixels before the first give to it though their own sums are not wanted.
    int start() const { return twice() ? std::max(range_.tap_first, range_.first - radius_) : range_.first; }
    /// The pixels that have to be written to pixels(i) before `filter(from, to)`: [imported(), the result).
    int make_room(int from, int to) {
        const int needed = std::max(imported_, std::min(range_.tap_last, to + radius_));
        if (needed - base_ >= capacity()) forget(std::max(base_, from - behind()));
        return needed;
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
    /// In pixels: those that a block reaches, the one after the last, and as many that seldom have to be moved.
    int capacity() const { return behind() + radius_ + 1 + std::max(192, 2 * radius_); }
    int behind() const { return twice() ? 0 : radius_; } ///< how many pixels back a pixel looks

    /// Moves the pixels from `first` on to the front.
    void forget(int first) {
        if (first == base_) return;
        const int by = first - base_, kept = imported_ - first;
        const auto move = [&](const PackedPixels<T>& packs) {
            std::copy(packs.values(by), packs.values(by + kept), packs.values(0));
        };
        move(pixels_);
        base_ = first;
        if (!twice()) return;
        move(sums_);
        std::fill(sums_.values(kept), sums_.values(capacity()), T(0));
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
    ScratchArray<T> memory_;
    PackedPixels<T> pixels_, sums_; ///< sums: where weights are used twice
    int base_ = 0, imported_ = 0; ///< the pixel at the front, and the one after the last
};

/// Packs of pixels along rows, one for each row, to packs of one pixel of each row, or back: number n of the i-th is at
/// from[i · step + n · width], and goes likewise to the first `count` of `to`.
template <class T>
void transpose_packs(const PackedPixels<T>& from, int numbers, const PackedPixels<T>& to, int count) {
    using P = FeaturePack<T>;
    for (int n = 0; n < numbers; ++n) {
        std::array<P, std::size_t(P::width)> square;
        for (int i = 0; i < P::width; ++i) square[std::size_t(i)] = P::load(from.values(i) + n * P::width);
        transpose(square);
        for (int i = 0; i < count; ++i) square[std::size_t(i)].store(to.values(i) + n * P::width);
    }
}

/// Filters `window` of a width × height image along its lines. load(x, y, count) gives so many homogeneous pixels of a
/// row, prefetch(x, y, count) asks for some that are wanted later; store(x, y, count, means) takes those of a row: see means().
/// Threads own whole lines, so nothing is shared and any number of them gives the same bits.
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
    constexpr int block = 16; // pixels of a line that are filtered before the next ones are read
    static_assert(block % P::width == 0);
    // Columns whose pixels share cache lines go on together: 16 pixels of dense RGB are three.
    const std::size_t together = rows ? 1 : std::size_t(16 / P::width);
    const auto import = [&](int x, int y, int count, T* to) {
        const Homogeneous<T> value = load(x, y, count);
        for (int c = 0; c < 4; ++c) value[std::size_t(c)].store(to + c * P::width);
        features.import(x, y, count, to + 5 * P::width);
    };
    executor.parallel_for(
        std::size_t((lines + P::width - 1) / P::width), together, [&](std::size_t begin, std::size_t end) {
            std::vector<LineStrip<T>> strips;
            strips.reserve(end - begin); // they hold pointers into themselves
            for (std::size_t i = begin; i < end; ++i) strips.emplace_back(use, range, kernel, features);
            const auto line_of = [&](std::size_t strip) { return line_begin + int(begin + strip) * P::width; };
            const auto count_of = [&](std::size_t strip) {
                return std::min(P::width, line_begin + lines - line_of(strip));
            };
            const int numbers = PackedPixels<T>::numbers(features);
            LargeArray<T> memory(std::size_t((numbers + 4) * P::width * P::width), T(0)); // of a block of rows
            const PackedPixels<T> in{memory.data(), numbers * P::width};
            const PackedPixels<T> out{in.values(P::width), 4 * P::width};
            for (int from = strips[0].start(); from < last; from += block) {
                const int to = std::min(last, from + block), imported = strips[0].imported();
                int needed = imported;
                for (auto& strip : strips) needed = strip.make_room(from, to);
                if (rows)
                    for (int x = imported; x < needed; x += P::width) {
                        const int count = std::min(P::width, needed - x);
                        for (int l = 0; l < count_of(0); ++l) import(x, line_of(0) + l, count, in.values(l));
                        transpose_packs(in, numbers, strips[0].pixels(x), count);
                    }
                else
                    for (int y = imported; y < needed; ++y)
                        for (std::size_t s = 0; s < strips.size(); ++s)
                            import(line_of(s), y, count_of(s), strips[s].pixels(y).values(0));
                for (std::size_t s = 0; s < strips.size(); ++s) {
                    int waiting = 0;
                    const auto store_rows = [&](int end_of_means) {
                        transpose_packs(out, 4, out, P::width);
                        for (int l = 0; l < count_of(s); ++l)
                            store(end_of_means - waiting, line_of(s) + l, waiting, std::to_array(out.value(l).channel));
                        waiting = 0;
                    };
                    // One at a time, so that the memory has time for each.
                    const auto prefetch_next = [&](int i) {
                        const int x = rows ? needed : line_of(s), y = rows ? line_of(s) + i : needed + i;
                        const int count = rows ? block : count_of(s);
                        if (rows && i >= count_of(s)) return;
                        prefetch(x, y, count);
                        features.prefetch(x, y, count);
                    };
                    strips[s].filter(from, to, needed, [&](int i, const WeightedSum<T>& sum, const T* usable) {
                        prefetch_next(i - from);
                        const Homogeneous<T> mean = means(sum, usable);
                        if (!rows) return store(line_of(s), i, count_of(s), mean);
                        for (int c = 0; c < 4; ++c) mean[std::size_t(c)].store(out.values(waiting) + c * P::width);
                        if (++waiting == P::width) store_rows(i + 1);
                    });
                    if (waiting > 0) store_rows(to);
                }
            }
        });
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
