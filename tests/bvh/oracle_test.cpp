#include "support/brute_force.hpp"
#include "support/meshes.hpp"
#include "support/random.hpp"
#include "support/rays.hpp"
#include <cmath>
#include <doctest/doctest.h>
#include <lambent/bvh/bvh.hpp>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

/// Does what the tree says about `ray` agree with double precision wherever that is sure of itself?
template <class T>
bool plausible(const lambent_test::Mesh<T>& mesh, std::span<const Corners<T>> all, const Ray<T>& ray, const Hit<T>& hit) {
    const double tolerance = 2e-3;
    if (hit) {
        const Corners<T> p = mesh.triangle(hit.primitive);
        const DoubleTest d = moller_trumbore(p, ray);
        if (d.plane && d.sharpness > 0.05) {
            const double size = double(length(ray.direction)) * (1 + std::abs(d.t));
            if (std::abs(d.t - double(hit.t)) > tolerance * (1 + std::abs(d.t)) * (1 + 1 / size)) return false;
        }
    }
    const double nearest = hit ? double(hit.t) : double(ray.t_max);
    for (const Corners<T>& p : all) {
        const DoubleTest d = moller_trumbore(p, ray);
        const double margin = 0.02;
        if (d.plane && d.sharpness > 0.05 && d.u > margin && d.v > margin && d.u + d.v < 1 - margin &&
            d.t > double(ray.t_min) + tolerance * (1 + std::abs(d.t)) && d.t < nearest - tolerance * (1 + std::abs(d.t)))
            return false;
    }
    return true;
}

} // namespace

TEST_CASE_TEMPLATE("G2: nearest hits equal brute force, to the bit in t, on 1e6 rays of all kinds", T, float, double) {
    std::size_t rays = 0, hits = 0, different = 0, implausible = 0;
    for (const lambent_test::Mesh<T>& mesh : small_meshes<T>()) {
        const std::vector<Corners<T>> all = corners(mesh);
        const auto bvh = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
        Random random(7);
        const std::size_t count = mesh.faces.size() < 10 ? 400000 : 125000;
        for (std::size_t i = 0; i < count; ++i) {
            const Ray<T> ray = hard_ray(mesh, i, random);
            const Hit<T> hit = bvh.intersect(ray);
            const T expected = is_black(ray.direction) ? std::numeric_limits<T>::infinity()
                                                       : brute_force<T>(all, ray);
            ++rays;
            hits += std::size_t(bool(hit));
            if (hit.t != expected || bool(hit) != is_finite(expected)) {
                if (different++ == 0) {
                    INFO(mesh.name, " ray ", i, ": t ", double(hit.t), ", brute force ", double(expected));
                    CHECK(hit.t == expected);
                }
            }
            if (i % 8 == 0 && !plausible<T>(mesh, all, ray, hit)) ++implausible;
        }
    }
    CHECK(rays >= 1000000);
    CHECK(hits > rays / 5);
    CHECK(different == 0);
    CHECK(implausible == 0);
}

TEST_CASE_TEMPLATE("G4: occluded equals closest hit before t_max on 1e6 segments", T, float, double) {
    std::size_t segments = 0, different = 0, blocked = 0;
    for (const lambent_test::Mesh<T>& mesh : {sphere<T>(60, 40, 0.3, 1), cube<T>(20), soup<T>(5000, 0.05, 2), slivers<T>(500, 3),
                                degenerate<T>(2000, 4)}) {
        const auto bvh = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
        Random random(11);
        for (std::size_t i = 0; i < 200000; ++i) {
            Ray<T> ray = hard_ray(mesh, i, random);
            if (i % 2 == 0) { // between two points
                const Vec3<T> to = random.in_box<T>(-1, 1);
                ray.direction = to - ray.origin;
                ray.t_min = 0;
                ray.t_max = 1;
            }
            const Hit<T> hit = bvh.intersect(ray);
            const bool occluded = bvh.occluded(ray);
            ++segments;
            blocked += std::size_t(occluded);
            different += std::size_t(occluded != bool(hit));
            if (hit) { // the range is half-open, at both ends to the bit
                Ray<T> edge = ray;
                edge.t_max = hit.t;
                different += std::size_t(bvh.occluded(edge) || bvh.intersect(edge));
                edge.t_max = next_up(hit.t);
                different += std::size_t(!bvh.occluded(edge) || bvh.intersect(edge).t != hit.t);
                edge.t_min = hit.t;
                different += std::size_t(!bvh.occluded(edge) || bvh.intersect(edge).t != hit.t);
                edge.t_max = ray.t_max;
                edge.t_min = next_up(hit.t);
                different += std::size_t(bvh.intersect(edge).t == hit.t);
            }
        }
    }
    CHECK(segments >= 1000000);
    CHECK(blocked > segments / 5);
    CHECK(blocked < segments);
    CHECK(different == 0);
}

