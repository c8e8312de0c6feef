#include "support/directions.hpp"
#include "support/random.hpp"
#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>
#include <lambent/material/ggx.hpp>
#include <lambent/material/ggx_albedo.hpp>
#include <support/statistics.hpp>

using namespace lambent;
using namespace lambent_test;

namespace {
constexpr double ggx_alphas[] = {1e-3, 0.03, 0.2, 0.5, 1.0}, ggx_cosines[] = {1.0, 0.9, 0.6, 0.3, 0.05};

template <class T>
Vec3<T> mirrored_by(const Vec3<T>& wo, const Vec3<T>& m) {
    return 2 * dot(wo, m) * m - wo;
}
} // namespace

TEST_CASE("GGX: visible facets and bounded reflections are drawn by their densities (chi-square)") {
    std::uint64_t seed = 1000;
    for (const double alpha : ggx_alphas)
        for (const double cosine : ggx_cosines) {
            const Ggx<double> facets{alpha};
            const Vec3d wo = direction(cosine), mirror(-wo.x, -wo.y, wo.z);
            const double stretched = facets.stretched(wo);
            CAPTURE(alpha);
            CAPTURE(cosine);
            CAPTURE(seed);
            Random random(seed++);
            const DensityTest visible = test_density(
                PeakBins({0, 0, 1}, alpha / 2), 30000,
                [&] {
                    return facets.sample_visible(wo, {random.uniform(), random.uniform()});
                },
                [&](const Vec3d& m) {
                    const double facing = dot(wo, m);
                    return facing > 0 && m.z > 0
                               ? facets.distribution(m) * facing * Ggx<double>::visible_factor(wo, stretched)
                               : 0.0;
                });
            CHECK(std::abs(visible.integral - 1) < 0.01); // midpoints at the edge of what is seen; sharper below
            CHECK(visible.p > 1e-5);
            const DensityTest bounded = test_density(
                PeakBins(mirror, alpha), 30000,
                [&] {
                    const Vec3d wi = mirrored_by(wo, facets.sample_bounded(wo, {random.uniform(), random.uniform()}));
                    return wi.z > 0 ? wi : Vec3d(0);
                },
                [&](const Vec3d& wi) {
                    return wi.z > 0 ? facets.distribution(wo + wi) * facets.bounded_factor(wo, stretched) : 0.0;
                });
            CHECK(bounded.integral < 1.005);
            CHECK(bounded.excess < 1);
            CHECK(bounded.p > 1e-5);
            if (cosine == 1) CHECK(bounded.integral > 0.99); // the bound is exact there
        }
}

TEST_CASE("GGX: facets cover the surface once; what masking leaves of them covers its view once") {
    for (const double alpha : {0.05, 0.2, 0.5, 1.0})
        for (const double cosine : {1.0, 0.5, 0.1}) {
            const Ggx<double> facets{alpha};
            const Vec3d wo = direction(cosine);
            double area = 0, seen = 0;
            constexpr int n = 1500, around = 200;
            for (int i = 0; i < n; ++i)
                for (int j = 0; j < around; ++j) { // even in the angle's square root
                    const double x = (i + 0.5) / n, theta = x * x * pi<double> / 2;
                    const double solid = std::sin(theta) * x * pi<double> / n * 2 * pi<double> / around;
                    const Vec3d m = direction(std::cos(theta), 2 * pi<double> * (j + 0.5) / around);
                    const double d = facets.distribution(m) * solid;
                    area += d * m.z;
                    // the weak furnace: G1 = 2 z / (z + stretched)
                    seen += d * std::max(0.0, dot(wo, m)) * Ggx<double>::visible_factor(wo, facets.stretched(wo));
                }
            CHECK(area == doctest::Approx(1).epsilon(1e-4));
            CHECK(seen == doctest::Approx(1).epsilon(1e-3));
        }
}

