// BuildQuality::best: triangles are cut at planes, and still no ray may tell.
#include "support/brute_force.hpp"
#include "support/meshes.hpp"
#include "support/random.hpp"
#include "support/rays.hpp"
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <doctest/doctest.h>
#include <lambent/bvh/bvh.hpp>
#include <lambent/bvh/statistics.hpp>
#include <lambent/core/parallel.hpp>
#include <span>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

constexpr BuildOptions best{.quality = BuildQuality::best};

/// Long thin triangles that lie aslant among small ones, in the box from -1 to 1, and needles that nearly, or just,
/// have no area.
template <class T>
lambent_test::Mesh<T> blades(std::size_t count, std::uint64_t seed) {
    lambent_test::Mesh<T> mesh{"blades", {}, {}};
    Random random(seed);
    for (std::size_t i = 0; i < count; ++i) {
        const Vec3<T> a = random.in_box<T>(-1, 1);
        Vec3<T> b = a + random.in_box<T>(-0.05, 0.05), c = a + random.in_box<T>(-0.05, 0.05);
        if (i % 8 == 0) {
            b = a + random.in_box<T>(-1, 1);
            c = b + random.in_box<T>(-0.05, 0.05);
        }
        if (i % 64 == 0) c = (a + b) * T(0.5);
        if (i % 64 == 8) c = b + (c - b) * T(1e-5);
        mesh.vertices.insert(mesh.vertices.end(), {a, b, c});
        const auto first = std::uint32_t(3 * i);
        mesh.faces.push_back({first, first + 1, first + 2});
    }
    return mesh;
}

template <class T>
lambent_test::Mesh<T> mapped(lambent_test::Mesh<T> mesh, T scale, Vec3<T> offset) {
    for (Vec3<T>& v : mesh.vertices) v = v * scale + offset;
    return mesh;
}

/// visit(primitive, box of the leaf, leaf's first block) for every place in every leaf.
template <class T, class Visit>
void for_each_place(const BasicBvh<T>& bvh, const Visit& visit) {
    const auto& tree = bvh.tree();
    for (const auto& node : tree.nodes)
        for (int lane = 0; lane < node_width<T>; ++lane) {
            const std::uint32_t child = node.child[lane];
            if ((child & detail::Child::leaf_bit) == 0 || !(node.plane[0][lane] <= node.plane[1][lane])) continue;
            Bounds3<T> box;
            for (int k = 0; k < 3; ++k) {
                box.min[k] = node.plane[2 * k][lane];
                box.max[k] = node.plane[2 * k + 1][lane];
            }
            const std::uint32_t first = child & detail::Child::index_mask;
            const std::uint32_t last = first + ((child & detail::Child::second_block_bit) != 0 ? 1 : 0);
            for (std::uint32_t b = first; b <= last; ++b)
                for (int i = 0; i < detail::block_lanes; ++i)
                    if (tree.blocks[b].primitive[i] != no_primitive) visit(tree.blocks[b].primitive[i], box, first);
        }
}

template <class T>
std::size_t duplicates(const BasicBvh<T>& bvh) {
    std::size_t places = 0;
    for_each_place(bvh, [&](std::uint32_t, const Bounds3<T>&, std::uint32_t) { ++places; });
    CHECK(places == bvh.triangle_count() + bvh.tree().duplicates);
    return bvh.tree().duplicates;
}

} // namespace

TEST_CASE_TEMPLATE("With cut triangles nearest and any hits equal brute force, to the bit in t, on 1e6 rays", T, float,
                   double) {
    const Vec3<T> none(0), far(100000, -100000, 30000);
    struct Case {
        lambent_test::Mesh<T> mesh;
        Vec3<T> center;
    };
    const Case cases[] = {{blades<T>(3000, 1), none},
                          {mapped<T>(blades<T>(3000, 2), 1, far), far},
                          {slivers<T>(2000, 3), none},
                          {mapped<T>(slivers<T>(2000, 4), 1, far), far},
                          {degenerate<T>(600, 5), none},
                          {sphere<T>(14, 9, 0.3, 6), none}};
    std::size_t rays = 0, hits = 0, different = 0;
    for (const Case& c : cases) {
        const auto bvh = BasicBvh<T>::build(triangles(c.mesh.vertices, c.mesh.faces), best);
        CAPTURE(c.mesh.name);
        if (c.mesh.name == "blades" || c.mesh.name == "slivers") CHECK(duplicates(bvh) > 15);
        const PrunedBruteForce<T> all(corners(c.mesh));
        Random random(7);
        for (std::size_t i = 0; i < 90000; ++i) {
            const Ray<T> ray = hard_ray(c.mesh, i, random, 1, c.center);
            if (is_black(ray.direction)) continue;
            const Hit<T> hit = bvh.intersect(ray);
            const T expected = all.nearest(ray);
            ++rays;
            hits += std::size_t(bool(hit));
            different += std::size_t(hit.t != expected || bvh.occluded(ray) != is_finite(expected));
        }
    }
    CHECK(rays > 500000); // and as many of the other scalar
    CHECK(hits > rays / 8);
    CHECK(different == 0);
}

