#include "lit_wall.hpp"
#include <cmath>
#include <cstring>
#include <doctest/doctest.h>
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise.hpp>
#include <lambent/denoise/denoise_tiles.hpp>
#include <limits>
#include <list>
#include <vector>

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
        const auto copy_of = [&]<int C>(PixelView<const float, C>& plane) {
            if (plane.absent()) return;
            std::vector<float>& copy = memory.emplace_back();
            for (int y = 0; y < window.height(); ++y)
                for (int x = 0; x < window.width(); ++x)
                    for (int c = 0; c < C; ++c) copy.push_back(plane.pixel(x, y)[c]);
            plane = PixelView<const float, C>(copy.data(), window.width(), window.height());
        };
        for_each_plane(copy_of, view);
        return view;
    }
};

/// What tiles give, put together.
struct Collected {
    Plane<float, 3> radiance, error;
    Plane<float, 1> times;

    Collected(int width, int height) : radiance(width, height), error(width, height), times(width, height) {}
    void operator()(const PixelWindow& tile, const PixelView<const float, 3>& light,
                    const PixelView<const float, 3>& e) {
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
PixelData<float> hard_frame(int width, int height, int spp, FilmPlanes planes = FilmPlanes::statistics, double chance = 1) {
    const LitWall wall{.width = width, .height = height, .chance = chance};
    PixelData<float> frame = wall.frame(spp, std::uint64_t(100 + spp), 1, planes);
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
        worst = std::max(worst, std::abs(double(a.values()[i]) - double(b.values()[i])) /
                                    (std::abs(double(b.values()[i])) + mean));
    return worst;
}

/// Even light that is all noise, so that all taps count, without features to stop them; and columns that are not finite,
/// so that what mends them is far away. No tile ends there.
PixelData<float> even_frame(int width, int height, int spp) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    PixelData<float> frame = LitWall{.width = width, .height = height}.frame(spp, std::uint64_t(spp));
    lambent_test::Random random{std::uint64_t(spp)};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const bool lost = x % 19 < 13 && y % 23 < 17;
            const Vec3f light(float(random.uniform()), float(random.uniform()), float(random.uniform()));
            frame.direct.view().store(x, y, lost ? Vec3f(nan) : light);
            frame.indirect.view().store(x, y, lost ? Vec3f(nan) : light);
            frame.radiance.view().store(x, y, lost ? Vec3f(nan) : light * 2.0f);
            frame.root_direct.view().store(x, y, sqrt(light));
            frame.root_indirect.view().store(x, y, sqrt(light));
            for (auto* plane : {&frame.variance, &frame.root_direct_variance, &frame.root_indirect_variance})
                plane->view().store(x, y, Vec3f(0.3f));
        }
    for (auto* plane : {&frame.albedo, &frame.normal, &frame.position, &frame.albedo_variance, &frame.normal_variance})
        *plane = {};
    frame.depth = frame.depth_variance = frame.material = {};
    return frame;
}

/// Whole and in tiles, the same.
void check(const PixelData<float>& frame, const char* method, const std::vector<TileSize>& sizes) {
    SerialExecutor serial;
    ThreadExecutor threads(2);
    CAPTURE(method);
    const DenoiseOptions options = denoise_options(method);
    const Denoised<float> whole = denoise(frame, options, serial);
    const bool rounded = options.form == BilateralForm::reuse_2d && whole.report.used == NoiseUse::filter;
    for (const TileSize& size : sizes) {
        CAPTURE(size.width);
        Collected tiles(frame.width, frame.height);
        const DenoiseReport report =
            denoise_tiles<float>(frame.width, frame.height, size, Windows{frame}, tiles, options, threads);
        if (rounded) CHECK(apart(tiles.radiance, whole.radiance) < 1e-5); // its taps are added in another order
        else CHECK(same(tiles.radiance, whole.radiance));
        if (whole.report.error) CHECK(same(tiles.error, whole.error));
        CHECK(report.error == whole.report.error);
        CHECK(report.used == whole.report.used);
        CHECK(report.non_finite == whole.report.non_finite);
        CHECK(report.spikes == whole.report.spikes);
        CHECK((report.bilateral.taps > 0) == (whole.report.bilateral.taps > 0)); // tiles filter their surroundings again
        CHECK(tiles.times.values() == std::vector<float>(tiles.times.values().size(), 1));
    }
}

} // namespace

