// Also compiled alone with other flags, see tests/CMakeLists.txt.
#include "support/aimed_rays.hpp"
#include "support/random.hpp"
#include <doctest/doctest.h>
#include <lambent/bvh/bvh.hpp>
#include <limits>

using namespace lambent;
using namespace lambent_test;

namespace {

struct Misses {
    std::size_t rays = 0, closest = 0, any = 0;
};

template <class T>
void shoot(const lambent_test::Mesh<T>& unit, double offset, double scale, std::size_t count, std::uint64_t seed, Misses& misses) {
    const Placed<T> placed(unit, offset, scale);
    const auto bvh = BasicBvh<T>::build(triangles(placed.mesh.vertices, placed.mesh.faces));
    Random random(seed);
    for (std::size_t i = 0; i < count; ++i) {
        const Ray<T> ray = aimed_ray(placed, i, random);
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
    const std::size_t faces = sphere<T>(40, 20, 0.5, 3).faces.size();
    const lambent_test::Mesh<T> mesh = with_needles(sphere<T>(40, 20, 0.5, 3), 5);
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
