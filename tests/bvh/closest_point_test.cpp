#include "support/brute_force.hpp"
#include "support/doubled.hpp"
#include "support/meshes.hpp"
#include "support/random.hpp"
#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>
#include <lambent/bvh/closest_point.hpp>
#include <limits>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

using Long = glm::vec<3, long double>;

long double along(const Long& a, const Long& b) { return dot(a, b); }

/// Distance from the origin to a segment.
long double to_segment(const Long& a, const Long& b) {
    const Long e = b - a;
    const long double square = along(e, e);
    const long double t = square > 0 ? std::clamp(-along(a, e) / square, 0.0L, 1.0L) : 0.0L;
    return length(a + t * e);
}

/// In long double: the nearest of the points closest on the edges, and of the foot of the perpendicular where that
/// lies within. Of a triangle too thin even for long double the edges are as good as any point.
template <class T>
long double to_triangle(const Corners<T>& corners, const Vec3<T>& p) {
    const Long a = Long(corners[0]) - Long(p), b = Long(corners[1]) - Long(p), c = Long(corners[2]) - Long(p);
    const long double edges = std::min({to_segment(a, b), to_segment(b, c), to_segment(c, a)});
    const Long n = cross(b - a, c - a);
    const long double wa = along(n, cross(b, c - b)), wb = along(n, cross(c, a - c)), wc = along(n, cross(a, b - a));
    if (!(wa >= 0 && wb >= 0 && wc >= 0 && wa + wb + wc > 0)) return edges;
    return std::min(edges, length(wa * a + wb * b + wc * c) / (wa + wb + wc));
}

/// A bound on the error of what the tree says about this distance.
template <class T>
long double tolerance(const Corners<T>& corners, const Vec3<T>& p) {
    long double farthest = 0;
    for (const Vec3<T>& v : corners) farthest = std::max(farthest, length(Long(v) - Long(p)));
    return 8 * std::numeric_limits<T>::epsilon() * farthest;
}

template <class T>
Vec3<T> query_point(const lambent_test::Mesh<T>& mesh, std::size_t i, Random& random, T scale) {
    const UVec3 face = mesh.faces[random.index(mesh.faces.size())];
    const Vec3<T> a = mesh.vertices[face.x], b = mesh.vertices[face.y], c = mesh.vertices[face.z];
    const bool finite = is_finite(a) && is_finite(b) && is_finite(c);
    switch (finite ? i % 6 : 0) {
    case 1: return a;
    case 2: return (a + b) / T(2);
    case 3: return (a + b + c) / T(3);
    case 4: return a + random.in_box<T>(-0.01, 0.01) * scale;
    case 5: return random.in_box<T>(-20, 20) * scale;
    default: return random.in_box<T>(-1.5, 1.5) * scale;
    }
}

/// What the tree says about the point of one triangle, against long double.
template <class T>
bool sound(const lambent_test::Mesh<T>& mesh, const Vec3<T>& p, const ClosestPoint<T>& found) {
    const Corners<T> c = mesh.triangle(found.primitive);
    const long double room = tolerance(c, p), exact = to_triangle(c, p);
    const Long mean = Long(c[0]) * (1.0L - found.u - found.v) + Long(c[1]) * static_cast<long double>(found.u) +
                      Long(c[2]) * static_cast<long double>(found.v);
    long double largest = 0;
    for (const Vec3<T>& v : c) largest = std::max(largest, length(Long(v)));
    return found.u >= 0 && found.v >= 0 && found.u + found.v <= 1 + 4 * std::numeric_limits<T>::epsilon() &&
           std::abs(exact - found.distance) <= room &&
           std::abs(length(mean - Long(p)) - found.distance) <= room &&
           length(mean - Long(found.point)) <= 8 * std::numeric_limits<T>::epsilon() * largest;
}

} // namespace

