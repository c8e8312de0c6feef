#include "lit_wall.hpp"
#include "support/random.hpp"
#include <cmath>
#include <cstring>
#include <doctest/doctest.h>
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise.hpp>
#include <limits>
#include <utility>

using namespace lambent;
using lambent_test::LitWall;
using lambent_test::Random;

namespace {

constexpr float infinite = std::numeric_limits<float>::infinity();

/// About normal.
float wobble(Random& random) {
    float sum = -6;
    for (int i = 0; i < 12; ++i) sum += float(random.uniform());
    return sum;
}

/// What noisy samples of a wall of radiance 1 would be, with what is known of them.
struct NoisyWall {
    static constexpr int width = 64, height = 40;
    Plane<float, 3> noisy{width, height}, variance{width, height};

    NoisyWall(float deviation, std::uint64_t seed) {
        Random random(seed);
        for (float& v : noisy.values()) v = 1 + deviation * wobble(random);
        for (float& v : variance.values()) v = deviation * deviation;
    }
    /// Mean square of the difference to 1 after blending a filter's result with it.
    double error(Plane<float, 3> clean, double samples = 64) const {
        SerialExecutor serial;
        blend_with_input<float>(clean.view(), noisy.view(), variance.view(), samples, serial);
        double sum = 0;
        for (const float v : clean.values()) sum += (double(v) - 1) * (double(v) - 1) / double(clean.values().size());
        return sum;
    }
};

} // namespace

TEST_CASE("box_mean: means over squares cut off at the border; one pixel is of no account beyond the radius") {
    Random random(3);
    Plane<double, 1> plane(13, 9);
    for (double& v : plane.values()) v = random.uniform();
    const auto value = [&](int x, int y) { return plane.load(x, y); };
    for (const unsigned count : {1u, 3u}) {
        ThreadExecutor threads(count);
        for (const int radius : {0, 1, 4, 20}) {
            const Plane<double, 1> means = box_mean<double>(13, 9, radius, value, threads);
            for (int y = 0; y < 9; ++y)
                for (int x = 0; x < 13; ++x) {
                    double sum = 0, n = 0;
                    for (int v = 0; v < 9; ++v)
                        for (int u = 0; u < 13; ++u)
                            if (std::abs(u - x) <= radius && std::abs(v - y) <= radius) sum += value(u, v), ++n;
                    CHECK(means.load(x, y) == doctest::Approx(sum / n).epsilon(1e-12));
                }
        }
    }
    SerialExecutor serial;
    const Plane<double, 1> before = box_mean<double>(13, 9, 2, value, serial);
    plane.view().store(4, 4, 1e300);
    const Plane<double, 1> after = box_mean<double>(13, 9, 2, value, serial);
    for (int y = 0; y < 9; ++y)
        for (int x = 0; x < 13; ++x)
            CHECK((before.load(x, y) == after.load(x, y)) == (std::abs(x - 4) > 2 || std::abs(y - 4) > 2));
}

TEST_CASE("spread_factor: 1 for independent samples, less for halves that lie closer together") {
    SerialExecutor serial;
    Random random(7);
    Plane<float, 3> variance(40, 40, 0.5f), halves(40, 40);
    Plane<float, 1> closer(40, 40), none(40, 40);
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 40; ++x) {
            Vec3f squares;
            for (int c = 0; c < 3; ++c) squares[c] = 0.5f * std::pow(wobble(random), 2.0f);
            halves.view().store(x, y, squares);
            closer.view().store(x, y, (squares.x + squares.y + squares.z) / 5);
        }
    const auto mean = [&](const auto& plane) {
        double sum = 0;
        const Plane<float, 1> factor = spread_factor<float>(variance.view(), std::as_const(plane).view(), serial);
        for (const float v : factor.values()) sum += double(v) / 1600;
        return sum;
    };
    CHECK(mean(halves) == doctest::Approx(0.97).epsilon(0.03)); // at most 1: what is above is cut off
    CHECK(mean(closer) == doctest::Approx(0.2).epsilon(0.03));
    CHECK(mean(none) == doctest::Approx(1)); // nothing known
    CHECK(mean(Plane<float, 3>()) == doctest::Approx(1));
}

