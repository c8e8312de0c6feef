#include "support/random.hpp"
#include <lambent/core/parallel.hpp>
#include <lambent/film/metrics.hpp>
#include <lambent/render/adaptive.hpp>
#include <lambent/render/path.hpp>
#include <lambent/render/render.hpp>
#include <lambent/sampling/sobol.hpp>
#include <lambent/scene/builtin.hpp>
#include <doctest/doctest.h>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

using namespace lambent;

namespace adaptive_test {
namespace {

constexpr int width = 96, height = 32;
constexpr FilmPlanes planes = FilmPlanes::halves;

/// Rounds to the end, as `render` makes them. `sample(x, y, i)` is the light of a sample.
template <class Sample>
Film<float> adaptive_film(double target, Sample&& sample, std::uint64_t limit = 1 << 14) {
    SerialExecutor serial;
    Film<float> film(width, height, planes);
    for (std::uint64_t begin = 0, end = 8; begin < limit; begin = end, end *= 2) {
        Plane<std::uint8_t, 1> active = going_on(film);
        if (begin > 0) {
            AdaptiveRound round = next_round(film, {.error_target = target, .first_samples = 8}, serial);
            if (round.count == 0) break;
            active = std::move(round.active);
        }
        FilmPass<float> pass(width, height, planes, begin, end, std::as_const(active).view());
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                if (active.load(x, y) == 0) continue;
                FilmPass<float>::Pixel pixel(pass, x, y);
                for (std::uint64_t i = begin; i < end; ++i) {
                    PixelSample<float> s;
                    s.radiance = Vec3f(float(sample(x, y, i)));
                    s.albedo = Vec3f(1);
                    s.hit = true;
                    pixel.add(s);
                }
            }
        film.merge(pass.finish());
    }
    return film;
}

double uniform(int x, int y, std::uint64_t i, std::uint64_t seed) {
    lambent_test::Random random(((seed * 64 + std::uint64_t(y)) * 128 + std::uint64_t(x)) * 65536 + i);
    return random.uniform();
}

/// Three thirds: light 20 in one of 20 samples; 1, and 100 more in one of 1000; an exponential's.
double rare_light(int x, double u) {
    if (x < 32) return u < 0.05 ? 20.0 : 0.0;
    if (x < 64) return u < 0.001 ? 101.0 : 1.0;
    return -std::log(1 - u);
}

} // namespace

TEST_CASE("stopping keeps the energy of rare bright light: each third's mean within 1 % and 4 sigma") {
    const double truth[] = {1, 1.1, 1}, deviation[] = {std::sqrt(19.0), std::sqrt(100 * 100 * 0.001 * 0.999), 1};
    double sums[3] = {}, variances[3] = {};
    constexpr int seeds = 16;
    std::uint64_t fewest = ~std::uint64_t(0), most = 0;
    for (std::uint64_t seed = 0; seed < seeds; ++seed) {
        const Film<float> film =
            adaptive_film(0.4, [&](int x, int y, std::uint64_t i) { return rare_light(x, uniform(x, y, i, seed)); });
        const PixelData<float> frame = film.resolve();
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const auto third = std::size_t(x / 32);
                const double n = double(frame.samples.load(x, y));
                sums[third] += double(frame.radiance.load(x, y).x);
                variances[third] += deviation[third] * deviation[third] / n;
                fewest = std::min(fewest, std::uint64_t(n));
                most = std::max(most, std::uint64_t(n));
            }
    }
    CHECK(most >= 8 * fewest); // it is adaptive
    for (std::size_t third = 0; third < 3; ++third) {
        const double pixels = 32.0 * height * seeds;
        const double bias = sums[third] / pixels / truth[third] - 1;
        const double sigma = std::sqrt(variances[third]) / pixels / truth[third];
        INFO("third ", third, ": bias ", bias, ", sigma ", sigma);
        CHECK(std::abs(bias) <= 0.01);
        CHECK(std::abs(bias) <= 4 * sigma);
    }
}

