#include "support/random.hpp"
#include <cmath>
#include <cstring>
#include <doctest/doctest.h>
#include <lambent/denoise/despike.hpp>
#include <lambent/film/pixel_data.hpp>
#include <limits>
#include <support/statistics.hpp>

using namespace lambent;
using lambent_test::infinity;
using lambent_test::Random;

namespace {

constexpr float nan_value = std::numeric_limits<float>::quiet_NaN();

Plane<float, 3> noise(int width, int height, std::uint64_t seed) {
    Random random(seed);
    Plane<float, 3> plane(width, height);
    for (float& v : plane.values()) v = float(-std::log(1 - random.uniform()));
    return plane;
}

Plane<float, 3> despiked(const Plane<float, 3>& image, double deviations, std::size_t* count = nullptr) {
    Plane<float, 3> out(image.width(), image.height());
    SerialExecutor serial;
    const std::size_t n = despike<float>(image.view(), out.view(), deviations, serial);
    if (count != nullptr) *count = n;
    return out;
}

} // namespace

TEST_CASE("F14: the original's rule divides by the threshold where r² + g² + b² exceeds 3 thresholds squared") {
    Plane<float, 3> image(4, 1);
    image.values() = {24.9f, 24.9f, 24.9f, 26, 26, 26, 0, 43.4f, 0, 0, 0, 43};
    CHECK(suppress_fireflies_seed(image.view(), 25) == 2);
    CHECK(image.values() == std::vector<float>{24.9f, 24.9f, 24.9f, 26 / 25.0f, 26 / 25.0f, 26 / 25.0f, 0, 43.4f / 25, 0, 0, 0, 43});
    CHECK_THROWS_AS(suppress_fireflies_seed(image.view(), 0), Error);
    CHECK_THROWS_AS(suppress_fireflies_seed(image.view(), -25), Error);
}

TEST_CASE("F14: both rules change no bit when off") {
    Plane<float, 3> image = noise(20, 10, 3);
    image.values()[7] = nan_value;
    image.values()[9] = 1e30f;
    image.values()[11] = -0.0f;
    Plane<float, 3> rule = image;
    std::size_t count = 1;
    CHECK(suppress_fireflies_seed(rule.view(), infinity) == 0);
    const Plane<float, 3> clamp = despiked(image, infinity, &count);
    CHECK(count == 0);
    const auto same = [&](const Plane<float, 3>& a) {
        return std::memcmp(a.values().data(), image.values().data(), a.values().size() * sizeof(float)) == 0;
    };
    CHECK(same(rule));
    CHECK(same(clamp));
}

TEST_CASE("F14: the clamp is monotone, keeps the hue and ends at its neighbours' mean + deviations") {
    Plane<float, 3> image = noise(9, 9, 5);
    double mean = 0, squares = 0;
    for (int y = 2; y <= 6; ++y)
        for (int x = 2; x <= 6; ++x)
            if (x != 4 || y != 4) {
                const Vec3d v(image.load(x, y));
                mean += (v.x + v.y + v.z) / 24;
                squares += (v.x + v.y + v.z) * (v.x + v.y + v.z) / 24;
            }
    const double limit = mean + 3 * std::sqrt(squares - mean * mean);
    double last = 0;
    for (double brightness = 0; brightness < 100; brightness += 0.37) {
        image.view().store(4, 4, Vec3f(float(0.5 * brightness), float(0.3 * brightness), float(0.2 * brightness)));
        const Vec3d v(despiked(image, 3).load(4, 4));
        CHECK(v.x + v.y + v.z == doctest::Approx(std::min(brightness, limit)).epsilon(1e-5));
        CHECK(v.x + v.y + v.z >= last - 1e-5);
        last = v.x + v.y + v.z;
        CHECK(v.y == doctest::Approx(0.6 * v.x).epsilon(1e-5));
    }
}

TEST_CASE("F14: the clamp takes a firefly's energy and leaves that of ordinary noise and of gradients") {
    const auto energy = [](const Plane<float, 3>& image) {
        double sum = 0;
        for (const float v : image.values()) sum += double(v);
        return sum;
    };
    Plane<float, 3> image = noise(64, 64, 8); // the sum of three exponentials a pixel
    CHECK(energy(despiked(image, 4)) > 0.99 * energy(image));
    const double before = energy(image);
    image.view().store(20, 30, Vec3f(4235));
    std::size_t count = 0;
    CHECK(energy(despiked(image, 4, &count)) < 1.01 * before);
    CHECK(count >= 1);
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x) image.view().store(x, y, Vec3f(1 / (0.1f + float((x - 30) * (x - 30) + y * y) / 900.0f)));
    CHECK(energy(despiked(image, 4)) > 0.9999 * energy(image));
}

TEST_CASE("what is not finite neither counts nor spreads in the clamp") {
    Plane<float, 3> image = noise(16, 16, 9), broken = image;
    broken.view().store(8, 8, Vec3f(1, nan_value, float(infinity)));
    const Plane<float, 3> result = despiked(broken, 3), expected = despiked(image, 3);
    for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 16; ++x) {
            if (x == 8 && y == 8) continue;
            CHECK(is_finite(result.load(x, y)));
            if (std::abs(x - 8) > 2 || std::abs(y - 8) > 2) CHECK(result.load(x, y) == expected.load(x, y));
        }
    SerialExecutor serial;
    for (const double bad : {0.0, -1.0})
        CHECK_THROWS_AS(despike<float>(image.view(), broken.view(), bad, serial), Error);
    CHECK_THROWS_AS(despike<float>(image.view(), Plane<float, 3>(16, 15).view(), 3, serial), Error);
}

TEST_CASE("light that sums cannot hold is repaired as what is not finite is; 10^30 is not") {
    constexpr float largest = std::numeric_limits<float>::max();
    Plane<float, 3> image(4, 3, 1.0f);
    image.view().store(0, 0, Vec3f(1, -largest, -largest)); // what the fuzzer found
    image.view().store(3, 2, Vec3f(largest, 1, 1));
    image.view().store(3, 0, Vec3f(1e30f));
    CHECK(repair_non_finite(image.view()) == 2);
    CHECK(image.load(0, 0) == Vec3f(1));
    CHECK(image.load(3, 2) == Vec3f(1));
    CHECK(image.load(3, 0) == Vec3f(1e30f));
}

TEST_CASE("repair takes the mean of the nearest finite neighbours, and 0 where none is in reach") {
    Plane<float, 3> image(5, 5);
    for (int i = 0; i < 25; ++i) image.view().store(i % 5, i / 5, Vec3f(float(i)));
    image.view().store(2, 2, Vec3f(nan_value));
    image.view().store(2, 1, Vec3f(float(infinity)));
    CHECK(repair_non_finite(image.view()) == 2);
    CHECK(image.load(2, 2).x == doctest::Approx((6 + 8 + 11 + 13 + 16 + 17 + 18) / 7.0));
    CHECK(image.load(2, 1).x == doctest::Approx((1 + 2 + 3 + 6 + 8 + 11 + 13) / 7.0));
    Plane<float, 3> hopeless(5, 5, nan_value);
    CHECK(repair_non_finite(hopeless.view()) == 25);
    CHECK(hopeless.values() == std::vector<float>(75, 0.0f));
}
