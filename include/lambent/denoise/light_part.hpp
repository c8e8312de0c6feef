#pragma once
#include <lambent/core/executor.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/denoise/by_samples.hpp>
#include <lambent/denoise/despike.hpp>
#include <lambent/denoise/spread_factor.hpp>
#include <lambent/film/pixel_data.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// How far a pixel outshines its 5 x 5 neighbours in the sum of the channels: the factor that brings it to their mean
/// and `deviations` of theirs, or by belief(x, y) in [0, 1] the less near to that.
template <class T, class Belief, class E>
Plane<T, 1> outlier_factors(const PixelView<const T, 3>& light, double deviations, Belief&& belief, E& executor) {
    constexpr int reach = 2;
    const int width = light.width(), height = light.height();
    Plane<T, 1> factors(width, height, T(1));
    executor.parallel_for(std::size_t(height), 16, [&](std::size_t begin, std::size_t end) {
        // Sums of columns over the rows around, with and without the row itself, of the light and of its square: so the
        // neighbours' are never a difference of what the pixel itself has.
        const int first = std::max(0, int(begin) - reach), last = std::min(height, int(end) + reach);
        const std::size_t size = std::size_t(width + 2 * reach);
        std::vector<double> brightness(std::size_t(last - first) * size);
        const auto row_of = [&](int y) { return brightness.data() + std::size_t(y - first) * size; };
        for (int y = first; y < last; ++y)
            for (int x = 0; x < width; ++x) {
                const Vec3<T> value = light.load(x, y);
                row_of(y)[x + reach] = double(value.x + value.y + value.z);
            }
        std::vector<double> all(size), squares(size), others(size), others2(size);
        for (int y = int(begin); y < int(end); ++y) {
            const int y0 = std::max(0, y - reach), y1 = std::min(height, y + reach + 1);
            const double* const here = row_of(y);
            for (auto* sums : {&others, &others2}) std::fill(sums->begin(), sums->end(), 0.0);
            for (int v = y0; v < y1; ++v) {
                if (v == y) continue;
                const double* const b = row_of(v);
                for (std::size_t i = 0; i < size; ++i) others[i] += b[i], others2[i] += b[i] * b[i];
            }
            for (std::size_t i = 0; i < size; ++i) all[i] = others[i] + here[i], squares[i] = others2[i] + here[i] * here[i];
            for (int x = 0; x < width; ++x) {
                const std::size_t i = std::size_t(x + reach);
                const int x0 = std::max(0, x - reach), x1 = std::min(width, x + reach + 1);
                const double count = double((x1 - x0) * (y1 - y0) - 1), b = here[i];
                const double mean = (all[i - 2] + all[i - 1] + others[i] + all[i + 1] + all[i + 2]) / count;
                if (!(b > mean)) continue; // without neighbours too
                const double sum2 = squares[i - 2] + squares[i - 1] + others2[i] + squares[i + 1] + squares[i + 2];
                double limit = mean + deviations * std::sqrt(std::max(0.0, sum2 / count - mean * mean));
                if (!(b > limit)) continue;
                limit += (b - limit) * belief(x, y);
                factors.store(x, y, T(limit / b));
            }
        }
    });
    return factors;
}

/// Variance of 3 x 3 pixels: what there is to go by after one sample.
template <class T>
void spatial_variance(const PixelView<const T, 3>& plane, const PixelView<T, 1>& variance) {
    for (int y = 0; y < plane.height(); ++y)
        for (int x = 0; x < plane.width(); ++x) {
            Vec3<T> sum(0), squares(0);
            T count = 0;
            for (int v = std::max(0, y - 1); v <= std::min(plane.height() - 1, y + 1); ++v)
                for (int u = std::max(0, x - 1); u <= std::min(plane.width() - 1, x + 1); ++u) {
                    const Vec3<T> value = plane.load(u, v) - plane.load(x, y); // differences: no loss of digits
                    sum += value;
                    squares += value * value;
                    count += 1;
                }
            const Vec3<T> v = squares / count - (sum / count) * (sum / count);
            variance.store(x, y, std::max(T(0), v.x) + std::max(T(0), v.y) + std::max(T(0), v.z));
        }
}

/// Direct or indirect light of a frame: what is fitted, and what is known of it.
template <class T>
struct LightPart {
    bool direct;
    PixelView<const T, 3> light, root, root_variance;
    PixelView<const T, 1> root_halves;

    LightPart(const FrameView<T>& frame, bool is_direct)
        : direct(is_direct), light(is_direct ? frame.direct : frame.indirect),
          root(is_direct ? frame.root_direct : frame.root_indirect),
          root_variance(is_direct ? frame.root_direct_variance : frame.root_indirect_variance),
          root_halves(is_direct ? frame.root_direct_halves : frame.root_indirect_halves) {}

