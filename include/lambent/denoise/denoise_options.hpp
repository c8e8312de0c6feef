#pragma once
#include <lambent/core/error.hpp>
#include <lambent/denoise/cross_bilateral.hpp>
#include <lambent/denoise/feature.hpp>
#include <cstddef>
#include <limits>
#include <string>
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
        return {.noise = NoiseUse::regression, .kernel = 25, .form = BilateralForm::reuse_2d};
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
    BilateralCounts bilateral{}; ///< of all passes of cross_bilateral(): nothing where other filters do all
};

} // namespace LAMBENT_ABI
} // namespace lambent