TEST_CASE_TEMPLATE("A filter makes holes: nearest and any hit equal brute force without the refused", T, float,
                   double) {
    const lambent_test::Mesh<T> mesh = soup<T>(300, 0.4, 2);
    const auto bvh = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
    const auto accept = [](std::uint32_t primitive, T u, T v, T t) {
        return primitive % 3 != 0 && u >= 0 && v >= 0 && u + v <= T(1.0001) && t >= 0;
    };
    std::vector<Corners<T>> rest;
    for (std::size_t i = 0; i < mesh.faces.size(); ++i)
        if (i % 3 != 0) rest.push_back(mesh.triangle(i));
    Random random(3);
    std::size_t different = 0;
    for (std::size_t i = 0; i < 50000; ++i) {
        Ray<T> ray = hard_ray(mesh, i, random);
        ray.t_min = 0;
        if (is_black(ray.direction)) continue;
        const T expected = brute_force<T>(rest, ray);
        different += std::size_t(bvh.intersect(ray, accept).t != expected);
        different += std::size_t(bvh.occluded(ray, accept) != is_finite(expected));
    }
    CHECK(different == 0);
}

TEST_CASE_TEMPLATE("u and v are the weights of vertices 1 and 2", T, float, double) {
    const lambent_test::Mesh<T> mesh = sphere<T>(20, 20, 0.3, 9);
    const auto bvh = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
    Random random(4);
    double worst = 0;
    for (int i = 0; i < 20000; ++i) {
        const Ray<T> ray{random.in_box<T>(-0.5, 0.5), random.in_box<T>(-1, 1)};
        const Hit<T> hit = bvh.intersect(ray);
        REQUIRE(hit);
        const Corners<T> p = mesh.triangle(hit.primitive);
        const Vec3<T> a = p[0] * (1 - hit.u - hit.v) + p[1] * hit.u + p[2] * hit.v;
        worst = std::max(worst, double(length(a - (ray.origin + hit.t * ray.direction))));
        CHECK(dot(geometric_normal(triangles(mesh.vertices, mesh.faces), hit.primitive), ray.direction) != 0);
    }
    CHECK(worst < 64 * double(std::numeric_limits<T>::epsilon()));
}

TEST_CASE_TEMPLATE("729 boxes and rays: every sign pattern from planes, edges and corners", T, float, double) {
    // All directions with components of {-1, 0, 1} or -0, from all origins on the planes of a cube, its middle and
    // outside, against brute force over the cube.
    lambent_test::Mesh<T> mesh = cube<T>(1);
    for (Vec3<T>& v : mesh.vertices) v += Vec3<T>(1, -2, 0); // planes through the origin too
    const std::vector<Corners<T>> all = corners(mesh);
    const auto bvh = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
    const T sides[] = {-1, 0, 1}, signs[] = {-1, 0, 1};
    std::size_t cases = 0, different = 0;
    for (const T x : sides)
        for (const T y : sides)
            for (const T z : sides)
                for (const T dx : signs)
                    for (const T dy : signs)
                        for (const T dz : signs)
                            for (const T zero : {T(0), -T(0)}) {
                                const auto signed_zero = [&](T d) { return d == 0 ? zero : d; };
                                for (const T out : {T(1), T(3)}) {
                                    const Ray<T> ray{Vec3<T>(1, -2, 0) + Vec3<T>(x, y, z) * out,
                                                     {signed_zero(dx), signed_zero(dy), signed_zero(dz)},
                                                     out == 1 ? T(0) : -T(10)};
                                    ++cases;
                                    const T expected = is_black(ray.direction)
                                                           ? std::numeric_limits<T>::infinity()
                                                           : brute_force<T>(all, ray);
                                    different += std::size_t(bvh.intersect(ray).t != expected);
                                    different += std::size_t(bvh.occluded(ray) != is_finite(expected));
                                }
                            }
    CHECK(cases == 4 * 729);
    CHECK(different == 0);
}
