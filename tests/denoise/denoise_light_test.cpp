#include "lit_wall.hpp"
#include "support/random.hpp"
#include <cmath>
#include <cstring>
#include <doctest/doctest.h>
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise.hpp>
#include <lambent/denoise/restore_energy.hpp>
#include <lambent/film/film.hpp>
#include <lambent/film/film_pass.hpp>
#include <limits>

using namespace lambent;
using lambent_test::LitWall;
using lambent_test::Random;

namespace {

template <class T>
Plane<T, 3> cleaned(const PixelData<T>& frame, const LightDenoiseOptions& options = {}) {
    Plane<T, 3> out(frame.width, frame.height);
    SerialExecutor serial;
    denoise_light<T>(frame.view(), out.view(), options, serial);
    return out;
}

} // namespace

TEST_CASE("denoise_light: better than its input at every number of samples, and its error falls with theirs") {
    const LitWall wall;
    const std::uint64_t seed = 11;
    CAPTURE(seed);
    double last = std::numeric_limits<double>::infinity();
    for (const int spp : {1, 4, 16, 64, 256, 1024}) {
        CAPTURE(spp);
        double raw = 0, fine = 0, fast = 0;
        const int rounds = spp <= 16 ? 6 : 2;
        for (int round = 0; round < rounds; ++round) {
            const PixelData<float> frame = wall.frame(spp, seed + 100 * std::uint64_t(round) + std::uint64_t(spp));
            raw += wall.error(frame.radiance) / rounds;
            fine += wall.error(cleaned(frame)) / rounds;
            fast += wall.error(cleaned(frame, {.stride = 2})) / rounds;
        }
        CAPTURE(raw);
        CAPTURE(fine);
        CAPTURE(fast);
        CHECK(fine < raw * (spp <= 64 ? 0.25 : 0.6));
        CHECK(fast < raw * (spp <= 64 ? 0.5 : 0.9));
        CHECK(fine < last);
        last = fine;
    }
    CHECK(wall.error(cleaned(wall.frame<double>(16, seed))) < 0.25 * wall.error(wall.frame<double>(16, seed).radiance));
}

TEST_CASE("denoise_light: keeps energy, lights seen directly, and what has no noise") {
    const LitWall wall;
    for (const int spp : {4, 16, 64}) {
        CAPTURE(spp);
        const Plane<float, 3> out = cleaned(wall.frame(spp, 5));
        double has = 0, truth = 0;
        for (int y = 0; y < wall.height; ++y)
            for (int x = 0; x < wall.width; ++x) {
                has += double(out.load(x, y).x + out.load(x, y).y + out.load(x, y).z);
                const Vec3d t = wall.truth(x, y);
                truth += t.x + t.y + t.z;
            }
        // Noise of the input's own mean: both parts' relative deviation is 1 in each of so many samples.
        CHECK(std::abs(has / truth - 1) < 0.01 + 4 / std::sqrt(double(spp) * wall.width * wall.height));
        CHECK(out.load(50, 20).x == doctest::Approx(9 + wall.truth(51, 20).x).epsilon(0.15));
    }
    const PixelData<float> still = wall.frame(16, 1, 0);
    const Plane<float, 3> out = cleaned(still);
    for (int y = 0; y < wall.height; ++y)
        for (int x = 0; x < wall.width; ++x)
            for (int c = 0; c < 3; ++c)
                CHECK(out.load(x, y)[c] == doctest::Approx(still.radiance.load(x, y)[c]).epsilon(2e-3));
}

TEST_CASE("denoise_light: energy that comes in few bright samples is clamped and given back") {
    const LitWall wall;
    const int spp = 16;
    const std::uint64_t seed = 21;
    Random random(seed);
    FilmPass<float> pass(wall.width, wall.height, FilmPlanes::statistics, 0, spp);
    for (int y = 0; y < wall.height; ++y)
        for (int x = 0; x < wall.width; ++x) {
            FilmPass<float>::Pixel pixel(pass, x, y);
            for (int i = 0; i < spp; ++i) {
                PixelSample<float> s;
                s.hit = true;
                s.albedo = Vec3f(wall.albedo(x, y));
                s.indirect = random.uniform() < 0.002 ? Vec3f(250) : Vec3f(0.5);
                s.radiance = s.indirect;
                pixel.add(s);
            }
        }
    const PixelData<float> frame = pass.finish().resolve();
    const Plane<float, 3> out = cleaned(frame);
    double has = 0, given = 0, brightest = 0;
    for (int y = 0; y < wall.height; ++y)
        for (int x = 0; x < wall.width; ++x) {
            has += double(out.load(x, y).y);
            given += double(frame.radiance.load(x, y).y);
            brightest = std::max(brightest, double(out.load(x, y).y));
        }
    CAPTURE(seed);
    CAPTURE(brightest);
    CHECK(has == doctest::Approx(given).epsilon(0.1)); // the gates keep back what does not stand out from noise
    CHECK(brightest < 5);                              // 16 in the input
}

