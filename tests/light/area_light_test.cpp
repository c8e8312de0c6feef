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

TEST_CASE("parallelogram light: irradiance of its two triangles, 1/pdf means the solid angle, points lie within it") {
    constexpr std::uint64_t seed = 23;
    INFO("seed " << seed);
    Random random(seed);
    for (int round = 0; round < 20; ++round) {
        CAPTURE(round);
        const auto any = [&](double size) {
            return Vec3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)) * size;
        };
        const Vec3d from = any(3), corner = from + any(1) + Vec3d(0, 6, 0);
        const Vec3d second = corner + any(2), third = corner + any(2);
        const Vec3d fourth = second + (third - corner);
        const auto light = TriangleLight<double>::joined({corner, second, third}, {fourth, third, second});
        REQUIRE(light);
        const Triangle one{corner - from, second - from, third - from}, other{second - from, fourth - from, third - from};
        Bounds3<double> corners;
        for (const Vec3d& p : {corner, second, third, fourth}) corners.add(p);
        const LightBounds<double> bounds = light->bounds(1, LightBounds<double>::Sides::both);
        CHECK(length(bounds.box.min - corners.min) < 1e-12);
        CHECK(length(bounds.box.max - corners.max) < 1e-12);
        CHECK(bounds.intensity == doctest::Approx(length(cross(second - corner, third - corner))));
        double irradiance = 0, omega = 0;
        bool inside = true;
        constexpr int side = 200;
        over_grid(side, seed + std::uint64_t(round), [&](const Vec2d& u) {
            Vec2d b;
            bool front = false;
            const LightSample<double> s = light->sample(from, u, b, front);
            REQUIRE(s.pdf > 0);
            irradiance += s.wi.y / s.pdf / (side * side);
            omega += 1 / s.pdf / (side * side);
            inside = inside && length(corner + (second - corner) * b.x + (third - corner) * b.y - s.target) < 1e-12 &&
                     std::min(b.x, b.y) >= 0 && std::max(b.x, b.y) <= 1;
        });
        const double expected = lambert_irradiance(one, {0, 1, 0}) + lambert_irradiance(other, {0, 1, 0});
        CHECK(irradiance == doctest::Approx(expected).epsilon(1e-3));
        CHECK(omega == doctest::Approx(solid_angle(one) + solid_angle(other)).epsilon(1e-3));
        CHECK(inside);
    }
}

TEST_CASE("parallelogram light: what two triangles make one, at whatever corner they begin") {
    using Corners = std::array<Vec3f, 3>;
    const auto rotated = [](const Corners& t, std::size_t by) {
        return Corners{t[by % 3], t[(by + 1) % 3], t[(by + 2) % 3]};
    };
    const auto joined = [&](const Corners& a, const Corners& b) {
        int found = 0;
        for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t j = 0; j < 3; ++j)
                if (const auto light = TriangleLight<float>::joined(rotated(a, i), rotated(b, j))) {
                    ++found;
                    CHECK(light->area() == doctest::Approx(length(cross(a[1] - a[0], a[2] - a[0]))).epsilon(2e-4));
                    CHECK(dot(light->normal(), cross(a[1] - a[0], a[2] - a[0])) > 0);
                }
        CHECK((found == 0 || found == 9));
        return found > 0;
    };
    const Vec3f p(1, 2, 3), q(2, 2, 3.5f), r(1.5f, 4, 3), s = q + r - p;
    CHECK(joined({p, q, r}, {s, r, q}));
    CHECK_FALSE(joined({p, q, r}, {s, q, r}));                                // faces the other way
    CHECK_FALSE(joined({p, q, r}, {p, q, r}));                                // the same one twice
    CHECK_FALSE(joined({p, q, r}, {p, r, q}));                                // its own back
    CHECK_FALSE(joined({p, q, r}, {s + Vec3f(0, 0.001f, 0), r, q}));          // not quite
    CHECK_FALSE(joined({p, q, r}, {s + Vec3f(0, 0, 1), r, q}));               // folded
    CHECK_FALSE(joined({p, q, r}, {s + Vec3f(1), r + Vec3f(1), q + Vec3f(1)})); // apart
    CHECK_FALSE(joined({p, q, q}, {q, q, q}));                                // of no area
    // Corners that float rounded: a light of a metre a kilometre away, and one too small there for its area to be known.
    const auto turned = [](float size) {
        const Vec3d corner(700.3, 300.7, 500.1);
        const Vec3d a = normalize(Vec3d(1, 2, 3)) * double(size), b = normalize(Vec3d(3, -1, 1)) * double(size);
        return std::array<Vec3f, 4>{Vec3f(corner), Vec3f(corner + a), Vec3f(corner + b), Vec3f(corner + a + b)};
    };
    const auto rounded = [](const std::array<Vec3f, 4>& c) {
        return Vec3d(c[1]) - Vec3d(c[0]) + Vec3d(c[2]) != Vec3d(c[3]);
    };
    const auto metre = turned(1.3f), speck = turned(0.013f);
    REQUIRE(rounded(metre));
    REQUIRE(rounded(speck));
    CHECK(joined({metre[0], metre[1], metre[2]}, {metre[3], metre[2], metre[1]}));
    CHECK_FALSE(joined({speck[0], speck[1], speck[2]}, {speck[3], speck[2], speck[1]}));
}

