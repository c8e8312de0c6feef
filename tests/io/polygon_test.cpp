#include <lambent/io/polygon.hpp>
#include <doctest/doctest.h>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

using namespace lambent;

namespace {

double area(const Vec2d& a, const Vec2d& b, const Vec2d& c) {
    return ((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)) / 2;
}

/// Triangles that all turn the polygon's way and whose areas add up to its area overlap nowhere.
void check_partition(const std::vector<Vec2d>& outline, const Vec3d& u, const Vec3d& v) {
    std::vector<Vec3d> corners;
    double total = 0;
    for (std::size_t i = 0; i < outline.size(); ++i) {
        corners.push_back(Vec3d(3, -2, 5) + u * outline[i].x + v * outline[i].y);
        total += area({0, 0}, outline[i], outline[(i + 1) % outline.size()]);
    }
    detail::Triangulator triangulate;
    const auto& triangles = triangulate(corners);
    CHECK(triangles.size() == outline.size() - 2);
    double sum = 0, least = 0;
    for (const auto& t : triangles) {
        const double one = area(outline[t[0]], outline[t[1]], outline[t[2]]) * (total > 0 ? 1 : -1);
        sum += one;
        least = std::min(least, one);
    }
    CHECK(sum == doctest::Approx(std::abs(total)).epsilon(1e-9));
    CHECK(least >= -1e-12 * std::abs(total));
}

} // namespace

TEST_CASE("concave polygons are cut without overlap, either way round and in any plane") {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> uniform(0.2, 1.0);
    for (int n : {4, 5, 6, 9, 17, 66, 936})
        for (int round = 0; round < 20; ++round) {
            CAPTURE(n);
            CAPTURE(round);
            std::vector<Vec2d> star;
            for (int i = 0; i < n; ++i) {
                const double angle = 2 * 3.14159265358979 * i / n;
                star.push_back(Vec2d(std::cos(angle), std::sin(angle)) * uniform(random));
            }
            check_partition(star, {1, 0, 0}, {0, 1, 0});
            check_partition(star, {0, 0, 1}, {0, 1, 0});
            std::reverse(star.begin(), star.end());
            check_partition(star, normalize(Vec3d(1, 2, 0.5)), normalize(Vec3d(-2, 1, 0)));
        }
}

TEST_CASE("a spiral, a comb and a square with collinear corners") {
    std::vector<Vec2d> spiral, comb{{-1, -5}, {41, -5}};
    for (int i = 0; i <= 100; ++i)
        spiral.push_back(Vec2d(std::cos(0.2 * i), std::sin(0.2 * i)) * (1 + 0.1 * i));
    for (int i = 100; i >= 0; --i)
        spiral.push_back(Vec2d(std::cos(0.2 * i), std::sin(0.2 * i)) * (0.9 + 0.1 * i));
    check_partition(spiral, {1, 0, 0}, {0, 0, 1});
    for (int i = 40; i >= 0; --i) comb.push_back({double(i), i % 2 == 0 ? 10.0 : 1.0});
    check_partition(comb, {1, 0, 0}, {0, 1, 0});
    check_partition({{0, 0}, {1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}}, {1, 0, 0}, {0, 1, 0});
}

TEST_CASE("polygons without an area still give n - 2 triangles of their own corners") {
    detail::Triangulator triangulate;
    for (std::size_t n = 0; n < 50; ++n) {
        const std::vector<Vec3d> point(n, Vec3d(1, 2, 3));
        CHECK(triangulate(point).size() == (n < 3 ? 0 : n - 2));
        std::vector<Vec3d> zigzag;
        for (std::size_t i = 0; i < n; ++i)
            zigzag.push_back({double(i % 3), double(i * i % 7), double(i % 2)});
        for (const auto& t : triangulate(zigzag))
            for (const std::uint32_t corner : t) CHECK(corner < n);
        CHECK(triangulate(zigzag).size() == (n < 3 ? 0 : n - 2));
    }
}
