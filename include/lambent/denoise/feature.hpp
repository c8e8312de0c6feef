#pragma once
#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <lambent/core/numerics.hpp>
#include <lambent/core/simd.hpp>
#include <lambent/film/pixel_packs.hpp>
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
///                     neither filtered nor used. Or, several times as fast:
///   prepare(x, y, count)       those of `count` pixels of a row, a pack a number; further lanes may hold anything
///   prefetch(x, y, count)      optional: asks for the memory that prepare will read, at any x and y; always_inline,
///                     else gcc takes it for a function without effect
///   add_distance2(a, b, sum)   sum + squared distance, in sigmas, of pixels with the numbers a[0..channels) and
///                     b, many at once; symmetric, >= 0; the weight is exp(-½ · the sum over features)
template <class F>
concept PixelFeature = requires(const F& feature, const FeaturePack<typename F::Scalar>* pixels) {
    { feature.width() } -> std::convertible_to<int>;
    { feature.height() } -> std::convertible_to<int>;
    { feature.active() } -> std::convertible_to<bool>;
    requires requires {
        { feature.prepare(0, 0) } -> std::same_as<std::array<typename F::Scalar, std::size_t(F::channels)>>;
    } || requires {
        { feature.prepare(0, 0, 1) } -> std::same_as<std::array<FeaturePack<typename F::Scalar>, std::size_t(F::channels)>>;
    };
    { feature.add_distance2(pixels, pixels, *pixels) } -> std::same_as<FeaturePack<typename F::Scalar>>;
};

namespace detail {
/// The taps that two packs of pixels, a and the b after it, weigh: [a_first, a_last) and [b_first, b_last),
/// where neither of b's ends comes before a's. Most taps are both packs': these are loaded once.
struct TapRuns {
    int a_first, a_last, b_first, b_last;

    /// Calls a(t), both(t) or b(t) for every tap t in rising order.
    template <class A, class Both, class B>
    [[gnu::always_inline]] void for_each(A&& a, Both&& both, B&& b) const {
        for (int t = a_first; t < std::min(b_first, a_last); ++t) a(t);
#pragma GCC unroll 4
        for (int t = b_first; t < a_last; ++t) both(t);
        for (int t = std::max(a_last, b_first); t < b_last; ++t) b(t);
    }
};

/// Squared distances of the taps of packs a and b, tap by tap; the spatial ones are the same for all lanes.
template <class T>
struct TapDistances {
    FeaturePack<T>*a, *b;
    const T *spatial_a, *spatial_b;
};


/// A feature behind function pointers that work on runs of pixels, so that the filters are compiled once for
/// any choice of features, and one that is not active costs nothing.
template <class T>
struct AnyFeature {
    using P = FeaturePack<T>;

    /// Writes the numbers of pixels (x .. x + count, y), no more than a pack of them: channel c of pixel i to
    /// out[c · width + i].
    void (*import)(const void* feature, int x, int y, int count, T* out);
    /// Asks for the memory of pixels (x .. x + count, y), which may lie outside.
    void (*prefetch)(const void* feature, int x, int y, int count);
    /// to.a[t - a_first] += the squared distance of the pack at `a` and that at taps + t · step, for a's taps
    /// t; likewise b. `set` starts from the spatial distances.
    using Distances = void (*)(const void* feature, const T* a, const T* b, const T* taps, std::ptrdiff_t step,
                               const TapRuns& runs, const TapDistances<T>& to);
    Distances set, add;
    const void* feature;
    int channels;
};

template <class F, bool Add>
void feature_distances(const void* erased, const typename F::Scalar* at_a, const typename F::Scalar* at_b,
                       const typename F::Scalar* taps, std::ptrdiff_t step, const TapRuns& runs,
                       const TapDistances<typename F::Scalar>& to) {
    using T = typename F::Scalar;
    using P = FeaturePack<T>;
    const F feature = *static_cast<const F*>(erased); // a copy, which stores of distances cannot alias
    P a[F::channels], b[F::channels], tap[F::channels];
    for (int c = 0; c < F::channels; ++c) {
        a[c] = P::load(at_a + c * P::width);
        b[c] = P::load(at_b + c * P::width);
    }
    const auto load = [&](int t) {
        for (int c = 0; c < F::channels; ++c) tap[c] = P::load(taps + t * step + c * P::width);
    };
    const auto put = [&](const P* pixel, P& sum, T spatial) {
        sum = feature.add_distance2(pixel, tap, Add ? sum : P(spatial));
    };
    const auto put_a = [&, first = runs.a_first](int t) { put(a, to.a[t - first], to.spatial_a[t - first]); };
    const auto put_b = [&, first = runs.b_first](int t) { put(b, to.b[t - first], to.spatial_b[t - first]); };
    runs.for_each([&](int t) { load(t), put_a(t); }, [&](int t) { load(t), put_a(t), put_b(t); },
                  [&](int t) { load(t), put_b(t); });
}

template <class F>
void feature_prefetch(const void* erased, int x, int y, int count) {
    const F& feature = *static_cast<const F*>(erased);
    if constexpr (requires { feature.prefetch(x, y, count); }) feature.prefetch(x, y, count);
}

template <class F>
void feature_import(const void* erased, int x, int y, int count, typename F::Scalar* out) {
    constexpr int width = FeaturePack<typename F::Scalar>::width;
    const F& feature = *static_cast<const F*>(erased);
    if constexpr (requires { feature.prepare(x, y, count); }) {
        const auto numbers = feature.prepare(x, y, count);
        for (int c = 0; c < F::channels; ++c) numbers[std::size_t(c)].store(out + c * width);
    } else {
        for (int i = 0; i < width; ++i) {
            const auto numbers = i < count ? feature.prepare(x + i, y) : decltype(feature.prepare(x, y)){};
            for (int c = 0; c < F::channels; ++c) out[c * width + i] = numbers[std::size_t(c)];
        }
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
        features_.push_back({feature_import<F>, feature_prefetch<F>, feature_distances<F, false>, feature_distances<F, true>,
                             std::addressof(feature), F::channels});
        channels_ += F::channels;
    }
    template <PixelFeature F>
    void add(const F&&, int, int) = delete;

    int channels() const { return channels_; }
    bool empty() const { return features_.empty(); }

    /// All features of a pack of pixels, one after the other: see AnyFeature::import.
    void import(int x, int y, int count, T* out) const {
        for (const auto& f : features_) {
            f.import(f.feature, x, y, count, out);
            out += f.channels * FeaturePack<T>::width;
        }
    }
    void prefetch(int x, int y, int count) const {
        for (const auto& f : features_) f.prefetch(f.feature, x, y, count);
    }

    /// The squared distances of all features and the spatial ones: see AnyFeature::Distances.
    void distances(const T* a, const T* b, const T* taps, std::ptrdiff_t step, const TapRuns& runs,
                   const TapDistances<T>& to) const {
        if (empty()) {
            for (int k = 0; k < runs.a_last - runs.a_first; ++k) to.a[k] = FeaturePack<T>(to.spatial_a[k]);
            for (int k = 0; k < runs.b_last - runs.b_first; ++k) to.b[k] = FeaturePack<T>(to.spatial_b[k]);
        }
        std::ptrdiff_t offset = 0;
        for (const auto& f : features_) {
            (offset == 0 ? f.set : f.add)(f.feature, a + offset, b + offset, taps + offset, step, runs, to);
            offset += f.channels * FeaturePack<T>::width;
        }
    }

private:
    std::vector<AnyFeature<T>> features_;
    int channels_ = 0;
};
} // namespace detail

} // namespace LAMBENT_ABI
} // namespace lambent