    /// The variance of the light, but for a factor, from that of its root: d(r²) = 2 r dr.
    T noise(int x, int y) const {
        const Vec3<T> l = light.load(x, y), v = root_variance.load(x, y);
        const T product = (l.x + l.y + l.z) * (v.x + v.y + v.z);
        return is_finite(product) ? product : T(0);
    }
};

/// By how much tests of patches of radius 1 and 3 may fail.
inline std::array<double, 2> test_softness(bool direct, double samples) {
    using By = BySamples;
    if (direct) return {By{{.12, .25, .5, .35, .5}}(samples), By{{.12, .25, .5, .5, .7}}(samples)};
    return {By{{.25, .5, .5, .7, 1.2}}(samples), By{{.12, .35, .5, .6, 1}}(samples)};
}

/// A part of the light as LightRegression takes it: finite, and clamped where it outshines its neighbours by accident.
template <class T>
struct ClampedPart {
    static constexpr int repair_reach = 8; ///< of repair_non_finite()
    /// How far away a pixel may be to count: neighbours that are repaired, or that tell how evenly samples are spread;
    /// with one sample, as the variance of 3 x 3.
    static constexpr int reach = 1 + std::max(2 + repair_reach, spread_reach);

    Plane<T, 3> light;
    Plane<T, 1> factors;  ///< of the clamp, in [0, 1]
    Plane<T, 1> variance; ///< of the clamped root, summed over channels, as it is for evenly spread samples

    template <class E>
    ClampedPart(const FrameView<T>& frame, const LightPart<T>& part, Plane<T, 3> given, double samples, E& executor)
        : light(std::move(given)), variance(light.width(), light.height()) {
        const int width = light.width(), height = light.height();
        // Sobol's points err less than their sample variance says, the more so the more there are. Without halves that
        // would tell: by how much on the scenes that parameters were chosen with. Halves of few samples tell too little.
        const bool halves = samples >= 8 && !part.root_halves.absent();
        const Plane<T, 1> spread = spread_factor<T>(
            part.root_variance, halves ? part.root_halves : PixelView<const T, 1>(), executor);
        const T scale = T(halves ? 1.5 : BySamples{{1, 1, 0.7, 0.6, 0.6}}(samples));
        // Light that is the pixel's deviation, or less than twice that, may have come by accident: k samples that are all
        // there is to a pixel have a mean of √k deviations. From four times that on, which is 16 samples, it has not. So
        // has not a small part of light that, in all, is eight times its deviation.
        const auto belief = [&](int x, int y) {
            const Vec3<T> v = frame.variance.load(x, y), its = light.load(x, y);
            const double s = std::sqrt(double(v.x)) + std::sqrt(double(v.y)) + std::sqrt(double(v.z));
            const double deviation = s * std::sqrt(double(spread.load(x, y)));
            if (!(deviation > 0) || !is_finite(deviation)) return 0.0;
            const Vec3<T> all = frame.direct.load(x, y) + frame.indirect.load(x, y);
            const double by_part = (double(its.x + its.y + its.z) / deviation - 2) / 2;
            const double by_all = (double(all.x + all.y + all.z) / deviation - 4) / 4;
            return std::clamp(std::max(by_part, is_finite(by_all) ? by_all : 0), 0.0, 1.0);
        };
        const double deviations = part.direct || samples < 16 ? 2 : 1;
        factors = outlier_factors<T>(std::as_const(light).view(), deviations, belief, executor);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const Vec3<T> v = part.root_variance.load(x, y);
                const T factor = factors.load(x, y);
                const T sum = std::min(T(1), scale * spread.load(x, y)) * (v.x + v.y + v.z) * factor;
                variance.store(x, y, is_finite(sum) ? sum : T(0));
                light.store(x, y, light.load(x, y) * factor);
            }
        if (samples < 2) {
            const Plane<T, 3> clamped = root(part);
            spatial_variance<T>(clamped.view(), variance.view());
        }
    }

    Plane<T, 3> root(const LightPart<T>& part) const {
        Plane<T, 3> root(light.width(), light.height());
        for (int y = 0; y < light.height(); ++y)
            for (int x = 0; x < light.width(); ++x) {
                const Vec3<T> r = part.root.load(x, y);
                root.store(x, y, is_finite(r) ? r * std::sqrt(factors.load(x, y))
                                              : sqrt(max(light.load(x, y), Vec3<T>(0))));
            }
        return root;
    }
};

/// A copy of light in which what is not finite is repaired.
template <class T>
Plane<T, 3> repaired(const PixelView<const T, 3>& light) {
    Plane<T, 3> copy(light.width(), light.height());
    for (int y = 0; y < light.height(); ++y)
        for (int x = 0; x < light.width(); ++x) copy.store(x, y, light.load(x, y));
    repair_non_finite(copy.view(), ClampedPart<T>::repair_reach);
    return copy;
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
