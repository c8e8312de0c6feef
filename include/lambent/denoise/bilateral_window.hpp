#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <lambent/core/executor.hpp>
#include <lambent/denoise/bilateral_weights.hpp>
#include <lambent/film/region.hpp>
#include <optional>
#include <vector>

/// The cross-bilateral filter over its whole square window.
namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Rows cut into as many segments as a register has lanes: lane l of pack i is pixel x0 + l · segment + i -
/// radius. So the taps along a row are packs side by side, and those past a segment's ends are there once
/// more.
template <class T>
class WindowPlanes {
public:
    using P = FeaturePack<T>;

    /// For the pixels of `window` as centres. load(x, y, count) gives so many homogeneous pixels of a row.
    template <Executor E, class Load>
    WindowPlanes(int width, int height, const PixelWindow& window, const std::vector<T>& kernel,
                 const FeatureList<T>& features, E& executor, Load&& load)
        : features_(features), radius_(int(kernel.size()) / 2), window_(window),
          y_begin_(std::max(0, window.y0 - radius_)), y_end_(std::min(height, window.y1 + radius_)),
          segment_((window.width() + P::width - 1) / P::width),
          center_(kernel[kernel.size() / 2] * kernel[kernel.size() / 2]),
          step_(P::width * PackedPixels<T>::numbers(features)), row_(step_ * (packs() + 1)),
          memory_(std::size_t(row_) * std::size_t(y_end_ - y_begin_), T(0)) {
        const std::vector<T> distances = squared_distances(kernel);
        for (int dy = 0; dy <= radius_; ++dy)
            for (const T d : distances) spatial_.push_back(distances[std::size_t(radius_ + dy)] + d);
        executor.parallel_for(std::size_t(y_end_ - y_begin_), 8, [&](std::size_t begin, std::size_t end) {
            std::vector<T> numbers(std::size_t(step_), T(0)); // of a pack of pixels of a row
            for (int y = y_begin_ + int(begin); y < y_begin_ + int(end); ++y)
                for (int l = 0; l < P::width; ++l) {
                    const int from = window.x0 + l * segment_ - radius_; // pixel of pack 0
                    const int x0 = std::max(0, from), x1 = std::min(width, from + packs());
                    if (x0 >= x1) continue;
                    const PackedPixels<T> to = row(y);
                    for (int x = x0; x < x1; x += P::width) {
                        const int count = std::min(P::width, x1 - x);
                        const Homogeneous<T> value = load(x, y, count);
                        for (std::size_t c = 0; c < 4; ++c) value[c].store(numbers.data() + int(c) * P::width);
                        features_.import(x, y, count, numbers.data() + 5 * P::width);
                        for (int i = 0; i < count; ++i)
                            for (int n = 0; n < int(numbers.size()); n += P::width)
                                to.values(x - from + i)[n + l] = numbers[std::size_t(n + i)];
                    }
                }
            for (int y = y_begin_ + int(begin); y < y_begin_ + int(end); ++y)
                row(y).drop_non_finite(features_.channels(), 0, packs());
        });
    }

    const FeatureList<T>& features() const { return features_; }
    const PixelWindow& window() const { return window_; }
    int radius() const { return radius_; }
    int y_begin() const { return y_begin_; } ///< rows with pixels: [y_begin, y_end)
    int y_end() const { return y_end_; }
    int first() const { return radius_; } ///< packs [first, last) hold the window's pixels
    int last() const { return radius_ + segment_; }
    int packs() const { return segment_ + 2 * radius_; }
    PackedPixels<T> row(int y) const { return {const_cast<T*>(memory_.data()) + (y - y_begin_) * row_, step_}; }
    /// The squared spatial distances of the taps `dy` rows away, from the one `dx` columns off on.
    const T* spatial(int dy, int dx) const { return spatial_.data() + std::abs(dy) * (2 * radius_ + 1) + radius_ + dx; }
    T center() const { return center_; } ///< the weight of a pixel for itself
    int column(int pack, int lane) const { return window_.x0 + lane * segment_ + pack - radius_; }

private:
    const FeatureList<T>& features_;
    int radius_;
    PixelWindow window_;
    int y_begin_, y_end_, segment_;
    T center_;
    std::ptrdiff_t step_, row_;
    LargeArray<T> memory_;
    std::vector<T> spatial_;
};

/// Weighs packs a and a + 1 (if it is before `last`) of row y with columns [first, last) relative to each, in
/// row v.
template <class T>
void weigh_row(PairOfPacks<T>& pair, const WindowPlanes<T>& planes, int a, int y, int v, int first, int last) {
    const bool both = a + 1 < planes.last();
    const TapRuns runs{a + first, a + last, both ? a + 1 + first : a + last, both ? a + 1 + last : a + last};
    const T* const spatial = planes.spatial(v - y, first);
    pair.weigh(planes.row(y), a, planes.row(v), runs, spatial, spatial);
}

/// Sums of weights for rows of packs.
template <class T>
struct WindowSums {
    static constexpr std::ptrdiff_t step = 4 * FeaturePack<T>::width;
    std::ptrdiff_t row_step;
    LargeArray<T> memory;

    WindowSums(const WindowPlanes<T>& planes, int rows)
        : row_step(step * (planes.packs() + 1)), memory(std::size_t(row_step) * std::size_t(rows), T(0)) {}
    PackedPixels<T> row(int i) const { return {const_cast<T*>(memory.data()) + row_step * i, step}; }