TEST_CASE("whether a pixel goes on is not its own samples' say") {
    SerialExecutor serial;
    const auto film_with = [&](int px, int py, double light) {
        FilmPass<float> pass(width, height, planes, 0, 16);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                FilmPass<float>::Pixel pixel(pass, x, y);
                for (std::uint64_t i = 0; i < 16; ++i) {
                    PixelSample<float> s;
                    s.radiance = Vec3f(float(rare_light(x, uniform(x, y, i, 1))));
                    if (x == px && y == py) s.radiance = Vec3f(i == 3 ? float(light) : 1.0f);
                    s.albedo = Vec3f(1);
                    s.hit = true;
                    pixel.add(s);
                }
            }
        return pass.finish();
    };
    int going = 0;
    lambent_test::Random random(2);
    for (int trial = 0; trial < 30; ++trial) {
        const int x = int(random.below(width)), y = int(random.below(height));
        const AdaptiveRound calm = next_round(film_with(x, y, 1), {.error_target = 0.6}, serial);
        const AdaptiveRound wild = next_round(film_with(x, y, 40), {.error_target = 0.6}, serial);
        INFO("pixel ", x, ", ", y);
        CHECK(calm.active.load(x, y) == wild.active.load(x, y));
        going += calm.active.load(x, y);
    }
    CHECK(going > 3);
    CHECK(going < 27);
}

TEST_CASE("the error target is met, with fewer samples than the same error takes everywhere") {
    // Light 1 with a noise that grows from left to right.
    const auto deviation = [](int x) { return 0.05 * std::exp2(double(x) / 16); };
    double mean_square = 0;
    for (int x = 0; x < width; ++x) mean_square += deviation(x) * deviation(x) / width;
    Plane<float, 3> truth(width, height, 1);
    for (const double target : {0.1, 0.05}) {
        double rel = 0, samples = 0;
        constexpr int seeds = 6;
        for (std::uint64_t seed = 0; seed < seeds; ++seed) {
            const Film<float> film = adaptive_film(target, [&](int x, int y, std::uint64_t i) {
                return 1 + deviation(x) * std::sqrt(12.0) * (uniform(x, y, i, seed) - 0.5);
            });
            const PixelData<float> frame = film.resolve();
            const double one = rel_mse(std::as_const(frame.radiance).view(), std::as_const(truth).view());
            CHECK(one >= 0.7 * target * target);
            CHECK(one <= 1.2 * target * target);
            rel += one / seeds;
            samples += double(film.total_samples()) / (width * height) / seeds;
            CHECK(estimated_error(frame) <= target);
        }
        INFO("target ", target, ": ", samples, " samples a pixel, of all ", mean_square / 1.01 / rel);
        CHECK(samples < 0.75 * mean_square / 1.01 / rel);
    }
}

TEST_CASE("halves: a quarter of the squared distance of the means; the estimate by them is that of the noise") {
    Film<float> film = adaptive_film(1e-9, [](int x, int y, std::uint64_t i) { return uniform(x, y, i, 5); }, 64);
    const PixelData<float> frame = film.resolve();
    double means[2] = {};
    for (std::uint64_t i = 0; i < 64; ++i) means[i / 32] += uniform(7, 9, i, 5) / 32;
    CHECK(double(frame.halves.load(7, 9).y) == doctest::Approx(std::pow(means[0] - means[1], 2) / 4).epsilon(1e-3));
    // 3072 pixels of one degree of freedom; 0.95 is what halves of Sobol's samples hold, see RelativeVariance.
    CHECK(estimated_error(frame) == doctest::Approx(std::sqrt(0.95 / 12 / 64 / (0.25 * 1.01))).epsilon(0.04));
}

