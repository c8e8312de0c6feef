#include "support/directions.hpp"
#include "support/random.hpp"
#include <cmath>
#include <doctest/doctest.h>
#include <lambent/material/delta.hpp>
#include <lambent/material/standard.hpp>
#include <support/statistics.hpp>

using namespace lambent;
using namespace lambent_test;

TEST_CASE("Fresnel: normal incidence, Brewster's angle, total reflection, the same from both sides") {
    for (const double ior : {1.1, 1.33, 1.5, 2.4}) {
        double other = 0;
        CHECK(dielectric_reflectance(1.0, ior, other) == doctest::Approx(dielectric_f0(ior)));
        CHECK(dielectric_f0(ior) == doctest::Approx(std::pow((ior - 1) / (ior + 1), 2)));
        // At Brewster's angle only the perpendicular half is reflected: ((n² - 1) / (n² + 1))².
        const double brewster = 1 / std::sqrt(1 + ior * ior), s = (ior * ior - 1) / (ior * ior + 1);
        CHECK(dielectric_reflectance(brewster, ior, other) == doctest::Approx(s * s / 2));
        for (const double cosine : {0.9, 0.5, 0.2, 0.01, 1e-5}) {
            const double from_outside = dielectric_reflectance(cosine, ior, other);
            double back = 0;
            CHECK(dielectric_reflectance(other, 1 / ior, back) == doctest::Approx(from_outside));
            CHECK(back == doctest::Approx(cosine).epsilon(1e-4));
            CHECK(ior * std::sqrt(1 - other * other) == doctest::Approx(std::sqrt(1 - cosine * cosine))); // Snell
        }
        const double critical = std::sqrt(1 - 1 / (ior * ior));
        CHECK(dielectric_reflectance(critical * 0.999, 1 / ior, other) == 1);
        CHECK(other == 0);
        CHECK(dielectric_reflectance(critical * 1.001, 1 / ior, other) < 1);
        CHECK(dielectric_reflectance(0.0, ior, other) == doctest::Approx(1));
    }
    CHECK(schlick(Vec3d(0.04), 1.0, 1.0).x == 0.04);
    CHECK(schlick(Vec3d(0.04), 1.0, 0.0).x == 1);
    CHECK(schlick(Vec3d(0.04), 1.0, 0.5).x == doctest::Approx(0.04 + 0.96 / 32));
}

TEST_CASE_TEMPLATE("exact mirror and dielectric: Snell, chances that sum to 1, energy that always weighs 1", T, float,
                   double) {
    Random random(11);
    for (int i = 0; i < 20000; ++i) {
        const double cosine = i % 4 == 0 ? std::pow(10.0, random.uniform(-7, 0)) : random.uniform();
        const Vec3<T> wo(direction(cosine, random.uniform(0, 6)));
        const Vec2<T> u(T(random.uniform_float()), T(random.uniform_float()));
        const Mirror<T> mirror{Vec3<T>(T(0.9), T(0.5), T(0.1))};
        const BsdfSample<T> m = mirror.sample(wo, T(0.3), u);
        REQUIRE(m.wi == Vec3<T>(-wo.x, -wo.y, wo.z));
        REQUIRE(m.weight == mirror.reflectance);
        REQUIRE((m.delta && m.pdf == 1));
        REQUIRE(mirror.eval(wo, m.wi) == Vec3<T>(0));

        const T eta = T(i % 2 == 0 ? random.uniform(1, 3) : 1 / random.uniform(1, 3));
        const Dielectric<T> glass{eta};
        const BsdfSample<T> low = glass.sample(wo, T(0), u), high = glass.sample(wo, T(1) - T(1e-7), u);
        for (const auto& s : {low, high}) {
            REQUIRE(s.delta);
            REQUIRE(glass.pdf(wo, s.wi) == 0);
            REQUIRE(std::abs(double(length(s.wi)) - 1) < 1e-5);
            REQUIRE(double(s.weight.x * s.eta_scale) == doctest::Approx(1));
        }
        if (low.wi.z > 0 && high.wi.z < 0) {
            REQUIRE(double(low.pdf) + double(high.pdf) == doctest::Approx(1));
            REQUIRE(std::abs(double(high.wi.x * eta + wo.x)) < 1e-5);
            REQUIRE(double(high.weight.x) == doctest::Approx(1 / (double(eta) * double(eta))));
        } else {
            REQUIRE(low.wi == high.wi); // total reflection, or none within the last digit
        }
        REQUIRE(glass.sample(-wo, T(0.5), u).pdf == 0);
    }
}

TEST_CASE("the standard material's smooth glass is the exact dielectric") {
    for (const bool front : {true, false})
        for (const double cosine : {1.0, 0.7, 0.3, 0.01})
            for (const double pick : {0.0, 0.01, 0.1, 0.5, 0.99}) {
                StandardPoint<double> p;
                p.specular = p.transmission = 1;
                p.roughness = 0;
                p.thin = false;
                p.front = front;
                const BsdfSample<double> a = StandardBsdf<double>(p).sample(direction(cosine), pick, {0.1, 0.2}),
                                         b = Dielectric<double>{front ? 1.5 : 1 / 1.5}.sample(direction(cosine), pick,
                                                                                              {0.1, 0.2});
                CHECK(length(a.wi - b.wi) < 1e-12);
                CHECK(length(a.weight - b.weight) < 1e-12);
                CHECK(a.pdf == doctest::Approx(b.pdf));
                CHECK(a.eta_scale == doctest::Approx(b.eta_scale));
                CHECK((a.delta && b.delta));
            }
}

TEST_CASE_TEMPLATE("white furnace: a path through a clear ball, smooth or nearly, comes out with all its energy", T,
                   float, double) {
    // In a uniform world the ball is invisible: radiance along a path is the product of its weights, which by the end,
    // outside again, has undone its scaling.
    Random random(12);
    for (const T roughness : {T(0), T(0.05)}) {
        Moments radiance;
        for (int i = 0; i < 20000; ++i) {
            StandardPoint<T> p;
            p.specular = p.transmission = 1;
            p.roughness = roughness;
            p.thin = false;
            Vec3<T> wo(direction(random.uniform(0.2, 1)));
            T weight = 1;
            for (int bounce = 0; bounce < 200; ++bounce) {
                const auto s = StandardBsdf<T>(p).sample(wo, T(random.uniform_float()),
                                                         {T(random.uniform_float()), T(random.uniform_float())});
                weight *= s.pdf > 0 ? s.weight.x : T(0);
                if (weight == 0) break;
                if (p.front && s.wi.z > 0) break;  // reflected outside
                if (!p.front && s.wi.z < 0) break; // left the ball
                p.front = false;
                // A chord of a sphere meets both ends at the same angle: the way on from wi arrives as its mirror
                // image.
                wo = Vec3<T>(s.wi.x, s.wi.y, glm::abs(s.wi.z));
            }
            radiance.add(double(weight));
        }
        CAPTURE(roughness);
        CHECK(std::abs(radiance.mean() - 1) < (roughness > 0 ? 3e-3 : 1e-5));
    }
}
