#include <cmath>
#include <denoise/bilateral_cases.hpp>
#include <doctest/doctest.h>

using namespace lambent;
using namespace lambent_test;

namespace {

enum class Along { row, column };

/// Two pixels, side by side or one above the other. What the first takes of the second's value is W / (1 + W)
/// with no spatial weight in it, so W can be read off.
template <class T>
struct Pair {
    Along direction = Along::row;
    double value = 1;        ///< of the second pixel; the first is 0
    double illumination = infinity, second_pass = 1;
    BilateralForm form = BilateralForm::separable_reuse;

    template <class... Features>
    double weight(const Features&... features) const {
        const bool row = direction == Along::row;
        Plane<T, 3> image(row ? 2 : 1, row ? 1 : 2), out(image.width(), image.height());
        image.view().store(image.width() - 1, image.height() - 1, Vec3<T>(T(value)));
        SerialExecutor serial;
        cross_bilateral<T>(image.view(), out.view(),
                           {.kernel = 3, .sigma_spatial = infinity, .sigma_illumination = illumination,
                            .second_pass_factor = second_pass, .form = form, .guide = SecondPassGuide::input},
                           serial, features...);
        const double taken = double(out.load(0, 0).x) / value, left = 1 - double(out.values().back()) / value;
        CHECK(taken == doctest::Approx(left).epsilon(1e-6)); // W(x, y) = W(y, x)
        return taken / (1 - taken);
    }
};

template <class T>
Plane<T, 3> two(const Vec3<T>& a, const Vec3<T>& b) {
    Plane<T, 3> plane(2, 1);
    plane.view().store(0, 0, a);
    plane.view().store(1, 0, b);
    return plane;
}
template <class T>
Plane<T, 1> two(T a, T b) {
    Plane<T, 1> plane(2, 1);
    plane.values() = {a, b};
    return plane;
}

double gauss(double x, double sigma) { return std::exp(-x * x / (2 * sigma * sigma)); }

} // namespace

TEST_CASE_TEMPLATE("F4: the illumination weight is a Gaussian of the distance in linear RGB", T, float, double) {
    for (const double sigma : {25.0, 50.0})
        for (const double grey : {0.5, 5.0, 20.0, 60.0}) {
            CAPTURE(sigma);
            CAPTURE(grey);
            const double distance = grey * std::sqrt(3.0);
            Pair<T> pair{.value = grey, .illumination = sigma, .second_pass = 1.0 / 3};
            CHECK(pair.weight() == doctest::Approx(gauss(distance, sigma)).epsilon(1e-6));
            pair.form = BilateralForm::naive_2d;
            CHECK(pair.weight() == doctest::Approx(gauss(distance, sigma)).epsilon(1e-6));
            pair = {.direction = Along::column, .value = grey, .illumination = sigma, .second_pass = 1.0 / 3};
            CHECK(pair.weight() == doctest::Approx(gauss(distance, sigma / 3)).epsilon(2e-6));
        }
}

TEST_CASE_TEMPLATE("F5: the position weight is a Gaussian of the distance in the world", T, float, double) {
    for (const double step : {0.0, 0.5, 2.0, 5.0}) {
        const auto plane = two(Vec3<T>(1, 2, 3), Vec3<T>(T(1 + 0.6 * step), 2, T(3 - 0.8 * step)));
        CHECK(Pair<T>{}.weight(DistanceFeature<T>(plane.view(), 2.0)) == doctest::Approx(gauss(step, 2)).epsilon(2e-6));
    }
}

TEST_CASE_TEMPLATE("F5: the distance off the other's plane, in footprints, does not know the scene's scale", T, float, double) {
    const Vec3<T> up(0, 1, 0);
    for (const double scale : {1.0, 100.0, 1e-3}) {
        CAPTURE(scale);
        const auto footprint = two(T(0.1 * scale), T(0.1 * scale));
        const auto along = two(Vec3<T>(0), Vec3<T>(T(7 * scale), 0, T(-3 * scale)));
        const auto off = two(Vec3<T>(0), Vec3<T>(T(7 * scale), T(0.3 * scale), 0));
        const auto normal = two(up, up);
        const auto weight = [&](const Plane<T, 3>& position) {
            return Pair<T>{}.weight(PlaneDistanceFeature<T>(position.view(), normal.view(), footprint.view(), 2.0));
        };
        CHECK(weight(along) == doctest::Approx(1).epsilon(1e-6));
        CHECK(weight(off) == doctest::Approx(gauss(3, 2)).epsilon(5e-6));
    }
}

