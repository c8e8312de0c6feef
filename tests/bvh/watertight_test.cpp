// Also compiled alone with other flags, see tests/CMakeLists.txt.
#include "support/meshes.hpp"
#include <cmath>
#include <doctest/doctest.h>
#include <lambent/bvh/bvh.hpp>
#include <limits>

using namespace lambent;
using namespace lambent_test;

namespace {

struct Misses {
    std::size_t rays = 0, closest = 0, any = 0;
};

/// Rays from inside a closed mesh, aimed at vertices, edges and anywhere. All of them have to hit.
template <class T>
void shoot(const lambent_test::Mesh<T>& unit, double offset, double scale, std::size_t count, std::uint64_t seed, Misses& misses) {
    lambent_test::Mesh<T> mesh = unit;
    const auto place = [&](const Vec3<double>& p) { // once and for all rounded to T
        return Vec3<T>((p + Vec3<double>(offset, offset / 3, -offset / 7)) * scale);
    };
    for (Vec3<T>& v : mesh.vertices) v = place(Vec3<double>(v));
    const auto bvh = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
    Random random(seed);
    for (std::size_t i = 0; i < count; ++i) {
        const UVec3 face = mesh.faces[random.index(mesh.faces.size())];
        const int k = int(random.index(3));
        const Vec3<T> a = mesh.vertices[face[k]], b = mesh.vertices[face[(k + 1) % 3]];
        Ray<T> ray;
        ray.origin = place(random.in_box<double>(-0.4, 0.4));
        switch (i % 4) {
        case 0: ray.direction = a - ray.origin; break;
        case 1: ray.direction = (a + (b - a) * T(random.uniform())) - ray.origin; break;
        case 2: { // the same, of unit length: rounded once more
            const Vec3<double> d = Vec3<double>(a) + Vec3<double>(b - a) * random.uniform() - Vec3<double>(ray.origin);
            ray.direction = Vec3<T>(normalize(d / scale));
            break;
        }
        default: { // from straight below the vertex, along an axis
            const int axis = int(random.index(3));
            const Vec3<T> center = place({0, 0, 0});
            ray.direction = Vec3<T>(0);
            ray.direction[axis] = a[axis] < center[axis] ? T(-1) : T(1);
            ray.origin = a;
            ray.origin[axis] = center[axis];
            Vec3<double> from(ray.origin - center);
            if (length(from) > 0.7 * scale) ray.origin = center; // might lie outside of a rough mesh
        }
        }
        if (is_black(ray.direction)) continue;
        ++misses.rays;
        misses.closest += std::size_t(!bvh.intersect(ray));
        misses.any += std::size_t(!bvh.occluded(ray));
    }
}

} // namespace

TEST_CASE_TEMPLATE("Watertight: no ray at edges and vertices of closed meshes gets out, far away, huge and tiny", T, float,
                   double) {
    Misses misses;
    const lambent_test::Mesh<T> shapes[] = {sphere<T>(80, 40, 0.5, 1), sphere<T>(7, 5, 0, 2), cube<T>(16)};
    std::uint64_t seed = 1;
    for (const lambent_test::Mesh<T>& shape : shapes) {
        for (const double offset : {0.0, 1.0, 1e3, 1e5}) shoot(shape, 2 * offset, 1, 130000, ++seed, misses);
        for (const double scale : {0x1p-50, 0x1p50}) {
            shoot(shape, 0, scale, 130000, ++seed, misses);
            shoot(shape, 2, scale, 40000, ++seed, misses);
        }
    }
    CHECK(misses.rays >= 2000000);
    CHECK(misses.closest == 0);
    CHECK(misses.any == 0);
}

TEST_CASE_TEMPLATE("Watertight: triangles without area that are left out open no crack", T, float, double) {
    // Every face's first edge gets a vertex on it (exactly or rounded), joined to both by a needle.
    lambent_test::Mesh<T> mesh = sphere<T>(40, 20, 0.5, 3);
    const std::size_t faces = mesh.faces.size();
    Random random(5);
    for (std::size_t i = 0; i < faces; ++i) {
        const UVec3 f = mesh.faces[i];
        const Vec3<T> a = mesh.vertices[f.x], b = mesh.vertices[f.y];
        const auto middle = std::uint32_t(mesh.vertices.size());
        mesh.vertices.push_back(i % 2 == 0 ? (a + b) * T(0.5) : a + (b - a) * T(random.uniform()));
        if (i % 5 == 0) mesh.vertices.back() = a;
        mesh.faces[i] = {f.x, middle, f.z};
        mesh.faces.push_back({middle, f.y, f.z});
        mesh.faces.push_back({f.x, f.y, middle});
    }
    mesh.faces.push_back({0, 0, 0});
    Misses misses;
    shoot(mesh, 0, 1, 200000, 21, misses);
    shoot(mesh, 10, 1, 200000, 22, misses);
    CHECK(misses.closest == 0);
    CHECK(misses.any == 0);
    CHECK(BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces)).dropped() > faces / 5);
}

TEST_CASE_TEMPLATE("Rays that are no rays hit nothing", T, float, double) {
    const lambent_test::Mesh<T> mesh = sphere<T>(20, 10, 0, 1);
    const auto bvh = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
    constexpr T inf = std::numeric_limits<T>::infinity(), nan = std::numeric_limits<T>::quiet_NaN();
    const Ray<T> good{{T(0.1), T(0.2), T(0.3)}, {T(0.5), T(-0.6), T(0.7)}};
    CHECK(bvh.occluded(good));
    for (const T bad : {nan, -nan, inf, -inf})
        for (int field = 0; field < 6; ++field) {
            Ray<T> ray = good;
            (field < 3 ? ray.origin[field] : ray.direction[field - 3]) = bad;
            CHECK_FALSE(bvh.intersect(ray));
            CHECK_FALSE(bvh.occluded(ray));
        }
    for (const bool low : {false, true}) {
        Ray<T> ray = good;
        (low ? ray.t_min : ray.t_max) = nan;
        CHECK_FALSE(bvh.intersect(ray));
        CHECK_FALSE(bvh.occluded(ray));
    }
    for (const T zero : {T(0), -T(0)}) CHECK_FALSE(bvh.intersect(Ray<T>{{0, 0, 0}, {zero, zero, zero}}));
    CHECK_FALSE(bvh.intersect(Ray<T>{{0, 0, 0}, {1, 0, 0}, 5, 1})); // an empty range
    CHECK_FALSE(bvh.occluded(Ray<T>{{0, 0, 0}, {1, 0, 0}, inf, inf}));
    CHECK(bvh.occluded(Ray<T>{{0, 0, 0}, {1, 0, 0}, -inf, 0})); // behind the origin
    CHECK(bvh.occluded(Ray<T>{{T(1e6), 0, 0}, {T(-1e-20), 0, 0}}));
    CHECK(bvh.occluded(Ray<T>{{0, 0, 0}, {T(1e30), T(1e-30), 0}}));
}