TEST_CASE("blend_with_input: a good filter's result stays, a wrong one gives way, more so the less noise there is") {
    const NoisyWall wall(0.2f, 5);
    CHECK(wall.error(Plane<float, 3>(64, 40, 1.0f)) < 0.01 * 0.04); // of the input's
    CHECK(wall.error(Plane<float, 3>(64, 40, 0.2f)) < 0.15 * 0.64); // of the filter's
    double last = 1;
    for (const float deviation : {0.1f, 0.03f, 0.01f, 0.003f}) {
        CAPTURE(deviation);
        const double error = NoisyWall(deviation, 6).error(Plane<float, 3>(64, 40, 0.9f));
        CHECK(error <
              1.25 * std::max(0.01 * 0.3, double(deviation) * double(deviation) * (deviation < 0.05f ? 1 : 1e9)));
        CHECK(error < last);
        last = error;
    }
    CHECK(wall.error(Plane<float, 3>(64, 40, 0.2f), 1) == doctest::Approx(0.64)); // one sample: no variance, no say
}

TEST_CASE("blend_with_input: dark pixels that are sure of themselves are believed beside a bright one") {
    constexpr int width = 16, height = 16;
    Plane<float, 3> noisy(width, height, 0.1f), variance(width, height, 1e-5f), clean(width, height, 0.1f);
    noisy.view().store(8, 8, Vec3f(20));
    variance.view().store(8, 8, Vec3f(1));
    for (int y = 7; y <= 9; ++y)
        for (int x = 7; x <= 9; ++x) clean.view().store(x, y, Vec3f(2)); // the filter smeared it
    SerialExecutor serial;
    const auto blended = [&](double samples) {
        Plane<float, 3> out = clean;
        blend_with_input<float>(out.view(), noisy.view(), variance.view(), samples, serial);
        return out;
    };
    CHECK(blended(16).load(7, 8).x == doctest::Approx(0.1).epsilon(0.02));
    const Plane<float, 3> smeared = clean;
    variance.view().store(8, 8, Vec3f(400)); // of one sample, with a little of it for each: no reason to miss that
    for (int y = 7; y <= 9; ++y)
        for (int x = 7; x <= 9; ++x) clean.view().store(x, y, Vec3f(0.5f));
    CHECK(blended(16).load(7, 8).x == 0.5f);
    CHECK(blended(16).load(8, 8).x == 0.5f);
    variance.view().store(8, 8, Vec3f(1));
    clean = smeared;
    noisy.view().store(3, 3, Vec3f(std::numeric_limits<float>::quiet_NaN()));
    variance.view().store(12, 3, Vec3f(infinite));
    const Plane<float, 3> out = blended(16);
    for (const float v : out.values()) CHECK(is_finite(v));
    CHECK(out.load(3, 3) == clean.load(3, 3));
    CHECK(out.load(12, 3) == clean.load(12, 3));
    CHECK(out.load(7, 8) == blended(16).load(7, 8));
}

TEST_CASE("blend_with_input: bright pixels that are sure of themselves come back too, and nothing less than black does") {
    constexpr int width = 16, height = 16;
    Plane<float, 3> noisy(width, height, 0.1f), variance(width, height, 1e-5f), clean(width, height, 0.1f);
    for (int x = 6; x <= 9; ++x) { // a line that the filter lost, beside one that is bright by chance
        noisy.view().store(x, 8, Vec3f(1));
        variance.view().store(x, 8, Vec3f(0.01f));
        noisy.view().store(x, 7, Vec3f(3));
        variance.view().store(x, 7, Vec3f(9));
    }
    SerialExecutor serial;
    const auto blended = [&](double samples) {
        Plane<float, 3> out = clean;
        blend_with_input<float>(out.view(), noisy.view(), variance.view(), samples, serial);
        return out;
    };
    CHECK(blended(16).load(7, 8).x > 0.8f);
    CHECK(blended(4).load(7, 8).x == 0.1f); // of so few samples agreement means nothing
    CHECK(blended(16).load(7, 7).x == 0.1f);
    noisy.view().store(3, 3, Vec3f(-5));
    const Plane<float, 3> out = blended(16);
    for (const float v : out.values()) CHECK(v >= 0);
}

