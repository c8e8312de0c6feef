#pragma once
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/bilateral_weights.hpp>
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
/// are aligned loads, and a line's result does not depend on how wide a register is.
template <class T>
class LineStrip {
public:
    using P = FeaturePack<T>;

    /// `kernel` has an odd size.
    LineStrip(int length, const std::vector<T>& kernel, const FeatureList<T>& features)
        : features_(features), kernel_(kernel), length_(length), radius_(int(kernel.size()) / 2),
          packs_(int(spread_stride(length * int(sizeof(P))) / int(sizeof(P)))),
          stride_(std::ptrdiff_t(packs_) * P::width), planes_(std::size_t((5 + features.channels()) * packs_)),
          weights_(std::size_t((radius_ + 1) * radius_) + kernel.size()) {}

    T* values() { return lanes(0); }             ///< 4 channels, each `stride()` further on
    T* usable() { return lanes(4 * packs_); }   ///< whether a pixel's features are finite
    T* features() { return lanes(5 * packs_); } ///< as FeatureList::import writes them
    std::ptrdiff_t stride() const { return stride_; }

    /// Calls store(i, sums) for every pack of pixels i.
    template <class Store>
    void filter(WeightUse use, Store&& store) {
        if (use == WeightUse::once) filter_each(store);
        else filter_pairs(store);
    }

private:
    T* lanes(int pack) { return reinterpret_cast<T*>(planes_.data() + pack); }

    void weigh(int center, int first, const T* spatial, int count, P* weights) {
        bilateral_weights(features_, features() + center * P::width, features() + first * P::width, P::width,
                          stride_, spatial, count, weights);
    }
    WeightedSum<T> center(int i) {
        WeightedSum<T> sum;
        sum.add(P(kernel_[std::size_t(radius_)]), values() + i * P::width, stride_);
        return sum;
    }

    template <class Store>
    void filter_each(Store&& store) {
        for (int i = 0; i < length_; ++i) {
            WeightedSum<T> sum = center(i);
            const auto add = [&](int first, int count) {
                weigh(i, first, kernel_.data() + radius_ + (first - i), count, weights_.data());
                for (int k = 0; k < count; ++k)
                    sum.add(weights_[std::size_t(k)], values() + (first + k) * P::width, stride_);
            };
            const int first = std::max(0, i - radius_);
            add(first, i - first);
            add(i + 1, std::min(length_ - 1, i + radius_) - i);
            store(i, sum);
        }
    }

    /// Pixel i weighs its neighbours after it and finds those before it in a ring of the last radius + 1
    /// pixels' weights. Nothing is scattered: every pixel's sums are its own, taken in one fixed order.
    template <class Store>
    void filter_pairs(Store&& store) {
        const int slots = radius_ + 1;
        for (int i = 0; i < length_; ++i) {
            WeightedSum<T> sum = center(i);
            P* const ours = weights_.data() + (i % slots) * radius_;
            const int after = std::min(radius_, length_ - 1 - i), before = std::min(radius_, i);
            weigh(i, i + 1, kernel_.data() + radius_ + 1, after, ours);
            for (int k = 0; k < after; ++k) sum.add(ours[k], values() + (i + 1 + k) * P::width, stride_);
            for (int k = 1; k <= before; ++k)
                sum.add(weights_[std::size_t((i - k) % slots * radius_ + k - 1)], values() + (i - k) * P::width, stride_);
            store(i, sum);
        }
    }

    const FeatureList<T>& features_;
    const std::vector<T>& kernel_;
    int length_, radius_, packs_;
    std::ptrdiff_t stride_;
    std::vector<P> planes_, weights_;
};

/// Filters all lines of a width × height image. load(x, y) gives the homogeneous pixel;
/// store(x, y, sums, usable) takes the weighted sums, once a pixel, with `usable` false where a feature is not
/// finite. Threads own whole lines, so nothing is shared and any number of them gives the same bits.
template <class T, Executor E, class Load, class Store>
void filter_lines(LineDirection direction, WeightUse use, int width, int height, const std::vector<T>& kernel,
                  const FeatureList<T>& features, E& executor, Load&& load, Store&& store) {
    using P = FeaturePack<T>;
    const bool rows = direction == LineDirection::rows;
    const int lines = rows ? height : width, length = rows ? width : height;
    const int strips = (lines + P::width - 1) / P::width;
    executor.parallel_for(std::size_t(strips), std::size_t((64 + P::width - 1) / P::width),
                          [&](std::size_t begin, std::size_t end) {
        LineStrip<T> strip(length, kernel, features);
        for (std::size_t index = begin; index < end; ++index) {
            const int first = int(index) * P::width, count = std::min(P::width, lines - first);
            const auto put = [&](int x, int y, std::ptrdiff_t at) {
                Homogeneous<T> value = load(x, y);
                if (strip.usable()[at] == 0) value = {};
                for (std::size_t c = 0; c < 4; ++c) strip.values()[std::ptrdiff_t(c) * strip.stride() + at] = value[c];
            };
            constexpr int block = 32; // pixels of all lines before the next ones, so that they meet in the cache
            if (rows)
                for (int from = 0; from < length; from += block)
                    for (int l = 0; l < count; ++l) {
                        const int to = std::min(length, from + block), at = from * P::width + l;
                        features.import(from, first + l, to - from, strip.features() + at, P::width, strip.stride(),
                                        strip.usable() + at);
                        for (int i = from; i < to; ++i) put(i, first + l, i * P::width + l);
                    }
            else
                for (int i = 0; i < length; ++i) {
                    features.import(first, i, count, strip.features() + i * P::width, 1, strip.stride(),
                                    strip.usable() + i * P::width);
                    for (int l = 0; l < count; ++l) put(first + l, i, i * P::width + l);
                }
            strip.filter(use, [&](int i, const WeightedSum<T>& sum) {
                for (int l = 0; l < count; ++l)
                    store(rows ? i : first + l, rows ? first + l : i,
                          Homogeneous<T>{sum.channel[0][l], sum.channel[1][l], sum.channel[2][l], sum.channel[3][l]},
                          strip.usable()[i * P::width + l] != 0);
            });
        }
    });
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
