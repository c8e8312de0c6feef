#pragma once
#include <lambent/denoise/atrous.hpp>
#include <lambent/denoise/cross_bilateral.hpp>
#include <lambent/denoise/denoise_light.hpp>
#include <lambent/denoise/footprint.hpp>
#include <lambent/denoise/noise_level.hpp>
#include <lambent/denoise/pixel_albedo.hpp>
#include <lambent/denoise/usable_frame.hpp>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

namespace lambent {
inline namespace LAMBENT_ABI {

/// What the sigmas of DenoiseOptions count.
enum class SigmaUnits {
    relative, ///< illumination, of a prefiltered image, in standard deviations of a pixel's noise; position in
              ///< pixel footprints off the other pixel's plane; normal in radians. All grow with the image's
              ///< noise_level(): by up to a factor of 2, and what another material weighs up to 1/2. So the same
              ///< numbers do at any exposure, any scale and any number of samples
    absolute, ///< illumination as radiance / albedo, of the noisy image; position in world units; normal as
              ///< 1 - cosine: the original's
};

/// What a frame's knowledge of its own noise is used for.
enum class NoiseUse {
    filter,            ///< the cross-bilateral filter of DenoiseOptions, whatever the frame has
    regression,        ///< denoise_light() where there are FilmPlanes::statistics, with a model for every pixel
    coarse_regression, ///< likewise, with one for every second pixel a side
    atrous             ///< atrous() of the illumination where there are variances and counts of samples
};

/// What denoise() does. Infinite sigmas and thresholds switch their part off.
struct DenoiseOptions {
    NoiseUse noise = NoiseUse::filter; ///< where the frame has what it takes, all below but despike is of no account
    int kernel = 33; ///< taps along a side, odd; 0 = off: the output is the radiance, bit for bit
    BilateralForm form = BilateralForm::separable_reuse;
    SigmaUnits units = SigmaUnits::relative;
    double sigma_spatial = 0; ///< in pixels; 0 = kernel / 6.4
    double sigma_illumination = 0.23;
    double sigma_position = 8;
    double sigma_normal = 0.5;
    double sigma_material = hard_stop; ///< the weight of another material is exp(-1 / 2 sigma²), more where noise is strong
    double second_pass_factor = 1;     ///< on an absolute sigma_illumination, in the second pass: CrossBilateralOptions
    double despike = 4;                ///< deviations above its neighbours to which a pixel is clamped: despike()
    double firefly = std::numeric_limits<double>::infinity(); ///< threshold of suppress_fireflies_seed()
};

/// The names that denoise_options() takes.
inline constexpr std::string_view denoise_methods =
    "best|balanced|fast|naive_2d|reuse_2d|separable|separable_reuse|seed|none";

/// The options of a method. best and balanced are denoise_light() where the frame has statistics of its samples
/// (FilmPlanes::statistics), fast is atrous() where it has variances. Where it has not: balanced is the filter of
/// DenoiseOptions{}; best weighs whole windows, which leaves no traces along rows and columns and takes four times as
/// long. fast has half the kernel; naive_2d … separable_reuse are the forms of the filter with balanced's sigmas; seed
/// has the original's sigmas and firefly rule; none leaves the image alone.
/// throws lambent::Error that names the choices
inline DenoiseOptions denoise_options(std::string_view method) {
    if (method == "best")
        return {
            .noise = NoiseUse::regression, .kernel = 25, .form = BilateralForm::reuse_2d};
    if (method == "reuse_2d") return {.form = BilateralForm::reuse_2d};
    if (method == "naive_2d") return {.form = BilateralForm::naive_2d};
    if (method == "separable") return {.form = BilateralForm::separable};
    if (method == "balanced") return {.noise = NoiseUse::coarse_regression};
    if (method == "separable_reuse") return {};
    if (method == "fast") return {.noise = NoiseUse::atrous, .kernel = 17, .sigma_illumination = 0.3};
    if (method == "none") return {.kernel = 0};
    if (method == "seed") {
        constexpr double off = std::numeric_limits<double>::infinity();
        return {.kernel = 65, .units = SigmaUnits::absolute, .sigma_spatial = 10, .sigma_illumination = 50,
                .sigma_position = 2, .sigma_normal = 0.5, .sigma_material = 0.5, .second_pass_factor = 1.0 / 3,
                .despike = off, .firefly = 25};
    }
    fail("'" + std::string(method) + "' is no denoising method; there are " + std::string(denoise_methods));
}

/// What denoise() met on its way.
struct DenoiseReport {
    std::size_t non_finite = 0; ///< pixels that came with a NaN or an infinity
    NoiseUse used = NoiseUse::filter; ///< what the frame had what it takes for
    bool error = false;         ///< denoised_error() is known
    std::size_t spikes = 0;     ///< pixels that a clamp or the firefly rule made darker
    BilateralCounts bilateral{}; ///< of all passes of cross_bilateral(): nothing where another filter was used
};

namespace detail {
/// What tells shadows and reflections from noise: the illumination through a small filter that heeds geometry
/// alone, and how much a single pixel's illumination varies about it. The noise comes from the frame's own
/// variance through the same filter; where there is none, as with one sample, from the spread of neighbours.
/// Both in units of the mean noise, so that exposure does not matter, or rather of the power of two below it, so
/// that a pixel far away does not matter either. No noise anywhere leaves `image` absent.
template <class T>
struct LightGuide {
    Plane<T, 3> image;
    Plane<T, 1> deviation;

    template <class Smooth> // smooth(image, out): the small filter, in place too
    LightGuide(const FrameView<T>& frame, const PixelView<const T, 3>& illumination, Smooth&& smooth) {
        const int width = illumination.width(), height = illumination.height();
        Plane<T, 3> mean(width, height), noise(width, height);
        smooth(illumination, mean.view());
        const auto fill_noise = [&](auto&& of) {
            bool any = false;
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    const Vec3<T> v = of(x, y);
                    any = any || max_component(v) > 0;
                    noise.view().store(x, y, v);
                }
            if (any) smooth(noise.view(), noise.view());
            return any;
        };
        const bool sampled = !frame.variance.absent() && fill_noise([&](int x, int y) {
            const Vec3<T> albedo = modulation(frame, x, y);
            return frame.variance.load(x, y) / (albedo * albedo);
        });
        if (!sampled)
            fill_noise([&](int x, int y) {
                const Vec3<T> d = illumination.load(x, y) - mean.load(x, y);
                return d * d;
            });

        deviation.allocate(width, height);
        CompensatedSum<double> sum;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const Vec3<T> v = noise.load(x, y);
                const T d = std::sqrt(std::max(T(0), v.x + v.y + v.z));
                deviation.view().store(x, y, d);
                if (is_finite(d)) sum.add(double(d));
            }
        if (!(sum.value() > 0)) return;
        const T scale = T(std::ldexp(1.0, -std::ilogb(sum.value() / double(deviation.values().size()))));
        for (T& d : deviation.values()) d *= scale;
        for (T& v : mean.values()) v *= scale;
        image = std::move(mean);
    }
};
/// The mean number of samples a pixel; infinite where the frame does not tell.
template <class T>
double mean_samples(const FrameView<T>& frame) {
    if (frame.samples.absent()) return std::numeric_limits<double>::infinity();
    const int width = frame.samples.width(), height = frame.samples.height();
    double samples = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) samples += double(frame.samples.load(x, y));
    return samples / (double(width) * double(height));
}