TEST_CASE_TEMPLATE("Cut triangles 2^50 times larger or smaller: the same t, to the bit", T, float, double) {
    const lambent_test::Mesh<T> mesh = blades<T>(3000, 8);
    const PrunedBruteForce<T> all(corners(mesh));
    for (const int exponent : {-50, 50}) {
        const T scale = std::ldexp(T(1), exponent);
        const lambent_test::Mesh<T> other = mapped<T>(mesh, scale, Vec3<T>(0));
        const auto bvh = BasicBvh<T>::build(triangles(other.vertices, other.faces), best);
        CHECK(duplicates(bvh) > 60);
        Random random(9);
        std::size_t different = 0, hits = 0;
        for (std::size_t i = 0; i < 30000; ++i) {
            Ray<T> ray{random.in_box<T>(-1.5, 1.5), random.in_box<T>(-1, 1), 0, 3};
            const T expected = all.nearest(ray);
            ray.origin *= scale;
            ray.direction *= scale;
            different += std::size_t(bvh.intersect(ray).t != expected);
            hits += std::size_t(is_finite(expected));
        }
        CHECK(hits > 3000);
        CHECK(different == 0);
    }
}

TEST_CASE_TEMPLATE("The leaves' boxes around the parts of a triangle cover all of it", T, float, double) {
    const Vec3<T> far(1000, -3, 70);
    for (const lambent_test::Mesh<T>& mesh : {blades<T>(3000, 10), slivers<T>(2000, 11), mapped<T>(blades<T>(2000, 12), 1, far),
                                degenerate<T>(3000, 13)}) {
        const auto bvh = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces), best);
        std::vector<std::vector<Bounds3<T>>> parts(mesh.faces.size());
        std::vector<std::uint32_t> leaf_of(mesh.faces.size(), ~0u);
        std::size_t twice_in_a_leaf = 0;
        for_each_place(bvh, [&](std::uint32_t primitive, const Bounds3<T>& box, std::uint32_t leaf) {
            parts[primitive].push_back(box);
            twice_in_a_leaf += std::size_t(leaf_of[primitive] == leaf);
            leaf_of[primitive] = leaf;
        });
        CHECK(twice_in_a_leaf == 0);
        std::size_t in_tree = 0, cut = 0, uncovered = 0;
        Random random(14);
        for (std::size_t i = 0; i < parts.size(); ++i) {
            if (parts[i].empty()) continue;
            ++in_tree;
            cut += std::size_t(parts[i].size() > 1);
            const Corners<T> p = mesh.triangle(i);
            using Long = long double; // exact enough to need no tolerance
            const auto check = [&](Long u, Long v, int exact_axis, T exact) {
                bool covered = false;
                for (const Bounds3<T>& box : parts[i]) {
                    bool inside = true;
                    for (int axis = 0; axis < 3; ++axis) {
                        Long x = Long(p[0][axis]) * (1 - u - v) + Long(p[1][axis]) * u + Long(p[2][axis]) * v;
                        if (axis == exact_axis) x = Long(exact);
                        const Long last_bits = std::abs(x) * 1e-18L;
                        inside = inside && x >= Long(box.min[axis]) - last_bits && x <= Long(box.max[axis]) + last_bits;
                    }
                    covered = covered || inside;
                }
                uncovered += std::size_t(!covered);
            };
            for (int k = 0; k < 100; ++k) {
                Long u = Long(random.uniform()), v = Long(random.uniform());
                if (u + v > 1) {
                    u = 1 - u;
                    v = 1 - v;
                }
                check(u, v, -1, 0);
            }
            for (const Bounds3<T>& box : parts[i]) // where edges cross the planes of boxes, the cuts among them
                for (int axis = 0; axis < 3; ++axis)
                    for (const T plane : {box.min[axis], box.max[axis]})
                        for (std::size_t e = 0; e < 3; ++e) {
                            const T from = p[e][axis], to = p[(e + 1) % 3][axis];
                            if (!(std::min(from, to) < plane && plane < std::max(from, to))) continue;
                            const Long w = (Long(plane) - Long(from)) / (Long(to) - Long(from));
                            check(e == 0 ? w : e == 1 ? 1 - w : 0, e == 1 ? w : e == 2 ? 1 - w : 0, axis, plane);
                        }
        }
        CAPTURE(mesh.name);
        CHECK(in_tree == bvh.triangle_count());
        CHECK(in_tree + bvh.dropped() == mesh.faces.size());
        CHECK(cut > (mesh.name == "degenerate" ? 10u : 50u));
        CHECK(uncovered == 0);
        CHECK(statistics(bvh).depth <= detail::max_depth);
        CHECK(duplicates(bvh) <= mesh.faces.size() / 2);
    }
}

