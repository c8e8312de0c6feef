#pragma once
#include <lambent/denoise/light_steps.hpp>
#include <lambent/denoise/usable_frame.hpp>
#include <lambent/film/pixel_data.hpp>
#include <lambent/film/window_of.hpp>
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

/// All steps but the last. planes(window) gives the frame's planes there; keep(tile, view) takes what finish() asks for.
template <class T, class Planes, class Keep, class E>
void run_light_steps(LightSteps<T>& steps, const std::vector<PixelWindow>& tiles, Planes&& planes, Keep&& keep,
                     E& executor) {
    for (const PixelWindow& tile : tiles) steps.count(tile, planes(tile));
    for (const PixelWindow& tile : tiles) steps.clamp(tile, planes(steps.around(tile)), executor);
    for (const PixelWindow& tile : tiles) {
        Plane<T, 4> kept(tile.width(), tile.height());
        steps.fit(tile, planes(steps.around(tile)), kept.view(), executor);
        keep(tile, std::as_const(kept).view());
    }
    steps.solve();
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
/// cost    2 · (2 · radius + 1)² / stride² taps of about 110 operations a pixel; MEMORY
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
    constexpr int at_once = 1 << 19; // pixels: more only take more memory
    const int rows = std::max(at_once / width, 1) / 16 * 16;
    detail::LightSteps<T> steps(width, height, options);
    Plane<T, 4> kept(width, height);
    detail::run_light_steps(
        steps, detail::tiles_of(width, height, width, std::max(rows, 16)),
        [&](const PixelWindow& window) { return window_of(frame, window); },
        [&](const PixelWindow& tile, const PixelView<const T, 4>& part) {
            const PixelView<T, 4> to = window_of(kept.view(), tile);
            for (int y = 0; y < tile.height(); ++y)
                for (int x = 0; x < tile.width(); ++x) to.store(x, y, part.load(x, y));
        },
        executor);
    const PixelWindow all{0, 0, width, height};
    steps.finish(all, frame, kept.view(), out, error, executor);
    return steps.report();
}

} // namespace LAMBENT_ABI
} // namespace lambent
