#include "support/brute_force.hpp"
#include "support/meshes.hpp"
#include "support/random.hpp"
#include "support/rays.hpp"
#include <array>
#include <cstdint>
#include <doctest/doctest.h>
#include <lambent/bvh/bvh.hpp>
#include <lambent/bvh/compact.hpp>
#include <lambent/bvh/statistics.hpp>
#include <vector>

using namespace lambent;
using namespace lambent_test;

TEST_CASE_TEMPLATE("The compact tree's answers are brute force's, and the full tree's to the last bit", T, float, double) {
    std::size_t different = 0, wrong = 0, hits = 0;
    for (const lambent_test::Mesh<T>& mesh : {sphere<T>(12, 8, 0.3, 1), cube<T>(4), soup<T>(163, 0.3, 2),
                                              slivers<T>(160, 3), degenerate<T>(160, 4), soup<T>(3, 1, 5)}) {
        std::vector<Corners<T>> all;
        for (std::size_t i = 0; i < mesh.faces.size(); ++i)
            if (finite_triangle(mesh.triangle(i))) all.push_back(mesh.triangle(i));
        const auto set = triangles(mesh.vertices, mesh.faces);
        const auto full = BasicBvh<T>::build(set);
        const auto compact = CompactBvh<decltype(set)>::build(set);
        CHECK(compact.dropped() == full.dropped());
        const auto accept = [](std::uint32_t primitive, T u, T, T) { return primitive % 3 != 0 && u < T(0.7); };
        Random random(7);
        for (std::size_t i = 0; i < 10000; ++i) {
            const Ray<T> ray = hard_ray(mesh, i, random);
            const auto compare = [&](const Hit<T>& a, const Hit<T>& b) {
                different += std::size_t(a.t != b.t || a.u != b.u || a.v != b.v || a.primitive != b.primitive);
            };
            const Hit<T> hit = compact.intersect(ray);
            hits += std::size_t(bool(hit));
            compare(hit, full.intersect(ray));
            compare(compact.intersect(ray, accept), full.intersect(ray, accept));
            different += std::size_t(compact.occluded(ray) != full.occluded(ray));
            different += std::size_t(compact.occluded(ray, accept) != full.occluded(ray, accept));
            if (!is_black(ray.direction)) wrong += std::size_t(hit.t != brute_force<T>(all, ray));
        }
    }
    CHECK(hits > 10000);
    CHECK(different == 0);
    CHECK(wrong == 0);
}

TEST_CASE("A compact tree takes less than 30 bytes a triangle beside the caller's vertices") {
    for (const lambent_test::Mesh<float>& mesh : {sphere<float>(100, 80, 0.3, 1), soup<float>(20000, 0.02, 2),
                                                  slivers<float>(5000, 3)}) {
        const auto set = triangles(mesh.vertices, mesh.faces);
        const BvhStatistics s = statistics(CompactBvh<decltype(set)>::build(set));
        CHECK(s.triangles == set.count());
        CHECK(s.bytes_per_triangle() > 16.0 / 4); // a block of four indices at the least
        CHECK(s.bytes_per_triangle() <= 30);
    }
}

TEST_CASE("A compact tree reads the caller's vertices, through any view, and can be copied and assigned") {
    struct OwnVertex {
        std::array<double, 3> position;
        int other;
    };
    std::vector<OwnVertex> vertices = {{{-1, -1, 2}, 0}, {{1, -1, 2}, 0}, {{0, 1, 2}, 0}};
    const std::vector<std::uint16_t> indices = {0, 1, 2};
    const double unit = 0.5; // a projection that captures
    const auto set = triangles(vertices, indices, [unit](const OwnVertex& v) {
        return Vec3f(float(v.position[0] * unit), float(v.position[1] * unit), float(v.position[2] * unit));
    });
    using Tree = CompactBvh<decltype(set)>;
    Tree bvh;
    CHECK(bvh.empty());
    CHECK_FALSE(bvh.intersect({}));
    bvh = Tree::build(set);
    Tree copy = bvh;
    bvh = Tree();
    CHECK_FALSE(bvh.intersect({}));
    bvh = copy;
    copy = std::move(bvh);
    CHECK(copy.intersect({}).t == 1);
    CHECK(copy.intersect({}).u == 0.25f);
    vertices[0].position[0] = -0.5; // inside of the box
    CHECK(copy.intersect({}).t == 1);
    CHECK(copy.intersect({}).u == doctest::Approx(1.0 / 6));
}
