#include "support/random.hpp"
#include <doctest/doctest.h>
#include <lambent/core/frame.hpp>
#include <lambent/core/simd.hpp>
#include <lambent/sampling/hash.hpp>
#include <lambent/sampling/warp.hpp>
#include <string>
#include <support/statistics.hpp>

using namespace lambent;
using namespace lambent_test;

namespace {

constexpr int samples = 400000, rings = 24, sectors = 32;
constexpr double turn = 2 * 3.14159265358979323846;

/// Chi-square of directions in bins of (cos theta, phi) against the integral of pdf(cos theta) over each bin.
template <class Direction, class Pdf>
double test_directions(std::uint64_t seed, double cos_low, Direction direction, Pdf pdf) {
    Random random(seed);
    std::vector<double> observed(rings * sectors), expected(rings * sectors);
    for (int i = 0; i < samples; ++i) {
        const Vec3d d = direction(Vec2f(random.uniform_float(), random.uniform_float()));
        const double ring = (d.z - cos_low) / (1 - cos_low) * rings, phi = std::atan2(d.y, d.x) / turn + 0.5;
        const auto r = std::size_t(std::clamp(ring, 0.0, rings - 1.0)),
                   s = std::size_t(phi * sectors) % sectors;
        ++observed[r * sectors + s];
    }
    for (std::size_t r = 0; r < rings; ++r) {
        double mass = 0;
        const double step = (1 - cos_low) / rings / 100;
        for (int i = 0; i < 100; ++i) mass += pdf(cos_low + (double(r) * 100 + i + 0.5) * step) * step;
        for (std::size_t s = 0; s < sectors; ++s) expected[r * sectors + s] = samples * mass * turn / sectors;
    }
    double total = 0;
    for (const double e : expected) total += e;
    CHECK(total == doctest::Approx(samples).epsilon(1e-4));
    return chi_square_test(observed, expected);
}

template <class T>
std::vector<T> awkward() {
    const T step = std::numeric_limits<T>::epsilon() / 2;
    return {0,
            std::numeric_limits<T>::denorm_min(),
            step,
            T(0.25),
            next_down(T(0.5)),
            T(0.5),
            T(0.5) - step / 2,
            T(0.5) + step,
            T(0.75),
            one_minus_epsilon<T>};
}

} // namespace

TEST_CASE("warps: directions follow the density beside them (chi-square)") {
    constexpr std::uint64_t seed = 101;
    INFO("seed " << seed);
    CHECK(test_directions(
              seed, 0, [](Vec2f u) { return Vec3d(square_to_cosine_hemisphere(u)); },
              [](double c) { return cosine_hemisphere_pdf(c); }) > min_p);
    CHECK(test_directions(
              seed, 0, [](Vec2f u) { return Vec3d(square_to_uniform_hemisphere(u)); },
              [](double) { return uniform_hemisphere_pdf<double>(); }) > min_p);
    CHECK(test_directions(
              seed, -1, [](Vec2f u) { return Vec3d(square_to_uniform_sphere(u)); },
              [](double) { return uniform_sphere_pdf<double>(); }) > min_p);
    for (const float sin2 : {1.0f, 0.5f, 0.01f}) {
        CAPTURE(sin2);
        CHECK(test_directions(
                  seed, 1 - one_minus_cos(double(sin2)),
                  [&](Vec2f u) { return Vec3d(square_to_uniform_cone(u, sin2)); },
                  [&](double) { return double(uniform_cone_pdf(sin2)); }) > min_p);
    }
}

TEST_CASE("warps: disk and triangle are uniform (chi-square)") {
    constexpr std::uint64_t seed = 102;
    INFO("seed " << seed);
    Random random(seed);
    std::vector<double> disk(rings * sectors), triangle(400);
    int outside = 0;
    for (int i = 0; i < samples; ++i) {
        const Vec2f u(random.uniform_float(), random.uniform_float());
        const Vec2d p(square_to_disk(u));
        outside += !(dot(p, p) < 1);
        const double phi = std::atan2(p.y, p.x) / turn + 0.5;
        ++disk[std::min<std::size_t>(rings - 1, std::size_t(dot(p, p) * rings)) * sectors +
               std::size_t(phi * sectors) % sectors];
        const Vec2f b = square_to_triangle(u);
        outside += !(b.x >= 0 && b.y >= 0 && 1 - b.x - b.y >= 0);
        // sqrt takes the triangle back to a square of equal chances: an independent way
        const double s = (1.0 - b.x) * (1.0 - b.x), t = b.x < 1 ? b.y / (1.0 - b.x) : 0;
        ++triangle[std::min<std::size_t>(19, std::size_t(s * 20)) * 20 +
                   std::min<std::size_t>(19, std::size_t(t * 20))];
    }
    CHECK(outside == 0);
    CHECK(chi_square_uniform(disk) > min_p);
    CHECK(chi_square_uniform(triangle) > min_p);
    CHECK(disk_pdf<double>() * turn / 2 == doctest::Approx(1).epsilon(1e-15));
    CHECK(triangle_pdf(4.0f) == 0.25f);
}

