#pragma once
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/bilateral_weights.hpp>
#include <algorithm>
#include <cstddef>
#include <vector>

/// The cross-bilateral filter over its whole square window.
namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// The planes of a whole image with empty pixels to either side of each row, so that no tap leaves it.
template <class T>
class WindowPlanes {
public:
    using P = FeaturePack<T>;

    template <Executor E, class Load>
    WindowPlanes(int width, int height, const std::vector<T>& kernel, const FeatureList<T>& features, E& executor,
                 Load&& load)
        : features_(features), kernel_(kernel), width_(width), height_(height), radius_(int(kernel.size()) / 2),
          pitch_(spread_stride((2 * (radius_ + P::width) + width) * std::ptrdiff_t(sizeof(T))) / std::ptrdiff_t(sizeof(T))),
          row_(pitch_ * (5 + features.channels())),
          planes_(std::size_t(row_) * std::size_t(height)) {
        executor.parallel_for(std::size_t(height), 8, [&](std::size_t begin, std::size_t end) {
            for (int y = int(begin); y < int(end); ++y) {
                T* const usable = values(0, y) + 4 * pitch_;
                features_.import(0, y, width_, usable + pitch_, 1, pitch_, usable);
                for (int x = 0; x < width_; ++x) {
                    Homogeneous<T> value = load(x, y);
                    if (usable[x] == 0) value = {};
                    for (std::size_t c = 0; c < 4; ++c) values(x, y)[std::ptrdiff_t(c) * pitch_] = value[c];
                }
            }
        });
    }

    int width() const { return width_; }
    int height() const { return height_; }
    int radius() const { return radius_; }
    std::ptrdiff_t pitch() const { return pitch_; }
    const T* values(int x, int y) const { return planes_.data() + y * row_ + radius_ + P::width + x; }
    bool usable(int x, int y) const { return values(x, y)[4 * pitch_] != 0; }
    P spatial(int offset) const { return P(kernel_[std::size_t(radius_ + offset)]); }

    /// Weights, without the spatial factor of the row offset, of the pixels at (x .., y) with those at
    /// (x + dx .., v) for dx in [first, last].
    void weigh(int x, int y, int v, int first, int last, P* weights) const {
        bilateral_weights(features_, values(x, y) + 5 * pitch_, values(x + first, v) + 5 * pitch_, 1, pitch_,
                          kernel_.data() + radius_ + first, last - first + 1, weights);
    }
    /// The column offsets that meet the image from the pack at x.
    int first_offset(int x) const { return std::max(-radius_, -x - P::width + 1); }
    int last_offset(int x) const { return std::min(radius_, width_ - 1 - x); }

    WeightedSum<T> center(int x, int y) const {
        WeightedSum<T> sum;
        sum.add(spatial(0) * spatial(0), values(x, y), pitch_);
        return sum;
    }

private:
    T* values(int x, int y) { return planes_.data() + y * row_ + radius_ + P::width + x; }

    const FeatureList<T>& features_;
    const std::vector<T>& kernel_;
    int width_, height_, radius_;
    std::ptrdiff_t pitch_, row_;
    std::vector<T> planes_;
};

template <class T, class Store>
void store_pack(const WindowPlanes<T>& planes, int x, int y, const WeightedSum<T>& sum, Store&& store) {
    for (int l = 0; l < std::min(FeaturePack<T>::width, planes.width() - x); ++l)
        store(x + l, y, Homogeneous<T>{sum.channel[0][l], sum.channel[1][l], sum.channel[2][l], sum.channel[3][l]},
              planes.usable(x + l, y));
}