TEST_CASE("Cutting pays where triangles lie aslant, and nothing is cut where it does not") {
    const auto cost = [](const lambent_test::Mesh<float>& mesh, BuildQuality quality) {
        return statistics(Bvh::build(triangles(mesh.vertices, mesh.faces), {.quality = quality})).sah_cost;
    };
    const lambent_test::Mesh<float> aslant = blades<float>(4000, 15), even = sphere<float>(80, 60, 0.2, 16);
    CHECK(cost(aslant, BuildQuality::best) < 0.95 * cost(aslant, BuildQuality::balanced));
    CHECK(cost(even, BuildQuality::best) <= 1.01 * cost(even, BuildQuality::balanced));
    CHECK(duplicates(Bvh::build(triangles(even.vertices, even.faces), best)) < even.faces.size() / 50);
}

TEST_CASE("With cut triangles the tree is the same bits for any number of threads") {
    const lambent_test::Mesh<float> mesh = blades<float>(30000, 17);
    const auto set = triangles(mesh.vertices, mesh.faces);
    const Bvh serial = Bvh::build(set, best);
    CHECK(duplicates(serial) > 1000);
    for (const unsigned threads : {2u, 5u}) {
        ThreadExecutor executor(threads);
        const Bvh parallel = Bvh::build(set, best, executor);
        const auto same = [](const auto& a, const auto& b) {
            return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0;
        };
        CHECK(same(serial.tree().nodes, parallel.tree().nodes));
        CHECK(same(serial.tree().blocks, parallel.tree().blocks));
    }
}

TEST_CASE("Best builds of many copies, of equal centres and of rubbish answer, and stay shallow") {
    const std::vector<Vec3f> vertices = {{-1, -1, 2}, {1, -1, 2.5f}, {0, 1, 2}};
    const std::vector<UVec3> faces(200000, UVec3(0, 1, 2));
    const Bvh copies = Bvh::build(triangles(vertices, faces), best);
    CHECK(copies.triangle_count() == 200000);
    CHECK(copies.occluded({}));
    CHECK(statistics(copies).depth <= 20);

    lambent_test::Mesh<float> nested{"nested", {}, {}};
    for (int i = 0; i < 5000; ++i) { // one centre; aslant
        const float r = 1 + float(i);
        const auto first = std::uint32_t(nested.vertices.size());
        nested.vertices.insert(nested.vertices.end(), {{-r, -r, -r}, {r, r, r}, {0, r / 2, -r / 2}});
        nested.faces.push_back({first, first + 1, first + 2});
    }
    const Bvh around = Bvh::build(triangles(nested.vertices, nested.faces), best);
    CHECK(around.triangle_count() == 5000);
    CHECK(statistics(around).depth <= detail::max_depth);

    lambent_test::Mesh<float> mesh = blades<float>(3000, 18);
    Random random(19);
    for (int i = 0; i < 30000; ++i) { // of random bits
        const auto any = [&] { return std::bit_cast<float>(std::uint32_t(random.bits() >> 32)); };
        mesh.vertices.push_back({any(), any(), any()});
        const auto n = std::uint32_t(mesh.vertices.size());
        if (i % 3 == 2) mesh.faces.push_back({n - 3, n - 2, n - 1});
    }
    const Bvh rubbish = Bvh::build(triangles(mesh.vertices, mesh.faces), best);
    CHECK(statistics(rubbish).depth <= detail::max_depth);
    std::size_t lost = 0;
    for (std::size_t i = 0; i < 3000; i += 3) {
        const Corners<float> p = mesh.triangle(i);
        const Vec3f center = (p[0] + p[1] + p[2]) / 3.0f, n = normalize(cross(p[1] - p[0], p[2] - p[0]));
        if (is_finite(n)) lost += std::size_t(!rubbish.occluded({center - 0.5f * n, n, 0, 1}));
    }
    CHECK(lost == 0);
}