TEST_CASE("denoise_light: the same bits for any number of threads, in place too") {
    const PixelData<float> frame = LitWall{.width = 67, .height = 35}.frame(4, 3);
    for (const int stride : {1, 2}) {
        const Plane<float, 3> one = cleaned(frame, {.stride = stride});
        ThreadExecutor threads(3);
        Plane<float, 3> in_place = frame.radiance;
        FrameView<float> view = frame.view();
        view.radiance = in_place.view();
        denoise_light<float>(view, in_place.view(), {.stride = stride}, threads);
        CHECK(std::memcmp(one.values().data(), in_place.values().data(), one.values().size() * sizeof(float)) == 0);
    }
}

TEST_CASE("denoise_light: a line of pixels, none of which is a center, is cleaned by its own kind") {
    constexpr int width = 48, height = 32, line = 21, spp = 16;
    const std::uint64_t seed = 5;
    CAPTURE(seed);
    FilmPass<float> pass(width, height, FilmPlanes::statistics, 0, spp);
    Random random(seed);
    const auto is_line = [](int x) { return x == line; };
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            FilmPass<float>::Pixel pixel(pass, x, y);
            for (int i = 0; i < spp; ++i) {
                PixelSample<float> s;
                s.hit = true;
                s.albedo = is_line(x) ? Vec3f(0.2f) : Vec3f(0.8f);
                s.normal = is_line(x) ? Vec3f(0, 1, 0) : Vec3f(0, 0, 1);
                s.depth = is_line(x) ? 2.0f : 3.0f;
                s.direct = s.albedo * float(-std::log(1 - random.uniform()));
                s.radiance = s.direct;
                pixel.add(s);
            }
        }
    const PixelData<float> frame = pass.finish().resolve();
    const auto error_of_line = [&](const Plane<float, 3>& image) {
        double sum = 0;
        for (int y = 0; y < height; ++y) sum += std::pow(double(image.load(line, y).x) / 0.2 - 1, 2) / height;
        return sum;
    };
    const double raw = error_of_line(frame.radiance);
    CHECK(raw > 0.03); // 1 / 16
    CHECK(error_of_line(cleaned(frame, {.stride = 2})) < 0.4 * raw);
    CHECK(error_of_line(cleaned(frame)) < 0.2 * raw);
}

