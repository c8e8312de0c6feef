#pragma once
#include <array>
#include <cmath>
#include <cstddef>
#include <lambent/core/exp.hpp>
#include <lambent/core/memory.hpp>
#include <lambent/denoise/feature.hpp>
#include <vector>

/// What the four forms of the cross-bilateral filter share: packs of pixels, and the weights of two packs at
/// a time. Weights are made in short runs that stay in the first cache: one loop a feature, one for the
/// exponential, one to sum. A processor's registers hold both packs' numbers for one feature, not for all of
/// them.
namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Pixels as the filters sum them: (r, g, b, 1), or (0, 0, 0, 0) where there is none or it is not finite. Such
/// a tap adds nothing to either sum, whatever its weight, so borders and bad pixels need no test in a loop.
template <class T>
using Homogeneous = std::array<FeaturePack<T>, 4>;

/// The squared distances, in sigmas, that give the weights of a kernel.
template <class T>
std::vector<T> squared_distances(const std::vector<T>& kernel) {
    std::vector<T> distances;
    for (const T weight : kernel) distances.push_back(T(-2 * std::log(double(weight))));
    return distances;
}

/// Running sums of weight · homogeneous pixel, a pack of pixels wide.
template <class T>
struct WeightedSum {
    using P = FeaturePack<T>;
    P channel[4] = {P(T(0)), P(T(0)), P(T(0)), P(T(0))};

    static WeightedSum load(const T* from) {
        WeightedSum sum;
        for (int c = 0; c < 4; ++c) sum.channel[c] = P::load(from + c * P::width);
        return sum;
    }
    void store(T* to) const {
        for (int c = 0; c < 4; ++c) channel[c].store(to + c * P::width);
    }
    [[gnu::always_inline]] void add(P weight, const WeightedSum& value) {
        for (int c = 0; c < 4; ++c) channel[c] = multiply_add(weight, value.channel[c], channel[c]);
    }
};

/// Packs of pixels one after the other, `step` elements apart: a pack's numbers lie together, so that they
/// share pages and spread over a cache's lines.
template <class T>
struct PackedPixels {
    using P = FeaturePack<T>;
    T* data;
    std::ptrdiff_t step;

    /// The numbers of a pixel: 4 channels, whether it is usable, its features.
    static int numbers(const FeatureList<T>& features) { return 5 + features.channels(); }
    T* values(int i) const { return data + i * step; }                  ///< 4 channels
    T* usable(int i) const { return data + i * step + 4 * P::width; }   ///< 1 or 0: whether all features are finite
    T* features(int i) const { return data + i * step + 5 * P::width; } ///< as FeatureList::import writes them
    WeightedSum<T> value(int i) const { return WeightedSum<T>::load(values(i)); }

    /// Sets `usable` of packs [first, last); empties pixels that are not.
    void drop_non_finite(int channels, int first, int last) const {
        for (int i = first; i < last; ++i) {
            auto finite = is_finite(P(T(0)));
            for (int c = 0; c < channels; ++c) finite = finite & is_finite(P::load(features(i) + c * P::width));
            if (!all(finite))
                for (int c = 0; c < 5 + channels; ++c) {
                    T* const number = values(i) + c * P::width;
                    select(finite, P::load(number), P(T(0))).store(number);
                }
            select(finite, P(T(1)), P(T(0))).store(usable(i));
        }
    }
};

/// Weighs the taps of two packs, a and the one after it, and sums them.
template <class T>
class PairOfPacks {
public:
    using P = FeaturePack<T>;

    /// `taps`: the most that one pack weighs at once.
    PairOfPacks(const FeatureList<T>& features, int taps)
        : features_(features), weights_a_(std::size_t(taps)), weights_b_(std::size_t(taps)) {}

