#include "support/random.hpp"
#include <lambent/core/ray.hpp>
#include <lambent/light/sphere_light.hpp>
#include <lambent/light/triangle_light.hpp>
#include <lambent/scene/sphere.hpp>
#include <support/statistics.hpp>
#include <doctest/doctest.h>
#include <algorithm>
#include <array>
#include <cmath>

using namespace lambent;
using namespace lambent_test;

namespace {

using Triangle = std::array<Vec3d, 3>;

/// Irradiance at the origin on a surface of normal n from a triangle of radiance 1 that is all above the horizon.
/// source  Lambert (1760): half the sum over the edges of the angle they fill times the cosine of their plane
double lambert_irradiance(const Triangle& t, const Vec3d& n) {
    double sum = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        const Vec3d a = normalize(t[i]), b = normalize(t[(i + 1) % 3]);
        sum += std::acos(std::clamp(dot(a, b), -1.0, 1.0)) * dot(n, normalize(cross(a, b)));
    }
    return std::abs(sum) / 2;
}

/// source  van Oosterom, Strackee, IEEE Trans. Biomed. Eng. 30:2 (1983)
double solid_angle(const Triangle& t) {
    const Vec3d a = normalize(t[0]), b = normalize(t[1]), c = normalize(t[2]);
    return 2 * std::atan2(std::abs(dot(a, cross(b, c))), 1 + dot(a, b) + dot(b, c) + dot(c, a));
}

/// Calls f(u) with one random point in each cell of a grid: far less noise than points at random.
template <class F>
void over_grid(int side, std::uint64_t seed, F&& f) {
    Random random(seed);
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x)
            f(Vec2d((x + random.uniform()) / side, (y + random.uniform()) / side));
}

} // namespace

TEST_CASE("triangle light: irradiance is Lambert's formula, 1/pdf means the solid angle, points lie where they say") {
    constexpr std::uint64_t seed = 21;
    INFO("seed " << seed);
    Random random(seed);
    for (int round = 0; round < 40; ++round) {
        // Above the plane y = 0 through `from`, near and far, fat and thin.
        const Vec3d from(random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3));
        const double size = std::pow(10, random.uniform(-2, 0.5)), height = size + random.uniform(0.5, 3);
        Triangle above;
        for (Vec3d& p : above)
            p = Vec3d(random.uniform(-1, 1), 0, random.uniform(-1, 1)) * 2.0 +
                Vec3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)) * size + Vec3d(0, height, 0);
        const TriangleLight<double> light({above[0] + from, above[1] + from, above[2] + from});
        double irradiance = 0, omega = 0, worst = 0;
        constexpr int side = 200;
        over_grid(side, seed + std::uint64_t(round), [&](const Vec2d& u) {
            Vec2d b;
            bool front = false;
            const LightSample<double> s = light.sample(from, u, b, front);
            REQUIRE(s.pdf > 0);
            irradiance += s.wi.y / s.pdf / (side * side);
            omega += 1 / s.pdf / (side * side);
            const double t = length(s.target - from);
            worst = std::max(worst, length(from + s.wi * t - s.target));
            worst = std::max(worst, std::abs(light.pdf(t * t, s.wi) / s.pdf - 1));
            const Vec3d point = light.vertices()[0] * (1 - b.x - b.y) + light.vertices()[1] * b.x + light.vertices()[2] * b.y;
            worst = std::max(worst, length(point - s.target));
        });
        CAPTURE(round);
        CHECK(irradiance == doctest::Approx(lambert_irradiance(above, {0, 1, 0})).epsilon(1e-3));
        CHECK(omega == doctest::Approx(solid_angle(above)).epsilon(1e-3));
        CHECK(worst < 1e-9);
    }
}

TEST_CASE("triangle light: areas whose squares float cannot hold") {
    for (const int power : {-60, -40, 0, 40, 60}) {
        const float side = std::ldexp(1.0f, power);
        const TriangleLight<float> light({Vec3f(0), Vec3f(side, 0, 0), Vec3f(0, side, 0)});
        CAPTURE(power);
        CHECK(light.area() == std::ldexp(0.5f, 2 * power));
        CHECK(light.normal() == Vec3f(0, 0, 1));
    }
}

