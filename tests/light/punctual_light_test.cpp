#include <lambent/light/punctual_light.hpp>
#include <support/statistics.hpp>
#include <doctest/doctest.h>
#include <cmath>

using namespace lambent;
using namespace lambent_test;

TEST_CASE("point light: intensity over squared distance, from wherever the scene's origin is") {
    PunctualLight light;
    light.position = {1e6 + 1, 2, 3};
    light.intensity = {4, 8, 12};
    const LightSample<float> s = light.sample<float>({1, 2, 1}, {1e6, 0, 0});
    CHECK(s.pdf == 1);
    CHECK(s.delta);
    CHECK_FALSE(s.infinite);
    CHECK(s.target == Vec3f(1, 2, 3));
    CHECK(s.wi == Vec3f(0, 0, 1));
    CHECK(s.radiance == Vec3f(1, 2, 3));
    CHECK(light.sample<float>({1, 2, 3}, {1e6, 0, 0}).pdf == 0); // at the light itself
}

TEST_CASE("directional light: its irradiance, everywhere the same, against the way it travels") {
    PunctualLight light;
    light.kind = PunctualLight::Kind::directional;
    light.direction = {0, -1, 0};
    light.intensity = {1, 2, 3};
    const LightSample<double> s = light.sample<double>({5, 6, 7}, Vec3d(0));
    CHECK(s.wi == Vec3d(0, 1, 0));
    CHECK(s.radiance == Vec3d(1, 2, 3));
    CHECK(s.infinite);
    CHECK(s.delta);
    CHECK(light.power(2) == doctest::Approx(luminance(Vec3d(1, 2, 3)) * pi<double> * 4));
}

TEST_CASE("spot light: glTF's fall-off between the cones") {
    PunctualLight light;
    light.kind = PunctualLight::Kind::spot;
    light.direction = {0, -1, 0};
    const double inner = 0.3, outer = 0.6;
    light.inner_cone_cos = float(std::cos(inner));
    light.outer_cone_cos = float(std::cos(outer));
    light.intensity = Vec3f(5);
    const auto at = [&](double angle) { // two metres from the light
        return light.sample<double>({2 * std::sin(angle), -2 * std::cos(angle), 0}, Vec3d(0));
    };
    // The specification's own formula: ((cos − cos outer) / (cos inner − cos outer))², clamped.
    for (const double angle : {0.0, 0.2, 0.31, 0.45, 0.59}) {
        const double share = (std::cos(angle) - std::cos(outer)) / (std::cos(inner) - std::cos(outer));
        const double expected = 5.0 / 4 * std::pow(std::min(1.0, share), 2);
        CHECK(at(angle).radiance.x == doctest::Approx(expected).epsilon(1e-5));
    }
    CHECK(at(0.61).pdf == 0);
    CHECK(at(2.5).pdf == 0);
    light.inner_cone_cos = light.outer_cone_cos; // a hard edge, not a division by zero
    CHECK(at(0.59).radiance.x == doctest::Approx(5.0 / 4));
    CHECK(at(0.61).pdf == 0);
}

TEST_CASE("power: the intensity over all directions") {
    PunctualLight light;
    light.intensity = {1, 2, 3};
    const double i = luminance(Vec3d(1, 2, 3));
    CHECK(light.power(1) == doctest::Approx(4 * pi<double> * i));
    light.kind = PunctualLight::Kind::spot;
    light.inner_cone_cos = 0.9f;
    light.outer_cone_cos = 0.9f;
    CHECK(light.power(1) == doctest::Approx(2 * pi<double> * (1 - 0.9) * i).epsilon(1e-5));
}