    /// The weights exp(-½ distance²) of packs a and a + 1 of `pixels` with the taps of `runs`; spatial_a[k]
    /// is the squared spatial distance of a's k-th tap.
    void weigh(const PackedPixels<T>& pixels, int a, const PackedPixels<T>& taps, const TapRuns& runs,
               const T* spatial_a, const T* spatial_b) {
        runs_ = runs;
        features_.distances(pixels.features(a), pixels.features(a + 1), taps.features(0), taps.step, runs,
                            {weights_a_.data(), weights_b_.data(), spatial_a, spatial_b});
        to_weights(weights_a_.data(), runs.a_last - runs.a_first);
        to_weights(weights_b_.data(), runs.b_last - runs.b_first);
    }

    /// sum_a += the weighted taps of a, in rising order; likewise b.
    void gather(const PackedPixels<T>& taps, WeightedSum<T>& sum_a, WeightedSum<T>& sum_b) const {
        const P* const weight_a = weights_a_.data() - runs_.a_first;
        const P* const weight_b = weights_b_.data() - runs_.b_first;
        WeightedSum<T> a = sum_a, b = sum_b;
        const auto take = [first = taps.values(0), step = taps.step](int t, auto&& add) {
            for (int c = 0; c < 4; ++c) add(P::load(first + t * step + c * P::width), c);
        };
        const auto to_a = [&](int t, P value, int c) { a.channel[c] = multiply_add(weight_a[t], value, a.channel[c]); };
        const auto to_b = [&](int t, P value, int c) { b.channel[c] = multiply_add(weight_b[t], value, b.channel[c]); };
        runs_.for_each([&](int t) { take(t, [&](P value, int c) { to_a(t, value, c); }); },
                       [&](int t) { take(t, [&](P value, int c) { to_a(t, value, c), to_b(t, value, c); }); },
                       [&](int t) { take(t, [&](P value, int c) { to_b(t, value, c); }); });
        sum_a = a;
        sum_b = b;
    }

    /// sums[t] += what a and b give to their taps t, a first; `sums` has 4 numbers a pixel.
    void scatter(const PackedPixels<T>& pixels, int a, const PackedPixels<T>& sums) const {
        const P* const weight_a = weights_a_.data() - runs_.a_first;
        const P* const weight_b = weights_b_.data() - runs_.b_first;
        const WeightedSum<T> value_a = pixels.value(a), value_b = pixels.value(a + 1);
        const auto give = [first = sums.values(0), step = sums.step](int t, auto&& added) {
            for (int c = 0; c < 4; ++c) {
                T* const sum = first + t * step + c * P::width;
                added(P::load(sum), c).store(sum);
            }
        };
        const auto from_a = [&](int t, P sum, int c) { return multiply_add(weight_a[t], value_a.channel[c], sum); };
        const auto from_b = [&](int t, P sum, int c) { return multiply_add(weight_b[t], value_b.channel[c], sum); };
        runs_.for_each([&](int t) { give(t, [&](P sum, int c) { return from_a(t, sum, c); }); },
                       [&](int t) { give(t, [&](P sum, int c) { return from_b(t, from_a(t, sum, c), c); }); },
                       [&](int t) { give(t, [&](P sum, int c) { return from_b(t, sum, c); }); });
    }

private:
    static void to_weights(P* distances, int count) {
        constexpr int together = 4;
        int k = 0;
        for (; k + together <= count; k += together) gaussians<together>(distances + k);
        for (; k < count; ++k) gaussians<1>(distances + k);
    }

    const FeatureList<T>& features_;
    TapRuns runs_{};
    std::vector<P, LargePageAllocator<P>> weights_a_, weights_b_;
};

/// A pack's means, and 1 in a fourth number, or 0 where nothing usable was in reach or the pixel's own features are
/// not finite: then there is no mean.
template <class T>
Homogeneous<T> means(const WeightedSum<T>& sum, const T* usable) {
    using P = FeaturePack<T>;
    const P weight = sum.channel[3];
    const auto filtered = (P::load(usable) > P(T(0))) & (weight > P(T(0)));
    return {sum.channel[0] / weight, sum.channel[1] / weight, sum.channel[2] / weight,
            select(filtered, P(T(1)), P(T(0)))};
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