TEST_CASE("denoise_tiles: every quality gives the whole frame's bits, with statistics and without, in tiles of any size") {
    for (const int spp : {1, 4, 20}) {
        CAPTURE(spp);
        std::vector<TileSize> sizes = {{100, 60}};
        if (spp == 4) sizes = {{64, 16}, {227, 41}, {}};
        const PixelData<float> frame = hard_frame(227, 139, spp);
        for (const char* method : {"best", "balanced", "fast"}) check(frame, method, sizes);
        if (spp != 20) continue;
        const PixelData<float> plain = hard_frame(227, 139, spp, FilmPlanes::features);
        for (const char* method : {"best", "fast", "separable", "seed", "none"}) check(plain, method, {{100, 60}, {}});
    }
}

TEST_CASE("denoise_tiles: the whole frame's bits where hardly any sample finds light") {
    const int width = 227, height = 139;
    const auto put = [](PixelData<float>& frame, const PixelData<float>& other, const PixelWindow& where) {
        for (const auto plane : {&PixelData<float>::radiance, &PixelData<float>::direct, &PixelData<float>::indirect,
                                 &PixelData<float>::root_direct, &PixelData<float>::root_indirect})
            for (int y = where.y0; y < where.y1; ++y)
                for (int x = where.x0; x < where.x1; ++x) (frame.*plane).view().store(x, y, (other.*plane).load(x, y));
    };
    const auto check_both = [](const PixelData<float>& frame) {
        SerialExecutor serial;
        for (const char* method : {"best", "balanced"}) {
            CHECK(denoise(frame, denoise_options(method), serial).report.bilateral.taps > 0);
            check(frame, method, {{64, 16}, {100, 60}});
        }
    };
    check_both(hard_frame(width, height, 1, FilmPlanes::statistics, 0.04));
    PixelData<float> left = hard_frame(width, height, 3, FilmPlanes::statistics, 0.04);
    put(left, hard_frame(width, height, 3), {110, 0, width, height});
    check_both(left);
    // Dark squares: what lies around and between them is filtered too, and is so even that the filter's guide is narrow.
    const PixelData<float> lit = LitWall{.width = width, .height = height}.frame(20, 5, 0.2);
    const PixelData<float> dark = hard_frame(width, height, 20, FilmPlanes::statistics, 0.002);
    PixelData<float> one = lit, two = lit;
    put(one, dark, {96, 64, 112, 80});
    check_both(one);
    put(two, dark, {32, 32, 64, 64});
    put(two, dark, {160, 96, 192, 128});
    check_both(two);
}

TEST_CASE("denoise_tiles: windows reach as far as pixels do") {
    for (const int spp : {1, 3, 30}) {
        CAPTURE(spp);
        PixelData<float> frame = even_frame(200, 90, spp);
        for (const char* method : {"best", "balanced", "fast"}) check(frame, method, {{64, 16}});
        if (spp != 3) continue;
        for (auto* plane : {&frame.root_direct, &frame.variance}) *plane = {};
        for (const char* method : {"best", "separable_reuse", "seed"}) check(frame, method, {{64, 16}});
    }
}

