#include "support/random.hpp"
#include <lambent/light/light_tree.hpp>
#include <lambent/light/punctual_light.hpp>
#include <lambent/light/sphere_light.hpp>
#include <lambent/light/triangle_light.hpp>
#include <support/statistics.hpp>
#include <doctest/doctest.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

Vec3d unit_vector(Random& random) {
    for (;;) {
        const Vec3d d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        if (dot(d, d) < 1 && dot(d, d) > 1e-3) return normalize(d);
    }
}

template <class T>
struct Lights {
    std::vector<TriangleLight<T>> triangles;
    std::vector<T> radiance;
    std::vector<LightBounds<T>> bounds;
    std::vector<bool> both_sides;
};

/// Small triangles all over a cube of side 2, of intensities over four powers of ten.
template <class T>
Lights<T> scattered(std::size_t n, std::uint64_t seed) {
    Random random(seed);
    Lights<T> lights;
    for (std::size_t i = 0; i < n; ++i) {
        const Vec3d place(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        const double size = std::pow(10, random.uniform(-2, -0.5));
        std::array<Vec3<T>, 3> vertices;
        for (Vec3<T>& v : vertices) v = Vec3<T>(place + unit_vector(random) * size);
        const TriangleLight<T> t(vertices);
        const bool both = random.uniform() < 0.2;
        const T radiance = T(std::pow(10, random.uniform(-1, 2)));
        lights.triangles.push_back(t);
        lights.radiance.push_back(radiance);
        lights.both_sides.push_back(both);
        lights.bounds.push_back(t.bounds(radiance, both ? LightBounds<T>::Sides::both : LightBounds<T>::Sides::front));
    }
    return lights;
}

/// Irradiance at a point from one light by the middles of many small triangles, in double; no shadows.
template <class T>
double irradiance(const Lights<T>& lights, std::size_t i, const Vec3d& p, const Vec3d& n, int side) {
    const TriangleLight<T>& t = lights.triangles[i];
    const Vec3d a(t.vertices()[0]), b(t.vertices()[1]), c(t.vertices()[2]);
    const Vec3d area = cross(b - a, c - a) / 2.0;
    double sum = 0;
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            const Vec2d u = square_to_triangle(Vec2d((x + 0.5) / side, (y + 0.5) / side));
            const Vec3d d = a + (b - a) * u.x + (c - a) * u.y - p;
            const double cos_light = -dot(area, d), cos_surface = dot(n, d);
            if (!(cos_surface > 0) || (!(cos_light > 0) && !lights.both_sides[i])) continue;
            sum += std::abs(cos_light) * cos_surface / (dot(d, d) * dot(d, d));
        }
    return sum * double(lights.radiance[i]) / (side * side);
}

} // namespace

TEST_CASE_TEMPLATE("light tree: the pmf is what sample() does, and sums to one", T, float, double) {
    constexpr std::uint64_t seed = 51;
    INFO("seed " << seed);
    Random random(seed);
    for (const std::size_t n : {1u, 2u, 7u, 8u, 9u, 100u, 3000u}) {
        CAPTURE(n);
        std::vector<LightBounds<T>> everywhere; // spheres shine on any point, so that no child is dark
        for (std::size_t i = 0; i < n; ++i)
            everywhere.push_back(SphereLight<T>{Vec3<T>(unit_vector(random) * random.uniform(0, 3)), T(random.uniform(0.01, 0.1))}.bounds(
                T(std::pow(10, random.uniform(-3, 3)))));
        const LightTree<T> tree(everywhere);
        int different = 0, impossible = 0;
        for (int k = 0; k < 20; ++k) {
            const Vec3<T> p(unit_vector(random) * random.uniform(0, 6));
            double sum = 0;
            for (std::uint32_t i = 0; i < n; ++i) {
                const T pmf = tree.pmf(p, Vec3<T>(0), i);
                impossible += !(pmf > 0);
                sum += double(pmf);
            }
            CHECK(std::abs(sum - 1) < 1e-5);
            for (int j = 0; j < 200; ++j) {
                const auto s = tree.sample(p, Vec3<T>(0), T(random.uniform_float()));
                different += !(std::abs(s.probability / tree.pmf(p, Vec3<T>(0), s.index) - 1) < 1e-6) || s.u < 0 || !(s.u < 1);
            }
        }
        CHECK(different == 0);
        CHECK(impossible == 0);
    }
}

