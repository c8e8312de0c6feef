#pragma once
#include <lambent/denoise/blend_with_input.hpp>
#include <lambent/denoise/denoised_error.hpp>
#include <lambent/denoise/despike.hpp>
#include <lambent/denoise/light_guides.hpp>
#include <lambent/denoise/light_regression.hpp>
#include <lambent/denoise/restore_energy.hpp>
#include <lambent/denoise/spread_factor.hpp>
#include <lambent/denoise/usable_frame.hpp>
#include <lambent/film/pixel_data.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <type_traits>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// What denoise_light() asks of a frame: what FilmPlanes::statistics gives.
template <class T>
bool has_light_statistics(const FrameView<T>& frame) {
    return !frame.radiance.absent() && !frame.direct.absent() && !frame.indirect.absent() &&
           !frame.root_direct.absent() && !frame.root_direct_variance.absent() && !frame.root_indirect.absent() &&
           !frame.root_indirect_variance.absent() && !frame.variance.absent() && !frame.samples.absent();
}

/// What denoise_light() met on its way.
struct LightDenoiseReport {
    std::size_t non_finite = 0; ///< pixels that came with light that is not finite
    std::size_t spikes = 0;     ///< pixels of direct, and again of indirect light that were clamped
};

/// Of denoise_light().
struct LightDenoiseOptions {
    int radius = 5;             ///< of the regression's windows, in pixels
    int stride = 1;             ///< one model for so many pixels a side: 2 is faster and worse
    double feature_sigma = 5;   ///< see LightRegressionOptions; after one sample 0.6 of it
    int feature_radius = 2;     ///< of the windows in which features are cleaned of their own noise: at most 1 from 8 samples
                                ///< on; 0: they are not
};