TEST_CASE_TEMPLATE("Closest points equal brute force in long double: near, far, on the surface, huge and tiny", T, float,
                   double) {
    std::size_t wrong = 0, unsound = 0, none = 0, missed = 0, extra = 0, reported = 0;
    for (lambent_test::Mesh<T> mesh : small_meshes<T>())
        for (const T scale : {T(1), T(0x1p40), T(0x1p-40)}) {
            for (Vec3<T>& v : mesh.vertices) v *= scale;
            CAPTURE(mesh.name);
            const auto bvh = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
            Random random(6);
            for (std::size_t i = 0; i < 1000; ++i) {
                const Vec3<T> p = query_point(mesh, i, random, scale);
                std::vector<long double> distances(mesh.faces.size(), std::numeric_limits<long double>::infinity());
                long double nearest = std::numeric_limits<long double>::infinity(), room = 0;
                for (std::size_t k = 0; k < mesh.faces.size(); ++k) {
                    if (!in_tree(mesh.triangle(k))) continue;
                    distances[k] = to_triangle(mesh.triangle(k), p);
                    if (distances[k] < nearest) {
                        nearest = distances[k];
                        room = tolerance(mesh.triangle(k), p);
                    }
                }
                const ClosestPoint<T> found = closest_point(bvh, p);
                none += std::size_t(!found);
                if (!found) continue;
                wrong += std::size_t(std::abs(nearest - found.distance) > room + tolerance(mesh.triangle(found.primitive), p));
                unsound += std::size_t(!sound(mesh, p, found));
                none += std::size_t(!closest_point(bvh, p, found.distance)); // the limit is inclusive
                wrong += std::size_t(found.distance > 0 && bool(closest_point(bvh, p, found.distance * T(0.999))));

                const T radius = scale * T(random.uniform(0, 0.5));
                std::vector<int> times(mesh.faces.size());
                for_each_within(bvh, p, radius, [&](const ClosestPoint<T>& c) {
                    ++times[c.primitive];
                    unsound += std::size_t(!sound(mesh, p, c) || c.distance > radius * (1 + std::numeric_limits<T>::epsilon()));
                });
                for (std::size_t k = 0; k < times.size(); ++k) {
                    reported += std::size_t(times[k]);
                    extra += std::size_t(times[k] > 1);
                    if (distances[k] == std::numeric_limits<long double>::infinity()) continue;
                    const long double margin = tolerance(mesh.triangle(k), p);
                    missed += std::size_t(times[k] == 0 && distances[k] < radius - margin);
                    extra += std::size_t(times[k] > 0 && distances[k] > radius + margin);
                }
            }
            for (Vec3<T>& v : mesh.vertices) v /= scale;
        }
    CHECK(none == 0);
    CHECK(wrong == 0);
    CHECK(unsound == 0);
    CHECK(reported > 40000);
    CHECK(missed == 0);
    CHECK(extra == 0);
}

TEST_CASE_TEMPLATE("Closest points whose answer is known", T, float, double) {
    const std::vector<Vec3<T>> vertices = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {10, 0, 0}, {12, 0, 0}, {11, 0, 0}};
    const std::vector<UVec3> faces = {{0, 1, 2}, {3, 4, 5}}; // the second has no area
    const auto bvh = BasicBvh<T>::build(triangles(vertices, faces));
    REQUIRE(bvh.dropped() == 0);
    const auto check = [&](Vec3<T> p, Vec3<T> point, T distance, std::uint32_t primitive) {
        const ClosestPoint<T> found = closest_point(bvh, p);
        CHECK(found.primitive == primitive);
        CHECK(found.point == point);
        CHECK(found.distance == distance);
        const Corners<T> c = triangles(vertices, faces).vertices(primitive);
        CHECK(c[0] * (1 - found.u - found.v) + c[1] * found.u + c[2] * found.v == point);
    };
    check({1, 1, 3}, {1, 1, 0}, 3, 0);
    check({1, 1, -3}, {1, 1, 0}, 3, 0);
    check({1, 1, 0}, {1, 1, 0}, 0, 0);
    check({-3, -4, 0}, {0, 0, 0}, 5, 0);
    check({4, 0, 7}, {4, 0, 0}, 7, 0);
    check({0, 7, 4}, {0, 4, 0}, 5, 0);
    check({2, -3, 4}, {2, 0, 0}, 5, 0);
    check({-3, 2, 4}, {0, 2, 0}, 5, 0);
    check({5, 5, 0}, {2, 2, 0}, std::sqrt(T(18)), 0);
    check({13, 0, 0}, {12, 0, 0}, 1, 1);
    check({T(11.5), 2, 0}, {T(11.5), 0, 0}, 2, 1);
    check({9, 0, 0}, {10, 0, 0}, 1, 1);
}

TEST_CASE_TEMPLATE("Points and distances that are none find nothing; triangles in several leaves are reported once", T,
                   float, double) {
    constexpr T inf = std::numeric_limits<T>::infinity(), nan = std::numeric_limits<T>::quiet_NaN();
    const lambent_test::Mesh<T> mesh = soup<T>(100, 0.3, 2);
    const auto bvh = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
    std::size_t calls = 0;
    const auto count = [&](const ClosestPoint<T>&) { ++calls; };
    for (const T bad : {inf, -inf, nan})
        for (int k = 0; k < 3; ++k) {
            Vec3<T> p(0);
            p[k] = bad;
            CHECK_FALSE(closest_point(bvh, p));
            for_each_within(bvh, p, inf, count);
        }
    for (const T bad : {T(-1), -inf, nan}) {
        CHECK_FALSE(closest_point(bvh, Vec3<T>(0), bad));
        for_each_within(bvh, Vec3<T>(0), bad, count);
    }
    CHECK_FALSE(closest_point(BasicBvh<T>(), Vec3<T>(0)));
    for_each_within(BasicBvh<T>(), Vec3<T>(0), inf, count);
    CHECK(calls == 0);
    CHECK(closest_point(bvh, Vec3<T>(T(1e15), 0, 0)));
    for_each_within(bvh, Vec3<T>(0), inf, count);
    CHECK(calls == 100);
    calls = 0;
    for_each_within(bvh, Vec3<T>(0), inf, [&](const ClosestPoint<T>&) { return ++calls < 7; });
    CHECK(calls == 7);
    calls = 0;
    for_each_within(doubled_bvh(mesh), Vec3<T>(0), inf, count);
    CHECK(calls == 100);
}
