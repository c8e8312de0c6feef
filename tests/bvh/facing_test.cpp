#include "support/brute_force.hpp"
#include "support/meshes.hpp"
#include "support/random.hpp"
#include "support/rays.hpp"
#include <doctest/doctest.h>
#include <lambent/bvh/facing.hpp>
#include <lambent/bvh/for_each_hit.hpp>
#include <limits>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

constexpr auto alpha = [](std::uint32_t primitive, auto, auto, auto) { return primitive % 3 != 0; };

/// From in front of the triangle? In double, by its normal; nullopt where that can't tell.
template <class T>
int side_of(const Corners<T>& p, const Ray<T>& ray) {
    const Vec3<double> a(p[0]), n = cross(Vec3<double>(p[1]) - a, Vec3<double>(p[2]) - a), d(ray.direction);
    const double cosine = dot(n, d) / (length(n) * length(d));
    return cosine < -1e-3 ? 1 : cosine > 1e-3 ? -1 : 0;
}

template <class T>
T nearest_on_side(const lambent_test::Mesh<T>& mesh, const Ray<T>& ray, int side, bool masked) {
    const ScalarTest<T> test(ray);
    T nearest = ray.t_max;
    bool any = false;
    for (std::uint32_t i = 0; i < mesh.faces.size(); ++i) {
        T t;
        if (masked && i % 3 == 0) continue;
        if (side_of(mesh.triangle(i), ray) == side && test(mesh.triangle(i), nearest, t)) {
            nearest = t;
            any = true;
        }
    }
    return any ? nearest : std::numeric_limits<T>::infinity();
}

} // namespace

TEST_CASE_TEMPLATE("One side alone: equal to brute force by normals, from all directions, with a filter, and mirrored",
                   T, float, double) {
    std::size_t unsure = 0, rays = 0, different = 0, hits = 0;
    for (const lambent_test::Mesh<T>& mesh : {sphere<T>(12, 8, 0.3, 1), soup<T>(150, 0.5, 2)}) {
        const auto bvh = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
        lambent_test::Mesh<T> mirrored = mesh; // its fronts are the other sides
        for (Vec3<T>& v : mirrored.vertices) v.x = -v.x;
        const auto mirror = BasicBvh<T>::build(triangles(mirrored.vertices, mirrored.faces));
        Random random(3);
        for (std::size_t i = 0; i < 10000; ++i) {
            Ray<T> ray{random.in_box<T>(-1.5, 1.5), random.in_box<T>(-1, 1)};
            if (i % 3 == 0) ray.t_max = T(1.5);
            if (i % 5 == 0) ray.t_min = T(-1);
            if (i % 7 == 0) ray.direction[int(i % 3)] = 0;
            bool sure = true;
            for (std::size_t k = 0; k < mesh.faces.size(); ++k) sure &= side_of(mesh.triangle(k), ray) != 0;
            if (!sure) { // edge-on somewhere
                ++unsure;
                continue;
            }
            ++rays;
            const auto check = [&](const auto& accept, int side, bool masked) {
                const T expected = nearest_on_side(mesh, ray, side, masked);
                hits += std::size_t(is_finite(expected));
                different += std::size_t(bvh.intersect(ray, accept).t != expected);
                different += std::size_t(bvh.occluded(ray, accept) != is_finite(expected));
            };
            check(front_faces_only, 1, false);
            check(back_faces_only, -1, false);
            check(CullBackFaces{alpha}, 1, true);
            check(CullFrontFaces{alpha}, -1, true);
            Ray<T> other = ray;
            other.origin.x = -other.origin.x;
            other.direction.x = -other.direction.x;
            different += std::size_t(mirror.intersect(other, front_faces_only).t != bvh.intersect(ray, back_faces_only).t);
            different += std::size_t(mirror.intersect(other, back_faces_only).t != bvh.intersect(ray, front_faces_only).t);
        }
    }
    CHECK(rays > 5 * unsure);
    CHECK(hits > rays / 2);
    CHECK(different == 0);
}

TEST_CASE_TEMPLATE("Every hit is on one of the two sides, edge cases too", T, float, double) {
    std::size_t wrong = 0, hits = 0;
    for (const lambent_test::Mesh<T>& mesh : {cube<T>(4), slivers<T>(160, 3), degenerate<T>(160, 4)}) {
        const auto bvh = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
        Random random(5);
        for (std::size_t i = 0; i < 20000; ++i) {
            const Ray<T> ray = hard_ray(mesh, i, random);
            std::vector<int> times(mesh.faces.size());
            const auto count = [&](const Hit<T>& hit) { ++times[hit.primitive]; };
            for_each_hit(bvh, ray, front_faces_only, count);
            for_each_hit(bvh, ray, back_faces_only, count);
            for_each_hit(bvh, ray, [&](const Hit<T>& hit) {
                --times[hit.primitive];
                ++hits;
            });
            for (const int n : times) wrong += std::size_t(n != 0);
        }
    }
    CHECK(hits > 50000);
    CHECK(wrong == 0);
}

namespace {

struct MyRay { // someone else's
    double from[3], to[3];
    std::uint32_t mask;
};

} // namespace

TEST_CASE("Rays of one's own type and masks by primitive, with a projection and a filter") {
    const lambent_test::Mesh<float> mesh = soup<float>(300, 0.5, 2);
    const Bvh bvh = Bvh::build(triangles(mesh.vertices, mesh.faces));
    const auto segment = [](const MyRay& r) {
        const Vec3f from(r.from[0], r.from[1], r.from[2]), to(r.to[0], r.to[1], r.to[2]);
        return Rayf{from, to - from, 0, 1};
    };
    static_assert(RayProjection<decltype(segment), MyRay, float>);
    static_assert(!RayProjection<decltype(segment), Rayf, float>);
    std::vector<std::uint32_t> masks(mesh.faces.size());
    for (std::size_t i = 0; i < masks.size(); ++i) masks[i] = 1u << (i % 3);
    Random random(4);
    std::size_t masked = 0, hits = 0;
    for (int i = 0; i < 2000; ++i) {
        MyRay mine{{}, {}, std::uint32_t(random.index(8))};
        for (double& x : mine.from) x = random.uniform(-1, 1);
        for (double& x : mine.to) x = random.uniform(-1, 1);
        const Rayf ray = segment(mine);
        const Hit<float> hit = bvh.intersect(ray);
        CHECK(bvh.intersect(mine, segment).t == hit.t);
        CHECK(bvh.occluded(mine, segment) == bool(hit));

        const auto visible = [&](std::uint32_t primitive, float, float, float) {
            return (masks[primitive] & mine.mask) != 0;
        };
        std::vector<Corners<float>> seen;
        for (std::size_t k = 0; k < masks.size(); ++k)
            if ((masks[k] & mine.mask) != 0) seen.push_back(mesh.triangle(k));
        const float expected = brute_force<float>(seen, ray);
        CHECK(bvh.intersect(mine, segment, visible).t == expected);
        CHECK(bvh.occluded(mine, segment, visible) == is_finite(expected));
        CHECK(bvh.intersect(ray, visible).t == expected);
        hits += std::size_t(bool(hit));
        masked += std::size_t(hit.t != expected);
    }
    CHECK(hits > 1000);
    CHECK(masked > 200);
}
