#include "support/random.hpp"
#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/light_part.hpp>
#include <limits>
#include <utility>
#include <vector>

using namespace lambent;
using lambent_test::Random;

namespace {

/// As its description says, in double, neighbour by neighbour.
double expected_factor(const Plane<float, 3>& light, int x, int y, double deviations, double belief) {
    std::vector<double> around;
    const auto bright = [&](int u, int v) {
        const Vec3d value(light.load(u, v));
        return value.x + value.y + value.z;
    };
    for (int v = y - 2; v <= y + 2; ++v)
        for (int u = x - 2; u <= x + 2; ++u)
            if ((u != x || v != y) && u >= 0 && v >= 0 && u < light.width() && v < light.height())
                around.push_back(bright(u, v));
    if (around.empty()) return 1;
    double mean = 0, square = 0;
    for (const double b : around) mean += b / double(around.size());
    for (const double b : around) square += (b - mean) * (b - mean) / double(around.size());
    const double here = bright(x, y), limit = mean + deviations * std::sqrt(square);
    if (here <= limit) return 1;
    return (limit + (here - limit) * belief) / here;
}

} // namespace

TEST_CASE("outlier_factors: as its description says, in double, at borders and in tiny images too") {
    ThreadExecutor threads(2);
    for (const auto& [width, height] : {std::pair(40, 23), std::pair(1, 1), std::pair(1, 7), std::pair(3, 2)})
        for (const double deviations : {1.0, 2.0}) {
            const std::uint64_t seed = std::uint64_t(width);
            CAPTURE(seed);
            Random random(seed);
            Plane<float, 3> light(width, height);
            Plane<float, 1> belief(width, height);
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    const double value = std::exp(4 * random.uniform()) * (random.uniform() < 0.1 ? 1e6 : 1);
                    light.view().store(x, y, Vec3f(float(value), float(0.3 * value), 0.1f));
                    belief.view().store(x, y, float(std::max(0.0, random.uniform(-1, 1))));
                }
            int clamped = 0;
            const Plane<float, 1> factors = detail::outlier_factors<float>(
                std::as_const(light).view(), deviations, [&](int x, int y) { return double(belief.load(x, y)); }, threads);
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    const double truth = expected_factor(light, x, y, deviations, double(belief.load(x, y)));
                    CHECK(double(factors.load(x, y)) == doctest::Approx(truth).epsilon(1e-5));
                    clamped += factors.load(x, y) < 1;
                }
            if (width == 40) CHECK(clamped > 30);
        }
}

TEST_CASE("ClampedPart: one sample's light is cut, that of many is not; samples that are spread evenly vouch for more") {
    constexpr int side = 31, samples = 64;
    SerialExecutor serial;
    // A pixel whose direct light came in `bright` of 64 samples, among dim ones whose halves say `spread` of their variance;
    // its indirect light does not vary.
    const auto factor = [&](int bright, float spread, float indirect = 0.01f) {
        Random random(3);
        PixelData<float> frame;
        for (auto* plane : {&frame.radiance, &frame.direct, &frame.indirect, &frame.variance, &frame.root_direct,
                            &frame.root_direct_variance, &frame.root_indirect, &frame.root_indirect_variance})
            plane->allocate(side, side, 0.01f);
        frame.root_direct_halves.allocate(side, side, 0.03f * spread); // of three channels
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < side; ++x) frame.direct.view().store(x, y, Vec3f(float(random.uniform())));
        // of equal bright samples
        const double mean = 30, variance = mean * mean / bright * (1 - bright / double(samples));
        frame.direct.view().store(15, 15, Vec3f(float(mean)));
        frame.variance.view().store(15, 15, Vec3f(float(variance)));
        frame.indirect.view().store(15, 15, Vec3f(indirect));
        const FrameView<float> view = frame.view();
        const detail::LightPart<float> part(view, true);
        const detail::ClampedPart<float> clamped(view, part, detail::repaired(part.light), samples, serial);
        CHECK(clamped.light.load(15, 15).x == doctest::Approx(mean * double(clamped.factors.load(15, 15))).epsilon(1e-5));
        return double(clamped.factors.load(15, 15));
    };
    CHECK(factor(1, 1) < 0.06); // 1.1 of 30
    CHECK(factor(4, 1) < 0.15);
    CHECK(factor(9, 1) > 0.4);
    CHECK(factor(9, 1) < 0.8);
    CHECK(factor(16, 1) > 0.99);
    CHECK(factor(4, 0.25f) > 0.99); // half the deviation: as 16 would
    CHECK(factor(1, 0.25f) < 0.15);
    // The deviation is 30: all of the light is 3, 6 and 11 times as much.
    CHECK(factor(1, 1, 60) < 0.06);
    CHECK(factor(1, 1, 150) > 0.4);
    CHECK(factor(1, 1, 150) < 0.6);
    CHECK(factor(1, 1, 300) > 0.99);
}
