#include "lit_wall.hpp"
#include <doctest/doctest.h>
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise.hpp>
#include <lambent/denoise/denoise_half.hpp>
#include <list>
#include <vector>

using namespace lambent;
using lambent_test::LitWall;

namespace {
/// A frame of halves, RGBA and so on: a number more a pixel than it needs; and the same numbers as floats.
struct Halves {
    std::list<std::vector<Half>> memory{};
    FrameView<Half> view{};
    PixelData<float> frame;
    PixelView<Half, 3> radiance{};

    explicit Halves(PixelData<float> of) : frame(std::move(of)) {
        FrameView<float> floats = frame.view();
        const auto narrow = [&]<int C>(PixelView<const float, C>& from, PixelView<const Half, C>& to) {
            if (from.absent()) return;
            const int w = from.width(), h = from.height(), step = C + 1;
            std::vector<Half>& plane = memory.emplace_back(std::size_t(w * h * step), Half(7.0f));
            for (int i = 0; i < w * h; ++i)
                for (int c = 0; c < C; ++c) {
                    float& value = const_cast<float&>(from.data()[i * C + c]); // ours
                    plane[std::size_t(i * step + c)] = Half(value);
                    value = float(plane[std::size_t(i * step + c)]);
                }
            to = PixelView<const Half, C>(plane.data(), w, h, {.pixel = step});
            if (memory.size() == 1) radiance = {memory.front().data(), w, h, {.pixel = step}};
        };
        for_each_plane(narrow, floats, view);
    }
};
} // namespace

TEST_CASE("denoise: planes of halves give what the same numbers as floats give, rounded; in place, alpha kept") {
    ThreadExecutor threads(2);
    for (const char* method : {"best", "balanced", "fast", "separable_reuse", "seed", "none"})
        for (const FilmPlanes planes : {FilmPlanes::statistics, FilmPlanes::features}) {
            CAPTURE(method);
            Halves halves(LitWall{.width = 90, .height = 50}.frame(4, 3, 1, planes));
            const Denoised<float> expected = denoise(halves.frame, denoise_options(method), threads);
            std::vector<Half> error_memory(90 * 50 * 3);
            const DenoiseReport report = denoise(halves.view, halves.radiance, denoise_options(method), threads,
                                                 PixelView<Half, 3>(error_memory.data(), 90, 50));
            int wrong = 0;
            for (int i = 0; i < 90 * 50; ++i) {
                for (int c = 0; c < 3; ++c) {
                    const std::size_t from = std::size_t(3 * i + c);
                    wrong += halves.radiance.data()[4 * i + c] != Half(expected.radiance.values()[from]);
                    if (report.error) wrong += error_memory[from] != Half(expected.error.values()[from]);
                }
                wrong += halves.radiance.data()[4 * i + 3] != Half(7.0f);
            }
            CHECK(wrong == 0);
            CHECK(report.used == expected.report.used);
            CHECK(report.error == expected.report.error);
        }
    Halves halves(LitWall{.width = 90, .height = 50}.frame(4, 3));
    std::vector<Half> small(3);
    const PixelView<Half, 3> one(small.data(), 1, 1);
    CHECK_THROWS_AS(denoise(halves.view, one, {}, threads), Error);
    CHECK_THROWS_AS(denoise(FrameView<Half>(), one, {}, threads), Error);
    halves.view.albedo = one;
    CHECK_THROWS_AS(denoise(halves.view, halves.radiance, {}, threads), Error);
}

TEST_CASE("denoise: a frame of halves is nearly as clean as one of floats") {
    const LitWall wall;
    ThreadExecutor threads(2);
    for (const int spp : {1, 16}) {
        CAPTURE(spp);
        const PixelData<float> frame = wall.frame(spp, 5);
        const double full = wall.error(denoise(frame, denoise_options("best"), threads).radiance);
        const Halves halves(frame);
        denoise(halves.view, halves.radiance, denoise_options("best"), threads);
        Plane<float, 3> out(wall.width, wall.height);
        for (int y = 0; y < wall.height; ++y)
            for (int x = 0; x < wall.width; ++x)
                for (int c = 0; c < 3; ++c) out.view().pixel(x, y)[c] = float(halves.radiance.pixel(x, y)[c]);
        CHECK(wall.error(out) < 1.02 * full);
    }
}