/// How much sigmas grow in an image of so much noise, by a factor of 1 + noise: where samples seldom find light, a pixel
/// needs neighbours on other surfaces. Another material then weighs noise² / 2 at least.
struct Loosened {
    double noise;
    double sigma(double at_rest) const { return at_rest * (1 + noise); }
    double material(double at_rest) const {
        const double weight = std::min(0.5 * noise * noise, 0.9);
        return weight > 0 ? std::max(at_rest, std::sqrt(-0.5 / std::log(weight))) : at_rest;
    }
};

/// atrous() of what despike() made of the noisy illumination, in place. Noise comes from the frame's variances or,
/// after one sample, from the spread of 7 x 7 pixels; how far light may differ goes with the number of samples.
template <class T, class E>
void atrous_of_illumination(const FrameView<T>& frame, const PixelView<T, 3>& noisy,
                            const PixelView<T, 3>& illumination, E& executor) {
    const int width = illumination.width(), height = illumination.height();
    const auto sum = [](const Vec3<T>& v) { return v.x + v.y + v.z; };
    const double samples = mean_samples(frame);
    Plane<T, 1> variance(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const Vec3<T> deviation = sqrt(max(frame.variance.load(x, y), Vec3<T>(0))) / modulation(frame, x, y);
            const T before = sum(noisy.load(x, y)), after = sum(illumination.load(x, y));
            variance.view().store(x, y, sum(deviation) * sum(deviation) * (before > after ? after / before : T(1)));
        }
    if (samples < 2) {
        const auto light = [&](int x, int y) { return sum(illumination.load(x, y)); };
        const Plane<T, 1> mean = box_mean<T>(width, height, 3, light, executor);
        variance = box_mean<T>(width, height, 3, [&](int x, int y) {
            const T d = light(x, y) - mean.load(x, y);
            return d * d;
        }, executor);
    }
    const AtrousOptions options{.levels = samples < 16 ? 5 : samples < 64 ? 4 : 3,
                                .sigma_light = BySamples{{4, 3, 2, 2}}(samples),
                                .sigma_normal = BySamples{{.3, .3, .15, .1}}(samples)};
    atrous<T>(illumination, variance.view(), frame.normal, frame.depth, illumination, options, executor);
}
} // namespace detail