TEST_CASE("blend_with_input: light that few samples bring does not come back as dots") {
    // One sample in twenty brings nearly all of it: of 64, a pixel has the mean and the variance of about three.
    constexpr int side = 96, samples = 64;
    constexpr double chance = 0.05;
    Random random(5);
    Plane<float, 3> noisy(side, side), variance(side, side), out(side, side, 1.0f);
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            double mean = 0, square = 0;
            for (int i = 0; i < samples; ++i) {
                const double v = random.uniform() < chance ? random.uniform(0, 2) / chance : 0.0;
                mean += v / samples;
                square += v * v / samples;
            }
            noisy.view().store(x, y, Vec3f(float(mean)));
            variance.view().store(x, y, Vec3f(float((square - mean * mean) / (samples - 1))));
        }
    SerialExecutor serial;
    blend_with_input<float>(out.view(), noisy.view(), variance.view(), samples, serial);
    int dots = 0;
    double square = 0;
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            const double off = double(out.load(x, y).x) - 1;
            dots += std::abs(off) > 0.3;
            square += off * off / (side * side);
        }
    MESSAGE(dots << " dots, mean square " << square);
    CHECK(dots <= side * side / 500);
    CHECK(square < 5e-4);
}

TEST_CASE("denoised_error: 95 % intervals hold the truth in 90 to 98 % of all values, and are not wide for that") {
    const LitWall wall;
    SerialExecutor serial;
    for (const int spp : {4, 16, 64, 256})
        for (const int stride : {1, 2}) {
            const std::uint64_t seed = 31;
            CAPTURE(seed);
            CAPTURE(spp);
            CAPTURE(stride);
            double covered = 0, width = 0, squares = 0, n = 0;
            for (std::uint64_t round = 0; round < 3; ++round) {
                const PixelData<float> frame = wall.frame(spp, seed + 100 * round + std::uint64_t(spp));
                Plane<float, 3> clean(wall.width, wall.height), error(wall.width, wall.height);
                denoise_light<float>(frame.view(), clean.view(), {.stride = stride}, serial, error.view());
                for (int y = 0; y < wall.height; ++y)
                    for (int x = 0; x < wall.width; ++x)
                        for (int c = 0; c < 3; ++c) {
                            const double off = double(clean.load(x, y)[c]) - wall.truth(x, y)[c];
                            const double half = 1.96 * double(error.load(x, y)[c]);
                            covered += std::abs(off) <= half;
                            width += half;
                            squares += off * off;
                            n += 1;
                        }
            }
            CHECK(covered / n > 0.9);
            CHECK(covered / n < 0.985);
            CHECK(width / n < 3 * std::sqrt(squares / n));
        }
    const PixelData<float> frame = wall.frame(16, 1);
    Denoised<float> known = denoise(frame, denoise_options("balanced"), serial);
    CHECK(known.report.error);
    const auto whole = [&](const PixelView<const float, 3>& emission) {
        return estimated_error<float>(std::as_const(known).radiance.view(), std::as_const(known).error.view(),
                                      emission);
    };
    const double estimate = whole(frame.emission.view());
    known.error.view().store(50, 20, Vec3f(1e6f)); // the lamp
    CHECK(whole(frame.emission.view()) == estimate);
    CHECK(whole({}) > 100 * estimate);
    CHECK(estimate > 0.5 * std::sqrt(wall.error(known.radiance)));
    CHECK(estimate < 2.5 * std::sqrt(wall.error(known.radiance)));
    const Denoised<float> unknown =
        denoise(wall.frame(16, 1, 1, FilmPlanes::features), denoise_options("balanced"), serial);
    CHECK(!unknown.report.error);
    CHECK(unknown.error.absent());
}
