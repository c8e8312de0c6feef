#pragma once
#include <lambent/denoise/filter_steps.hpp>
#include <lambent/denoise/light_steps.hpp>
#include <lambent/denoise/usable_frame.hpp>
#include <lambent/film/pixel_data.hpp>
#include <lambent/film/window_of.hpp>
#include <algorithm>
#include <concepts>
#include <type_traits>
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

namespace detail {

/// An image cut into tiles of this size, smaller at its right and lower end, row by row.
inline std::vector<PixelWindow> tiles_of(int width, int height, int tile_width, int tile_height) {
    std::vector<PixelWindow> tiles;
    for (int y = 0; y < height; y += tile_height)
        for (int x = 0; x < width; x += tile_width)
            tiles.push_back({x, y, std::min(x + tile_width, width), std::min(y + tile_height, height)});
    return tiles;
}

} // namespace detail

/// Denoises a frame that has statistics of its samples, into `out`, emission included: direct and indirect light apart,
/// each clamped where it outshines its neighbours by accident and fitted by LightRegression; lights seen directly stay
/// as they are. Where the sum differs from the input by more than noise, the input is blended in. Where most samples find
/// no light a wide cross_bilateral() takes the place of all that. What is lacking is given back. `out` may be the frame's
/// radiance. Consistent: with the samples' noise the error goes to 0, unlike that of filters whose windows are fixed.
/// `error`, where there is one, gets denoised_error().
/// samples their mean number in a pixel chooses the parameters
/// nan     light that is not finite, or beyond 7e16 in float, is repaired from its neighbours up to 8 pixels away;
///         features and variances that are not, negative, or as far beyond count as 0
/// threads the same bits for any executor
/// throws  lambent::Error when planes are absent or of unequal size, before anything is written
/// cost    2 · (2 · radius + 1)² / stride² taps of about 110 operations a pixel; by count 198 bytes a pixel of
///         256 x 144, 166 of 640 x 360, and less the larger a frame: parts of half a million pixels are done one after
///         the other
template <std::floating_point T, Executor E>
LightDenoiseReport denoise_light(const FrameView<T>& input, const std::type_identity_t<PixelView<T, 3>>& out,
                                 const LightDenoiseOptions& options, E& executor,
                                 const std::type_identity_t<PixelView<T, 3>>& error = {}) {
    require(has_light_statistics(input), "denoise_light: the frame has no statistics of its samples");
    require(options.radius >= 1 && options.radius <= 8 && (options.stride == 1 || options.stride == 2),
            "denoise_light: radius must be 1 to 8, stride 1 or 2");
    require_same_size("denoise_light: radiance and output", input.radiance, out);
    if (!error.absent()) require_same_size("denoise_light: radiance and error", input.radiance, error);
    require_equal_sizes("denoise_light: radiance and another plane", input);
    const detail::UsableFrame<T> usable(input);
    const FrameView<T>& frame = usable.view();
    const int width = out.width(), height = out.height();
    constexpr int at_once = 1 << 19; // pixels: more only take more memory
    const std::vector<PixelWindow> tiles =
        detail::tiles_of(width, height, width, std::max(16, at_once / std::max(1, width) / 16 * 16));
    detail::LightSteps<T> steps(width, height, options);
    Plane<T, 4> kept(width, height);
    for (const PixelWindow& t : tiles) steps.count(t, window_of(frame, t));
    const auto on_each = [&](auto&& step) {
        for (const PixelWindow& t : tiles) step(t, window_of(frame, steps.around(t)));
    };
    on_each([&](const PixelWindow& t, const FrameView<T>& planes) { steps.clamp(t, planes, executor); });
    if (steps.choose_filter()) detail::measure(steps, on_each, executor);
    on_each([&](const PixelWindow& t, const FrameView<T>& planes) {
        steps.fit(t, planes, window_of(kept.view(), t), executor);
    });
    steps.solve();
    const PixelWindow all{0, 0, width, height};
    steps.finish(all, frame, kept.view(), out, error, executor);
    return steps.report();
}

} // namespace LAMBENT_ABI
} // namespace lambent
