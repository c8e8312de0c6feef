// Also compiled alone with other flags, see tests/CMakeLists.txt.
#include "support/meshes.hpp"
#include "support/random.hpp"
#include <cmath>
#include <doctest/doctest.h>
#include <lambent/bvh/facing.hpp>
#include <lambent/bvh/for_each_hit.hpp>
#include <limits>
#include <utility>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

struct Crossings {
    std::size_t rays = 0, shared_once = 0, shared_twice = 0, shared_more = 0, owned_not_once = 0, owned_even = 0, line_odd = 0,
                closest_lost = 0;
};

/// Rays from inside a closed mesh, exactly at its vertices and edges.
template <class T>
void cross_edges(lambent_test::Mesh<T> mesh, double offset, std::size_t count, std::uint64_t seed, Crossings& c,
                 double scale = 1) {
    const Vec3<T> center = Vec3<T>(T(offset), T(-offset / 2), T(offset / 4)) * T(scale);
    for (Vec3<T>& v : mesh.vertices) v = v * T(scale) + center;
    const auto bvh = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
    Random random(seed);
    for (std::size_t i = 0; i < count; ++i) {
        const UVec3 face = mesh.faces[random.index(mesh.faces.size())];
        const int k = int(random.index(3));
        const Vec3<T> a = mesh.vertices[face[k]], b = mesh.vertices[face[(k + 1) % 3]];
        Ray<T> ray{center + random.in_box<T>(-0.4, 0.4) * T(scale), {}};
        if (i % 4 == 1) { // origins that differences with vertices are exact from
            const auto whole = [scale](double x) { return std::round(x / scale * 64) / 64 * scale; };
            for (int axis = 0; axis < 3; ++axis) ray.origin[axis] = T(whole(double(ray.origin[axis])));
        }
        if (i % 4 == 2) ray.origin = center;
        ray.direction = (i % 2 == 0 ? a : (a + b) * T(0.5)) - ray.origin;
        if (i % 4 == 3) { // straight below the vertex, along an axis
            const int axis = int(random.index(3));
            ray.direction = Vec3<T>(0);
            ray.direction[axis] = a[axis] < center[axis] ? T(-1) : T(1);
            ray.origin = a;
            ray.origin[axis] = center[axis];
            if (double(length((ray.origin - center) / T(scale))) > 0.7) ray.origin = center;
        }
        std::vector<T> depths;
        for_each_hit(bvh, ray, [&](const Hit<T>& hit) { depths.push_back(hit.t); });
        std::size_t equal = 0;
        for (std::size_t m = 0; m < depths.size(); ++m)
            for (std::size_t n = 0; n < m; ++n) equal += std::size_t(depths[m] == depths[n]);
        const auto owned = [&](T t_min) {
            std::size_t n = 0;
            const Ray<T> line{ray.origin, ray.direction, t_min};
            for_each_hit(bvh, line, own_edges, [&](const Hit<T>&) { ++n; });
            return n;
        };
        const std::size_t ahead = owned(0);
        ++c.rays;
        c.shared_once += std::size_t(depths.size() == 1);
        c.shared_twice += std::size_t(equal == 1);
        c.shared_more += std::size_t(equal > 1);
        c.owned_not_once += std::size_t(ahead != 1);
        c.owned_even += std::size_t(ahead % 2 == 0);
        c.line_odd += owned(-std::numeric_limits<T>::infinity()) % 2;
        c.closest_lost += std::size_t(!bvh.intersect(ray, own_edges) || !bvh.occluded(ray, own_edges));
    }
}

template <class T>
void turn_some(lambent_test::Mesh<T>& mesh) {
    Random random(9);
    for (UVec3& f : mesh.faces)
        if (random.index(2) == 0) std::swap(f.y, f.z);
}

} // namespace

TEST_CASE_TEMPLATE("Owned edges: rays out of closed meshes, through edges and vertices, hit an odd number of times", T,
                   float, double) {
    Crossings round, rough; // convex ones, and not
    for (const bool turned : {false, true})
        for (const double offset : {0.0, 1.0, 1000.0}) {
            lambent_test::Mesh<T> shapes[] = {sphere<T>(40, 20, 0, 1), cube<T>(8), sphere<T>(40, 20, 0.5, 2)};
            for (auto& shape : shapes)
                if (turned) turn_some(shape);
            cross_edges(shapes[0], offset, 15000, 1, round);
            cross_edges(shapes[1], offset, 15000, 2, round);
            cross_edges(shapes[2], offset, 15000, 3, rough);
        }
    MESSAGE("of ", round.rays + rough.rays, " rays at edges and vertices, ", round.shared_twice + rough.shared_twice,
            " meet two triangles at one t, ", round.shared_more + rough.shared_more, " more than two; out of convex meshes ",
            round.rays - round.shared_once, " of ", round.rays, " have several hits, with owned edges ",
            round.owned_not_once);
    CHECK(round.rays + rough.rays == 270000);
    CHECK(round.shared_twice + round.shared_more > round.rays / 10); // or there is nothing to own
    CHECK(round.owned_not_once == 0);
    CHECK(rough.owned_even == 0);
    CHECK(round.line_odd + rough.line_odd == 0);
    CHECK(round.closest_lost + rough.closest_lost == 0);
}

TEST_CASE_TEMPLATE("Owned edges: tiny meshes, whose products lose bits, own theirs too", T, float, double) {
    for (const int power : {-50, -56, -57}) {
        Crossings round;
        // In double no ray was found, down to 2^-513, whose edge had two owners without the scaling.
        const double scale = std::ldexp(1.0, sizeof(T) == 4 ? power : 8 * power);
        cross_edges(sphere<T>(40, 20, 0, 1), 0, 40000, 4, round, scale);
        cross_edges(cube<T>(8), 0, 40000, 5, round, scale);
        INFO("scale " << scale << ", seeds 4 and 5");
        CHECK(round.rays == 80000);
        CHECK(round.shared_twice + round.shared_more > round.rays / 10);
        CHECK(round.owned_not_once == 0);
        CHECK(round.line_odd == 0);
        CHECK(round.closest_lost == 0);
    }
}

TEST_CASE("A square's diagonal, edges and corners are owned once or not at all") {
    const std::vector<Vec3f> vertices = {{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    for (const std::vector<UVec3>& faces :
         {std::vector<UVec3>{{0, 1, 2}, {0, 2, 3}}, {{0, 2, 1}, {0, 2, 3}}, {{0, 1, 2}, {3, 2, 0}}}) {
        const Bvh bvh = Bvh::build(triangles(vertices, faces));
        for (const float z : {1.0f, -1.0f}) {
            const auto count = [&](float x, float y) {
                int n = 0;
                for_each_hit(bvh, Rayf{{x, y, 1 - z}, {0, 0, z}}, own_edges, [&](const Hit<float>&) { ++n; });
                return n;
            };
            CHECK(count(0.5f, 0.25f) == 1);
            for (const float x : {0.125f, 0.5f, 0.75f}) {
                CHECK(count(x, x) == 1);
                CHECK(count(x, 0) + count(x, 1) == 1); // so that squares side by side meet once
                CHECK(count(0, x) + count(1, x) == 1);
            }
            CHECK(count(0, 0) + count(0, 1) + count(1, 0) + count(1, 1) == 1);
        }
    }
}