TEST_CASE("denoise_tiles: images of every size, smaller than what is around a tile too") {
    for (const auto& size : {std::pair(1, 1), std::pair(5, 70), std::pair(130, 3), std::pair(65, 17)})
        for (const char* method : {"best", "balanced", "fast", "separable"}) {
            const int width = size.first, height = size.second;
            CAPTURE(width);
            check(hard_frame(width, height, 4), method, {{64, 16}});
            check(hard_frame(width, height, 4, FilmPlanes::features), method, {{64, 16}});
        }
}

TEST_CASE("denoise_tiles: a frame of doubles; a store of the caller's; what windows are asked for") {
    const PixelData<double> frame = LitWall{.width = 150, .height = 100}.frame<double>(4, 2);
    SerialExecutor serial;
    struct Store {
        MemoryStore<double> memory{150, 100};
        int stored = 0, loaded = 0;
        void store(const PixelWindow& w, const PixelView<const double, 4>& in) { memory.store(w, in), ++stored; }
        void load(const PixelWindow& w, const PixelView<double, 4>& out) { memory.load(w, out), ++loaded; }
    } store;
    const Denoised<double> whole = denoise(frame, denoise_options("best"), serial);
    int different = 0, outside = 0, largest = 0;
    denoise_tiles<double>(150, 100, {64, 32}, [&](const PixelWindow& window) {
        outside += !window.inside(150, 100);
        largest = std::max(largest, window.height());
        return window_of(frame.view(), window);
    }, [&](const PixelWindow& tile, const PixelView<const double, 3>& radiance, const PixelView<const double, 3>& error) {
        for (int y = 0; y < tile.height(); ++y)
            for (int x = 0; x < tile.width(); ++x) {
                different += radiance.load(x, y) != whole.radiance.load(tile.x0 + x, tile.y0 + y);
                different += error.load(x, y) != whole.error.load(tile.x0 + x, tile.y0 + y);
            }
    }, denoise_options("best"), serial, store);
    CHECK(different == 0);
    CHECK(outside == 0);
    CHECK(largest == 32 + 32 + 29); // 29 pixels, above up to the next multiple of 16
    CHECK(store.stored == 12);
    CHECK(store.loaded == 12);
}

TEST_CASE("denoise_tiles: what is wrong is said") {
    const PixelData<float> frame = hard_frame(70, 40, 4);
    SerialExecutor serial;
    Collected tiles(70, 40);
    const auto run = [&](int width, int height, const TileSize& size, auto&& planes, const char* method = "best") {
        denoise_tiles<float>(width, height, size, planes, tiles, denoise_options(method), serial);
    };
    const auto planes = [&](const PixelWindow& w) { return window_of(frame.view(), w); };
    CHECK_THROWS_WITH_AS(run(0, 40, {}, planes), "denoise_tiles: an image of 0 x 40 in tiles of 512 x 512", Error);
    CHECK_THROWS_AS(run(70, 40, {64, 0}, planes), Error);
    CHECK_THROWS_AS(run(71, 40, {}, planes), Error); // window_of()
    CHECK_THROWS_WITH_AS(run(70, 40, {64, 16}, [&](const PixelWindow&) { return frame.view(); }),
                         "denoise_tiles: a plane of 70 x 40 for a window of 64 x 16", Error);
    CHECK_THROWS_WITH_AS(run(70, 40, {}, [](const PixelWindow&) { return FrameView<float>(); }),
                         "denoise_tiles: the frame has no radiance plane", Error);
    int calls = 0;
    const auto sometimes = [&](const PixelWindow& w) {
        FrameView<float> view = planes(w);
        if (++calls > 2) view.variance = {};
        return view;
    };
    CHECK_THROWS_WITH_AS(run(70, 40, {64, 16}, sometimes), "denoise_tiles: a window has no statistics of its samples",
                         Error);
    calls = 0;
    CHECK_THROWS_WITH_AS(run(70, 40, {64, 16}, sometimes, "fast"),
                         "denoise_tiles: a window has no variances or samples", Error);
    CHECK(tiles.times.values() == std::vector<float>(70 * 40, 0)); // nothing came out
}