TEST_CASE_TEMPLATE("F6: the normal weight of the original takes 1 - cosine, the other one the angle", T, float, double) {
    for (const double angle : {0.0, 0.1, 0.5, 1.2, 1.5707, 2.0, 3.1415}) {
        CAPTURE(angle);
        const auto plane = two(Vec3<T>(0, 0, 1), Vec3<T>(T(std::sin(angle)), 0, T(std::cos(angle))));
        CHECK(Pair<T>{}.weight(NormalFeature<T>(plane.view(), 0.5)) ==
              doctest::Approx(gauss(1 - std::cos(angle), 0.5)).epsilon(3e-6));
        CHECK(Pair<T>{}.weight(NormalAngleFeature<T>(plane.view(), 0.8)) ==
              doctest::Approx(gauss(angle, 0.8)).epsilon(1e-5));
    }
}

TEST_CASE_TEMPLATE("F7: another material weighs exp(-2) at sigma 0.5, and nothing behind a hard stop", T, float, double) {
    const auto plane = two(T(3), T(4)), same = two(T(4), T(4));
    CHECK(Pair<T>{}.weight(IdentityFeature<T>(plane.view(), 0.5)) == doctest::Approx(std::exp(-2.0)).epsilon(1e-6));
    CHECK(Pair<T>{}.weight(IdentityFeature<T>(plane.view(), hard_stop)) == 0);
    CHECK(Pair<T>{}.weight(IdentityFeature<T>(same.view(), hard_stop)) == doctest::Approx(1).epsilon(1e-6));
}

TEST_CASE_TEMPLATE("F7: no surface is like none, however much other materials count", T, float, double) {
    const auto weight = [](T a, T b) {
        const auto plane = two(a, b);
        return Pair<T>{}.weight(MaterialFeature<T>(plane.view(), 0.5));
    };
    CHECK(weight(3, 4) == doctest::Approx(std::exp(-2.0)).epsilon(1e-6));
    CHECK(weight(0, 4) == doctest::Approx(std::exp(-2.0)).epsilon(1e-6));
    CHECK(weight(4, 4) == doctest::Approx(1).epsilon(1e-6));
    CHECK(weight(-1, -1) == doctest::Approx(1).epsilon(1e-6));
    CHECK(weight(-1, 4) == 0);
    CHECK(weight(0, -1) == 0);
}

TEST_CASE_TEMPLATE("distance in units of the pixels' own deviations, by their geometric mean", T, float, double) {
    const auto plane = two(Vec3<T>(1), Vec3<T>(1, 1, 4));
    const auto deviation = two(T(0.5), T(8));
    CHECK(Pair<T>{}.weight(RelativeDistanceFeature<T>(plane.view(), deviation.view(), 1.5)) ==
          doctest::Approx(gauss(3 / std::sqrt(0.5 * 8), 1.5)).epsilon(2e-6));
    const auto none = two(T(0), T(-1));
    CHECK(Pair<T>{}.weight(RelativeDistanceFeature<T>(plane.view(), none.view(), 1.5, 2.0)) ==
          doctest::Approx(gauss(3.0 / 2, 1.5)).epsilon(2e-6));
}

TEST_CASE("features multiply; infinite sigmas, absent planes and constant planes are left out") {
    const auto position = two(Vec3d(0), Vec3d(1, 0, 0));
    const auto material = two(1.0, 2.0);
    const DistanceFeature<double> near(position.view(), 0.8);
    const IdentityFeature<double> other(material.view(), 1.1);
    CHECK(Pair<double>{.value = 2, .illumination = 3}.weight(near, other) ==
          doctest::Approx(gauss(1, 0.8) * gauss(1, 1.1) * gauss(2 * std::sqrt(3.0), 3)).epsilon(1e-12));
    const auto same = two(Vec3d(5, 6, 7), Vec3d(5, 6, 7));
    CHECK_FALSE(DistanceFeature<double>(position.view(), infinity).active());
    CHECK_FALSE(DistanceFeature<double>(same.view(), 1).active());
    CHECK_FALSE(DistanceFeature<double>({}, 1).active());
    CHECK_FALSE(NormalFeature<double>({}, 1).active());
    CHECK_FALSE(IdentityFeature<double>({}, hard_stop).active());
    CHECK_FALSE(PlaneDistanceFeature<double>({}, {}, {}, 1).active());
    CHECK_FALSE(PlaneDistanceFeature<double>(position.view(), {}, {}, 1).active());
}

TEST_CASE("F13: every sigma must be positive") {
    const auto plane = two(Vec3f(0), Vec3f(1));
    const auto index = two(0.0f, 1.0f);
    for (const double sigma : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
        CHECK_THROWS_AS(DistanceFeature<float>(plane.view(), sigma), Error);
        CHECK_THROWS_AS(DifferenceFeature<float>(index.view(), sigma), Error);
        CHECK_THROWS_AS(NormalFeature<float>(plane.view(), sigma), Error);
        CHECK_THROWS_AS(NormalAngleFeature<float>(plane.view(), sigma), Error);
        CHECK_THROWS_AS(IdentityFeature<float>(index.view(), sigma), Error);
        CHECK_THROWS_AS(Pair<float>{.illumination = sigma}.weight(), Error);
        CHECK_THROWS_AS((Pair<float>{.illumination = 1, .second_pass = sigma}.weight()), Error);
    }
}
