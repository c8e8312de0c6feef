#include "support/random.hpp"
#include <lambent/core/frame.hpp>
#include <lambent/material/lambert.hpp>
#include <support/statistics.hpp>
#include <doctest/doctest.h>
#include <algorithm>
#include <cmath>
#include <vector>

using namespace lambent;
using namespace lambent_test;

TEST_CASE_TEMPLATE("S1: Lambert bounces follow the cosine (chi-square), mean cosine 2/3, around every axis", T, float, double) {
    constexpr std::uint64_t seed = 41;
    INFO("seed " << seed);
    Random random(seed);
    const Lambert<T> bsdf{Vec3<T>(T(0.7), T(0.5), T(0.2))};
    const Vec3d axes[] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}, normalize(Vec3d(1, 2, -3))};
    for (const Vec3d& axis : axes) {
        const Frame<T> frame{Vec3<T>(axis)};
        constexpr int n = 200000, rings = 16, sectors = 24;
        std::vector<double> observed(rings * sectors);
        Moments cosine;
        double worst = 0;
        const Vec3d across = normalize(std::abs(axis.x) < 0.9 ? cross(axis, Vec3d(1, 0, 0)) : cross(axis, Vec3d(0, 1, 0)));
        const Vec3d along = cross(axis, across);
        for (int i = 0; i < n; ++i) {
            const BsdfSample<T> s = bsdf.sample({0, 0, 1}, T(0), {T(random.uniform_float()), T(random.uniform_float())});
            REQUIRE(s.pdf > 0);
            const Vec3d w(frame.to_world(s.wi));
            const double c = dot(w, axis);
            cosine.add(c);
            worst = std::max(worst, std::abs(double(s.pdf) - double(s.wi.z) / pi<double>));
            const Vec3d weight = Vec3d(bsdf.eval({0, 0, 1}, s.wi)) * double(s.wi.z) / double(s.pdf);
            worst = std::max(worst, length(weight - Vec3d(s.weight)));
            // Equal chances: rings of equal cos², sectors of equal angle.
            const int ring = std::clamp(int(c * c * rings), 0, rings - 1);
            const double angle = std::atan2(dot(w, along), dot(w, across)) / (2 * pi<double>) + 0.5;
            ++observed[std::size_t(ring * sectors + std::clamp(int(angle * sectors), 0, sectors - 1))];
        }
        CAPTURE(axis.x);
        CAPTURE(axis.y);
        CAPTURE(axis.z);
        CHECK(chi_square_uniform(observed) > min_p);
        CHECK(std::abs(cosine.z(2.0 / 3)) < max_z);
        CHECK(worst < 1e-6);
    }
}

TEST_CASE("Lambert: reciprocal, nothing below, pdf integrates to 1 and reflects its albedo") {
    const Vec3d albedo(0.8, 0.3, 1);
    const Lambert<double> bsdf{albedo};
    Random random(42);
    const auto up = [&] {
        const double z = random.uniform(), phi = random.uniform(0, 2 * pi<double>), r = std::sqrt(1 - z * z);
        return Vec3d(r * std::cos(phi), r * std::sin(phi), z);
    };
    double pdf = 0;
    Vec3d reflected(0);
    constexpr int side = 1000;
    for (int i = 0; i < side; ++i) { // uniform hemisphere by height: midpoints
        const double z = (i + 0.5) / side;
        const Vec3d wi(std::sqrt(1 - z * z), 0, z);
        pdf += bsdf.pdf({0, 0, 1}, wi) * 2 * pi<double> / side;
        reflected += bsdf.eval({0, 0, 1}, wi) * (z * 2 * pi<double> / side);
    }
    CHECK(pdf == doctest::Approx(1));
    for (int c = 0; c < 3; ++c) CHECK(reflected[c] == doctest::Approx(albedo[c]));
    for (int i = 0; i < 1000; ++i) {
        const Vec3d a = up(), b = up();
        REQUIRE(bsdf.eval(a, b) == bsdf.eval(b, a));
        REQUIRE(bsdf.eval(a, -b) == Vec3d(0));
        REQUIRE(bsdf.pdf(a, -b) == 0);
    }
}