TEST_CASE_TEMPLATE("light tree: lights are picked as often as the pmf says (chi-square), what is left of u is even", T,
                   float, double) {
    constexpr std::uint64_t seed = 52;
    INFO("seed " << seed);
    Random random(seed);
    constexpr std::size_t lights = 60;
    const LightTree<T> tree(scattered<T>(lights, seed).bounds);
    constexpr int n = 200000, points = 10;
    for (int k = 0; k < points; ++k) {
        const Vec3<T> p(unit_vector(random)), normal(unit_vector(random));
        std::vector<double> observed(lights + 1), expected(lights + 1), rest(16);
        expected[lights] = n; // of no light, where children of a node that may contribute cannot
        for (std::uint32_t i = 0; i < lights; ++i) expected[lights] -= expected[i] = n * double(tree.pmf(p, normal, i));
        if (expected[lights] < 0.1) expected[lights] = 0;
        for (int j = 0; j < n; ++j) {
            const auto s = tree.sample(p, normal, T(random.uniform()));
            ++observed[s.probability > 0 ? s.index : lights];
            if (s.probability > 0) ++rest[std::size_t(s.u * 16)];
        }
        CHECK(chi_square_test(observed, expected) > min_p / (2 * points));
        CHECK(chi_square_uniform(rest) > min_p / (2 * points));
    }
}

TEST_CASE_TEMPLATE("light tree: whatever shines on a point can be picked, and the estimate is the sum over all lights", T,
                   float, double) {
    constexpr std::uint64_t seed = 53;
    INFO("seed " << seed);
    Random random(seed);
    for (const std::size_t count : {5u, 40u, 700u}) {
        const Lights<T> lights = scattered<T>(count, seed + count);
        const LightTree<T> tree(lights.bounds);
        double tree_error = 0, uniform_error = 0;
        for (int k = 0; k < 15; ++k) {
            const Vec3<T> p(unit_vector(random) * random.uniform(0, 2)), n(unit_vector(random));
            std::vector<double> exact(count);
            double total = 0, squares_uniform = 0, squares_tree = 0;
            int missed = 0;
            for (std::uint32_t i = 0; i < count; ++i) {
                exact[i] = irradiance(lights, i, Vec3d(p), Vec3d(n), 12);
                total += exact[i];
                const double pmf = double(tree.pmf(p, n, i));
                missed += exact[i] > 0 && !(pmf > 0);
                squares_uniform += exact[i] * exact[i] * double(count);
                if (pmf > 0) squares_tree += exact[i] * exact[i] / pmf;
            }
            CHECK(missed == 0);
            Moments estimate;
            for (int j = 0; j < 4000; ++j) {
                const auto s = tree.sample(p, n, T(random.uniform()));
                estimate.add(s.probability > 0 ? exact[s.index] / double(s.probability) : 0.0);
            }
            CHECK(std::abs(estimate.z(total)) < max_z);
            if (!(total > 0)) continue;
            tree_error += (squares_tree - total * total) / (total * total);
            uniform_error += (squares_uniform - total * total) / (total * total);
        }
        CHECK(tree_error < uniform_error / (count < 10 ? 1.5 : 5));
    }
}

TEST_CASE("light tree: lights in one place, of no intensity, tiny and huge; no light at all") {
    CHECK(LightTree<float>().empty());
    CHECK(LightTree<float>(std::vector<LightBounds<float>>(3)).empty()); // of no intensity
    CHECK(LightTree<float>().sample(Vec3f(0), Vec3f(0), 0.5f).probability == 0);

    PunctualLight lamp;
    std::vector<LightBounds<float>> lamps(20000, lamp.bounds<float>(Vec3d(0))); // all at the origin
    lamps[7].intensity = 0;
    lamps[9].intensity = 1e-30f;
    lamps[11].intensity = 1e30f;
    const LightTree<float> tree(lamps);
    CHECK(tree.pmf({1, 2, 3}, Vec3f(0), 7) == 0);
    CHECK(tree.pmf({1, 2, 3}, Vec3f(0), 11) == doctest::Approx(1));
    CHECK(tree.sample({1, 2, 3}, Vec3f(0), 0.3f).index == 11);
    CHECK(tree.sample({0, 0, 0}, Vec3f(0), 0.3f).index == 11); // where they are
    CHECK(tree.node_count() < 20000 / 3);

    std::vector<LightBounds<double>> steps; // each ten times as far as the last: a tree as deep as they get
    for (int i = 0; i < 250; ++i) {
        lamp.position = Vec3d(std::pow(10.0, i / 5.0), 0, 0);
        steps.push_back(lamp.bounds<double>(Vec3d(0)));
    }
    const LightTree<double> deep(steps);
    double sum = 0;
    for (std::uint32_t i = 0; i < 250; ++i) sum += deep.pmf({0, 1, 0}, Vec3d(0), i);
    CHECK(sum == doctest::Approx(1));
}