namespace detail {

/// How far a pixel outshines its 5 x 5 neighbours in the sum of the channels: the factor that brings it to their mean
/// and `deviations` of theirs. 1 where its own deviation sigma(x, y) says that it is no accident.
template <class T, class Sigma, class E>
Plane<T, 1> outlier_factors(const PixelView<const T, 3>& light, double deviations, Sigma&& sigma, E& executor) {
    const int width = light.width(), height = light.height();
    Plane<T, 1> factors(width, height, T(1)), bright(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const Vec3<T> v = light.load(x, y);
            bright.view().store(x, y, v.x + v.y + v.z);
        }
    executor.parallel_for(std::size_t(height), 16, [&](std::size_t begin, std::size_t end) {
        for (int y = int(begin); y < int(end); ++y)
            for (int x = 0; x < width; ++x) {
                const int x0 = std::max(0, x - 2), x1 = std::min(width, x + 3);
                const int y0 = std::max(0, y - 2), y1 = std::min(height, y + 3);
                const auto over_neighbours = [&](auto&& f) {
                    double sum = 0;
                    for (int v = y0; v < y1; ++v)
                        for (int u = x0; u < x1; ++u)
                            if (u != x || v != y) sum += f(double(bright.load(u, v)));
                    return sum;
                };
                const double here = double(bright.load(x, y)), count = double((x1 - x0) * (y1 - y0) - 1);
                if (count < 1) continue;
                const double mean = over_neighbours([](double b) { return b; }) / count;
                if (!(here > mean)) continue;
                const double squares = over_neighbours([&](double b) { return (b - mean) * (b - mean); });
                double limit = mean + deviations * std::sqrt(squares / count);
                if (!(here > limit)) continue;
                const double own = sigma(x, y);
                if (own > 0) limit += (here - limit) * std::clamp(((here - limit) / own - 1) / 2, 0.0, 1.0);
                factors.view().store(x, y, T(limit / here));
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

/// Cleans `light`, a part's without what is not finite, in place. `own`: as LightRegression::run() gives it.
/// Returns the number of pixels that were clamped.
template <class T, class E>
std::size_t clean_part(const FrameView<T>& frame, const LightPart<T>& part, const LightRegression<T>& fit,
                       double samples, Plane<T, 3>& light, Plane<T, 1>& own, E& executor) {
    const int width = light.width(), height = light.height();
    // Sobol's points err less than their sample variance says, the more so the more there are. Without halves that
    // would tell: by how much on the scenes that parameters were chosen with. Halves of few samples tell too little.
    const bool halves = samples >= 8 && !part.root_halves.absent();
    const Plane<T, 1> spread = spread_factor<T>(part.root_variance, halves ? part.root_halves : PixelView<const T, 1>(),
                                                executor);
    const T scale = T(halves ? 1.5 : BySamples{{1, 1, 0.7, 0.6, 0.6}}(samples));
    const auto deviation = [&](int x, int y) {
        const Vec3<T> v = frame.variance.load(x, y);
        const double s = std::sqrt(double(v.x)) + std::sqrt(double(v.y)) + std::sqrt(double(v.z));
        return is_finite(s) ? s * std::sqrt(double(spread.load(x, y))) : 0.0;
    };
    const Plane<T, 1> factors = outlier_factors<T>(light.view(), part.direct || samples < 16 ? 2 : 1, deviation,
                                                   executor);
    Plane<T, 3> root(width, height);
    Plane<T, 1> variance(width, height);
    std::size_t clamped = 0;
    double noise = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const T factor = factors.load(x, y);
            clamped += factor < 1;
            light.view().store(x, y, light.load(x, y) * factor);
            const Vec3<T> r = part.root.load(x, y), v = part.root_variance.load(x, y);
            root.view().store(x, y, is_finite(r) ? r * std::sqrt(factor) : sqrt(max(light.load(x, y), Vec3<T>(0))));
            const T sum = std::min(T(1), scale * spread.load(x, y)) * (v.x + v.y + v.z) * factor;
            variance.view().store(x, y, is_finite(sum) ? sum : T(0));
        }
    if (samples < 2) spatial_variance<T>(root.view(), variance.view());
    for (const T v : variance.values()) noise += double(v);
    if (!(noise > 0)) return clamped;
    for (T& v : variance.values()) v += T(1e-4 * noise / double(variance.values().size()));
    fit.run({std::as_const(light).view(), std::as_const(root).view(), std::as_const(variance).view(),
             test_softness(part.direct, samples)}, light.view(), executor, own.view());
    return clamped;
}

} // namespace detail

/// Denoises a frame that has statistics of its samples, into `out`, emission included: direct and indirect light apart,
/// each clamped where it outshines its neighbours by accident and fitted by LightRegression; lights seen directly stay
/// as they are. Where the sum differs from the input by more than noise, the input is blended in; what clamping and
/// blending took is given back. `out` may be the frame's radiance. Consistent: with the samples' noise the error goes
/// to 0, unlike that of filters whose windows are fixed. `error`, where there is one, gets denoised_error().
/// samples their mean number in a pixel chooses the parameters
/// nan     light that is not finite, or beyond 7e16 in float, is repaired from its neighbours; features and variances
///         that are not, negative, or as far beyond count as 0
/// threads the same bits for any executor
/// throws  lambent::Error when planes are absent or of unequal size, before anything is written
/// cost    2 · (2 · radius + 1)² / stride² taps of about 110 operations a pixel; some 280 bytes a pixel, by count
template <std::floating_point T, Executor E>
LightDenoiseReport denoise_light(const FrameView<T>& input, const std::type_identity_t<PixelView<T, 3>>& out,
                                 const LightDenoiseOptions& options, E& executor,
                                 const std::type_identity_t<PixelView<T, 3>>& error = {}) {
    require(has_light_statistics(input), "denoise_light: the frame has no statistics of its samples");
    require(options.radius >= 1 && options.radius <= 8 && (options.stride == 1 || options.stride == 2),
            "denoise_light: radius must be 1 to 8, stride 1 or 2");
    require_same_size("denoise_light: radiance and output", input.radiance, out);
    if (!error.absent()) require_same_size("denoise_light: radiance and error", input.radiance, error);
    const auto same_size = [&](const auto&... planes) {
        const auto check = [&](const auto& plane) {
            if (!plane.absent()) require_same_size("denoise_light: radiance and another plane", input.radiance, plane);
        };
        (check(planes), ...);
    };
    same_size(input.samples, input.variance, input.direct, input.root_direct, input.root_direct_variance,
              input.indirect, input.root_indirect, input.root_indirect_variance, input.albedo, input.albedo_variance,
              input.normal, input.normal_variance, input.depth, input.depth_variance, input.halves,
              input.root_direct_halves, input.root_indirect_halves);
    const detail::UsableFrame<T> usable(input);
    const FrameView<T>& frame = usable.view();
    const int width = out.width(), height = out.height();
    const auto each = [&](auto&& f) {
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) f(x, y);
    };
    LightDenoiseReport report;
    double samples = 0, counted = 0;
    each([&](int x, int y) {
        const double n = double(frame.samples.load(x, y));
        samples += n;
        counted += n > 0;
        report.non_finite += !is_finite(frame.radiance.load(x, y)) || !is_finite(frame.direct.load(x, y)) ||
                             !is_finite(frame.indirect.load(x, y));
    });
    samples /= std::max(1.0, counted);
    // feature_noise() errs towards more.
    const double feature_sigma = options.feature_sigma * (samples < 2 ? 0.6 : 1);
    LightRegressionOptions regression{.radius = options.radius, .stride = options.stride,
                                      .feature_sigma = feature_sigma, .feature_floor = 3e-4,
                                      .own_vote = options.stride > 1 ? 0.1 : 1e-9};
    regression.ridge = samples < 2 ? 0.1 : samples < 16 ? 1e-3 : 1e-4;

    LightRegression<T> fit(width, height, regression);
    detail::LightGuides<T>(frame, options.feature_radius, samples, executor).set(fit);
    Plane<T, 3> result(width, height), given(width, height); // given: the input, finite
    Plane<T, 1> own(width, height), noise(width, height);
    for (const bool direct : {true, false}) {
        const detail::LightPart<T> part(frame, direct);
        Plane<T, 3> light(width, height);
        each([&](int x, int y) { light.view().store(x, y, part.light.load(x, y)); });
        repair_non_finite(light.view());
        each([&](int x, int y) { given.view().store(x, y, given.load(x, y) + light.load(x, y)); });
        Plane<T, 1> share(width, height, T(1));
        report.spikes += detail::clean_part(frame, part, fit, samples, light, share, executor);
        each([&](int x, int y) {
            result.view().store(x, y, result.load(x, y) + light.load(x, y));
            own.view().store(x, y, own.load(x, y) + share.load(x, y) * part.noise(x, y));
            noise.view().store(x, y, noise.load(x, y) + part.noise(x, y));
        });
    }

    Plane<T, 3> seen(width, height); // lights, directly
    each([&](int x, int y) {
        const Vec3<T> directly = frame.radiance.load(x, y) - frame.direct.load(x, y) - frame.indirect.load(x, y);
        seen.view().store(x, y, max(directly, Vec3<T>(0)));
    });
    repair_non_finite(seen.view());
    each([&](int x, int y) {
        result.view().store(x, y, result.load(x, y) + seen.load(x, y));
        given.view().store(x, y, given.load(x, y) + seen.load(x, y));
        own.view().store(x, y, noise.load(x, y) > 0 ? std::min(T(1), own.load(x, y) / noise.load(x, y)) : T(0));
    });
    blend_with_input<T>(result.view(), frame.radiance, frame.variance, samples, executor);
    restore_energy<T>(result.view(), given.view());
    if (!error.absent())
        denoised_error<T>(result.view(), frame.radiance, frame.variance, frame.halves, own.view(), error, executor);
    each([&](int x, int y) { out.store(x, y, result.load(x, y)); });
    return report;
}

} // namespace LAMBENT_ABI
} // namespace lambent
