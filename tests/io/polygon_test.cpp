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

/// No corner lies on an edge that is not its own, and no two edges cross.
bool is_simple(const std::vector<Vec2d>& p) {
    const std::size_t n = p.size();
    const auto on_edge = [](const Vec2d& a, const Vec2d& b, const Vec2d& q) {
        return area(a, b, q) == 0 && dot(q - a, q - b) <= 0;
    };
    for (std::size_t i = 0; i < n; ++i) {
        const Vec2d &a = p[i], &b = p[(i + 1) % n];
        for (std::size_t k = 0; k < n; ++k) {
            if (k != i && k != (i + 1) % n && on_edge(a, b, p[k])) return false;
            const Vec2d &c = p[k], &d = p[(k + 1) % n];
            if (area(a, b, c) * area(a, b, d) < 0 && area(c, d, a) * area(c, d, b) < 0) return false;
        }
    }
    return true;
}

} // namespace

TEST_CASE("concave polygons are cut without overlap, either way round and in any plane") {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> uniform(0.2, 1.0);
    for (int n : {4, 5, 6, 9, 17, 66, 128, 129, 936, 5000})
        for (int round = 0; round < 10; ++round) {
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
    for (int i = 0; i <= 100; ++i) spiral.push_back(Vec2d(std::cos(0.2 * i), std::sin(0.2 * i)) * (1 + 0.1 * i));
    for (int i = 100; i >= 0; --i) spiral.push_back(Vec2d(std::cos(0.2 * i), std::sin(0.2 * i)) * (0.9 + 0.1 * i));
    check_partition(spiral, {1, 0, 0}, {0, 0, 1});
    for (int i = 40; i >= 0; --i) comb.push_back({double(i), i % 2 == 0 ? 10.0 : 1.0});
    check_partition(comb, {1, 0, 0}, {0, 1, 0});
    check_partition({{0, 0}, {1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}}, {1, 0, 0}, {0, 1, 0});
}

TEST_CASE("large polygons: combs and spirals at an angle, stairs, repeated corners, holes joined by a cut") {
    const Vec3d u = normalize(Vec3d(3, 1, 1)), v = normalize(cross(Vec3d(1, 2, -1), u));
    std::vector<Vec2d> comb{{-1, -5}, {1001, -5}}, spiral, stairs, repeated, holes{{0, 0}, {10, 0}, {10, 10}, {0, 10}};
    for (int i = 1000; i >= 0; --i) comb.push_back({double(i), i % 2 == 0 ? 10.0 : 1.0});
    for (int i = 0; i <= 1000; ++i) spiral.push_back(Vec2d(std::cos(0.2 * i), std::sin(0.2 * i)) * (1 + 0.1 * i));
    for (int i = 1000; i >= 0; --i) spiral.push_back(Vec2d(std::cos(0.2 * i), std::sin(0.2 * i)) * (0.9 + 0.1 * i));
    for (int i = 0; i < 500; ++i) stairs.insert(stairs.end(), {{double(i), double(-i)}, {double(i + 1), double(-i)}});
    stairs.insert(stairs.end(), {{500, -500}, {0, -500}});
    for (int i = 0; i < 300; ++i) {
        const Vec2d p = Vec2d(std::cos(i * 0.02), std::sin(i * 0.02)) * (1.0 + 0.5 * (i % 3));
        repeated.insert(repeated.end(), std::size_t(1 + i % 3), p);
    }
    for (int y = 9; y >= 0; --y) { // a row of diamonds, in from the left side between them and back
        holes.push_back({0, y + 0.5});
        for (int x = 0; x < 10; ++x)
            holes.insert(holes.end(), {{x + 0.25, y + 0.5}, {x + 0.5, y + 0.75}, {x + 0.75, y + 0.5}});
        for (int x = 9; x >= 0; --x) {
            holes.insert(holes.end(), {{x + 0.5, y + 0.25}, {x + 0.25, y + 0.5}});
            if (x > 0) holes.push_back({x - 0.25, y + 0.5});
        }
        holes.push_back({0, y + 0.5});
    }
    for (const auto* outline : {&comb, &spiral, &stairs, &repeated, &holes}) {
        CHECK(outline->size() > detail::Triangulator::few_corners);
        check_partition(*outline, {1, 0, 0}, {0, 1, 0});
        check_partition(*outline, u, v);
    }
}

TEST_CASE("the sweep cuts every simple polygon on a small grid, where corners line up") {
    std::mt19937 random(3);
    int tried = 0, cut = 0;
    for (int round = 0; round < 20000; ++round) {
        const int n = 4 + int(random() % 9), side = 3 + int(random() % 6);
        std::vector<Vec2d> p;
        for (int i = 0; i < n; ++i)
            p.push_back({double(int(random() % unsigned(side))), double(int(random() % unsigned(side)))});
        for (bool crossing = true;
             crossing;) { // turn around what lies between two edges that cross: the outline shrinks
            crossing = false;
            for (std::size_t i = 0; i < p.size() && !crossing; ++i)
                for (std::size_t k = i + 2; k < p.size() && !crossing; ++k) {
                    const Vec2d &a = p[i], &b = p[i + 1], &c = p[k], &d = p[(k + 1) % p.size()];
                    crossing = area(a, b, c) * area(a, b, d) < 0 && area(c, d, a) * area(c, d, b) < 0;
                    if (crossing) std::reverse(p.begin() + long(i) + 1, p.begin() + long(k) + 1);
                }
        }
        if (!is_simple(p)) continue;
        double whole = 0;
        for (std::size_t i = 0; i < p.size(); ++i) whole += area({0, 0}, p[i], p[(i + 1) % p.size()]);
        if (whole < 0) std::reverse(p.begin(), p.end());
        detail::PolygonSweep sweep;
        std::vector<detail::PolygonSweep::Triangle> triangles;
        ++tried;
        const bool done = sweep(p, triangles);
        cut += done;
        CAPTURE(round);
        if (!done) continue;
        double sum = 0;
        for (const auto& t : triangles) {
            const double one = area(p[t[0]], p[t[1]], p[t[2]]);
            REQUIRE(one >= 0);
            sum += one;
        }
        REQUIRE(triangles.size() == p.size() - 2);
        REQUIRE(sum == std::abs(whole)); // small whole numbers and halves
    }
    CHECK(tried > 3000);
    CHECK(cut == tried);
}

TEST_CASE("polygons without an area still give n - 2 triangles of their own corners") {
    detail::Triangulator triangulate;
    for (std::size_t n = 0; n < 50; ++n) {
        const std::vector<Vec3d> point(n, Vec3d(1, 2, 3));
        CHECK(triangulate(point).size() == (n < 3 ? 0 : n - 2));
        std::vector<Vec3d> zigzag;
        for (std::size_t i = 0; i < n; ++i) zigzag.push_back({double(i % 3), double(i * i % 7), double(i % 2)});
        for (const auto& t : triangulate(zigzag))
            for (const std::uint32_t corner : t) CHECK(corner < n);
        CHECK(triangulate(zigzag).size() == (n < 3 ? 0 : n - 2));
    }
}
