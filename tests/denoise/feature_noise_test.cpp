#include "support/random.hpp"
#include <cmath>
#include <cstdlib>
#include <doctest/doctest.h>
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise_light.hpp>
#include <lambent/denoise/feature_noise.hpp>
#include <lambent/film/film.hpp>
#include <lambent/film/film_pass.hpp>

using namespace lambent;
using lambent_test::Random;

namespace {

template <class F> // f(x, y)
Plane<float, 3> noise_of(int width, int height, F&& f) {
    Plane<float, 3> plane(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) plane.view().store(x, y, f(x, y));
    SerialExecutor serial;
    return feature_noise<float>(std::as_const(plane).view(), serial);
}

double total(const Plane<float, 3>& plane) {
    double sum = 0;
    for (const float v : plane.values()) sum += double(v);
    return sum;
}

/// Normal of variance 1, about.
float normal(Random& random) {
    float sum = -6;
    for (int i = 0; i < 12; ++i) sum += random.uniform_float();
    return sum;
}

} // namespace

TEST_CASE("feature_noise: 1.1 to 1.9 times the variance of normal noise, next to nothing of slopes and straight edges") {
    constexpr int width = 80, height = 60, pixels = width * height;
    Random random(5);
    const double one = total(noise_of(width, height, [&](int, int) { return Vec3f(3 * normal(random), 0, 0); }));
    CHECK(one / (9 * pixels) == doctest::Approx(1.11).epsilon(0.08));
    const double three = total(noise_of(width, height, [&](int, int) {
        return Vec3f(normal(random), normal(random), normal(random));
    }));
    CHECK(three / (3 * pixels) == doctest::Approx(1.91).epsilon(0.08));
    // Two things in turn by chance: what a lens out of focus sees.
    const double either = total(noise_of(width, height, [&](int, int) { return Vec3f(random.uniform() < 0.5, 0, 0); }));
    CHECK(either / pixels > 0.05);
    CHECK(either / pixels < 0.25);

    CHECK(total(noise_of(width, height, [](int, int) { return Vec3f(0.7f); })) == 0);
    const Plane<float, 3> slope = noise_of(width, height, [](int x, int y) { return Vec3f(float(x) + 2 * float(y)); });
    for (int y = 2; y < height - 2; ++y)
        for (int x = 2; x < width - 2; ++x) CHECK(slope.load(x, y).x < 1e-6f);
    for (const auto& [across, down] : {std::pair(1, 0), std::pair(0, 1), std::pair(1, 1), std::pair(1, -1)}) {
        const Plane<float, 3> edge = noise_of(width, height, [a = across, d = down](int x, int y) {
            return Vec3f(a * (x - 30) + d * (y - 30) > 0);
        });
        for (int y = 2; y < height - 2; ++y)
            for (int x = 2; x < width - 2; ++x) CHECK(edge.load(x, y).x == 0);
    }
}

TEST_CASE("feature_noise: a lone pixel is noise of its neighbours alone; images of every size; the same bits for any number of threads") {
    const Plane<float, 3> spot = noise_of(20, 20, [](int x, int y) { return Vec3f(x == 9 && y == 9, 0, 0); });
    for (int y = 0; y < 20; ++y)
        for (int x = 0; x < 20; ++x)
            CHECK((spot.load(x, y).x > 0) == (std::max(std::abs(x - 9), std::abs(y - 9)) <= 1));
    for (const auto& [w, h] : {std::pair(1, 1), std::pair(1, 7), std::pair(7, 1), std::pair(2, 2)})
        CHECK(is_finite(total(noise_of(w, h, [](int x, int y) { return Vec3f(float(x * y)); }))));
    Random random(2);
    Plane<float, 3> plane(67, 45);
    for (float& v : plane.values()) v = random.uniform_float();
    SerialExecutor one;
    ThreadExecutor three(3);
    CHECK(feature_noise<float>(std::as_const(plane).view(), one).values() ==
          feature_noise<float>(std::as_const(plane).view(), three).values());
}

TEST_CASE("denoise_light: one sample through a wide lens, whose features are as noisy as its light") {
    constexpr int width = 96, height = 48;
    Random random(14);
    // Dark and bright stripes out of focus, whose share grows from left to right, under light without a shadow.
    const auto share = [](int x) { return 0.2 + 0.6 * x / width; };
    FilmPass<float> pass(width, height, FilmPlanes::statistics, 0, 1);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            FilmPass<float>::Pixel pixel(pass, x, y);
            PixelSample<float> s;
            s.hit = true;
            s.albedo = Vec3f(random.uniform() < share(x) ? 0.9f : 0.1f);
            s.normal = Vec3f(0, 0, 1);
            s.depth = 5;
            s.direct = s.radiance = s.albedo * float(-std::log(1 - random.uniform()));
            pixel.add(s);
        }
    const PixelData<float> frame = pass.finish().resolve();
    Plane<float, 3> out(width, height);
    SerialExecutor serial;
    denoise_light<float>(frame.view(), out.view(), {}, serial);
    double raw = 0, clean = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double truth = 0.1 + 0.8 * share(x);
            raw += std::pow(double(frame.radiance.load(x, y).x) - truth, 2);
            clean += std::pow(double(out.load(x, y).x) - truth, 2);
        }
    CAPTURE(clean / raw);
    CHECK(clean < 0.06 * raw);
}