/// Denoises a frame into `out`, as radiance with the emission in it: despike → cross-bilateral filter of the
/// illumination → remodulate. Emission that is seen directly is not filtered. Only radiance has to be there; each
/// further plane keeps edges sharp. `out` may be the very view of the frame's radiance. `error`, where there is one,
/// gets denoised_error() where the frame's statistics are used, and else stays as it is: the report says so.
/// nan     a pixel that is not finite, or beyond 1e30 in float (is_summable(); 7e16 where the frame's variances are used),
///         takes its neighbours' value and gives nothing; what lies further away than the kernel is wide is the same to the bit
/// threads the same bits for any executor
/// throws  lambent::Error on a bad option, absent radiance or unequal sizes, before anything is written
/// cost    three filters of `form`, two of them 9 taps wide or, by the noise, up to half as wide as the other; absolute
///         units: one filter
template <std::floating_point T, Executor E>
DenoiseReport denoise(const FrameView<T>& input, const std::type_identity_t<PixelView<T, 3>>& out,
                      const DenoiseOptions& options, E& executor,
                      const std::type_identity_t<PixelView<T, 3>>& error = {}) {
    require(!input.radiance.absent(), "denoise: the frame has no radiance plane");
    detail::require_planes("denoise", input, out);
    const bool by_atrous = options.noise == NoiseUse::atrous && !input.variance.absent() && !input.samples.absent();
    std::optional<detail::UsableFrame<T>> usable;
    const FrameView<T>& frame = by_atrous ? usable.emplace(input).view() : input;
    const bool coarse = options.noise == NoiseUse::coarse_regression;
    if ((coarse || options.noise == NoiseUse::regression) && has_light_statistics(frame)) {
        const LightDenoiseReport light = denoise_light(frame, out, {.stride = coarse ? 2 : 1}, executor, error);
        return {
            .non_finite = light.non_finite, .used = options.noise, .error = !error.absent(), .spikes = light.spikes};
    }
    const bool relative = options.units == SigmaUnits::relative;
    CrossBilateralOptions filter{.kernel = options.kernel, .sigma_spatial = options.sigma_spatial,
                                 .second_pass_factor = options.second_pass_factor, .form = options.form};
    if (!relative) filter.sigma_illumination = options.sigma_illumination;
    detail::check(filter);
    const IdentityFeature<T> material(frame.material, options.sigma_material);
    const Plane<T, 1> footprint = pixel_footprint(frame.position, executor);
    const PlaneDistanceFeature<T> plane(frame.position, frame.normal, footprint.view(), options.sigma_position);
    const NormalAngleFeature<T> angle(frame.normal, options.sigma_normal);
    DenoiseReport report;
    if (options.kernel == 0) {
        for (int y = 0; y < out.height(); ++y)
            for (int x = 0; x < out.width(); ++x) out.store(x, y, frame.radiance.load(x, y));
        return report;
    }

    Plane<T, 3> noisy(out.width(), out.height()), illumination(out.width(), out.height());
    demodulate(frame, noisy.view());
    report.non_finite = repair_non_finite(noisy.view(), options.kernel / 2);
    report.spikes = suppress_fireflies_seed(noisy.view(), options.firefly);
    report.spikes += despike<T>(noisy.view(), illumination.view(), options.despike, executor);
    const PixelView<T, 3> view = illumination.view();
    if (by_atrous) {
        detail::atrous_of_illumination(frame, noisy.view(), view, executor);
        report.used = NoiseUse::atrous;
    } else if (!relative) {
        const DistanceFeature<T> position(frame.position, options.sigma_position);
        const NormalFeature<T> normal(frame.normal, options.sigma_normal);
        report.bilateral = cross_bilateral<T>(view, view, filter, executor, position, normal, material);
    } else {
        // In steps, so that a pixel far away seldom matters. Guides only tell light from noise: geometry's sigmas grow
        // twice as much for them.
        const int steps = int(std::lround(16 * noise_level<T>(view, executor)));
        const double noise = steps / 16.0;
        const auto with_geometry = [&](const detail::Loosened& loosened, auto&& run) {
            const PlaneDistanceFeature<T> off_plane(frame.position, frame.normal, footprint.view(),
                                                    loosened.sigma(options.sigma_position));
            const NormalAngleFeature<T> turned(frame.normal, loosened.sigma(options.sigma_normal));
            run(off_plane, turned, MaterialFeature<T>(frame.material, loosened.material(options.sigma_material)));
        };
        CrossBilateralOptions small = filter;
        const int widest = std::max(1, filter.kernel / 4);
        small.kernel = 2 * std::clamp(steps, std::min(4, widest), widest) + 1;
        small.sigma_spatial = 0;
        const detail::LightGuide<T> guide(frame, view, [&](const PixelView<const T, 3>& from, const PixelView<T, 3>& to) {
            with_geometry({2 * noise}, [&](const auto&... geometry) {
                report.bilateral += cross_bilateral<T>(from, to, small, executor, geometry...);
            });
        });
        const RelativeDistanceFeature<T> light(guide.image.view(), guide.deviation.view(),
                                               detail::Loosened{noise}.sigma(options.sigma_illumination), 1e-3);
        with_geometry({noise}, [&](const auto&... geometry) {
            report.bilateral += cross_bilateral<T>(view, view, filter, executor, light, geometry...);
        });
    }
    FrameView<T> shown = frame;
    Plane<T, 3> albedo;
    if (relative && !by_atrous && !frame.albedo.absent() && detail::mean_samples(frame) < 2) {
        albedo = pixel_albedo(frame, executor);
        shown.albedo = albedo.view();
    }
    remodulate(shown, illumination.view(), out);
    return report;
}

/// What denoise() gives of a frame with planes of its own.
template <class T>
struct Denoised {
    Plane<T, 3> radiance;
    Plane<T, 3> error; ///< denoised_error(); absent where the frame has no statistics of its samples
    DenoiseReport report;
};

/// Denoises a frame with planes of its own.
template <std::floating_point T, Executor E>
Denoised<T> denoise(const PixelData<T>& frame, const DenoiseOptions& options, E& executor) {
    Denoised<T> out{Plane<T, 3>(frame.width, frame.height), Plane<T, 3>(frame.width, frame.height), {}};
    out.report = denoise(frame.view(), out.radiance.view(), options, executor, out.error.view());
    if (!out.report.error) out.error = {};
    return out;
}

} // namespace LAMBENT_ABI
} // namespace lambent
