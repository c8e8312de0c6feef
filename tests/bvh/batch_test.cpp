#include "support/meshes.hpp"
#include "support/random.hpp"
#include "support/rays.hpp"
#include <cmath>
#include <doctest/doctest.h>
#include <functional>
#include <lambent/bvh/bvh.hpp>
#include <limits>
#include <memory>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

template <class T>
Ray<T> between(const Vec3<T>& from, const Vec3<T>& to) {
    return {.origin = from, .direction = to - from};
}

/// What a path tracer shoots, and what none does: tiles of a camera's rays, aimed at vertices and edges as well; bundles
/// along an axis; rays of all ways; broken ones among them.
template <class T>
std::vector<Ray<T>> batch(const lambent_test::Mesh<T>& mesh, std::size_t count, std::uint64_t seed) {
    Random random(seed);
    std::vector<Ray<T>> rays;
    while (rays.size() < count) {
        const Vec3<T> eye = random.in_box<T>(-2.5, 2.5), target = random.in_box<T>(-0.5, 0.5);
        const double spread = random.uniform(0, 0.3);
        const std::size_t size = 1 + random.index(150);
        const std::size_t sort = random.index(4);
        const Vec3<T> face_vertex = mesh.vertices[mesh.faces[random.index(mesh.faces.size())].x];
        for (std::size_t i = 0; i < size; ++i) {
            Ray<T> ray = between(eye, target + random.in_box<T>(-spread, spread));
            if (sort == 1) { // towards one vertex, from close by each other
                ray = between(eye + random.in_box<T>(-0.05, 0.05), face_vertex);
            } else if (sort == 2) { // side by side along an axis, through vertices
                ray = {.origin = face_vertex, .direction = Vec3<T>(0)};
                ray.origin[0] += T(random.uniform(-0.1, 0.1));
                ray.origin[2] = -3;
                ray.direction[2] = 1;
                if (i % 3 == 0) ray.direction[1] = random.index(2) ? T(1e-20) : -T(0);
            } else if (sort == 3) {
                ray = hard_ray(mesh, i, random);
            }
            if (i % 5 == 0) ray.t_max = T(random.uniform(0, 2));
            if (i % 31 == 0) ray.t_min = T(random.uniform(-1, 1));
            if (i % 61 == 0) ray.direction[int(random.index(3))] = std::numeric_limits<T>::quiet_NaN();
            if (i % 67 == 0) ray.origin[int(random.index(3))] = std::numeric_limits<T>::infinity();
            if (i % 71 == 0) ray.t_max = std::numeric_limits<T>::quiet_NaN();
            if (i % 73 == 0) ray.direction = Vec3<T>(0);
            rays.push_back(ray);
        }
    }
    rays.resize(count);
    return rays;
}

template <class T>
std::vector<lambent_test::Mesh<T>> large_meshes() {
    return {sphere<T>(80, 60, 0.3, 1), cube<T>(12), soup<T>(4000, 0.08, 2), slivers<T>(700, 3),
            degenerate<T>(500, 4), soup<T>(3, 1, 5)};
}

} // namespace

TEST_CASE_TEMPLATE("Batches answer as single rays do, to the bit", T, float, double) {
    std::size_t different = 0, hits = 0, rays_shot = 0;
    for (const lambent_test::Mesh<T>& mesh : large_meshes<T>()) {
        const auto bvh = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
        for (const std::size_t count : {0u, 1u, 15u, 16u, 17u, 63u, 64u, 65u, 1000u, 40000u}) {
            const std::vector<Ray<T>> rays = batch(mesh, count, count + 7);
            std::vector<Hit<T>> closest(count);
            const std::unique_ptr<bool[]> occluded(new bool[count + 1]);
            occluded[count] = true;
            bvh.intersect(std::span<const Ray<T>>(rays), closest);
            bvh.occluded(std::span<const Ray<T>>(rays), std::span<bool>(occluded.get(), count));
            for (std::size_t i = 0; i < count; ++i) {
                const Hit<T> single = bvh.intersect(rays[i]);
                ++rays_shot;
                hits += std::size_t(bool(single));
                const bool same = closest[i].t == single.t && closest[i].primitive == single.primitive &&
                                  closest[i].u == single.u && closest[i].v == single.v && occluded[i] == bool(single);
                different += std::size_t(!same);
                if (different == 1 && !same)
                    MESSAGE(mesh.name << " ray " << i << " of " << count << ": " << closest[i].t << " != " << single.t);
            }
            CHECK(occluded[count]); // nothing written beyond
        }
    }
    CHECK(rays_shot > 240000);
    CHECK(hits > rays_shot / 8);
    CHECK(different == 0);
}