TEST_CASE("denoise_light: values that are not finite, missing features, odd sizes") {
    const LitWall wall;
    PixelData<float> frame = wall.frame(4, 9);
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    for (auto* plane : {&frame.radiance, &frame.direct, &frame.indirect, &frame.root_direct, &frame.root_direct_variance,
                        &frame.variance}) {
        plane->view().store(20, 20, Vec3f(nan));
        plane->view().store(40, 10, Vec3f(inf));
    }
    for (auto* plane : {&frame.albedo, &frame.albedo_variance, &frame.normal, &frame.normal_variance})
        plane->view().store(60, 30, Vec3f(nan));
    frame.depth.view().store(60, 31, inf);
    frame.depth_variance.view().store(61, 31, nan);
    Plane<float, 3> out(wall.width, wall.height);
    SerialExecutor serial;
    const LightDenoiseReport report = denoise_light<float>(frame.view(), out.view(), {}, serial);
    CHECK(report.non_finite == 2);
    CHECK(report.spikes > 10);
    for (const float v : out.values()) CHECK(is_finite(v));
    CHECK(wall.error(out) < wall.error(wall.frame(4, 9).radiance) * 0.3);

    PixelData<float> bare = wall.frame(16, 9, 1, FilmPlanes::light_moments);
    CHECK(wall.error(cleaned(bare)) < wall.error(bare.radiance));
    for (const auto& [w, h] : {std::pair(1, 1), std::pair(1, 9), std::pair(33, 2), std::pair(8, 17)}) {
        const PixelData<float> small = LitWall{.width = w, .height = h}.frame(2, 1);
        const Plane<float, 3> clean = cleaned(small);
        for (const float v : clean.values()) CHECK(is_finite(v));
    }
    Plane<float, 3> target(wall.width, wall.height), other(3, 3);
    const PixelData<float> plain = wall.frame(4, 1, 1, FilmPlanes::features);
    CHECK_THROWS_WITH_AS(denoise_light<float>(plain.view(), target.view(), {}, serial),
                         "denoise_light: the frame has no statistics of its samples", Error);
    CHECK_THROWS_AS(denoise_light<float>(frame.view(), other.view(), {}, serial), Error);
    FrameView<float> uneven = frame.view();
    uneven.root_indirect = other.view();
    CHECK_THROWS_AS(denoise_light<float>(uneven, target.view(), {}, serial), Error);
    CHECK_THROWS_AS(LightRegression<float>(8, 8, {.ridge = 0}), Error);
    CHECK_THROWS_AS(LightRegression<float>(0, 8, {}), Error);
    CHECK_THROWS_AS(denoise_light<float>(frame.view(), target.view(), {.stride = 3}, serial), Error);
    CHECK_THROWS_AS(denoise_light<float>(frame.view(), target.view(), {.radius = 9}, serial), Error);
    CHECK(denoise(frame, denoise_options("best"), serial).report.used == NoiseUse::regression);
    CHECK(denoise(plain, denoise_options("best"), serial).report.used == NoiseUse::filter);
}

TEST_CASE("denoise_light: numbers whose squares overflow count as absent in every plane, and stay where they are") {
    const LitWall wall;
    const PixelData<float> whole = wall.frame(16, 9);
    const Plane<float, 3> expected = cleaned(whole);
    SerialExecutor serial;
    for (const float wrong : {-1.84768e38f, 2.72717e23f, 1e30f, 3.4e38f, -1.0f}) // the first two: what the fuzzer found
        for (int plane = 0; plane < 16; ++plane) {
            PixelData<float> frame = whole;
            Plane<float, 3>* const three[] = {&frame.radiance, &frame.direct, &frame.indirect, &frame.root_direct,
                                              &frame.root_indirect, &frame.root_direct_variance,
                                              &frame.root_indirect_variance, &frame.variance, &frame.halves,
                                              &frame.albedo, &frame.albedo_variance, &frame.normal_variance};
            Plane<float, 1>* const one[] = {&frame.depth, &frame.depth_variance, &frame.root_direct_halves, &frame.samples};
            if (plane < 12) three[plane]->view().store(9, 9, Vec3f(wrong, 1, wrong));
            else one[plane - 12]->view().store(9, 9, wrong);
            CAPTURE(wrong);
            CAPTURE(plane);
            const Plane<float, 3> clean = cleaned(frame);
            bool finite = true;
            double moved = 0;
            for (int y = 0; y < wall.height; ++y)
                for (int x = 0; x < wall.width; ++x) {
                    finite = finite && is_finite(clean.load(x, y));
                    if (std::abs(x - 9) < 30 && std::abs(y - 9) < 30) continue;
                    moved = std::max(moved, double(max_component(abs(clean.load(x, y) - expected.load(x, y)))));
                }
            const Denoised<float> fast = denoise(frame, denoise_options("fast"), serial);
            for (const float v : fast.radiance.values()) finite = finite && is_finite(v);
            CHECK(finite);
            CHECK(moved < 0.02); // energy is given back over the whole image
        }
}