TEST_CASE("light tree: a spot lights its cone only, a triangle its front, both sides where they shine") {
    PunctualLight spot;
    spot.kind = PunctualLight::Kind::spot;
    spot.direction = {0, -1, 0};
    spot.outer_cone_cos = 0.8f;
    const TriangleLight<float> triangle({Vec3f{0, 0, 0}, Vec3f{0, 0, 0.1f}, Vec3f{0.1f, 0, 0}}); // front towards +y
    using Sides = LightBounds<float>::Sides;
    const auto lit = [](const LightBounds<float>& b, const Vec3f& p, const Vec3f& n) {
        return LightTree<float>(std::vector{b}).pmf(p, n, 0) > 0;
    };
    CHECK(lit(spot.bounds<float>(Vec3d(0)), {0.3f, -1, 0}, Vec3f(0)));
    CHECK_FALSE(lit(spot.bounds<float>(Vec3d(0)), {1, -1, 0}, Vec3f(0)));
    CHECK(lit(triangle.bounds(1, Sides::front), {0, 1, 0}, Vec3f(0)));
    CHECK_FALSE(lit(triangle.bounds(1, Sides::front), {0, -1, 0}, Vec3f(0)));
    CHECK(lit(triangle.bounds(1, Sides::both), {0, -1, 0}, Vec3f(0)));
    CHECK(lit(triangle.bounds(1, Sides::front), {0, 1, 0}, {0.1f, -1, 0}));
    CHECK_FALSE(lit(triangle.bounds(1, Sides::front), {0, 1, 0}, {0.1f, 1, 0}));
}

TEST_CASE("bounds of lights together hold the normals of each") {
    constexpr std::uint64_t seed = 54;
    INFO("seed " << seed);
    Random random(seed);
    using Sides = LightBounds<double>::Sides;
    int outside = 0, wide = 0;
    for (int round = 0; round < 5000; ++round) {
        LightBounds<double> all;
        std::vector<LightBounds<double>> parts(std::size_t(random.uniform(2, 6)));
        const Vec3d around = unit_vector(random);
        const double spread = std::pow(10, random.uniform(-6, 0.5));
        for (LightBounds<double>& b : parts) {
            b.box.add(unit_vector(random));
            b.axis = normalize(around + unit_vector(random) * spread);
            b.cos_normals = std::cos(random.uniform() < 0.5 ? 0 : spread * random.uniform());
            b.intensity = 1;
            b.sides = random.uniform() < 0.3 ? Sides::both : Sides::front;
            all = unite(all, b);
        }
        for (const LightBounds<double>& b : parts) {
            const Vec3d side = normalize(cross(b.axis, unit_vector(random)));
            const double angle = std::acos(b.cos_normals);
            for (int k = 0; k < 8; ++k) { // normals on the rim
                const double turn = k * pi<double> / 4;
                const Vec3d rim = side * std::cos(turn) + cross(b.axis, side) * std::sin(turn);
                double cosine = dot(b.axis * std::cos(angle) + rim * std::sin(angle), all.axis);
                if (all.sides == Sides::both) cosine = std::abs(cosine);
                outside += cosine < all.cos_normals - 1e-12;
            }
        }
        wide += all.sides == Sides::front && spread < 0.7 && all.cos_normals < std::cos(4 * spread);
    }
    CHECK(outside == 0);
    CHECK(wide == 0);
}