TEST_CASE("triangle light: which side is the front, and none from the edge on") {
    const TriangleLight<float> light({Vec3f{0, 0, 0}, Vec3f{1, 0, 0}, Vec3f{0, 1, 0}}); // front towards +z
    Vec2f b;
    bool front = false;
    CHECK(light.sample({0.2f, 0.2f, 1}, {0.3f, 0.6f}, b, front).pdf > 0);
    CHECK(front);
    CHECK(light.sample({0.2f, 0.2f, -1}, {0.3f, 0.6f}, b, front).pdf > 0);
    CHECK_FALSE(front);
    CHECK(light.sample({4, 4, 0}, {0.3f, 0.6f}, b, front).pdf == 0);
    CHECK(light.sample(Vec3f(0), {0, 0}, b, front).pdf == 0); // from the sampled point itself
    const TriangleLight<float> flat({Vec3f{0, 0, 0}, Vec3f{1, 0, 0}, Vec3f{2, 0, 0}});
    CHECK(flat.sample({0, 0, 1}, {0.3f, 0.6f}, b, front).pdf == 0);
}

TEST_CASE_TEMPLATE("sphere light: samples meet the sphere, the pdf is 1 over its solid angle, irradiance has the closed form",
                   T, float, double) {
    const Vec3<T> center(1, 2, -3);
    for (const double ratio : {0.999, 0.7, 0.1, 1e-2, 1e-3}) { // of radius to distance
        CAPTURE(ratio);
        const T radius = T(0.5);
        const SphereLight<T> light{center, radius};
        const Vec3d axis = normalize(Vec3d(0.3, 0.9, 0.2));
        const Vec3<T> from = center - Vec3<T>(axis * (0.5 / ratio));
        const double omega = 2 * pi<double> * (1 - std::sqrt(1 - ratio * ratio));
        CHECK(double(light.pdf(from)) == doctest::Approx(1 / omega).epsilon(ratio > 0.9 ? 1e-3 : 1e-5));
        const Sphere<double> exact{Vec3d(center), double(radius), 0};
        double irradiance = 0;
        int missed = 0, beyond = 0;
        constexpr int side = 128;
        over_grid(side, 22, [&](const Vec2d& u) {
            const LightSample<T> s = light.sample(from, Vec2<T>(u));
            const double t = exact.intersect({Vec3d(from), Vec3d(s.wi)}, 1e30);
            missed += !is_finite(t);
            if (is_finite(t)) beyond += length(Vec3d(s.target - from)) > t * (1 + 1e-6);
            irradiance += dot(Vec3d(s.wi), axis) / double(s.pdf) / (side * side);
        });
        CHECK(missed <= side * side / 200); // rounding at the rim
        CHECK(beyond == 0);
        CHECK(irradiance == doctest::Approx(pi<double> * ratio * ratio).epsilon(1e-4)); // π (R/d)², light straight above
    }
    const SphereLight<T> light{center, T(0.5)};
    CHECK(light.pdf(center + Vec3<T>(T(0.2))) == 0);
    CHECK(light.sample(center + Vec3<T>(T(0.2)), {T(0.5), T(0.5)}).pdf == 0);
}

TEST_CASE("sphere light: the shadow ray does not meet the light that it goes to, near or far, small or large") {
    constexpr std::uint64_t seed = 23;
    INFO("seed " << seed);
    Random random(seed);
    const auto direction = [&] {
        for (;;) {
            const Vec3d d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
            if (dot(d, d) < 1 && dot(d, d) > 1e-3) return normalize(d);
        }
    };
    for (const double place : {0.0, 1.0, 1e3})
        for (const double radius : {1e-3, 1.0, 1e3})
            for (const double reach : {1e-3, 1.0, 1e2, 1e4}) { // distance from the surface, in radii
                int met = 0, short_of_it = 0;
                constexpr int n = 4000;
                for (int i = 0; i < n; ++i) {
                    const Sphere<float> sphere{Vec3f(direction() * place), float(radius), 0};
                    const Vec3f from = sphere.center + Vec3f(direction() * (radius * (1 + reach)));
                    const LightSample<float> s =
                        SphereLight<float>{sphere.center, sphere.radius}.sample(from, {random.uniform_float(), random.uniform_float()});
                    if (!(s.pdf > 0)) continue; // rounded into the sphere
                    const Ray<float> shadow{from, s.target - from, 0, 1 - 4 * std::numeric_limits<float>::epsilon()};
                    met += sphere.intersect(shadow, shadow.t_max) < shadow.t_max;
                    const double gap = length(Vec3d(s.target) - Vec3d(sphere.center)) / radius - 1;
                    short_of_it += gap > 1e-3 + 3e-6 * (reach + place / radius) && gap > 0.5 * reach;
                }
                CAPTURE(place);
                CAPTURE(radius);
                CAPTURE(reach);
                CHECK(met == 0);
                CHECK(short_of_it == 0);
            }
}