TEST_CASE("nothing to do: an image of emitters, one that is exact; what cannot be is refused") {
    SerialExecutor serial;
    const Film<float> exact = adaptive_film(0.1, [](int, int, std::uint64_t) { return 0.5; });
    CHECK(exact.total_samples() == 8 * width * height);
    CHECK(exact.stops().empty());
    FilmPass<float> pass(4, 4, planes, 0, 8);
    for (int p = 0; p < 16; ++p) {
        FilmPass<float>::Pixel pixel(pass, p % 4, p / 4);
        for (int i = 0; i < 8; ++i) {
            PixelSample<float> s;
            s.radiance = s.emission = Vec3f(float(i));
            pixel.add(s);
        }
    }
    const Film<float> lamp = pass.finish();
    CHECK(next_round(lamp, {.first_samples = 8}, serial).count == 0);
    CHECK_THROWS_AS(next_round(lamp, {.first_samples = 16}, serial), Error);
    CHECK_THROWS_AS(next_round(lamp, {.first_samples = 6}, serial), Error);
    CHECK_THROWS_AS(next_round(lamp, {.error_target = 0}, serial), Error);
    CHECK_THROWS_AS(next_round(FilmPass<float>(4, 4, FilmPlanes::albedo, 0, 16).finish(), {}, serial), Error);
    CHECK_THROWS_AS(next_round(FilmPass<float>(4, 4, planes, 0, 24).finish(), {}, serial), Error);
    CHECK_THROWS_AS(next_round(FilmPass<float>(4, 4, planes, 16, 32).finish(), {}, serial), Error);
}

TEST_CASE("render: a pixel that goes on has the bits it has where all do; threads change nothing") {
    const Scene<float> scene = cornell_scene<float>();
    ThreadExecutor threads(3);
    SerialExecutor serial;
    const PreparedScene<float> prepared(scene, serial);
    const auto rounds = [&](auto& executor) {
        Film<float> film;
        RenderOptions options{.width = 24, .height = 20, .end_sample = 8, .planes = planes};
        Plane<std::uint8_t, 1> active;
        for (int round = 0; round < 4; ++round) {
            options.active = std::as_const(active).view();
            render(film, prepared, scene.cameras[0], PathIntegrator<>{}, SobolSampler<float>(1), options, executor,
                   [] { return true; });
            active = next_round(film, {.error_target = 0.2, .first_samples = 8}, executor).active;
            options.first_sample = options.end_sample;
            options.end_sample *= 2;
        }
        return film;
    };
    const Film<float> film = rounds(threads);
    CHECK(film.stops().size() == 24 * 20);
    CHECK(film.stops() == rounds(serial).stops());
    CHECK(film.blocks()[0].sums == rounds(serial).blocks()[0].sums);
    const PixelData<float> frame = film.resolve();
    int numbers = 0;
    for (const std::uint64_t n : {8u, 16u, 32u, 64u}) {
        const PixelData<float> all = render(prepared, scene.cameras[0], PathIntegrator<>{}, SobolSampler<float>(1),
                                            {.width = 24, .height = 20, .end_sample = n, .planes = planes}, threads);
        int count = 0;
        for (int y = 0; y < 20; ++y)
            for (int x = 0; x < 24; ++x) {
                if (frame.samples.load(x, y) != float(n)) continue;
                ++count;
                REQUIRE(frame.radiance.load(x, y) == all.radiance.load(x, y));
                REQUIRE(frame.variance.load(x, y) == all.variance.load(x, y));
            }
        numbers += count > 0;
    }
    CHECK(numbers >= 2);
    const std::vector<std::uint8_t> small(4, 1);
    RenderOptions wrong{.width = 24, .height = 20, .first_sample = 64, .end_sample = 128, .planes = planes};
    wrong.active = ActivePixels(small.data(), 2, 2);
    Film<float> same = film;
    CHECK_THROWS_AS(render(same, prepared, scene.cameras[0], PathIntegrator<>{}, SobolSampler<float>(1), wrong, serial,
                           [] { return true; }),
                    Error);
}

} // namespace adaptive_test