    static void add(const PackedPixels<T>& to, int pack, const WeightedSum<T>& sum) {
        WeightedSum<T> total = to.value(pack);
        total.add(FeaturePack<T>(T(1)), sum);
        total.store(to.values(pack));
    }
    /// sums[pack] += the taps of a and a + 1 that `pair` has weighed.
    static void gather(const PackedPixels<T>& to, const PairOfPacks<T>& pair, const PackedPixels<T>& taps, int a) {
        WeightedSum<T> sum_a, sum_b;
        pair.gather(taps, sum_a, sum_b);
        add(to, a, sum_a);
        add(to, a + 1, sum_b);
    }
    /// sums += the pixels' own values.
    static void add_centers(const PackedPixels<T>& to, const WindowPlanes<T>& planes, int y) {
        for (int i = planes.first(); i < planes.last(); ++i) {
            WeightedSum<T> own;
            own.add(FeaturePack<T>(planes.center()), planes.row(y).value(i));
            add(to, i, own);
        }
    }
};

/// Every pixel weighs every other pixel of its window.
template <class T, Executor E, class Store>
void filter_window(const WindowPlanes<T>& planes, E& executor, Store&& store) {
    using P = FeaturePack<T>;
    const int radius = planes.radius();
    const PixelWindow& window = planes.window();
    executor.parallel_for(std::size_t(window.height()), 1, [&](std::size_t begin, std::size_t end) {
        PairOfPacks<T> pair(planes.features(), 2 * radius + 1);
        for (int y = window.y0 + int(begin); y < window.y0 + int(end); ++y) {
            const WindowSums<T> sums(planes, 1);
            const auto add = [&](int v, int first, int last) {
                for (int a = planes.first(); a < planes.last(); a += 2) {
                    weigh_row(pair, planes, a, y, v, first, last);
                    sums.gather(sums.row(0), pair, planes.row(v), a);
                }
            };
            for (int v = std::max(planes.y_begin(), y - radius); v < std::min(planes.y_end(), y + radius + 1); ++v)
                if (v != y) add(v, -radius, radius + 1);
            add(y, -radius, 0);
            add(y, 1, radius + 1);
            sums.add_centers(sums.row(0), planes, y);
            for (int i = planes.first(); i < planes.last(); ++i) {
                const auto [r, g, b, filtered] = means<T>(sums.row(0).value(i), planes.row(y).usable(i));
                for (int l = 0; l < P::width; ++l)
                    if (const int x = planes.column(i, l); x < window.x1)
                        store(x, y, Vec3<T>(r[l], g[l], b[l]), filtered[l] > 0);
            }
        }
    });
}

/// Every unordered pair is weighed once: each pixel weighs those to its right and those in the rows below,
/// the half of its window, and adds to both. (A quarter, right and below, never meets the pairs that lie the
/// other way: it is another kernel, off by up to a fifth.) Bands of rows, whose height depends on the kernel
/// alone, add to sums of their own that reach `radius` rows further; these overlaps are then added in band
/// order, so any number of threads gives the same bits. The planes' window has to hold all taps of the pixels
/// one wants.
template <class T, Executor E, class Store>
void filter_window_pairs(const WindowPlanes<T>& planes, E& executor, Store&& store) {
    using P = FeaturePack<T>;
    const PixelWindow& window = planes.window();
    const int radius = planes.radius(), band = std::max(16, radius);
    const int bands = (window.height() + band - 1) / band;
    std::vector<std::optional<WindowSums<T>>> sums{std::size_t(bands)};

    executor.parallel_for(sums.size(), 1, [&](std::size_t begin, std::size_t end) {
        PairOfPacks<T> pair(planes.features(), 2 * radius + 1);
        for (std::size_t b = begin; b < end; ++b) {
            const int top = window.y0 + int(b) * band, bottom = std::min(window.y1, top + band);
            sums[b].emplace(planes, std::min(window.y1, bottom + radius) - top);
            const auto row = [&](int y) { return sums[b]->row(y - top); };
            for (int y = top; y < bottom; ++y) {
                for (int v = y; v < std::min(window.y1, y + radius + 1); ++v)
                    for (int a = planes.first(); a < planes.last(); a += 2) {
                        weigh_row(pair, planes, a, y, v, v == y ? 1 : -radius, radius + 1);
                        pair.scatter(planes.row(y), a, row(v));
                        WindowSums<T>::gather(row(y), pair, planes.row(v), a);
                    }
                WindowSums<T>::add_centers(row(y), planes, y);
            }
        }
    });

    executor.parallel_for(std::size_t(window.height()), 8, [&](std::size_t begin, std::size_t end) {
        const std::size_t width = std::size_t(window.width());
        for (int y = window.y0 + int(begin); y < window.y0 + int(end); ++y) {
            std::vector<std::array<T, 4>> line(width, std::array<T, 4>{});
            std::vector<T> usable(width);
            const auto add = [&](int b) { // what a segment's pixels gave beyond its ends belongs to others
                const PackedPixels<T> row = sums[std::size_t(b)]->row(y - window.y0 - b * band);
                for (int l = 0; l < P::width; ++l)
                    for (int i = 0; i < planes.packs(); ++i) {
                        const int x = planes.column(i, l) - window.x0;
                        if (x < 0 || x >= window.width()) continue;
                        for (std::size_t c = 0; c < 4; ++c)
                            line[std::size_t(x)][c] += row.values(i)[int(c) * P::width + l];
                        usable[std::size_t(x)] = planes.row(y).usable(i)[l];
                    }
            };
            const int b = (y - window.y0) / band;
            if (b > 0 && y - window.y0 - b * band < radius) add(b - 1);
            add(b);
            for (std::size_t x = 0; x < width; ++x) {
                const auto& [red, green, blue, weight] = line[x];
                store(window.x0 + int(x), y, Vec3<T>(red / weight, green / weight, blue / weight),
                      usable[x] != 0 && weight > 0);
            }
        }
    });
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
