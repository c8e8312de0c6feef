#include "support/random.hpp"
#include <cmath>
#include <doctest/doctest.h>
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise.hpp>
#include <limits>
#include <utility>

using namespace lambent;
using lambent_test::Random;

namespace {

template <class F> // of a random number in [0, 1)
Plane<float, 3> grey_noise(int width, int height, std::uint64_t seed, F&& value) {
    Random random(seed);
    Plane<float, 3> image(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) image.view().store(x, y, Vec3f(float(value(random.uniform()))));
    return image;
}

double level(const Plane<float, 3>& image) {
    SerialExecutor serial;
    return noise_level<float>(image.view(), serial);
}

/// A plane seen from in front, in even light.
PixelData<float> wall_frame(int width, int height) {
    PixelData<float> frame;
    frame.width = width, frame.height = height;
    for (auto* plane : {&frame.radiance, &frame.albedo, &frame.normal, &frame.position}) plane->allocate(width, height);
    for (auto* plane : {&frame.material, &frame.samples}) plane->allocate(width, height, 1);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            frame.albedo.view().store(x, y, Vec3f(0.5f));
            frame.radiance.view().store(x, y, Vec3f(1));
            frame.normal.view().store(x, y, Vec3f(0, 0, 1));
            frame.position.view().store(x, y, Vec3f(float(x), float(y), 0));
        }
    return frame;
}

} // namespace

TEST_CASE("noise_level: 1/2 of exponential noise, 2 (1 - p) / (2 - p) where samples find light with chance p") {
    constexpr std::uint64_t seed = 5;
    CAPTURE(seed);
    // 2 · 256 · 192 pairs of standard deviations below 0.3, correlated by fours: 0.004 is five of their mean's.
    const auto exponential = grey_noise(256, 192, seed, [](double u) { return -std::log(1 - u); });
    CHECK(level(exponential) == doctest::Approx(0.5).epsilon(0.008));
    for (const double p : {0.1, 0.5, 0.9})
        CHECK(level(grey_noise(256, 192, seed, [&](double u) { return u < p ? 3.0 : 0.0; })) ==
              doctest::Approx(2 * (1 - p) / (2 - p)).epsilon(0.02));
    CHECK(level(Plane<float, 3>(9, 7, 2)) == 0);
    CHECK(level(Plane<float, 3>(9, 7)) == 0);
    CHECK(level(Plane<float, 3>(1, 1, 2)) == 0);
}

TEST_CASE("noise_level: neither exposure nor a bright pixel nor threads matter") {
    const auto image = grey_noise(80, 60, 2, [](double u) { return u; });
    auto scaled = image, spiked = image;
    for (float& v : scaled.values()) v *= 0x1p-20f;
    spiked.view().store(40, 30, Vec3f(1e30f));
    CHECK(level(scaled) == level(image));
    CHECK(std::abs(level(spiked) - level(image)) <= 4.0 / (79 * 60 + 80 * 59));
    ThreadExecutor three(3);
    CHECK(noise_level<float>(image.view(), three) == level(image));
}

TEST_CASE("pixel_albedo: a Gaussian of half a pixel, surfaces among themselves") {
    PixelData<float> frame = wall_frame(9, 9);
    SerialExecutor serial;
    frame.albedo.view().store(4, 4, Vec3f(1, 0.5f, 0));
    const double g = std::exp(-2.0), whole = (1 + 2 * g) * (1 + 2 * g);
    const auto at = [&](const Plane<float, 3>& albedo, int x, int y) { return double(albedo.load(x, y).x); };
    Plane<float, 3> albedo = pixel_albedo(frame.view(), serial);
    CHECK(at(albedo, 4, 4) == doctest::Approx(0.5 + 0.5 / whole));
    CHECK(at(albedo, 5, 4) == doctest::Approx(0.5 + 0.5 * g / whole));
    CHECK(at(albedo, 3, 3) == doctest::Approx(0.5 + 0.5 * g * g / whole));
    CHECK(at(albedo, 6, 4) == doctest::Approx(0.5));
    CHECK(albedo.load(4, 4).y == doctest::Approx(0.5));

    frame.albedo.view().store(4, 4, Vec3f(0)); // a black surface counts, a miss does not, nor does what is no albedo
    CHECK(at(pixel_albedo(frame.view(), serial), 4, 4) == doctest::Approx(0.5 - (0.5 - albedo_floor) / whole).epsilon(1e-4));
    frame.normal.view().store(4, 4, Vec3f(0));
    albedo = pixel_albedo(frame.view(), serial);
    CHECK(at(albedo, 4, 4) == doctest::Approx(albedo_floor));
    CHECK(at(albedo, 5, 4) == doctest::Approx(0.5));
    frame.albedo.view().store(4, 4, Vec3f(std::numeric_limits<float>::quiet_NaN()));
    albedo = pixel_albedo(frame.view(), serial);
    CHECK(at(albedo, 4, 4) == 1);
    CHECK(at(albedo, 5, 4) == doctest::Approx(0.5));
    frame.albedo = {};
    CHECK_THROWS_AS(pixel_albedo(frame.view(), serial), Error);
}

TEST_CASE("denoise: after one sample textures are taken over their pixels, after two they stay") {
    PixelData<float> frame = wall_frame(24, 16);
    for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 24; ++x) frame.albedo.view().store(x, y, Vec3f((x + y) % 2 == 0 ? 0.9f : 0.1f));
    frame.radiance = frame.albedo;
    SerialExecutor serial;
    const auto once = denoise(frame, {}, serial).radiance;
    for (float& n : frame.samples.values()) n = 2;
    const auto twice = denoise(frame, {}, serial).radiance;
    const auto expected = pixel_albedo(frame.view(), serial);
    for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 24; ++x) {
            REQUIRE(once.load(x, y).x == doctest::Approx(expected.load(x, y).x).epsilon(1e-5));
            REQUIRE(twice.load(x, y).x == doctest::Approx(frame.radiance.load(x, y).x).epsilon(1e-5));
        }
    frame.samples = {}; // who knows
    CHECK(denoise(frame, {}, serial).radiance.load(3, 3).x == doctest::Approx(frame.radiance.load(3, 3).x).epsilon(1e-5));
}

TEST_CASE("denoise: where few samples find light, a pixel of its own material takes some of its neighbours', not where all do") {
    constexpr std::uint64_t seed = 3;
    CAPTURE(seed);
    SerialExecutor serial;
    PixelData<float> frame = wall_frame(96, 64);
    for (const double share : {0.1, 1.0}) {
        frame.radiance = grey_noise(96, 64, seed, [&](double u) { return u < share ? 0.5 / share : 0.0; });
        int like_others = 0, lone = 0;
        for (int y = 8; y < 64; y += 16)
            for (int x = 8; x < 96; x += 16, ++lone) {
                frame.radiance.view().store(x, y, Vec3f(0));
                frame.material.view().store(x, y, 7);
            }
        const auto out = denoise(frame, {}, serial).radiance;
        for (int y = 8; y < 64; y += 16)
            for (int x = 8; x < 96; x += 16) like_others += out.load(x, y).x > 0.15f && out.load(x, y).x < 1.5f ? 1 : 0;
        CHECK(like_others == (share < 1 ? lone : 0));
    }
}