TEST_CASE_TEMPLATE("Batches honour filters, and refuse too few places for their answers", T, float, double) {
    const lambent_test::Mesh<T> mesh = sphere<T>(40, 30, 0.2, 1);
    const auto bvh = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
    const auto odd = [](std::uint32_t primitive, T, T, T) { return primitive % 2 == 1; };
    const std::vector<Ray<T>> rays = batch(mesh, 20000, 3);
    std::vector<Hit<T>> hits(rays.size());
    const std::unique_ptr<bool[]> occluded(new bool[rays.size()]);
    bvh.intersect(std::span<const Ray<T>>(rays), hits, odd);
    bvh.occluded(std::span<const Ray<T>>(rays), std::span<bool>(occluded.get(), rays.size()), odd);
    std::size_t wrong = 0, found = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const Hit<T> single = bvh.intersect(rays[i], odd);
        found += std::size_t(bool(single));
        wrong += std::size_t(hits[i].t != single.t || hits[i].primitive != single.primitive || occluded[i] != bool(single) || (hits[i] && hits[i].primitive % 2 == 0));
    }
    CHECK(found > rays.size() / 10);
    CHECK(wrong == 0);
    hits.resize(rays.size() - 1);
    CHECK_THROWS_WITH_AS(bvh.intersect(std::span<const Ray<T>>(rays), hits), "Bvh: room for 19999 answers to 20000 rays", Error);
}

TEST_CASE_TEMPLATE("Batches honour filters that differ from ray to ray, as single rays do", T, float, double) {
    struct Filters { // ray i does not see the triangles that have its own remainder
        auto for_ray(std::size_t i) const {
            return [i](std::uint32_t primitive, T, T, T) { return primitive % 3 != i % 3; };
        }
    };
    std::size_t wrong = 0, found = 0, other = 0;
    for (const int size : {40, sizeof(T) == 4 ? 420 : 300}) { // the second one's are interleaved, as far as that pays
        const lambent_test::Mesh<T> mesh = sphere<T>(size, size, 0.2, 1);
        const auto bvh = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces), {.quality = BuildQuality::fast});
        const std::vector<Ray<T>> rays = batch(mesh, 20000, 3);
        std::vector<Hit<T>> hits(rays.size());
        const std::unique_ptr<bool[]> occluded(new bool[rays.size()]);
        std::vector<Hit<T>> all_interleaved(rays.size());
        detail::Interleaved<detail::Query::closest, T, detail::StoredTriangles<T>, Filters>(bvh.tree(), bvh.leaves(), {})
            .run(rays.size(), std::identity(), [&](std::size_t i) -> const Ray<T>& { return rays[i]; },
                 [&](std::size_t i, const Hit<T>& hit) { all_interleaved[i] = hit; });
        bvh.intersect(std::span<const Ray<T>>(rays), hits, Filters{});
        bvh.occluded(std::span<const Ray<T>>(rays), std::span<bool>(occluded.get(), rays.size()), Filters{});
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const Hit<T> single = bvh.intersect(rays[i], Filters{}.for_ray(i));
            found += std::size_t(bool(single));
            other += std::size_t(single.primitive != bvh.intersect(rays[i]).primitive);
            wrong += std::size_t(hits[i].t != single.t || hits[i].primitive != single.primitive || occluded[i] != bool(single));
            wrong += std::size_t(all_interleaved[i].t != single.t || all_interleaved[i].primitive != single.primitive);
        }
    }
    CHECK(found > 5000);
    CHECK(other > 1000);
    CHECK(wrong == 0);
}

