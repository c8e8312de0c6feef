#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/core/parallel.hpp>
#include <lambent/film/film.hpp>
#include <lambent/render/integrator.hpp>
#include <lambent/sampling/sampler.hpp>
#include <lambent/scene/camera.hpp>
#include <lambent/scene/prepared_scene.hpp>
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <limits>
#include <string>

namespace lambent {
inline namespace LAMBENT_ABI {

/// A rectangle of pixels [x0, x1) × [y0, y1).
struct PixelWindow {
    int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
    bool empty() const { return x0 >= x1 || y0 >= y1; }
};

struct RenderOptions {
    int width = 1280, height = 720;
    std::uint64_t first_sample = 0;   ///< sample indices [first_sample, end_sample) of every pixel
    std::uint64_t end_sample = 16;
    PixelWindow window{};             ///< of the image to render; empty = all of it
    FilmPlanes planes = FilmPlanes::features;
    double firefly_clamp = std::numeric_limits<double>::infinity(); ///< largest channel of a sample's reflected
                                                                    ///< radiance: above, it is scaled down
    int tile = 16;                    ///< side of the squares that threads take, in pixels
};

struct RenderResult {
    RayCounts rays;
    std::uint64_t rejected = 0; ///< samples with a non-finite radiance, counted as black
    bool stopped = false;       ///< ended by the caller's wish; the film is without this pass
};

namespace detail {
/// Makes a sample fit to be summed: finite, and not above the clamp, which is monotone and keeps the hue.
template <class T>
inline bool sanitise(PixelSample<T>& sample, T clamp) {
    if (!is_finite(sample.radiance)) {
        sample.radiance = sample.emission = Vec3<T>(0);
        return false;
    }
    const Vec3<T> reflected = sample.radiance - sample.emission;
    const T peak = max_component(reflected);
    if (peak > clamp) sample.radiance = sample.emission + reflected * (clamp / peak);
    return true;
}
} // namespace detail

/// Renders the samples [first_sample, end_sample) of every pixel of the window and merges them into `film`,
/// which is made when it is empty. What a pixel gets depends on scene, sampler and sample index alone: any
/// number of threads, order of tiles and split of the samples gives the same bits.
/// `keep_going()` is asked before each tile; once it says no, the pass is dropped.
/// throws lambent::Error on an empty image, a window outside it, an empty sample range, a film that does not fit
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
    require(window.x0 >= 0 && window.y0 >= 0 && window.x1 <= options.width && window.y1 <= options.height,
            "render: the window reaches out of the image");
    require(options.first_sample < options.end_sample, [&] {
        return "render: no samples in [" + std::to_string(options.first_sample) + ", " +
               std::to_string(options.end_sample) + ")";
    });
    const int width = window.x1 - window.x0, height = window.y1 - window.y0;
    const int tile = std::max(1, options.tile);
    const int tiles_x = (width + tile - 1) / tile, tiles_y = (height + tile - 1) / tile;
    const CameraRays<T> rays(camera, options.width, options.height, scene.scene().origin);

    FilmPass<T> pass(width, height, options.planes, options.first_sample, options.end_sample);
    std::atomic<std::uint64_t> closest{0}, shadow{0}, rejected{0};
    std::atomic<bool> stopped{false};
    executor.parallel_for(std::size_t(tiles_x) * std::size_t(tiles_y), 1, [&](std::size_t begin, std::size_t end) {
        RayCounts counts;
        std::uint64_t bad = 0;
        for (std::size_t index = begin; index < end; ++index) {
            if (stopped.load(std::memory_order_relaxed) || !keep_going()) {
                stopped = true;
                return;
            }
            const int tile_x = int(index % std::size_t(tiles_x)) * tile, tile_y = int(index / std::size_t(tiles_x)) * tile;
            for (int y = tile_y; y < std::min(height, tile_y + tile); ++y)
                for (int x = tile_x; x < std::min(width, tile_x + tile); ++x) {
                    const auto px = std::uint32_t(x + window.x0), py = std::uint32_t(y + window.y0);
                    typename FilmPass<T>::Pixel pixel(pass, x, y);
                    for (std::uint64_t i = options.first_sample; i < options.end_sample; ++i) {
                        const auto stream = sampler.at(px, py, std::uint32_t(i));
                        const auto jitter = stream.get_2d(dimensions::pixel);
                        PixelSample<T> sample = integrator.sample(
                            scene, rays.ray(T(px) + T(jitter.x), T(py) + T(jitter.y)), stream, counts);
                        bad += !detail::sanitise(sample, T(options.firefly_clamp));
                        pixel.add(sample);
                    }
                }
        }
        closest += counts.closest;
        shadow += counts.shadow;
        rejected += bad;
    });
    RenderResult result{{closest, shadow}, rejected, stopped};
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
    return film.resolve(scene.scene().origin);
}

} // namespace LAMBENT_ABI
} // namespace lambent