TEST_CASE("LightRegression: tiles without light around are left out, and black as they would come out") {
    constexpr int width = 300, height = 150;
    SerialExecutor serial;
    const auto fitted = [&](float dark, int radius, int stride) {
        LightRegression<float> fit(width, height, {.radius = radius, .stride = stride});
        Random random(5);
        Plane<float, 3> color(width, height, dark), root(width, height, std::sqrt(dark));
        Plane<float, 1> guide(width, height), variance(width, height, 1e-3f), own(width, height, 7);
        for (int y = 60; y < 90; ++y)
            for (int x = 130; x < 160; ++x) {
                const float light = float(0.5 + random.uniform());
                color.view().store(x, y, Vec3f(light));
                root.view().store(x, y, Vec3f(std::sqrt(light)));
                guide.view().store(x, y, float(random.uniform()));
            }
        fit.set_guide(0, [&](int x, int y) { return guide.load(x, y); }, [](int, int) { return 0.01f; });
        Plane<float, 3> out(width, height);
        fit.run({std::as_const(color).view(), std::as_const(root).view(), std::as_const(variance).view(), {.35, .35}},
                out.view(), serial, own.view());
        return std::pair(out, own);
    };
    for (const auto& [radius, stride] : {std::pair(5, 1), std::pair(8, 2), std::pair(1, 1)}) {
        const auto [left_out, own] = fitted(0, radius, stride);
        const auto [all, all_own] = fitted(1e-30f, radius, stride); // as good as dark, but counted as light
        int untouched = 0;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const bool near = x >= 130 - 2 * radius && x < 160 + 2 * radius && y >= 60 - 2 * radius && y < 90 + 2 * radius;
                if (near) CHECK(left_out.load(x, y).x == doctest::Approx(all.load(x, y).x).epsilon(1e-6));
                else CHECK(left_out.load(x, y) == Vec3f(0));
                untouched += own.load(x, y) == 7;
                CHECK(all_own.load(x, y) != 7);
            }
        CHECK(untouched > width * height / 2);
    }
}

TEST_CASE("pair_average: takes a feature's noise away, not its edges") {
    Random random(4);
    Plane<float, 3> noisy(60, 30), variance(60, 30), none(60, 30);
    for (int y = 0; y < 30; ++y)
        for (int x = 0; x < 60; ++x) {
            const float truth = x < 30 ? 0.2f : 0.8f, deviation = y < 15 ? 0.1f : 0.0f;
            float sum = 0; // about normal
            for (int i = 0; i < 12; ++i) sum += float(random.uniform()) - 0.5f;
            noisy.view().store(x, y, Vec3f(truth + deviation * sum, 0, 0));
            variance.view().store(x, y, Vec3f(deviation * deviation, 0, 0));
        }
    SerialExecutor serial;
    const PairAveraged<float> out = pair_average<float>(noisy.view(), variance.view(), 4, 0.25, serial);
    double before = 0, after = 0;
    for (int y = 0; y < 15; ++y)
        for (int x = 0; x < 60; ++x) {
            const double truth = x < 30 ? 0.2 : 0.8;
            before += std::pow(double(noisy.load(x, y).x) - truth, 2);
            after += std::pow(double(out.mean.load(x, y).x) - truth, 2);
        }
    CHECK(after < before / 8);
    for (int y = 20; y < 30; ++y) // without variance nothing of another value counts
        for (int x = 0; x < 60; ++x) CHECK(out.mean.load(x, y).x == doctest::Approx(x < 30 ? 0.2 : 0.8).epsilon(1e-4));
    noisy.view().store(5, 5, Vec3f(std::numeric_limits<float>::quiet_NaN()));
    const PairAveraged<float> hurt = pair_average<float>(noisy.view(), variance.view(), 4, 0.25, serial);
    int lost = 0;
    for (const float v : hurt.mean.values()) lost += !is_finite(v);
    CHECK(lost == 3);                                             // the three channels of that pixel
    CHECK(hurt.mean.load(12, 5).x == out.mean.load(12, 5).x);     // out of reach
    noisy.view().store(5, 5, Vec3f(0.2f, 0, 0));
    const PairAveraged<float> same = pair_average<float>(noisy.view(), none.view(), 4, 0.25, serial);
    CHECK(same.mean.values() == noisy.values());
}

