#include "support/brute_force.hpp"
#include "support/meshes.hpp"
#include "support/random.hpp"
#include "support/rays.hpp"
#include <doctest/doctest.h>
#include <lambent/bvh/bvh.hpp>
#include <lambent/bvh/compact.hpp>
#include <lambent/bvh/instance.hpp>
#include <lambent/bvh/primitive_leaves.hpp>
#include <lambent/bvh/sphere.hpp>
#include <type_traits>
#include <utility>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

/// Every triangle `copies` times, in random order.
template <class T>
lambent_test::Mesh<T> repeated(lambent_test::Mesh<T> mesh, std::size_t copies, std::uint64_t seed) {
    const std::vector<UVec3> faces = mesh.faces;
    for (std::size_t i = 1; i < copies; ++i) mesh.faces.insert(mesh.faces.end(), faces.begin(), faces.end());
    Random random(seed);
    for (std::size_t i = mesh.faces.size(); i > 1; --i) std::swap(mesh.faces[i - 1], mesh.faces[random.index(i)]);
    return mesh;
}

/// The nearest triangle of all; of several at the same t the first one.
template <class T>
std::uint32_t first_of_nearest(const lambent_test::Mesh<T>& mesh, const Ray<T>& ray) {
    if (is_black(ray.direction)) return no_primitive;
    const ScalarTest<T> test(ray);
    T nearest = ray.t_max, t;
    std::uint32_t first = no_primitive;
    for (std::size_t i = 0; i < mesh.faces.size(); ++i)
        if (test(mesh.triangle(i), nearest, t)) {
            nearest = t;
            first = std::uint32_t(i);
        }
    return first;
}

template <class T>
std::vector<Ray<T>> rays_at(const lambent_test::Mesh<T>& mesh, std::size_t count, std::uint64_t seed) {
    Random random(seed);
    std::vector<Ray<T>> rays;
    for (std::size_t i = 0; i < count; ++i) {
        if (i / 64 % 2 == 0) { // a bundle that goes together
            const std::uint64_t bundle = i / 64;
            Random here(bundle);
            const Vec3<T> eye = here.in_box<T>(-2.5, 2.5);
            rays.push_back({.origin = eye, .direction = random.in_box<T>(-0.1, 0.1) - eye});
        } else rays.push_back(hard_ray(mesh, i, random));
        if (i % 7 == 0) rays.back().t_max = T(random.uniform(0.5, 2));
    }
    return rays;
}

} // namespace

TEST_CASE_TEMPLATE("Of triangles at the same t the lowest index is named, by every query of every tree", T, float, double) {
    const lambent_test::Mesh<T> meshes[] = {repeated(sphere<T>(20, 14, 0.2, 1), 3, 2), repeated(slivers<T>(150, 3), 2, 4),
                                            repeated(cube<T>(5), 4, 5)};
    const auto any = [](std::uint32_t, T, T, T) { return true; };
    std::size_t hits = 0, wrong = 0, ends = 0;
    for (const lambent_test::Mesh<T>& mesh : meshes) {
        const auto set = triangles(mesh.vertices, mesh.faces);
        std::vector<Ray<T>> rays = rays_at(mesh, 2560, 6);
        std::vector<std::uint32_t> expected;
        for (const Ray<T>& ray : rays) expected.push_back(first_of_nearest(mesh, ray));
        for (const BuildQuality quality : {BuildQuality::fast, BuildQuality::balanced, BuildQuality::best}) {
            const auto bvh = BasicBvh<T>::build(set, {.quality = quality});
            const auto compact = CompactBvh<std::remove_const_t<decltype(set)>>::build(set, {.quality = quality});
            std::vector<Hit<T>> batch(rays.size()), filtered(rays.size()), interleaved(rays.size());
            bvh.intersect(std::span<const Ray<T>>(rays), batch);
            bvh.intersect(std::span<const Ray<T>>(rays), filtered, any);
            detail::Interleaved<detail::Query::closest, T, detail::StoredTriangles<T>, AcceptAll>(bvh.tree(), bvh.leaves(), {})
                .run(rays.size(), [](std::size_t i) { return i; }, [&](std::size_t i) { return rays[i]; },
                     [&](std::size_t i, const Hit<T>& hit) { interleaved[i] = hit; });
            for (std::size_t i = 0; i < rays.size(); ++i) {
                hits += expected[i] != no_primitive;
                for (const Hit<T>& hit : {bvh.intersect(rays[i]), bvh.intersect(rays[i], any), compact.intersect(rays[i]),
                                          batch[i], filtered[i], interleaved[i]}) {
                    wrong += hit.primitive != expected[i];
                    if (!hit) continue;
                    Ray<T> before = rays[i]; // t_max itself is not in the range, whatever lies there
                    before.t_max = hit.t;
                    ends += bvh.intersect(before) || compact.intersect(before) || bvh.occluded(before);
                }
            }
        }
    }
    CHECK(hits > 5000);
    CHECK(wrong == 0);
    CHECK(ends == 0);
}

TEST_CASE_TEMPLATE("Of instances and of own primitives at the same t the lowest index is named", T, float, double) {
    const lambent_test::Mesh<T> mesh = repeated(sphere<T>(12, 8, 0.2, 1), 2, 2);
    const auto object = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
    const std::vector<Instance<BasicBvh<T>>> list(11, {&object, {}}); // all in one place
    const auto top = InstancedBvh<BasicBvh<T>>::build(InstanceSet(list));
    const std::vector<Instance<BasicBvh<T>>> one(1, {&object, {}}); // rays are moved to it, so not quite the object's
    const auto alone = InstancedBvh<BasicBvh<T>>::build(InstanceSet(one));
    const std::vector<Vec3<T>> centers(23, Vec3<T>(0));
    const std::vector<T> radii(centers.size(), T(1));
    const auto set = spheres(centers, radii);
    const auto round = PrimitiveBvh<std::remove_const_t<decltype(set)>>::build(set);
    std::size_t hits = 0, wrong = 0;
    const std::vector<Ray<T>> rays = rays_at(mesh, 5000, 3);
    std::vector<Hit<T>> batch(rays.size());
    top.intersect(std::span<const Ray<T>>(rays), batch);
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const std::uint32_t expected = alone.intersect(rays[i]).primitive;
        const Hit<T> hit = top.intersect(rays[i]);
        hits += bool(hit);
        wrong += hit.primitive != expected || hit.instance != 0 || batch[i].primitive != expected || batch[i].instance != 0;
        const Hit<T> ball = round.intersect(rays[i]);
        wrong += ball && ball.primitive != 0;
        Ray<T> before = rays[i];
        if (before.t_max = hit.t; hit) wrong += bool(top.intersect(before));
        if (before.t_max = ball.t; ball) wrong += bool(round.intersect(before));
    }
    CHECK(hits > 1000);
    CHECK(wrong == 0);
}