TEST_CASE("GGX: float keeps its digits from alpha 1e-6 to 1 and down to cosines of 1e-7") {
    Random random(77);
    double distribution = 0, factors = 0;
    for (int i = 0; i < 200000; ++i) {
        const float alpha = float(std::pow(10.0, random.uniform(-6, 0)));
        const Ggx<float> facets{alpha};
        const Ggx<double> exact{double(alpha)};
        const double cosine = i % 2 == 0 ? std::pow(10.0, random.uniform(-7, 0)) : random.uniform();
        const Vec3f wo(direction(cosine, random.uniform(0, 6)));
        const Vec3f h(Vec3d(random.uniform(-1, 1), random.uniform(-1, 1), 1) *
                      Vec3d(3.0 * double(alpha), 3.0 * double(alpha), random.uniform(1e-6, 2)));
        const auto compare = [](double& worst, float got, double expected) {
            REQUIRE(is_finite(got));
            worst = std::max(worst, std::abs(double(got) - expected) / expected);
        };
        compare(distribution, facets.distribution(h), exact.distribution(Vec3d(h)));
        compare(factors, facets.stretched(wo), exact.stretched(Vec3d(wo)));
        compare(factors, facets.bounded_factor(wo, facets.stretched(wo)),
                exact.bounded_factor(Vec3d(wo), exact.stretched(Vec3d(wo))));
        const Vec3f m = facets.sample_bounded(wo, {random.uniform_float(), random.uniform_float()});
        REQUIRE(std::abs(length(m) - 1) < 1e-6f);
        REQUIRE(m.z >= 0);
        REQUIRE(dot(m, wo) >= -1e-6f);
    }
    CHECK(distribution < 2e-6);
    CHECK(factors < 1e-6);
    // The textbook's cos²(alpha² - 1) + 1 is infinite here.
    CHECK(Ggx<float>{1e-5f}.distribution({0, 0, 2}) == doctest::Approx(1e10 / pi<double>));
}

TEST_CASE("GGX: samples in float lie where those in double do") {
    Random random(78);
    double worst = 0;
    for (int i = 0; i < 100000; ++i) {
        const float alpha = float(std::pow(10.0, random.uniform(-6, 0)));
        const Vec3f wo(
            direction(i % 2 == 0 ? std::pow(10.0, random.uniform(-7, 0)) : 1 - std::pow(10.0, random.uniform(-7, 0)),
                      random.uniform(0, 6)));
        const Vec2f u(random.uniform_float(), random.uniform_float());
        const Vec3f m = Ggx<float>{alpha}.sample_bounded(wo, u);
        const Vec3d e = Ggx<double>{double(alpha)}.sample_bounded(Vec3d(wo), Vec2d(u));
        // in units of the lobe's width at that place: slopes against alpha
        const Vec3d slope = Vec3d(m) / double(m.z) - e / e.z;
        worst = std::max(worst, length(slope) / (double(alpha) + length(e / e.z - Vec3d(0, 0, 1))));
    }
    CHECK(worst < 1e-5);
}

TEST_CASE("GGX: the table of directional albedos, against field/render.md's at normal incidence and against sums") {
    const std::pair<double, double> known[] = {{0.1, 0.9882}, {0.25, 0.9155}, {0.5, 0.6878}, {1, 0.3072}};
    for (const auto& [alpha, albedo] : known) {
        const Vec2f got = ggx_albedo(1, float(std::sqrt(alpha)));
        CHECK(std::abs(double(got.x + got.y) - albedo) < 0.002);
    }
    for (const double alpha : {0.1, 0.3, 0.7, 1.0})
        for (const double cosine : {0.9, 0.4, 0.1, 0.02}) {
            const Ggx<double> facets{alpha};
            const Vec3d wo = direction(cosine, 0);
            Vec2d sum(0);
            constexpr int n = 600;
            for (int i = 0; i < n; ++i)
                for (int j = 0; j < n; ++j) { // hemisphere, denser at the horizon
                    const double x = (i + 0.5) / n, z = x * x;
                    const Vec3d wi = direction(z, pi<double> * (j + 0.5) / n), h = wo + wi;
                    const double f = facets.distribution(h) *
                                     Ggx<double>::visibility(cosine, facets.stretched(wo), z, facets.stretched(wi));
                    const double grazing = std::pow(1 - length(h) / 2, 5);
                    sum += Vec2d(1 - grazing, grazing) * (f * z * 2 * x * 2 * pi<double> / (n * n));
                }
            const Vec2f got = ggx_albedo(float(cosine), float(std::sqrt(alpha)));
            CAPTURE(alpha);
            CAPTURE(cosine);
            CHECK(std::abs(double(got.x) - sum.x) < 0.005);
            CHECK(std::abs(double(got.y) - sum.y) < 0.005);
        }
}
