#include "support/brute_force.hpp"
#include "support/meshes.hpp"
#include "support/random.hpp"
#include "support/rays.hpp"
#include <cstring>
#include <doctest/doctest.h>
#include <lambent/bvh/bvh.hpp>
#include <lambent/bvh/compact.hpp>
#include <lambent/bvh/primitive_leaves.hpp>
#include <lambent/bvh/sphere.hpp>
#include <lambent/bvh/statistics.hpp>
#include <lambent/core/parallel.hpp>
#include <limits>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

/// Triangles that were sound when the tree was built, as they are now.
template <class T>
std::vector<Corners<T>> hittable(const lambent_test::Mesh<T>& mesh, const std::vector<char>& built) {
    std::vector<Corners<T>> all;
    for (std::size_t i = 0; i < mesh.faces.size(); ++i)
        if (built[i] && finite_triangle(mesh.triangle(i))) all.push_back(mesh.triangle(i));
    return all;
}

template <class T, class Tree>
std::size_t count_wrong(const lambent_test::Mesh<T>& mesh, const std::vector<char>& built, const Tree& bvh,
                        std::size_t rays, std::size_t& hits) {
    const std::vector<Corners<T>> all = hittable(mesh, built);
    Random random(3);
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < rays; ++i) {
        const Ray<T> ray = hard_ray(mesh, i, random, 2);
        if (is_black(ray.direction)) continue;
        const T expected = brute_force<T>(all, ray);
        hits += std::size_t(is_finite(expected));
        wrong += std::size_t(bvh.intersect(ray).t != expected || bvh.occluded(ray) != is_finite(expected));
    }
    return wrong;
}

template <class T>
void deform(lambent_test::Mesh<T>& mesh, int kind, Random& random) {
    const Vec3<T> by = random.in_box<T>(-0.5, 0.5);
    for (Vec3<T>& v : mesh.vertices) {
        switch (kind) {
        case 0: v += by; break;                                      // everything moves
        case 1: v += random.in_box<T>(-0.3, 0.3); break;             // every vertex on its own
        case 2: v = random.in_box<T>(-2, 2); break;                  // nothing stays where it was
        case 3: v.y = T(0.5); break;                                 // flat
        default: v *= T(0.01) + by; break;
        }
    }
}

} // namespace

TEST_CASE_TEMPLATE("After any deformation a refitted tree, full or compact, answers as brute force does", T, float, double) {
    std::size_t wrong = 0, hits = 0;
    for (lambent_test::Mesh<T> mesh : {sphere<T>(12, 8, 0.3, 1), soup<T>(163, 0.3, 2), slivers<T>(160, 3),
                                       degenerate<T>(200, 4), soup<T>(3, 1, 5)}) {
        std::vector<char> built;
        for (std::size_t i = 0; i < mesh.faces.size(); ++i) {
            const Corners<T> p = mesh.triangle(i);
            built.push_back(finite_triangle(p) && p[0] != p[1] && p[1] != p[2] && p[2] != p[0]);
        }
        const auto set = triangles(mesh.vertices, mesh.faces);
        auto full = BasicBvh<T>::build(set);
        auto compact = CompactBvh<decltype(set)>::build(set);
        Random random(11);
        for (int kind = 0; kind < 5; ++kind) {
            deform(mesh, kind, random);
            full.refit(set);
            ThreadExecutor executor(2);
            compact.refit(set, executor);
            CHECK(full.bounds().min == compact.bounds().min);
            wrong += count_wrong(mesh, built, full, 4000, hits);
            wrong += count_wrong(mesh, built, compact, 4000, hits);
        }
    }
    CHECK(hits > 50000);
    CHECK(wrong == 0);
}