TEST_CASE("restore_energy: what is lacking comes back where it was, noise does not") {
    Random random(8);
    Plane<float, 3> noisy(96, 64), image(96, 64);
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 96; ++x) {
            noisy.view().store(x, y, Vec3f(float(-std::log(1 - random.uniform()))));
            image.view().store(x, y, Vec3f(x < 48 ? 0.7f : 1.0f)); // a third is missing on the left
        }
    restore_energy<float>(image.view(), noisy.view());
    double left = 0, right = 0, squares = 0;
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 96; ++x) {
            (x < 48 ? left : right) += double(image.load(x, y).x) / (48 * 64);
            squares += std::pow(double(image.load(x, y).x) - 1, 2) / (96 * 64);
        }
    CHECK(left == doctest::Approx(1).epsilon(0.06)); // 3072 pixels: 1.8 % of noise, and what the gates hold back
    CHECK(right == doctest::Approx(1).epsilon(0.06));
    CHECK(squares < 0.03);
}

TEST_CASE("restore_energy: what a lamp lacks does not brighten the dark around it, and the whole keeps its energy") {
    Plane<float, 3> noisy(64, 64, 0.1f), image(64, 64, 0.1f);
    for (int y = 30; y < 34; ++y)
        for (int x = 30; x < 34; ++x) {
            noisy.view().store(x, y, Vec3f(20));
            image.view().store(x, y, Vec3f(15));
        }
    restore_energy<float>(image.view(), noisy.view());
    CHECK(image.load(28, 32).x < 1.05f * image.load(2, 2).x);
    double has = 0, truth = 0;
    for (std::size_t i = 0; i < image.values().size(); ++i) {
        has += double(image.values()[i]);
        truth += double(noisy.values()[i]);
    }
    CHECK(has == doctest::Approx(truth).epsilon(0.05));
    Plane<float, 3> black(9, 9), light(9, 9, 1.0f);
    restore_energy<float>(black.view(), light.view());
    for (const float v : black.values()) CHECK(v == 0);
}

TEST_CASE("denoise_light: pixels beside a lamp's faint reflection stay dark") {
    constexpr int width = 64, height = 40, spp = 16;
    const auto lamp = [](int x, int y) { return x >= 30 && x < 36 && y >= 16 && y < 22; };
    const std::uint64_t seed = 3;
    CAPTURE(seed);
    Random random(seed);
    FilmPass<float> pass(width, height, FilmPlanes::statistics, 0, spp);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            FilmPass<float>::Pixel pixel(pass, x, y);
            for (int i = 0; i < spp; ++i) { // one path in twenty is reflected, the others see a dark wall
                PixelSample<float> s;
                s.hit = true;
                s.albedo = Vec3f(0.1f);
                s.direct = Vec3f(lamp(x, y) && random.uniform() < 0.05 ? 100 : float(0.1 + 0.1 * random.uniform()));
                s.radiance = s.direct;
                pixel.add(s);
            }
        }
    const Plane<float, 3> out = cleaned(pass.finish().resolve());
    double beside = 0, count = 0, inside = 0;
    for (int y = 13; y < 25; ++y)
        for (int x = 27; x < 39; ++x) {
            if (lamp(x, y)) inside += double(out.load(x, y).x) / 36;
            else beside += std::pow(double(out.load(x, y).x) / 0.15 - 1, 2), count += 1;
        }
    CAPTURE(beside / count);
    CHECK(beside / count < 4);
    CHECK(inside > 0.5);
}

TEST_CASE("LightRegression: a bright pixel has a say where its samples agree, none where one may have brought it all") {
    constexpr int side = 24;
    const auto fitted = [&](float variance_of_bright) {
        Random random(7);
        Plane<float, 3> color(side, side), root(side, side);
        Plane<float, 1> variance(side, side, 1e-5f);
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < side; ++x) {
                const float light = x == 12 && y == 12 ? 0.5f : float(random.uniform(0.009, 0.011));
                color.view().store(x, y, Vec3f(light));
                root.view().store(x, y, Vec3f(std::sqrt(light)));
            }
        variance.view().store(12, 12, variance_of_bright);
        const LightRegression<float> fit(side, side, {.radius = 5, .stride = 1});
        Plane<float, 3> out(side, side);
        SerialExecutor serial;
        fit.run({std::as_const(color).view(), std::as_const(root).view(), std::as_const(variance).view(), {.5, .5}},
                out.view(), serial);
        return out.load(12, 12).x;
    };
    const float agree = fitted(0.05f), alone = fitted(1.5f); // 3 · variance beside (3 · 0.71)², the root's square
    CAPTURE(agree);
    CAPTURE(alone);
    CHECK(agree > 0.04f); // 0.011 without a say
    CHECK(alone < 0.02f);
}
