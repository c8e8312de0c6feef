#include <cmath>
#include <doctest/doctest.h>
#include <lambent/film/metrics.hpp>
#include <limits>

using namespace lambent;

namespace {

/// A 2 × 2 image of four greys.
Plane<float, 3> greys(float a, float b, float c, float d) {
    Plane<float, 3> plane(2, 2);
    plane.values() = {a, a, a, b, b, b, c, c, c, d, d, d};
    return plane;
}

} // namespace

TEST_CASE("errors of a constant offset: closed forms") {
    Plane<double, 3> reference(31, 17, 2.0), image(31, 17, 2.5);
    CHECK(mse(image.view(), reference.view()) == doctest::Approx(0.25).epsilon(1e-14));
    CHECK(rmse(image.view(), reference.view()) == doctest::Approx(0.5).epsilon(1e-14));
    CHECK(rel_mse(image.view(), reference.view()) == doctest::Approx(0.25 / (4 + 0.04)).epsilon(1e-14));
    CHECK(rel_mse(reference.view(), reference.view()) == 0);
}

TEST_CASE("relative error: each channel of each pixel over its own reference, squared, and 1 % of their mean") {
    Plane<float, 3> reference(1, 2), image(1, 2);
    reference.values() = {1, 2, 3, 0, 4, 10};
    image.values() = {1.5f, 2, 2, 1, 4, 12};
    const double floor = 0.01 * (1 + 4 + 9 + 0 + 16 + 100) / 6;
    const double expected = (0.25 / (1 + floor) + 1 / (9 + floor) + 1 / floor + 4 / (100 + floor)) / 6;
    CHECK(rel_mse(image.view(), reference.view()) == doctest::Approx(expected).epsilon(1e-12));
}

TEST_CASE("relative error does not know the exposure") {
    const auto image = greys(1, 2, 3, 4), reference = greys(1.5f, 2, 2.5f, 5);
    const auto bright = greys(1024, 2048, 3072, 4096), bright_reference = greys(1536, 2048, 2560, 5120);
    CHECK(rel_mse(bright.view(), bright_reference.view()) ==
          doctest::Approx(rel_mse(image.view(), reference.view())).epsilon(1e-14));
}

TEST_CASE("masked pixels count in no mean") {
    const auto image = greys(2, 1e6f, 3, 1), reference = greys(1, 1e9f, 2, 1);
    Plane<float, 3> emission(2, 2);
    emission.view().store(1, 0, {0, 0, 1e-6f});
    const auto mask = emitter_mask(emission.view());
    CHECK(mask.values() == std::vector<std::uint8_t>{0, 1, 0, 0});
    const double floor = 0.01 * (1 + 4 + 1) / 3;
    CHECK(mse(image.view(), reference.view(), mask.view()) == doctest::Approx(2.0 / 3));
    CHECK(rel_mse(image.view(), reference.view(), mask.view()) ==
          doctest::Approx((1 / (1 + floor) + 1 / (4 + floor)) / 3).epsilon(1e-12));
    Plane<std::uint8_t, 1> all(2, 2, 1);
    CHECK(rel_mse(image.view(), reference.view(), all.view()) == 0);
}

TEST_CASE("errors of what is black or not finite") {
    const auto black = greys(0, 0, 0, 0), dim = greys(0, 0, 1e-3f, 0);
    CHECK(rel_mse(black.view(), black.view()) == 0);
    CHECK_FALSE(is_finite(rel_mse(dim.view(), black.view())));
    const auto broken = greys(0, std::numeric_limits<float>::quiet_NaN(), 0, 0), reference = greys(1, 1, 1, 1);
    CHECK_FALSE(is_finite(rel_mse(broken.view(), reference.view())));
    CHECK_FALSE(is_finite(mse(broken.view(), reference.view())));
}

TEST_CASE("errors of images of unlike sizes are refused") {
    const Plane<float, 3> a(3, 2), b(2, 3);
    const Plane<std::uint8_t, 1> mask(2, 3);
    CHECK_THROWS_AS(mse(a.view(), b.view()), Error);
    CHECK_THROWS_AS(rel_mse(a.view(), a.view(), mask.view()), Error);
}
