#include "support/brute_force.hpp"
#include "support/doubled.hpp"
#include "support/meshes.hpp"
#include "support/random.hpp"
#include "support/rays.hpp"
#include <algorithm>
#include <doctest/doctest.h>
#include <lambent/bvh/for_each_hit.hpp>
#include <random>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

template <class T>
struct Found {
    std::uint32_t primitive;
    T t;
    friend bool operator==(const Found&, const Found&) = default;
};

template <class T>
std::vector<Found<T>> all_hits(const lambent_test::Mesh<T>& mesh, const Ray<T>& ray) {
    std::vector<Found<T>> found;
    if (is_black(ray.direction)) return found;
    const ScalarTest<T> test(ray);
    for (std::uint32_t i = 0; i < mesh.faces.size(); ++i) {
        T t;
        if (finite_triangle(mesh.triangle(i)) && test(mesh.triangle(i), ray.t_max, t)) found.push_back({i, t});
    }
    return found;
}

/// Hits of the tree in the order of primitives, those reported twice included.
template <class T, class Bvh>
std::vector<Found<T>> hits_of(const Bvh& bvh, const Ray<T>& ray) {
    std::vector<Found<T>> found;
    for_each_hit(bvh, ray, [&](const Hit<T>& hit) { found.push_back({hit.primitive, hit.t}); });
    std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.primitive < b.primitive; });
    return found;
}

template <class Bvh, class T>
std::size_t differences(const Bvh& bvh, const lambent_test::Mesh<T>& mesh, std::size_t rays, std::size_t& hits) {
    Random random(7);
    std::size_t different = 0;
    for (std::size_t i = 0; i < rays; ++i) {
        const Ray<T> ray = hard_ray(mesh, i, random);
        const std::vector<Found<T>> found = hits_of(bvh, ray);
        hits += found.size();
        different += std::size_t(found != all_hits(mesh, ray));
    }
    return different;
}

} // namespace

TEST_CASE_TEMPLATE("Every hit is reported once, with the t of brute force", T, float, double) {
    std::size_t hits = 0;
    for (const lambent_test::Mesh<T>& mesh :
         {sphere<T>(12, 8, 0.3, 1), cube<T>(4), soup<T>(160, 0.8, 2), slivers<T>(160, 3), degenerate<T>(160, 4)}) {
        CAPTURE(mesh.name);
        for (const BuildQuality quality : {BuildQuality::fast, BuildQuality::balanced, BuildQuality::best}) {
            const auto bvh = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces), {.quality = quality});
            CHECK(differences(bvh, mesh, 10000, hits) == 0);
        }
    }
    CHECK(hits > 100000);
}

TEST_CASE_TEMPLATE("Triangles that lie in several leaves are reported once, few of them and thousands", T, float,
                   double) {
    std::size_t hits = 0;
    const lambent_test::Mesh<T> mesh = soup<T>(160, 0.8, 2);
    CHECK(differences(doubled_bvh(mesh), mesh, 10000, hits) == 0);
    CHECK(hits > 25000);

    lambent_test::Mesh<T> pile;
    for (int i = 0; i < 3000; ++i) {
        const T z = T(i % 1500);
        const auto first = std::uint32_t(pile.vertices.size());
        pile.vertices.insert(pile.vertices.end(), {{-1, -1, z}, {1, -1, z}, {0, 1, z}});
        pile.faces.push_back({first, first + 1, first + 2});
    }
    hits = 0;
    CHECK(hits_of<T>(doubled_bvh(pile), Ray<T>{}) == all_hits<T>(pile, Ray<T>{}));
    CHECK(hits_of<T>(doubled_bvh(pile), Ray<T>{}).size() == 3000);
    CHECK(hits_of<T>(doubled_bvh(pile), Ray<T>{.t_max = 20}).size() == 40); // beyond what is kept in place
    CHECK(hits_of<T>(doubled_bvh(pile), Ray<T>{.t_max = 16}).size() == 32);
}

TEST_CASE("Once: true the first time, however many there are and however late they come again") {
    Random random(1);
    for (const std::size_t count : {5u, 31u, 32u, 33u, 129u, 1000u, 50000u}) {
        std::vector<std::uint32_t> ids;
        for (std::size_t i = 0; i < count; ++i) ids.push_back(std::uint32_t(random.bits() % (1u << 30)));
        std::sort(ids.begin(), ids.end());
        ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
        std::shuffle(ids.begin(), ids.end(), std::mt19937(3));
        detail::Once once(true), no_need(false);
        std::size_t first = 0, again = 0;
        for (const std::uint32_t p : ids) first += std::size_t(once.first(p));
        for (const std::uint32_t p : ids) again += std::size_t(once.first(p));
        CHECK(first == ids.size());
        CHECK(again == 0);
        CHECK((no_need.first(ids[0]) && no_need.first(ids[0])));
    }
}

TEST_CASE("False stops; a filter's refused hits are not reported; an empty tree and a ray that is none report nothing") {
    const lambent_test::Mesh<float> mesh = soup<float>(200, 0.8, 2);
    const Bvh bvh = Bvh::build(triangles(mesh.vertices, mesh.faces));
    Random random(1);
    std::size_t most = 0;
    for (std::size_t i = 0; i < 2000; ++i) {
        const Rayf ray = hard_ray(mesh, i, random);
        const std::vector<Found<float>> all = all_hits(mesh, ray);
        most = std::max(most, all.size());
        for (std::size_t stop = 1; stop <= 3; ++stop) {
            std::size_t calls = 0;
            for_each_hit(bvh, ray, [&](const Hit<float>&) { return ++calls < stop; });
            CHECK(calls == std::min(stop, all.size()));
        }
        const auto odd = [](std::uint32_t primitive, float, float, float) { return primitive % 2 == 1; };
        std::size_t calls = 0, wrong = 0;
        for_each_hit(bvh, ray, odd, [&](const Hit<float>& hit) {
            ++calls;
            wrong += hit.primitive % 2 == 0;
        });
        CHECK(wrong == 0);
        CHECK(calls == std::size_t(std::count_if(all.begin(), all.end(),
                                                 [](const Found<float>& f) { return f.primitive % 2 == 1; })));
    }
    CHECK(most > 5);

    std::size_t calls = 0;
    const auto count = [&](const Hit<float>&) { ++calls; };
    for_each_hit(Bvh(), Rayf{}, count);
    for_each_hit(bvh, Rayf{.origin = {0, 0, std::numeric_limits<float>::quiet_NaN()}}, count);
    for_each_hit(bvh, Rayf{.direction = {0, 0, 0}}, count);
    CHECK(calls == 0);
}

TEST_CASE("A ray through an edge meets both triangles, and one through a vertex all around it") {
    const std::vector<Vec3f> vertices = {{0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {-1, 0, 1}, {0, -1, 1}};
    const std::vector<UVec3> faces = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 1}};
    const Bvh bvh = Bvh::build(triangles(vertices, faces));
    const auto count = [&](float x, float y) {
        int hits = 0;
        for_each_hit(bvh, Rayf{.origin = {x, y, 0}}, [&](const Hit<float>&) { ++hits; });
        return hits;
    };
    CHECK(count(0.25f, 0.25f) == 1);
    CHECK(count(0.5f, 0) == 2);
    CHECK(count(0, 0) == 4);
    CHECK(count(1, 0) == 2);
    CHECK(count(1, 1) == 0);
}
