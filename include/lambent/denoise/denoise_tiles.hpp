#pragma once
#include <lambent/denoise/denoise_light.hpp>
#include <lambent/denoise/denoise_options.hpp>
#include <lambent/denoise/filter_steps.hpp>
#include <lambent/denoise/usable_frame.hpp>
#include <lambent/film/window_of.hpp>
#include <concepts>
#include <cstddef>
#include <string>
#include <utility>

namespace lambent {
inline namespace LAMBENT_ABI {

/// A frame's planes by windows: `frame(window)` gives a FrameView of the window's size with the same planes each time.
/// They have to stay until the next call.
template <class S, class T>
concept TileSource = requires(S& source, const PixelWindow& window) {
    { source(window) } -> std::convertible_to<FrameView<T>>;
};

/// Where the result of each tile goes: `result(tile, radiance, error)`, both of the tile's size. The error is absent where
/// the frame has no statistics of its samples. Each tile comes once.
template <class S, class T>
concept TileSink = requires(S& sink, const PixelWindow& tile, const PixelView<const T, 3>& plane) {
    sink(tile, plane, plane);
};

/// Where denoise_tiles() keeps four numbers a pixel between two of its passes. Tiles are stored once, then loaded by
/// windows that reach over them.
template <class S, class T>
concept TileStore = requires(S& store, const PixelWindow& window, const PixelView<const T, 4>& in,
                             const PixelView<T, 4>& out) {
    store.store(window, in);
    store.load(window, out);
};

/// Keeps them in memory: four numbers a pixel of the whole image.
template <std::floating_point T>
class MemoryStore {
public:
    void store(const PixelWindow& window, const PixelView<const T, 4>& from) {
        copy(from, window_of(plane_.view(), window));
    }
    void load(const PixelWindow& window, const PixelView<T, 4>& to) const { copy(window_of(plane_.view(), window), to); }
    MemoryStore(int width, int height) : plane_(width, height) {}

private:
    static void copy(const PixelView<const T, 4>& from, const PixelView<T, 4>& to) {
        for (int y = 0; y < to.height(); ++y)
            for (int x = 0; x < to.width(); ++x) to.store(x, y, from.load(x, y));
    }
    Plane<T, 4> plane_;
};

/// How denoise_tiles() cuts an image.
struct TileSize {
    int width = 512, height = 512; ///< in pixels; taken up to multiples of 64 and 16
};

/// denoise() of an image that does not fit into memory, tile by tile, to the same bits; filters over whole windows
/// (BilateralForm::naive_2d and reuse_2d) add up their taps in another order: to 1e-5. Planes are asked for by windows:
/// the tile, and as far around it as its pixels depend on (29 pixels for `best` and `balanced`, and up to the next tile
/// of 64 x 16, where most samples find no light 50 to 146; 84 for `fast` with one sample; 50 for the filter of 33 taps), as
/// far as the image goes.
///   denoise_tiles<float>(width, height, {}, [&](const PixelWindow& w) { return planes_from_file(w); },
///       [&](const PixelWindow& w, const auto& radiance, const auto& error) { write(w, radiance); }, options, threads);
/// frame    is asked for each tile up to six times, first of the tiles alone: what one pixel is depends on the mean
///          number of samples, light and noise of all. Planes of statistics have to be there everywhere, or nowhere
/// result   comes when windows are read for the last time; they overlap, so it must not go where they come from
/// store    keeps four numbers a pixel of images that have statistics; by default in memory
/// memory   for `best` some 200 bytes a pixel of a tile with what is around it (22 MB for 256 x 256), and 1.5 a pixel of
///          the image
/// threads  the same bits for any executor
/// throws   lambent::Error as denoise(), and when planes have another size than the window
template <std::floating_point T, TileSource<T> Frame, TileSink<T> Result, TileStore<T> Store, Executor E>
DenoiseReport denoise_tiles(int width, int height, const TileSize& size, Frame&& frame, Result&& result,
                            const DenoiseOptions& options, E& executor, Store&& store) {
    require(width > 0 && height > 0 && size.width > 0 && size.height > 0, [&] {
        return "denoise_tiles: an image of " + std::to_string(width) + " x " + std::to_string(height) + " in tiles of " +
               std::to_string(size.width) + " x " + std::to_string(size.height);
    });
    using Light = detail::LightSteps<T>;
    const auto up = [](int value, int unit, int all) { return value >= all ? all : (value + unit - 1) / unit * unit; };
    const std::vector<PixelWindow> tiles =
        detail::tiles_of(width, height, up(size.width, Light::tile_x, width), up(size.height, Light::tile_y, height));
    const auto planes = [&](const PixelWindow& window) {
        const FrameView<T> view = frame(window);
        const auto check = [&](const auto& plane) {
            require(plane.absent() || (plane.width() == window.width() && plane.height() == window.height()), [&] {
                return "denoise_tiles: a plane of " + std::to_string(plane.width()) + " x " +
                       std::to_string(plane.height()) + " for a window of " + std::to_string(window.width()) + " x " +
                       std::to_string(window.height());
            });
        };
        for_each_plane(check, view);
        require(!view.radiance.absent(), "denoise_tiles: the frame has no radiance plane");
        return view;
    };
    const FrameView<T> first = planes(tiles.front());
    const bool coarse = options.noise == NoiseUse::coarse_regression;
    if ((coarse || options.noise == NoiseUse::regression) && has_light_statistics(first)) {
        Light steps(width, height, {.stride = coarse ? 2 : 1});
        const auto usable = [&](const PixelWindow& window, auto&& use) {
            const FrameView<T> view = planes(window);
            require(has_light_statistics(view), "denoise_tiles: a window has no statistics of its samples");
            use(detail::UsableFrame<T>(view).view());
        };
        for (const PixelWindow& t : tiles) usable(t, [&](const auto& view) { steps.count(t, view); });
        const auto on_each = [&](auto&& step) {
            for (const PixelWindow& t : tiles) usable(steps.around(t), [&](const auto& view) { step(t, view); });
        };
        on_each([&](const auto& t, const auto& view) { steps.clamp(t, view, executor); });
        if (steps.choose_filter()) detail::measure(steps, on_each, executor);
        on_each([&](const auto& t, const auto& view) {
            Plane<T, 4> kept(t.width(), t.height());
            steps.fit(t, view, kept.view(), executor);
            store.store(t, std::as_const(kept).view());
        });
        steps.solve();
        for (const PixelWindow& t : tiles) {
            const PixelWindow around = steps.around_result(t);
            Plane<T, 4> kept(around.width(), around.height());
            Plane<T, 3> radiance(t.width(), t.height()), error(t.width(), t.height());
            store.load(around, kept.view());
            usable(around, [&](const auto& view) {
                steps.finish(t, view, kept.view(), radiance.view(), error.view(), executor);
            });
            result(t, std::as_const(radiance).view(), std::as_const(error).view());
        }
        const LightDenoiseReport report = steps.report();
        return {.non_finite = report.non_finite, .used = options.noise, .error = true, .spikes = report.spikes,
                .bilateral = report.bilateral};
    }
    const bool by_atrous = options.noise == NoiseUse::atrous && !first.variance.absent() && !first.samples.absent();
    detail::FilterSteps<T> steps(width, height, options, by_atrous);
    const auto usable = [&](const PixelWindow& window, auto&& use) {
        const FrameView<T> view = planes(window);
        if (!by_atrous) return use(view);
        require(!view.variance.absent() && !view.samples.absent(),
                "denoise_tiles: a window has no variances or samples");
        use(detail::UsableFrame<T>(view).view());
    };
    for (const PixelWindow& t : tiles) usable(t, [&](const auto& view) { steps.count(t, view); });
    const auto on_each = [&](auto&& step) {
        for (const PixelWindow& t : tiles) usable(steps.around(t), [&](const auto& view) { step(t, view); });
    };
    if (steps.needs_measure()) detail::measure(steps, on_each, executor);
    on_each([&](const auto& t, const auto& view) {
        Plane<T, 3> radiance(t.width(), t.height());
        steps.filter(t, view, radiance.view(), executor);
        result(t, std::as_const(radiance).view(), PixelView<const T, 3>());
    });
    return steps.report();
}

/// With a MemoryStore.
template <std::floating_point T, TileSource<T> Frame, TileSink<T> Result, Executor E>
DenoiseReport denoise_tiles(int width, int height, const TileSize& size, Frame&& frame, Result&& result,
                            const DenoiseOptions& options, E& executor) {
    return denoise_tiles<T>(width, height, size, frame, result, options, executor, MemoryStore<T>(width, height));
}

} // namespace LAMBENT_ABI
} // namespace lambent
