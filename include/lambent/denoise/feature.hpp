#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/core/simd.hpp>
#include <lambent/film/pixel_view.hpp>
#include <array>
#include <concepts>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

template <class T>
using FeaturePack = Pack<T, native_width<T>>; ///< as many pixels at once as a register holds

/// What tells two pixels apart: a small struct that keeps a few numbers a pixel and turns two pixels' numbers
/// into a distance. To add a feature, write one:
///   Scalar            float or double
///   channels          how many numbers it keeps a pixel
///   width(), height() the size of its plane, which must be the image's
///   active()          false: it tells nothing apart (no plane, a constant plane, sigma infinite), leave it out
///   prepare(x, y)     the numbers of one pixel, best in units of sigma; a pixel where one is not finite is
///                     neither filtered nor used
///   distance2(a, b)   squared distance in sigmas of pixels with the numbers a[0..channels) and b, many at
///                     once: symmetric, >= 0; the weight is exp(-½ · the sum over features)
template <class F>
concept PixelFeature = requires(const F& feature, const FeaturePack<typename F::Scalar>* pixels) {
    { feature.width() } -> std::convertible_to<int>;
    { feature.height() } -> std::convertible_to<int>;
    { feature.active() } -> std::convertible_to<bool>;
    { feature.prepare(0, 0) } -> std::same_as<std::array<typename F::Scalar, std::size_t(F::channels)>>;
    { feature.distance2(pixels, pixels) } -> std::same_as<FeaturePack<typename F::Scalar>>;
};

namespace detail {
/// A feature behind function pointers that work on runs of pixels, so that the filters are compiled once for
/// any choice of features, and one that is not active costs nothing.
template <class T>
struct AnyFeature {
    using P = FeaturePack<T>;

    /// Writes the numbers of pixels (x .. x + count, y): channel c of pixel i to
    /// out[c · channel_stride + i · step]; multiplies usable[i · step] by 0 where one is not finite.
    void (*import)(const void* feature, int x, int y, int count, T* out, std::ptrdiff_t step,
                   std::ptrdiff_t channel_stride, T* usable);
    /// distances[i] = or += distance2 of the pack at `center` and that at taps + i · step, i < count.
    using Distances = void (*)(const void* feature, const T* center, const T* taps, std::ptrdiff_t step,
                               std::ptrdiff_t channel_stride, int count, P* distances);
    Distances set, add;
    const void* feature;
    int channels;
};

template <class F, bool Add>
void feature_distances(const void* erased, const typename F::Scalar* center, const typename F::Scalar* taps,
                       std::ptrdiff_t step, std::ptrdiff_t channel_stride, int count,
                       FeaturePack<typename F::Scalar>* distances) {
    using P = FeaturePack<typename F::Scalar>;
    const F feature = *static_cast<const F*>(erased); // a copy, which stores to `distances` cannot alias
    P a[F::channels], b[F::channels];
    for (int c = 0; c < F::channels; ++c) a[c] = P::load(center + c * channel_stride);
    for (int i = 0; i < count; ++i, taps += step) {
        for (int c = 0; c < F::channels; ++c) b[c] = P::load(taps + c * channel_stride);
        const P distance = feature.distance2(a, b);
        distances[i] = Add ? distances[i] + distance : distance;
    }
}

template <class F>
void feature_import(const void* erased, int x, int y, int count, typename F::Scalar* out, std::ptrdiff_t step,
                    std::ptrdiff_t channel_stride, typename F::Scalar* usable) {
    using T = typename F::Scalar;
    const F feature = *static_cast<const F*>(erased);
    for (int i = 0; i < count; ++i) {
        const std::array<T, std::size_t(F::channels)> numbers = feature.prepare(x + i, y);
        bool finite = true;
        for (const T number : numbers) finite = finite && is_finite(number);
        for (std::size_t c = 0; c < numbers.size(); ++c)
            out[std::ptrdiff_t(c) * channel_stride + i * step] = finite ? numbers[c] : T(0);
        if (!finite) usable[i * step] = 0;
    }
}

/// The active ones of a filter's features; keeps pointers to them.
template <class T>
class FeatureList {
public:
    /// throws lambent::Error when the feature is active and its plane is not width × height
    template <PixelFeature F>
    void add(const F& feature, int width, int height) {
        static_assert(std::same_as<typename F::Scalar, T>, "features and image must share one scalar type");
        if (!feature.active()) return;
        require(feature.width() == width && feature.height() == height, [&] {
            return "cross_bilateral: a feature of " + std::to_string(feature.width()) + " x " +
                   std::to_string(feature.height()) + " pixels for an image of " + std::to_string(width) + " x " +
                   std::to_string(height);
        });
        features_.push_back({feature_import<F>, feature_distances<F, false>, feature_distances<F, true>,
                             std::addressof(feature), F::channels});
        channels_ += F::channels;
    }
    template <PixelFeature F>
    void add(const F&&, int, int) = delete;

    int channels() const { return channels_; }
    bool empty() const { return features_.empty(); }

    /// All features of a run of pixels, one after the other; `usable` is set to 1 or 0.
    void import(int x, int y, int count, T* out, std::ptrdiff_t step, std::ptrdiff_t channel_stride, T* usable) const {
        for (int i = 0; i < count; ++i) usable[i * step] = 1;
        for (const auto& f : features_) {
            f.import(f.feature, x, y, count, out, step, channel_stride, usable);
            out += f.channels * channel_stride;
        }
    }

    /// Sums of the squared distances of one pack of pixels to `count` packs of taps. Not for an empty list.
    void distances(const T* center, const T* taps, std::ptrdiff_t step, std::ptrdiff_t channel_stride, int count,
                   FeaturePack<T>* out) const {
        bool first = true;
        for (const auto& f : features_) {
            (first ? f.set : f.add)(f.feature, center, taps, step, channel_stride, count, out);
            center += f.channels * channel_stride;
            taps += f.channels * channel_stride;
            first = false;
        }
    }

private:
    std::vector<AnyFeature<T>> features_;
    int channels_ = 0;
};
} // namespace detail

} // namespace LAMBENT_ABI
} // namespace lambent