TEST_CASE("A refit without movement changes no bit; one after movement bounds every child by its parent") {
    lambent_test::Mesh<float> mesh = soup<float>(20000, 0.03, 4);
    const auto set = triangles(mesh.vertices, mesh.faces);
    const Bvh fresh = Bvh::build(set);
    Bvh bvh = fresh;
    bvh.refit(set);
    const auto same = [](const auto& a, const auto& b) {
        return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0;
    };
    CHECK(same(fresh.tree().nodes, bvh.tree().nodes));
    CHECK(same(fresh.tree().blocks, bvh.tree().blocks));
    CHECK(fresh.bounds().min == bvh.bounds().min);
    CHECK(fresh.bounds().max == bvh.bounds().max);

    Random random(6);
    deform(mesh, 1, random);
    Bvh threaded = bvh;
    bvh.refit(set);
    ThreadExecutor executor(3);
    threaded.refit(set, executor);
    CHECK(same(bvh.tree().nodes, threaded.tree().nodes));
    CHECK(same(bvh.tree().blocks, threaded.tree().blocks));
    Bounds3<float> all, box;
    for (const Vec3f& v : mesh.vertices) all.add(v);
    CHECK(bvh.bounds().min == all.min);
    CHECK(bvh.bounds().max == all.max);
    std::size_t outside = 0, children = 0;
    const auto& nodes = bvh.tree().nodes;
    for (std::size_t i = 0; i < nodes.size(); ++i)
        for (int lane = 0; lane < node_width<float>; ++lane) {
            if (!detail::read_box(nodes[i], lane, box) || (nodes[i].child[lane] & detail::Child::leaf_bit) != 0) continue;
            Bounds3<float> inner, sum;
            for (int k = 0; k < node_width<float>; ++k)
                if (detail::read_box(nodes[nodes[i].child[lane]], k, inner)) sum.add(inner);
            ++children;
            outside += std::size_t(sum.min != box.min || sum.max != box.max);
        }
    CHECK(children > 500);
    CHECK(outside == 0);

    mesh.faces.pop_back();
    CHECK_THROWS_WITH_AS(bvh.refit(triangles(mesh.vertices, mesh.faces)),
                         "refit: 19999 primitives, but the tree was built over 20000", Error);
    Bvh empty;
    CHECK_NOTHROW(empty.refit(triangles(std::span<const Vec3f>(), std::span<const UVec3>())));
}

TEST_CASE_TEMPLATE("Triangles that lose their finite vertices are passed over, and come back with them", T, float, double) {
    const lambent_test::Mesh<T> good = soup<T>(300, 0.4, 7);
    lambent_test::Mesh<T> mesh = good;
    const std::vector<char> built(mesh.faces.size(), 1);
    const auto set = triangles(mesh.vertices, mesh.faces);
    auto full = BasicBvh<T>::build(set);
    auto compact = CompactBvh<decltype(set)>::build(set);
    std::size_t hits = 0;
    Random random(2);
    for (const std::size_t every : {7u, 2u, 1u, 0u, 3u}) { // 1: all of them; 0: none
        mesh.vertices = good.vertices;
        for (std::size_t i = 0; every > 0 && i < mesh.faces.size(); i += every)
            mesh.vertices[3 * i + random.index(3)][int(random.index(3))] =
                random.index(2) ? std::numeric_limits<T>::quiet_NaN() : -std::numeric_limits<T>::infinity();
        full.refit(set);
        compact.refit(set);
        for (const BvhStatistics& s : {statistics(full), statistics(compact)}) {
            CHECK(s.triangles == mesh.faces.size());
            CHECK(s.hidden == (every == 0 ? 0 : (mesh.faces.size() + every - 1) / every));
            CHECK(s.duplicates == 0);
        }
        hits = 0;
        CHECK(count_wrong(mesh, built, full, 5000, hits) == 0);
        CHECK(count_wrong(mesh, built, compact, 5000, hits) == 0);
        CHECK((hits == 0) == (every == 1));
    }
}

TEST_CASE_TEMPLATE("Spheres refit; those that were left out stay so", T, float, double) {
    Random random(5);
    std::vector<Vec3<T>> centers;
    std::vector<T> radii;
    for (int i = 0; i < 200; ++i) {
        centers.push_back(random.in_box<T>(-1, 1));
        radii.push_back(i == 17 ? T(-1) : T(random.uniform(0, 0.2)));
    }
    const auto set = spheres(centers, radii);
    auto bvh = PrimitiveBvh<decltype(set)>::build(set);
    CHECK(bvh.dropped() == 1);
    std::size_t wrong = 0, hits = 0;
    for (int round = 0; round < 4; ++round) {
        for (std::size_t i = 0; i < 200; ++i) {
            centers[i] = random.in_box<T>(-1, 1);
            radii[i] = T(random.uniform(round % 2 ? -0.1 : 0, 0.2)); // now and then a negative one
        }
        bvh.refit(set);
        for (int i = 0; i < 5000; ++i) {
            Ray<T> ray{random.in_box<T>(-2, 2), random.in_box<T>(-1, 1)};
            const Hit<T> hit = bvh.intersect(ray);
            wrong += std::size_t(bvh.occluded(ray) != bool(hit));
            for (std::size_t k = 0; k < 200; ++k)
                if (k != 17 && radii[k] >= 0) ray.t_max = std::min(ray.t_max, intersect_sphere(ray, centers[k], radii[k]));
            wrong += std::size_t(hit.t != ray.t_max);
            hits += std::size_t(bool(hit));
        }
    }
    CHECK(hits > 3000);
    CHECK(wrong == 0);
}
