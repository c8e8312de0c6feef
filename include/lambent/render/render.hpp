#pragma once
#include <lambent/core/executor.hpp>
#include <lambent/film/film.hpp>
#include <lambent/film/film_pass.hpp>
#include <lambent/film/region.hpp>
#include <lambent/render/integrator.hpp>
#include <lambent/render/pixel_filter.hpp>
#include <lambent/render/packed_paths.hpp>
#include <lambent/render/sample_batch.hpp>
#include <lambent/sampling/sampler.hpp>
#include <lambent/sampling/warp.hpp>
#include <lambent/scene/camera.hpp>
#include <lambent/scene/prepared_scene.hpp>
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// One more than the largest sample index.
inline constexpr std::uint64_t max_samples = std::uint64_t(1) << 32;

/// What render() samples, and which planes it fills.
struct RenderOptions {
    int width = 1280, height = 720;
    std::uint64_t first_sample = 0;   ///< sample indices [first_sample, end_sample) of every pixel
    std::uint64_t end_sample = 16;
    PixelWindow window{};             ///< of the image to render; empty = all of it
    PixelFilter filter = PixelFilter::box;
    FilmPlanes planes = FilmPlanes::features;
    double firefly_clamp = std::numeric_limits<double>::infinity(); ///< largest channel of a sample's reflected
                                                                    ///< radiance: above, it is scaled down
    int tile = 16;                    ///< side of the squares that threads take, in pixels
    ActivePixels active{};            ///< of the window: see FilmPass. Absent = all
};

/// What a pass of render() took.
struct RenderResult {
    RayCounts rays;
    std::uint64_t skipped = 0; ///< samples that were not traced, since their pixel sees one background
    bool stopped = false; ///< ended by the caller's wish; the film is without this pass
};

namespace detail {
/// What a scene's own coordinates are relative to; scenes of others, which have no such thing, are as they are.
template <class S>
Vec3d origin_of(const S& scene) {
    if constexpr (requires { scene.scene().origin; }) return scene.scene().origin;
    else return Vec3d(0);
}

/// Whether all samples of a rectangle of pixels are the same: their rays are proved to see nothing but one background,
/// by a scene that can tell, and the integrator says that a miss is a matter of the background alone.
template <class I, class S, class T>
bool sees_only_background(const S& scene, const CameraRays<T>& rays, int x0, int y0, int x1, int y1) {
    if constexpr (requires { I::miss_is_background; } && requires(const Pyramid<T>& p) { scene.sees_only_background(p); }) {
        constexpr T reach = 2; // no pixel filter's is wider; and more than any rounding of directions
        return !rays.has_lens() && scene.sees_only_background(rays.pyramid(T(x0) - reach, T(y0) - reach, T(x1) + reach,
                                                                           T(y1) + reach));
    } else return false;
}

/// A sample's ray through a pixel.
template <class T, class Stream>
Ray<T> camera_ray(const CameraRays<T>& rays, PixelFilter filter, std::uint32_t px, std::uint32_t py, const Stream& stream) {
    const Vec2<T> u(stream.get_2d(dimensions::pixel));
    const T x = T(px) + T(0.5) + filter_offset(filter, u.x), y = T(py) + T(0.5) + filter_offset(filter, u.y);
    if (!rays.has_lens()) return rays.ray(x, y);
    return rays.ray(x, y, square_to_disk(Vec2<T>(stream.get_2d(dimensions::lens))));
}
} // namespace detail