TEST_CASE("parallelogram light: points are no farther off its triangles than their error says") {
    constexpr std::uint64_t seed = 24;
    INFO("seed " << seed);
    Random random(seed);
    const auto any = [&](double size) {
        return Vec3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)) * size;
    };
    int lights = 0, rounded = 0;
    double worst = 0; // part of the error that is used up
    for (int round = 0; round < 3000; ++round) {
        const Vec3d corner = any(1000) * std::pow(10, random.uniform(-3, 0)), a = any(100), b = any(100);
        const Vec3f p(corner), q(corner + a), r(corner + b), s(corner + a + b);
        const auto light = TriangleLight<float>::joined({p, q, r}, {s, r, q});
        if (!light) continue;
        ++lights;
        rounded += Vec3d(q) - Vec3d(p) + Vec3d(r) != Vec3d(s);
        for (int i = 0; i < 100; ++i) {
            Vec2f weights;
            bool front = false;
            const Vec2f u(random.uniform_float(), random.uniform_float());
            const LightSample<float> sample = light->sample(Vec3f(corner + any(300)), u, weights, front);
            const Vec3d at = u.x + u.y < 1 ? Vec3d(p) : Vec3d(s); // the triangle that it is on
            const Vec3d n = normalize(u.x + u.y < 1 ? cross(Vec3d(q - p), Vec3d(r - p)) : cross(Vec3d(r - s), Vec3d(q - s)));
            worst = std::max(worst, std::abs(dot(Vec3d(sample.target) - at, n)) / dot(abs(n), Vec3d(sample.target_error)));
        }
    }
    CHECK(lights > 1000);
    CHECK(rounded > 500);
    CHECK(worst < 0.7); // a ray's own rounding needs some, too
}

TEST_CASE("triangle light: areas whose squares float cannot hold") {
    for (const int power : {-60, -40, 0, 40, 60}) {
        const float side = std::ldexp(1.0f, power);
        const TriangleLight<float> light({Vec3f(0), Vec3f(side, 0, 0), Vec3f(0, side, 0)});
        CAPTURE(power);
        CHECK(light.area() == std::ldexp(0.5f, 2 * power));
        CHECK(light.normal() == Vec3f(0, 0, 1));
        const auto both = TriangleLight<float>::joined({Vec3f(0), Vec3f(side, 0, 0), Vec3f(0, side, 0)},
                                                       {Vec3f(side, side, 0), Vec3f(0, side, 0), Vec3f(side, 0, 0)});
        REQUIRE(both);
        CHECK(both->area() == std::ldexp(1.0f, 2 * power));
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
