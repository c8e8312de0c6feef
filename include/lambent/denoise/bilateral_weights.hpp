#pragma once
#include <lambent/core/exp.hpp>
#include <lambent/denoise/feature.hpp>
#include <array>
#include <cstddef>

/// What the four forms of the cross-bilateral filter share: pixels in homogeneous form and runs of weights.
namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// A pixel as the filters sum it: (r, g, b, 1), or (0, 0, 0, 0) where there is none or it is not finite. Such
/// a tap adds nothing to either sum, whatever its weight, so borders and bad pixels need no test in a loop.
template <class T>
using Homogeneous = std::array<T, 4>;

template <class T>
Homogeneous<T> homogeneous(const Vec3<T>& rgb, bool usable) {
    return usable ? Homogeneous<T>{rgb.x, rgb.y, rgb.z, T(1)} : Homogeneous<T>{};
}

/// A stride of at least `bytes` that keeps the planes of a pixel apart in a cache: at a multiple of 4096 bytes
/// they would all fall into the same few lines.
constexpr std::ptrdiff_t spread_stride(std::ptrdiff_t bytes) { return (bytes + 4095) / 4096 * 4096 + 640; }

/// Running sums of weight · homogeneous pixel, a pack of pixels wide.
template <class T>
struct WeightedSum {
    using P = FeaturePack<T>;
    P channel[4] = {P(T(0)), P(T(0)), P(T(0)), P(T(0))};

    void add(P weight, const T* value, std::ptrdiff_t channel_stride) {
        for (int c = 0; c < 4; ++c)
            channel[c] = multiply_add(weight, P::load(value + c * channel_stride), channel[c]);
    }
    void add(P factor, const WeightedSum& other) {
        for (int c = 0; c < 4; ++c) channel[c] = multiply_add(factor, other.channel[c], channel[c]);
    }
};

/// weights[i] = spatial[i] · exp(-½ distance²) of the pack at `center` and the one at taps + i · step.
template <class T>
void bilateral_weights(const FeatureList<T>& features, const T* center, const T* taps, std::ptrdiff_t step,
                       std::ptrdiff_t channel_stride, const T* spatial, int count, FeaturePack<T>* weights) {
    using P = FeaturePack<T>;
    if (features.empty()) {
        for (int i = 0; i < count; ++i) weights[i] = P(spatial[i]);
        return;
    }
    features.distances(center, taps, step, channel_stride, count, weights);
    for (int i = 0; i < count; ++i) weights[i] = P(spatial[i]) * exp_of_negative(weights[i] * P(T(-0.5)));
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