/// Renders the samples [first_sample, end_sample) of every pixel of the window and merges them into `film`,
/// which is made when it is empty. What a pixel gets depends on scene, sampler and sample index alone: any
/// number of threads, order of tiles and split of the samples gives the same bits. Tiles that are proved to see nothing
/// but a background of one colour take one sample a pixel, which counts for all.
/// `keep_going()` is asked before each tile; once it says no, the pass is dropped.
/// throws lambent::Error on an empty image, a window outside it, an empty sample range, a film that does not fit,
///        active pixels of another size than the window, stops at 0
template <class S, class I, Sampler P, Executor E, class KeepGoing>
RenderResult render(Film<typename S::Scalar>& film, const S& scene, const Camera& camera, const I& integrator,
                    const P& sampler, const RenderOptions& options, E& executor, KeepGoing&& keep_going) {
    using T = typename S::Scalar;
    require(options.width > 0 && options.height > 0, [&] {
        return "render: the image of " + std::to_string(options.width) + " x " + std::to_string(options.height) +
               " pixels is empty";
    });
    PixelWindow window = options.window;
    if (window.empty()) window = {0, 0, options.width, options.height};
    require(window.inside(options.width, options.height), "render: the window reaches out of the image");
    require(options.first_sample < options.end_sample && options.end_sample <= max_samples, [&] {
        return "render: " + describe(SampleRange{options.first_sample, options.end_sample}) +
               " is not a range of samples below 2^32";
    });
    const int width = window.width(), height = window.height();
    const int tile = std::max(1, options.tile);
    const int tiles_x = (width + tile - 1) / tile, tiles_y = (height + tile - 1) / tile;
    const CameraRays<T> rays(camera, options.width, options.height, detail::origin_of(scene));

    FilmPass<T> pass(width, height, options.planes, options.first_sample, options.end_sample, options.active);
    std::atomic<std::uint64_t> closest{0}, shadow{0}, saved{0}, skipped{0};
    std::atomic<bool> stopped{false};
    executor.parallel_for(std::size_t(tiles_x) * std::size_t(tiles_y), 1, [&](std::size_t begin, std::size_t end) {
        RayCounts counts;
        std::uint64_t not_traced = 0;
        for (std::size_t index = begin; index < end; ++index) {
            if (stopped.load(std::memory_order_relaxed) || !keep_going()) {
                stopped = true;
                return;
            }
            const int tile_x = int(index % std::size_t(tiles_x)) * tile, tile_y = int(index / std::size_t(tiles_x)) * tile;
            const int end_x = std::min(width, tile_x + tile), end_y = std::min(height, tile_y + tile);
            const bool empty = detail::sees_only_background<I>(scene, rays, tile_x + window.x0, tile_y + window.y0,
                                                               end_x + window.x0, end_y + window.y0);
            std::vector<std::pair<int, int>> pixels;
            for (int y = tile_y; y < end_y; ++y)
                for (int x = tile_x; x < end_x; ++x)
                    if (options.active.absent() || options.active.load(x, y) != 0) pixels.emplace_back(x, y);
            if (pixels.empty()) continue;
            const std::uint64_t samples = options.end_sample - options.first_sample, traced = empty ? 1 : samples;
            typename detail::BatchFor<S, I, decltype(sampler.at(0, 0, 0))>::Type batch(scene, integrator, pixels.size() * traced);
            auto at = pixels.begin();
            typename FilmPass<T>::Pixel pixel(pass, at->first, at->second);
            std::uint64_t taken = 0; // of its samples
            const auto take = [&](PixelSample<T> sample) {
                if (taken == traced) {
                    ++at;
                    pixel.go_to(at->first, at->second);
                    taken = 0;
                }
                ++taken;
                clamp_reflected(sample, T(options.firefly_clamp));
                if (empty) pixel.add_equal(sample, samples);
                else pixel.add(sample);
            };
            for (const auto& [x, y] : pixels) {
                const auto px = std::uint32_t(x + window.x0), py = std::uint32_t(y + window.y0);
                for (std::uint64_t i = options.first_sample; i < options.first_sample + traced; ++i) {
                    const auto stream = sampler.at(px, py, std::uint32_t(i));
                    batch.add(detail::camera_ray(rays, options.filter, px, py, stream), stream);
                    if (batch.full()) batch.run(counts, take);
                }
            }
            batch.run(counts, take);
            not_traced += pixels.size() * (samples - traced);
        }
        closest += counts.closest;
        shadow += counts.shadow;
        saved += counts.saved;
        skipped += not_traced;
    });
    RenderResult result{{closest, shadow, saved}, skipped, stopped};
    if (stopped) return result;
    if (film.blocks().empty()) film = pass.finish();
    else film.merge(pass.finish());
    return result;
}

/// The same to the end, and the frame of it.
template <class S, class I, Sampler P, Executor E>
PixelData<typename S::Scalar> render(const S& scene, const Camera& camera, const I& integrator, const P& sampler,
                                     const RenderOptions& options, E& executor) {
    Film<typename S::Scalar> film;
    render(film, scene, camera, integrator, sampler, options, executor, [] { return true; });
    return film.resolve(detail::origin_of(scene));
}

} // namespace LAMBENT_ABI
} // namespace lambent
