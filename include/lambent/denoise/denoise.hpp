#pragma once
#include <lambent/denoise/denoise_light.hpp>
#include <lambent/denoise/denoise_options.hpp>
#include <lambent/denoise/filter_steps.hpp>
#include <lambent/denoise/usable_frame.hpp>
#include <concepts>
#include <optional>
#include <type_traits>

namespace lambent {
inline namespace LAMBENT_ABI {

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
    require_same_size("denoise: radiance and output", input.radiance, out);
    require_equal_sizes("denoise: radiance and another plane", input);
    const bool coarse = options.noise == NoiseUse::coarse_regression;
    if ((coarse || options.noise == NoiseUse::regression) && has_light_statistics(input)) {
        const LightDenoiseReport light = denoise_light(input, out, {.stride = coarse ? 2 : 1}, executor, error);
        return {.non_finite = light.non_finite, .used = options.noise, .error = !error.absent(), .spikes = light.spikes,
                .bilateral = light.bilateral};
    }
    const bool by_atrous = options.noise == NoiseUse::atrous && !input.variance.absent() && !input.samples.absent();
    std::optional<detail::UsableFrame<T>> usable;
    const FrameView<T>& frame = by_atrous ? usable.emplace(input).view() : input;
    const PixelWindow all{0, 0, out.width(), out.height()};
    detail::FilterSteps<T> steps(out.width(), out.height(), options, by_atrous);
    steps.count(all, frame);
    if (steps.needs_measure()) detail::measure(steps, [&](auto&& step) { step(all, frame); }, executor);
    steps.filter(all, frame, out, executor);
    return steps.report();
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
