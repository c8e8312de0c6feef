#pragma once
#include <lambent/denoise/cross_bilateral.hpp>
#include <lambent/denoise/footprint.hpp>
#include <cmath>
#include <string_view>

namespace lambent {
inline namespace LAMBENT_ABI {

/// What the sigmas of DenoiseOptions count.
enum class SigmaUnits {
    relative, ///< illumination in standard deviations of its noise, position in pixels' footprints off the other's
              ///< plane, normal in radians: the same at any exposure, scale and sample count
    absolute, ///< illumination as radiance / albedo, position in world units, normal as 1 - cosine: the original's
};

/// The recommended chain. Infinite sigmas and thresholds switch their part off.
struct DenoiseOptions {
    int kernel = 65;                ///< taps along a side, odd; 0 = off: the output is the radiance, bit for bit
    BilateralForm form = BilateralForm::separable_reuse;
    SigmaUnits units = SigmaUnits::relative;
    double sigma_spatial = 0;       ///< in pixels; 0 = kernel / 6.4
    double sigma_illumination = 2;
    double sigma_position = 2;
    double sigma_normal = 0.3;
    double sigma_material = hard_stop; ///< weight between different materials: exp(-1 / 2 sigma²)
    double second_pass_factor = 1;  ///< on sigma_illumination, in the second pass of the separable forms
    double despike = 3;             ///< clamp to the mean of a pixel's neighbours + this many deviations of them
    double firefly = std::numeric_limits<double>::infinity(); ///< the original's rule: see suppress_fireflies_seed()
};

/// The names that denoise_options() takes.
inline constexpr std::string_view denoise_methods = "best|balanced|fast|naive_2d|reuse_2d|separable|separable_reuse|seed|none";

/// The options of a method: best, balanced and fast, by falling quality; one form of the filter with the sigmas of
/// balanced; seed, the original's absolute sigmas, firefly rule and order; none.
/// throws lambent::Error naming the choices
inline DenoiseOptions denoise_options(std::string_view method) {
    DenoiseOptions o;
    if (method == "balanced" || method == "separable_reuse") return o;
    if (method == "best" || method == "reuse_2d") o.form = BilateralForm::reuse_2d;
    else if (method == "naive_2d") o.form = BilateralForm::naive_2d;
    else if (method == "separable") o.form = BilateralForm::separable;
    else if (method == "fast") o.kernel = 33;
    else if (method == "seed")
        o = {.kernel = 65, .form = BilateralForm::separable_reuse, .units = SigmaUnits::absolute, .sigma_spatial = 10,
             .sigma_illumination = 50, .sigma_position = 2, .sigma_normal = 0.5, .sigma_material = 0.5,
             .second_pass_factor = 1.0 / 3, .despike = std::numeric_limits<double>::infinity(), .firefly = 25};
    else if (method == "none") o.kernel = 0;
    else fail("'" + std::string(method) + "' is no denoising method; there are " + std::string(denoise_methods));
    return o;
}

/// What the chain met on its way.
struct DenoiseReport {
    std::size_t fireflies = 0;  ///< pixels whose illumination was clamped or scaled down
    std::size_t non_finite = 0; ///< pixels that came with a NaN or an infinity
};

/// Denoises a frame into `out`, radiance with the emission in it: despike → cross-bilateral on the illumination →
/// remodulate; emission seen directly is not filtered. Of the planes only radiance is needed; each that is there
/// keeps an edge sharp. `out` may be the very view of the frame's radiance.
/// nan     a pixel that is not finite takes its neighbours' value; nothing reaches further than the kernel
/// threads the same bits for any executor
/// throws  lambent::Error on a bad option, absent radiance or unequal sizes, before anything is written
template <std::floating_point T, Executor E>
DenoiseReport denoise(const FrameView<T>& frame, const std::type_identity_t<PixelView<T, 3>>& out,
                      const DenoiseOptions& options, E& executor) {
    DenoiseReport report;
    require_same_size("denoise: radiance and output", frame.radiance, out);
    if (options.kernel == 0) {
        for (int y = 0; y < out.height(); ++y)
            for (int x = 0; x < out.width(); ++x) out.store(x, y, frame.radiance.load(x, y));
        return report;
    }
    Plane<T, 3> illumination(out.width(), out.height());
    demodulate(frame, illumination.view());
    report.fireflies = suppress_fireflies_seed(illumination.view(), options.firefly);
    CrossBilateralOptions filter{.kernel = options.kernel, .sigma_spatial = options.sigma_spatial,
                                 .second_pass_factor = options.second_pass_factor, .form = options.form};
    const IdentityFeature<T> material(frame.material, options.sigma_material);
    const auto view = illumination.view();
    if (options.units == SigmaUnits::absolute) {
        filter.sigma_illumination = options.sigma_illumination;
        cross_bilateral<T>(view, view, filter, executor, DistanceFeature<T>(frame.position, options.sigma_position),
                           NormalFeature<T>(frame.normal, options.sigma_normal), material);
    } else {
        const Plane<T, 1> footprint = pixel_footprint(frame.position, executor);
        const PlaneDistanceFeature<T> position(frame.position, frame.normal, footprint.view(), options.sigma_position);
        const NormalAngleFeature<T> normal(frame.normal, options.sigma_normal);
        cross_bilateral<T>(view, view, filter, executor, position, normal, material);
    }
    remodulate(frame, illumination.view(), out);
    return report;
}

template <class T>
struct Denoised {
    Plane<T, 3> radiance;
    DenoiseReport report;
};

/// Denoises a frame with planes of its own.
template <std::floating_point T, Executor E>
Denoised<T> denoise(const PixelData<T>& frame, const DenoiseOptions& options, E& executor) {
    Denoised<T> out{Plane<T, 3>(frame.width, frame.height), {}};
    out.report = denoise(frame.view(), out.radiance.view(), options, executor);
    return out;
}

} // namespace LAMBENT_ABI
} // namespace lambent
