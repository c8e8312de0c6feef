#include "support/brute_force.hpp"
#include "support/doubled.hpp"
#include "support/meshes.hpp"
#include "support/random.hpp"
#include <cmath>
#include <doctest/doctest.h>
#include <lambent/bvh/overlap.hpp>
#include <limits>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

/// Does anything of the triangle lie in the closed box? The triangle is cut by the box's planes, one after the
/// other, in long double (Sutherland and Hodgman): no axis separates anything here.
template <class T>
bool cut_leaves_some(const Corners<T>& corners, const Bounds3<T>& box, long double margin) {
    using Point = glm::vec<3, long double>;
    std::vector<Point> polygon(corners.begin(), corners.end()), next;
    for (int k = 0; k < 3; ++k)
        for (const int side : {-1, 1}) {
            const long double plane = side < 0 ? box.min[k] - margin : box.max[k] + margin;
            const auto outside = [&](const Point& p) { return side * (p[k] - plane); };
            next.clear();
            for (std::size_t i = 0; i < polygon.size(); ++i) {
                const Point &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
                const long double a = outside(p), b = outside(q);
                if (a <= 0) next.push_back(p);
                if ((a < 0 && b > 0) || (a > 0 && b < 0)) {
                    next.push_back(p + (q - p) * (a / (a - b)));
                    next.back()[k] = plane;
                }
            }
            polygon = next;
        }
    return !polygon.empty();
}

template <class Bvh, class T>
std::vector<std::uint32_t> overlaps_of(const Bvh& bvh, const Bounds3<T>& box) {
    std::vector<std::uint32_t> found;
    for_each_overlap(bvh, box, [&](std::uint32_t primitive) { found.push_back(primitive); });
    return found;
}

} // namespace

TEST_CASE_TEMPLATE("Overlaps equal cutting every triangle, for boxes of all shapes, huge and tiny", T, float, double) {
    std::size_t reported = 0, lost = 0, extra = 0, twice = 0, different = 0;
    std::size_t unsure = 0, unsure_aimed = 0; // reported, though by a rounding the box lies beside it
    for (lambent_test::Mesh<T> mesh :
         {sphere<T>(12, 8, 0.3, 1), cube<T>(4), soup<T>(160, 0.5, 2), slivers<T>(160, 3), degenerate<T>(160, 4)})
        for (const T scale : {T(1), T(0x1p50), T(0x1p-50)}) {
            for (Vec3<T>& v : mesh.vertices) v *= scale;
            const auto bvh = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
            Random random(8);
            for (std::size_t i = 0; i < 1250; ++i) {
                const bool aimed = i % 9 == 0 || i % 11 == 0 || i % 13 == 0;
                const Vec3<T> center = random.in_box<T>(-1.1, 1.1);
                const double size = i % 2 ? 0.5 : 0.05;
                Vec3<T> half(T(random.uniform(0, size)), T(random.uniform(0, size)), T(random.uniform(0, size)));
                if (i % 5 == 0) half[int(i % 3)] = 0; // flat
                if (i % 7 == 0) half = Vec3<T>(0);    // a point
                Bounds3<T> box{(center - half) * scale, (center + half) * scale};
                if (i % 9 == 0) { // with planes and corners through the grid's
                    for (int k = 0; k < 3; ++k) {
                        box.min[k] = std::round(box.min[k] / scale * 2) / 2 * scale;
                        box.max[k] = std::max(box.min[k], std::round(box.max[k] / scale * 2) / 2 * scale);
                    }
                }
                if (i % 11 == 0) { // at a vertex
                    const Vec3<T> v = mesh.vertices[random.index(mesh.vertices.size())];
                    if (is_finite(v)) box = {v, v + half * scale};
                }
                if (i % 13 == 0) { // a corner on a triangle or its edge, but for rounding
                    const Corners<T> c = mesh.triangle(random.index(mesh.faces.size()));
                    const T u = T(random.uniform()), v = i % 2 ? (1 - u) * T(random.uniform()) : 1 - u;
                    const Vec3<T> p = c[0] * (1 - u - v) + c[1] * u + c[2] * v;
                    if (is_finite(p)) box = {p, p};
                    for (int k = 0; k < 3 && is_finite(p); ++k) {
                        if (random.index(2)) box.max[k] += half[k] * scale;
                        else box.min[k] -= half[k] * scale;
                    }
                }
                std::vector<int> times(mesh.faces.size());
                for (const std::uint32_t p : overlaps_of(bvh, box)) ++times[p];
                bool any = false;
                const long double margin = 32 * static_cast<long double>(std::numeric_limits<T>::epsilon() * scale);
                for (std::size_t k = 0; k < times.size(); ++k) {
                    any |= times[k] > 0;
                    reported += std::size_t(times[k]);
                    twice += std::size_t(times[k] > 1);
                    if (!in_tree(mesh.triangle(k))) {
                        extra += std::size_t(times[k]);
                        continue;
                    }
                    const bool exact = cut_leaves_some(mesh.triangle(k), box, 0);
                    lost += std::size_t(exact && times[k] == 0);
                    if (times[k] > 0 && !exact) {
                        ++(aimed ? unsure_aimed : unsure);
                        extra += std::size_t(!cut_leaves_some(mesh.triangle(k), box, margin));
                    }
                }
                different += std::size_t(any != overlaps(bvh, box));
            }
            for (Vec3<T>& v : mesh.vertices) v /= scale;
        }
    CHECK(reported > 25000);
    CHECK(lost == 0);
    CHECK(extra == 0);
    CHECK(twice == 0);
    CHECK(different == 0);
    CHECK(unsure == 0);
    CHECK(unsure_aimed < reported / 50);
}

