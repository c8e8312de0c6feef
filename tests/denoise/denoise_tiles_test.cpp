#include "lit_wall.hpp"
#include <cmath>
#include <cstring>
#include <doctest/doctest.h>
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise.hpp>
#include <lambent/denoise/denoise_tiles.hpp>
#include <limits>
#include <list>

using namespace lambent;
using lambent_test::LitWall;

namespace {

/// A frame that gives its planes by windows, in memory of their own that the next call takes away.
struct Windows {
    const PixelData<float>& frame;
    std::list<std::vector<float>> memory{};
    std::size_t largest = 0; ///< pixels of a window

    FrameView<float> operator()(const PixelWindow& window) {
        memory.clear();
        largest = std::max(largest, std::size_t(window.width()) * std::size_t(window.height()));
        FrameView<float> view = window_of(frame.view(), window);
        for_each_plane(view, [&]<int C>(PixelView<const float, C>& plane) {
            if (plane.absent()) return;
            std::vector<float>& copy = memory.emplace_back();
            for (int y = 0; y < window.height(); ++y)
                for (int x = 0; x < window.width(); ++x)
                    for (int c = 0; c < C; ++c) copy.push_back(plane.pixel(x, y)[c]);
            plane = PixelView<const float, C>(copy.data(), window.width(), window.height());
        });
        return view;
    }
};

/// What tiles give, put together.
struct Collected {
    Plane<float, 3> radiance, error;
    Plane<float, 1> times;

    Collected(int width, int height) : radiance(width, height), error(width, height), times(width, height) {}
    void operator()(const PixelWindow& tile, const PixelView<const float, 3>& light, const PixelView<const float, 3>& e) {
        for (int y = 0; y < tile.height(); ++y)
            for (int x = 0; x < tile.width(); ++x) {
                const int u = tile.x0 + x, v = tile.y0 + y;
                radiance.view().store(u, v, light.load(x, y));
                if (!e.absent()) error.view().store(u, v, e.load(x, y));
                times.view().store(u, v, times.load(u, v) + 1);
            }
    }
};

/// Everything that makes one place of an image matter to another: a lamp, outliers, what is not finite, a black corner
/// without features.
PixelData<float> hard_frame(int width, int height, int spp, FilmPlanes planes = FilmPlanes::statistics) {
    PixelData<float> frame = LitWall{.width = width, .height = height}.frame(spp, std::uint64_t(100 + spp), 1, planes);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const auto each_light = [&](auto&& f) {
        for (auto* plane : {&frame.radiance, &frame.direct, &frame.indirect, &frame.root_direct, &frame.root_indirect})
            if (!plane->absent()) f(plane->view());
    };
    for (int i = 0; i < width * height / 150; ++i) {
        const int x = i * 61 % width, y = i * 37 % height;
        each_light([&](const PixelView<float, 3>& plane) {
            plane.store(x, y, i % 7 == 0 ? Vec3f(nan) : plane.load(x, y) * float(i % 40));
        });
    }
    for (int y = 0; y < height / 3; ++y)
        for (int x = width * 2 / 3; x < width; ++x) {
            each_light([&](const PixelView<float, 3>& plane) { plane.store(x, y, Vec3f(0)); });
            frame.albedo.view().store(x, y, Vec3f(0)), frame.normal.view().store(x, y, Vec3f(0));
            frame.depth.view().store(x, y, 0);
        }
    return frame;
}

bool same(const Plane<float, 3>& a, const Plane<float, 3>& b) {
    return a.values().size() == b.values().size() &&
           std::memcmp(a.values().data(), b.values().data(), a.values().size() * sizeof(float)) == 0;
}

/// Largest difference, relative to the value and the mean of all.
double apart(const Plane<float, 3>& a, const Plane<float, 3>& b) {
    double mean = 0, worst = 0;
    for (const float v : b.values()) mean += std::abs(double(v)) / double(b.values().size());
    for (std::size_t i = 0; i < a.values().size(); ++i)
        worst = std::max(worst, std::abs(double(a.values()[i]) - double(b.values()[i])) / (std::abs(double(b.values()[i])) + mean));
    return worst;
}

} // namespace

TEST_CASE("denoise_tiles: every quality gives the whole frame's bits, with statistics and without, whatever the tiles' size") {
    SerialExecutor serial;
    ThreadExecutor threads(2);
    constexpr int width = 227, height = 139;
    for (const FilmPlanes planes : {FilmPlanes::statistics, FilmPlanes::features})
        for (const int spp : {1, 4, 20}) {
            const PixelData<float> frame = hard_frame(width, height, spp, planes);
            for (const char* method : {"best", "balanced", "fast", "separable", "seed", "none"}) {
                if (spp == 20 && method[0] == 's') continue;
                CAPTURE(method);
                CAPTURE(spp);
                CAPTURE(planes == FilmPlanes::statistics);
                const DenoiseOptions options = denoise_options(method);
                const Denoised<float> whole = denoise(frame, options, serial);
                // to rounding: its taps are added in another order
                const bool rounded = options.form == BilateralForm::reuse_2d && whole.report.used == NoiseUse::filter;
                for (const TileSize size : {TileSize{64, 16}, TileSize{100, 60}, TileSize{227, 41}, TileSize{}}) {
                    CAPTURE(size.width);
                    Windows windows{frame};
                    Collected tiles(width, height);
                    const DenoiseReport report =
                        denoise_tiles<float>(width, height, size, windows, tiles, options, threads);
                    if (rounded) CHECK(apart(tiles.radiance, whole.radiance) < 1e-5);
                    else CHECK(same(tiles.radiance, whole.radiance));
                    if (whole.report.error) CHECK(same(tiles.error, whole.error));
                    CHECK(report.error == whole.report.error);
                    CHECK(report.used == whole.report.used);
                    CHECK(report.non_finite == whole.report.non_finite);
                    CHECK(report.spikes == whole.report.spikes);
                    CHECK(tiles.times.values() == std::vector<float>(std::size_t(width * height), 1));
                }
            }
        }
}