/// Every pixel weighs every other pixel of its window.
template <class T, Executor E, class Store>
void filter_window(const WindowPlanes<T>& planes, E& executor, Store&& store) {
    using P = FeaturePack<T>;
    const int radius = planes.radius();
    const std::size_t window = std::size_t(2 * radius + 1);
    executor.parallel_for(std::size_t(planes.height()), 1, [&](std::size_t begin, std::size_t end) {
        std::vector<P> weights(window);
        for (int y = int(begin); y < int(end); ++y)
            for (int x = 0; x < planes.width(); x += P::width) {
                WeightedSum<T> sum = planes.center(x, y);
                for (int v = std::max(0, y - radius); v <= std::min(planes.height() - 1, y + radius); ++v) {
                    WeightedSum<T> row;
                    const auto add = [&](int first, int last) {
                        if (first > last) return;
                        planes.weigh(x, y, v, first, last, weights.data());
                        for (int dx = first; dx <= last; ++dx)
                            row.add(weights[std::size_t(dx - first)], planes.values(x + dx, v), planes.pitch());
                    };
                    if (v == y) {
                        add(planes.first_offset(x), -1);
                        add(1, planes.last_offset(x));
                    } else {
                        add(planes.first_offset(x), planes.last_offset(x));
                    }
                    sum.add(planes.spatial(v - y), row);
                }
                store_pack(planes, x, y, sum, store);
            }
    });
}

/// Every unordered pair is weighed once: each pixel weighs those to its right and those in the rows below, the
/// half of its window, and adds to both. (A quarter, right and below, never meets the pairs that lie the other
/// way: it is another kernel, off by up to a fifth.) Bands of rows, whose height depends on the kernel alone,
/// add to sums of their own that reach `radius` rows further; these overlaps are then added in band order, so
/// any number of threads gives the same bits.
template <class T, Executor E, class Store>
void filter_window_pairs(const WindowPlanes<T>& planes, E& executor, Store&& store) {
    using P = FeaturePack<T>;
    const int radius = planes.radius(), height = planes.height();
    const int band = std::max(16, radius), bands = (height + band - 1) / band;
    const std::ptrdiff_t pitch = planes.pitch(), row = 4 * pitch;
    const std::size_t window = std::size_t(2 * radius + 1), count = std::size_t(bands);
    std::vector<std::vector<T>> sums(count);
    const auto at = [&](int b, int x, int y) {
        return sums[std::size_t(b)].data() + (y - b * band) * row + radius + P::width + x;
    };

    executor.parallel_for(count, 1, [&](std::size_t begin, std::size_t end) {
        std::vector<P> weights(window);
        for (int b = int(begin); b < int(end); ++b) {
            sums[std::size_t(b)].assign(std::size_t(std::min(band + radius, height - b * band)) * std::size_t(row), T(0));
            for (int y = b * band; y < std::min(height, (b + 1) * band); ++y)
                for (int x = 0; x < planes.width(); x += P::width) {
                    WeightedSum<T> sum = planes.center(x, y);
                    for (int v = y; v <= std::min(height - 1, y + radius); ++v) {
                        const int first = v == y ? 1 : planes.first_offset(x), last = planes.last_offset(x);
                        if (first > last) continue;
                        planes.weigh(x, y, v, first, last, weights.data());
                        WeightedSum<T> gathered, given;
                        given.add(planes.spatial(v - y), planes.values(x, y), pitch);
                        // In steps of a whole pack: a load soon after a store that it overlaps has to wait.
                        for (int start = first; start < std::min(last + 1, first + P::width); ++start)
                            for (int dx = start; dx <= last; dx += P::width) {
                                const P weight = weights[std::size_t(dx - first)];
                                gathered.add(weight, planes.values(x + dx, v), pitch);
                                for (int c = 0; c < 4; ++c) {
                                    T* const to = at(b, x + dx, v) + c * pitch;
                                    multiply_add(weight, given.channel[c], P::load(to)).store(to);
                                }
                            }
                        sum.add(planes.spatial(v - y), gathered);
                    }
                    for (int c = 0; c < 4; ++c) {
                        T* const to = at(b, x, y) + c * pitch;
                        (P::load(to) + sum.channel[c]).store(to);
                    }
                }
        }
    });

    executor.parallel_for(std::size_t(height), 8, [&](std::size_t begin, std::size_t end) {
        for (int y = int(begin); y < int(end); ++y) {
            const int b = y / band;
            const bool overlapped = b > 0 && y - b * band < radius;
            for (int x = 0; x < planes.width(); x += P::width) {
                WeightedSum<T> sum;
                if (overlapped) sum.add(P(T(1)), at(b - 1, x, y), pitch);
                sum.add(P(T(1)), at(b, x, y), pitch);
                store_pack(planes, x, y, sum, store);
            }
        }
    });
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