TEST_CASE_TEMPLATE("Touching counts; boxes that are none meet nothing, those with infinite sides do", T, float, double) {
    constexpr T inf = std::numeric_limits<T>::infinity(), nan = std::numeric_limits<T>::quiet_NaN();
    const std::vector<Vec3<T>> vertices = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 0, 5}, {2, 0, 5}, {0, 2, 5}};
    const std::vector<UVec3> faces = {{0, 1, 2}, {3, 4, 5}};
    const auto bvh = BasicBvh<T>::build(triangles(vertices, faces));
    const auto count = [&](Vec3<T> low, Vec3<T> high) {
        const std::size_t n = overlaps_of(bvh, Bounds3<T>{low, high}).size();
        CHECK(overlaps(bvh, Bounds3<T>{low, high}) == (n > 0));
        return n;
    };
    CHECK(count({T(0.5), T(0.5), -1}, {1, 1, 1}) == 1);
    CHECK(count({T(0.5), T(0.5), 0}, {1, 1, 1}) == 1);            // on its lower side
    CHECK(count({T(0.5), T(0.5), -1}, {1, 1, 0}) == 1);           // on its upper side
    CHECK(count({2, -1, -1}, {3, 1, 1}) == 1);                    // a vertex on a face
    CHECK(count({1, 1, 0}, {2, 2, 1}) == 1);                      // the hypotenuse at an edge of the box
    CHECK(count({T(1.25), T(1.25), -1}, {2, 2, 1}) == 0);         // in its box, but beside it
    CHECK(count({next_up(T(2)), -1, -1}, {3, 1, 1}) == 0);
    CHECK(count({T(0.5), T(0.5), next_up(T(0))}, {1, 1, 1}) == 0);
    CHECK(count({T(0.5), T(0.5), 0}, {T(0.5), T(0.5), 0}) == 1);  // a point within
    CHECK(count({0, 0, 0}, {0, 0, 0}) == 1);
    CHECK(count({T(0.1), T(0.1), T(-0.1)}, {T(0.2), T(0.2), T(0.1)}) == 1); // no vertex or edge in the box
    CHECK(count({-inf, -inf, -inf}, {inf, inf, inf}) == 2);
    CHECK(count({-inf, -inf, 4}, {inf, inf, inf}) == 1);
    CHECK(count({T(1.5), T(1.5), -inf}, {inf, inf, inf}) == 0);
    CHECK(count({1, 0, -1}, {0, 2, 1}) == 0); // inside out
    CHECK(overlaps_of(bvh, Bounds3<T>{}).empty());
    for (int k = 0; k < 6; ++k) {
        Bounds3<T> box{{-9, -9, -9}, {9, 9, 9}};
        CHECK(overlaps(bvh, box));
        (k < 3 ? box.min[k] : box.max[k - 3]) = nan;
        CHECK_FALSE(overlaps(bvh, box));
    }
    CHECK_FALSE(overlaps(BasicBvh<T>(), Bounds3<T>{{-inf, -inf, -inf}, {inf, inf, inf}}));
}

TEST_CASE("False stops; triangles in several leaves are reported once") {
    const lambent_test::Mesh<float> mesh = soup<float>(100, 0.3, 2);
    const Bvh bvh = Bvh::build(triangles(mesh.vertices, mesh.faces));
    const Bounds3<float> all{{-2, -2, -2}, {2, 2, 2}};
    int calls = 0;
    for_each_overlap(bvh, all, [&](std::uint32_t) { return ++calls < 7; });
    CHECK(calls == 7);
    CHECK(overlaps_of(bvh, all).size() == 100);
    CHECK(overlaps_of(doubled_bvh(mesh), all).size() == 100);
}