TEST_CASE_TEMPLATE("Batches take rays of the caller's own type", T, float, double) {
    struct Mine {
        T values[7];
    };
    const lambent_test::Mesh<T> mesh = sphere<T>(40, 30, 0.2, 1);
    const auto bvh = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
    std::vector<Mine> rays;
    for (const Ray<T>& r : batch(mesh, 5000, 4))
        rays.push_back({{r.origin.x, r.origin.y, r.origin.z, r.direction.x, r.direction.y, r.direction.z, r.t_max}});
    const auto as_ray = [](const Mine& m) {
        return Ray<T>{{m.values[0], m.values[1], m.values[2]}, {m.values[3], m.values[4], m.values[5]}, 0, m.values[6]};
    };
    std::vector<Hit<T>> hits(rays.size());
    const std::unique_ptr<bool[]> occluded(new bool[rays.size()]);
    bvh.intersect(std::span<const Mine>(rays), hits, as_ray);
    bvh.occluded(std::span<const Mine>(rays), std::span<bool>(occluded.get(), rays.size()), as_ray);
    std::size_t found = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        found += std::size_t(bool(hits[i]));
        CHECK(hits[i].t == bvh.intersect(as_ray(rays[i])).t);
        CHECK(occluded[i] == bool(hits[i]));
    }
    CHECK(found > 1000);
}

TEST_CASE_TEMPLATE("Trees too large for the caches answer interleaved rays as single ones", T, float, double) {
    const lambent_test::Mesh<T> mesh = soup<T>(sizeof(T) == 4 ? 700000 : 350000, 0.01, 6);
    const auto bvh = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces), {.quality = BuildQuality::fast});
    const auto& tree = bvh.tree();
    REQUIRE(tree.bytes() > detail::large_tree);
    const std::vector<Ray<T>> rays = batch(mesh, 20000, 9);
    const auto steps = [&]<detail::Query query>() {
        const auto none = [](std::size_t, const Hit<T>&) {};
        return detail::Interleaved<query, T, detail::StoredTriangles<T>, AcceptAll>(tree, bvh.leaves(), {})
            .run(128, std::identity(), [&](std::size_t i) -> const Ray<T>& { return rays[i]; }, none);
    };
    REQUIRE(steps.template operator()<detail::Query::closest>() > 128 * detail::long_way<detail::Query::closest>);
    REQUIRE(steps.template operator()<detail::Query::any>() > 128 * detail::long_way<detail::Query::any>);
    std::vector<Hit<T>> hits(rays.size());
    const std::unique_ptr<bool[]> occluded(new bool[rays.size()]);
    bvh.intersect(std::span<const Ray<T>>(rays), hits);
    bvh.occluded(std::span<const Ray<T>>(rays), std::span<bool>(occluded.get(), rays.size()));
    std::size_t wrong = 0, found = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const Hit<T> single = bvh.intersect(rays[i]);
        found += std::size_t(bool(single));
        wrong += std::size_t(hits[i].t != single.t || hits[i].primitive != single.primitive || occluded[i] != bool(single));
    }
    CHECK(found > 5000);
    CHECK(wrong == 0);
}

TEST_CASE_TEMPLATE("An empty tree answers a batch", T, float, double) {
    const BasicBvh<T> bvh;
    const std::vector<Ray<T>> rays(100);
    std::vector<Hit<T>> hits(100, Hit<T>{.t = 1, .primitive = 3});
    bvh.intersect(std::span<const Ray<T>>(rays), hits);
    for (const Hit<T>& hit : hits) CHECK(!hit);
}