TEST_CASE("S1: cosine-weighted bounce") {
    // Around every axis, the poles' neighbours and random normals, binned in a frame that is not ours.
    constexpr std::uint64_t seed = 103;
    INFO("seed " << seed);
    Random random(seed);
    std::vector<Vec3f> normals{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0},           {0, -1, 0},
                               {0, 0, 1}, {0, 0, -1}, {1e-4f, -1e-4f, -1}, {0.6f, 0.0f, -0.8f}};
    for (int i = 0; i < 8; ++i)
        normals.push_back(
            normalize(Vec3f(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1))));
    for (const Vec3f& normal : normals) {
        const Frame<float> frame(normal);
        const Vec3d n = normalize(Vec3d(normal));
        const Vec3d tangent = normalize(cross(n, std::abs(n.x) > 0.5 ? Vec3d(0, 1, 0) : Vec3d(1, 0, 0)));
        const Vec3d bitangent = cross(n, tangent);
        Moments mean_cos;
        const double p = test_directions(
            seed + 1, 0,
            [&](Vec2f u) {
                const Vec3d d(frame.to_world(square_to_cosine_hemisphere(u)));
                mean_cos.add(dot(d, n));
                return Vec3d(dot(d, tangent), dot(d, bitangent), dot(d, n));
            },
            [](double c) { return cosine_hemisphere_pdf(c); });
        INFO("normal " << normal.x << ' ' << normal.y << ' ' << normal.z);
        CHECK(p > min_p);
        CHECK(std::abs(mean_cos.z(2.0 / 3)) < 3);
    }
}

TEST_CASE_TEMPLATE("warps: unit length, finite and inside for every awkward u", T, float, double) {
    const double tolerance = 4 * double(std::numeric_limits<T>::epsilon());
    double worst = 0;
    int bad = 0;
    const auto check = [&](const Vec3<T>& d, T cos_low) {
        bad += !is_finite(d) || !(d.z >= cos_low);
        worst = std::max(worst, std::abs(double(dot(Vec3d(d), Vec3d(d))) - 1));
    };
    Random random(104);
    std::vector<Vec2<T>> points;
    for (const T x : awkward<T>())
        for (const T y : awkward<T>()) points.push_back({x, y});
    for (int i = 0; i < 300000;
         ++i) { // along the square's border and its diagonals, where r and z are extreme
        const T a = T(random.uniform_float());
        for (const T x : {T(0), one_minus_epsilon<T>}) {
            points.push_back({x, a});
            points.push_back({a, x});
        }
        points.push_back({a, a});
    }
    for (const Vec2<T>& u : points) {
        const Vec3<T> c = square_to_cosine_hemisphere(u);
        check(c, 0);
        bad += !(cosine_hemisphere_pdf(c.z) > 0);
        check(square_to_uniform_hemisphere(u), 0);
        check(square_to_uniform_sphere(u), -1);
        for (const T sin2 : {T(1), T(0.3), T(1e-6), T(1e-12), T(1e-30)})
            check(square_to_uniform_cone(u, sin2), 0);
        const Vec2<T> b = square_to_triangle(u);
        bad += !(b.x >= 0 && b.y >= 0 && 1 - b.x - b.y >= 0);
    }
    CHECK(bad == 0);
    CHECK(worst < tolerance);
    CHECK(cosine_hemisphere_pdf(T(0)) == 0);
    CHECK(cosine_hemisphere_pdf(T(-1)) == 0);
}

TEST_CASE("warps: cones down to a hair keep their density and their spread") {
    constexpr std::uint64_t seed = 105;
    INFO("seed " << seed);
    Random random(seed);
    for (const double sin2 : {1.0, 0.9, 1e-3, 1e-6, 1e-9, 1e-14, 1e-30}) {
        CAPTURE(sin2);
        // 2 sin^2(theta / 2) has no cancellation.
        const double half = std::sin(std::asin(std::sqrt(sin2)) / 2), solid_angle = turn * 2 * half * half;
        CHECK(uniform_cone_pdf(float(sin2)) * solid_angle == doctest::Approx(1).epsilon(1e-6));
        CHECK(uniform_cone_pdf(sin2) * solid_angle == doctest::Approx(1).epsilon(1e-13));
        Moments share; // of the cone's solid angle inside the sample's own; uniform in [0, 1]
        for (int i = 0; i < 100000; ++i) {
            const Vec3f d =
                square_to_uniform_cone(Vec2f(random.uniform_float(), random.uniform_float()), float(sin2));
            const double s2 = double(d.x) * d.x + double(d.y) * d.y;
            share.add(s2 / (1 + std::sqrt(std::max(0.0, 1 - s2))) / (2 * half * half));
        }
        CHECK(std::abs(share.z(0.5)) < max_z);
        CHECK(share.variance() == doctest::Approx(1.0 / 12).epsilon(0.02));
    }
}

TEST_CASE("warps: lanes go where numbers go") {
    constexpr int width = 4;
    using P = Pack<float, width>;
    Random random(41);
    for (int i = 0; i < 10000; ++i) {
        Vec2<P> u(P(0.5f), P(0.5f)); // the middle of the square, its diagonal, and elsewhere
        for (int lane = i % 2; lane < width; ++lane) {
            u.x.set(lane, random.uniform_float());
            u.y.set(lane, lane == 1 ? u.x[lane] : random.uniform_float());
        }
        const Vec3<P> directions = square_to_cosine_hemisphere(u);
        const Vec2<P> triangle = square_to_triangle(u), disk = square_to_disk(u);
        for (int lane = 0; lane < width; ++lane) {
            const Vec2f at(u.x[lane], u.y[lane]);
            const Vec3f direction(directions.x[lane], directions.y[lane], directions.z[lane]);
            REQUIRE(length(direction - square_to_cosine_hemisphere(at)) <= 5e-7f);
            REQUIRE(length(Vec2f(disk.x[lane], disk.y[lane]) - square_to_disk(at)) <= 5e-7f);
            REQUIRE(Vec2f(triangle.x[lane], triangle.y[lane]) == square_to_triangle(at));
        }
    }
}
