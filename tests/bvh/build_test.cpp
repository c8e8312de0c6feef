#include "support/brute_force.hpp"
#include "support/meshes.hpp"
#include "support/random.hpp"
#include "support/rays.hpp"
#include <array>
#include <bit>
#include <cstring>
#include <deque>
#include <doctest/doctest.h>
#include <lambent/bvh/bvh.hpp>
#include <lambent/bvh/statistics.hpp>
#include <lambent/core/parallel.hpp>
#include <random>
#include <span>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

template <class Mesh>
bool hits(const BasicBvh<float>& bvh, const Mesh& mesh, std::size_t i) {
    const auto p = mesh.vertices(i);
    const Vec3f center = (p[0] + p[1] + p[2]) / 3.0f;
    return bool(bvh.intersect({center - Vec3f(0, 0, 1), {0, 0, 1}}));
}

struct OwnVertex {
    double junk;
    float position[3];
};

} // namespace

TEST_CASE_TEMPLATE("Empty sets, one triangle and nothing but rubbish build and answer", T, float, double) {
    const BasicBvh<T> untouched;
    CHECK(untouched.empty());
    CHECK_FALSE(untouched.intersect({}));
    CHECK(statistics(untouched).nodes == 0);

    std::vector<Vec3<T>> vertices;
    std::vector<UVec3> faces;
    auto bvh = BasicBvh<T>::build(triangles(vertices, faces));
    CHECK(bvh.empty());
    CHECK_FALSE(bvh.occluded({}));
    CHECK(bvh.bounds().empty());

    vertices = {{-1, -1, 2}, {1, -1, 2}, {0, 1, 2}};
    faces = {{0, 1, 2}};
    bvh = BasicBvh<T>::build(triangles(vertices, faces));
    CHECK_FALSE(bvh.empty());
    CHECK(bvh.triangle_count() == 1);
    const Hit<T> hit = bvh.intersect({});
    CHECK(hit.t == 2);
    CHECK(hit.primitive == 0);
    CHECK(hit.u == T(0.25));
    CHECK(hit.v == T(0.5));
    CHECK(bvh.bounds().min == Vec3<T>(-1, -1, 2));
    CHECK(bvh.bounds().max == Vec3<T>(1, 1, 2));

    constexpr T nan = std::numeric_limits<T>::quiet_NaN();
    vertices = {{nan, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 1, std::numeric_limits<T>::infinity()}};
    faces = {{0, 1, 2}, {1, 2, 3}, {1, 1, 2}, {2, 1, 1}, {1, 2, 1}};
    bvh = BasicBvh<T>::build(triangles(vertices, faces));
    CHECK(bvh.empty());
    CHECK(bvh.dropped() == 5);
}

TEST_CASE("Identifiers stay those of the caller when triangles are dropped") {
    const lambent_test::Mesh<float> mesh = degenerate<float>(300, 8);
    const auto set = triangles(mesh.vertices, mesh.faces);
    const Bvh bvh = Bvh::build(set);
    CHECK(bvh.dropped() == 4 * 30); // points, needles of two vertices, NaN, infinity
    CHECK(bvh.dropped() + bvh.triangle_count() == 300);
    Random random(2);
    std::size_t checked = 0;
    for (std::size_t i = 0; i < 20000; ++i) {
        const Rayf ray = hard_ray(mesh, i, random);
        if (const Hit<float> hit = bvh.intersect(ray)) {
            const ScalarTest<float> test(ray);
            float t = 0;
            REQUIRE(test(mesh.triangle(hit.primitive), ray.t_max, t));
            REQUIRE(t == hit.t);
            ++checked;
        }
    }
    CHECK(checked > 1000);
}

TEST_CASE("A million copies of one triangle build, answer, and stay shallow") {
    const std::vector<Vec3f> vertices = {{-1, -1, 2}, {1, -1, 2}, {0, 1, 2}};
    const std::vector<UVec3> faces(1000000, UVec3(0, 1, 2));
    const Bvh bvh = Bvh::build(triangles(vertices, faces));
    CHECK(bvh.triangle_count() == 1000000);
    CHECK(bvh.intersect({}).t == 2);
    CHECK(bvh.occluded({}));
    CHECK_FALSE(bvh.occluded({{5, 0, 0}, {0, 0, 1}}));
    CHECK(statistics(bvh).depth <= 20);
}

TEST_CASE("Triangles around one centre, and sizes that halve for ever, keep the depth bounded") {
    std::vector<Vec3f> vertices;
    std::vector<UVec3> faces;
    for (int i = 0; i < 5000; ++i) { // equal centres, other boxes
        const float r = 1 + float(i);
        const auto first = std::uint32_t(vertices.size());
        vertices.insert(vertices.end(), {{-r, -r, 0}, {r, -r, 0}, {0, r, 0}});
        faces.push_back({first, first + 1, first + 2});
    }
    for (int k = 0; k < 20; ++k)
        for (int i = -120; i < 120; ++i) { // each bin holds all but one of the rest
            const float x = std::ldexp(1.0f, i);
            const auto first = std::uint32_t(vertices.size());
            vertices.insert(vertices.end(), {{x, 0, 1}, {x * 1.5f, 0, 1}, {x, x / 2, 1}});
            faces.push_back({first, first + 1, first + 2});
        }
    const Bvh bvh = Bvh::build(triangles(vertices, faces));
    CHECK(bvh.dropped() == 0);
    CHECK(statistics(bvh).depth <= detail::max_depth);
    CHECK(bvh.intersect({{0, 0, -1}, {0, 0, 1}}).t == 1);
    CHECK(bvh.intersect({{1.1f, 0.1f, 2}, {0, 0, -1}}).t == 1);
}

TEST_CASE_TEMPLATE("Triangles of random bits build; sound ones among them are still found", T, float, double) {
    Random random(6);
    lambent_test::Mesh<T> mesh = soup<T>(3000, 0.1, 3);
    for (int i = 0; i < 60000; ++i) {
        using Bits = typename detail::FloatBits<T>::Type;
        mesh.vertices.push_back({std::bit_cast<T>(Bits(random.bits() >> (64 - 8 * sizeof(T)))),
                                 std::bit_cast<T>(Bits(random.bits() >> (64 - 8 * sizeof(T)))),
                                 std::bit_cast<T>(Bits(random.bits() >> (64 - 8 * sizeof(T))))});
        if (i % 3 == 0) {
            const auto first = std::uint32_t(mesh.vertices.size() - 1);
            mesh.faces.push_back({first, first + 1, first + 2});
        }
    }
    const auto bvh = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
    CHECK(statistics(bvh).depth <= detail::max_depth);
    CHECK(bvh.dropped() > 0);
    std::size_t lost = 0;
    for (std::size_t i = 0; i < 3000; ++i) {
        const Corners<T> p = mesh.triangle(i);
        const Vec3<T> center = (p[0] + p[1] + p[2]) / T(3), n = cross(p[1] - p[0], p[2] - p[0]);
        const Ray<T> ray{center - n, n, T(0.5), T(1.5)};
        if (is_black(n)) continue;
        lost += std::size_t(!bvh.occluded(ray));
    }
    CHECK(lost == 0);
}

TEST_CASE("The tree is the same bits for any number of threads, and for the serial build") {
    const lambent_test::Mesh<float> mesh = soup<float>(60000, 0.02, 4);
    const auto set = triangles(mesh.vertices, mesh.faces);
    const Bvh serial = Bvh::build(set);
    for (const unsigned threads : {1u, 2u, 5u}) {
        ThreadExecutor executor(threads);
        const Bvh parallel = Bvh::build(set, {}, executor);
        const auto same = [](const auto& a, const auto& b) {
            return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0;
        };
        CHECK(same(serial.tree().nodes, parallel.tree().nodes));
        CHECK(same(serial.tree().blocks, parallel.tree().blocks));
    }
}

TEST_CASE_TEMPLATE("Every triangle lies once in the tree, inside of all boxes above it", T, float, double) {
    const lambent_test::Mesh<T> mesh = degenerate<T>(20000, 4);
    const auto bvh = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
    const auto& tree = bvh.tree();
    std::vector<int> seen(mesh.faces.size());
    std::size_t outside = 0;
    const auto check = [&](const auto& self, std::uint32_t child, Bounds3<T> box) -> void {
        if ((child & detail::Child::leaf_bit) == 0) {
            const auto& node = tree.nodes[child];
            for (int lane = 0; lane < node_width<T>; ++lane) {
                if (!(node.plane[0][lane] <= node.plane[1][lane])) continue;
                Bounds3<T> inner;
                for (int k = 0; k < 3; ++k) {
                    inner.min[k] = node.plane[2 * k][lane];
                    inner.max[k] = node.plane[2 * k + 1][lane];
                    outside += std::size_t(inner.min[k] < box.min[k] || inner.max[k] > box.max[k]);
                }
                self(self, node.child[lane], inner);
            }
            return;
        }
        const std::uint32_t first = child & detail::Child::index_mask;
        const std::uint32_t last = first + ((child & detail::Child::second_block_bit) != 0 ? 1 : 0);
        for (std::uint32_t b = first; b <= last; ++b)
            for (int lane = 0; lane < 4; ++lane) {
                const std::uint32_t primitive = tree.blocks[b].primitive[lane];
                if (primitive == no_primitive) continue;
                ++seen[primitive];
                for (std::size_t i = 0; i < 3; ++i)
                    for (int k = 0; k < 3; ++k) {
                        const T x = tree.blocks[b].vertex[i][k][lane];
                        outside += std::size_t(x != mesh.triangle(primitive)[i][k]);
                        outside += std::size_t(x < box.min[k] || x > box.max[k]);
                    }
            }
    };
    check(check, 0, bvh.bounds());
    CHECK(outside == 0);
    std::size_t once = 0, never = 0;
    for (const int n : seen) {
        once += std::size_t(n == 1);
        never += std::size_t(n == 0);
    }
    CHECK(once == bvh.triangle_count());
    CHECK(never == bvh.dropped());

    const BvhStatistics s = statistics(bvh);
    CHECK(s.triangles == once);
    CHECK(s.node_fill > 0.5);
    CHECK(s.block_fill > 0.4);
    CHECK(s.sah_cost > 1);
    CHECK(s.depth <= detail::max_depth);
    CHECK(s.bytes_per_triangle() < 100 * double(sizeof(T)) / 4);
}

TEST_CASE("A balanced build is cheaper for rays than a fast one, and answers the same") {
    std::mt19937 random(20);
    std::uniform_real_distribution<float> unit(-1, 1);
    const auto point = [&] { return Vec3f(unit(random), unit(random), unit(random)); };
    std::vector<Vec3f> vertices;
    std::vector<UVec3> faces;
    const auto add = [&](Vec3f a, Vec3f b, Vec3f c) {
        const unsigned n = unsigned(vertices.size());
        for (const Vec3f& p : {a, b, c}) vertices.push_back(p);
        faces.emplace_back(n, n + 1, n + 2);
    };
    for (int cluster = 0; cluster < 1600; ++cluster) { // small things in heaps, and from each a long one
        const Vec3f center = point() * Vec3f(1, 1, 0.2f);
        for (int k = 0; k < 20; ++k) {
            const Vec3f p = center + 0.03f * point();
            add(p, p + 0.01f * point(), p + 0.01f * point());
        }
        const Vec3f end = center + 2.0f * point();
        add(center, end, end + 0.01f * point());
    }
    const auto mesh = triangles(vertices, faces);
    BuildOptions options;
    options.quality = BuildQuality::fast;
    const Bvh fast = Bvh::build(mesh, options);
    options.quality = BuildQuality::balanced;
    const Bvh balanced = Bvh::build(mesh, options);
    const BvhStatistics before = statistics(fast), after = statistics(balanced);
    CAPTURE(before.sah_cost);
    CAPTURE(after.sah_cost);
    CHECK(after.sah_cost < 0.95 * before.sah_cost);
    CHECK(after.triangles == before.triangles);
    std::size_t hit_count = 0;
    for (int i = 0; i < 20000; ++i) {
        const Rayf ray{2.0f * point(), point()};
        const Hit<float> a = fast.intersect(ray), b = balanced.intersect(ray);
        hit_count += bool(a);
        REQUIRE(a.t == b.t);
        REQUIRE(fast.occluded(ray) == balanced.occluded(ray));
    }
    CHECK(hit_count > 100);
}

TEST_CASE("Vertices and faces of many kinds make the same tree") {
    const lambent_test::Mesh<float> mesh = cube<float>(3);
    std::vector<OwnVertex> own;
    for (const Vec3f& v : mesh.vertices) own.push_back({0, {v.x, v.y, v.z}});
    std::vector<std::uint32_t> flat32;
    std::vector<std::uint16_t> flat16;
    std::vector<std::array<std::uint16_t, 3>> threes;
    for (const UVec3& f : mesh.faces) {
        for (int k = 0; k < 3; ++k) {
            flat32.push_back(f[k]);
            flat16.push_back(std::uint16_t(f[k]));
        }
        threes.push_back({std::uint16_t(f[0]), std::uint16_t(f[1]), std::uint16_t(f[2])});
    }
    const std::deque<UVec3> deque(mesh.faces.begin(), mesh.faces.end());
    const auto projection = [](const OwnVertex& v) { return Vec3f(v.position[0], v.position[1], v.position[2]); };
    const auto in_double = [](const Vec3f& v) { return Vec3d(v); };

    const auto plain = triangles(mesh.vertices, mesh.faces);
    const auto check = [&](const auto& set) {
        REQUIRE(set.count() == plain.count());
        std::size_t different = 0;
        for (std::size_t i = 0; i < set.count(); ++i) different += std::size_t(set.vertices(i) != plain.vertices(i));
        CHECK(different == 0);
        const Bvh bvh = Bvh::build(set);
        CHECK(bvh.triangle_count() == plain.count());
        CHECK(hits(bvh, set, 0));
    };
    check(plain);
    check(triangles(std::span(mesh.vertices), std::span(mesh.faces)));
    check(triangles(own, flat32, projection));
    check(triangles(own, flat16, projection));
    check(triangles(own, threes, projection));
    check(triangles(mesh.vertices, deque));
    CHECK(BasicBvh<double>::build(triangles(mesh.vertices, mesh.faces, in_double)).triangle_count() == plain.count());

    flat32.pop_back();
    CHECK_THROWS_WITH_AS(triangles(own, flat32, projection), "triangles: 323 indices are not a multiple of 3", Error);
    const std::vector<UVec3> wrong = {{0, 1, 2}, {0, 999, 1}};
    CHECK_THROWS_WITH_AS(triangles(mesh.vertices, wrong), "triangles: face 1 refers to vertex 999 of 56", Error);
    CHECK_THROWS_AS(Bvh::build(plain, {.bins = 1}), Error);
    CHECK_THROWS_AS(Bvh::build(plain, {.block_cost = 0}), Error);
}

TEST_CASE_TEMPLATE("Any-hit rays look first where a hit is likely: at a wall, not at the dust before it", T, float, double) {
    Mesh<T> mesh = soup<T>(3000, 0.01, 5);
    const auto corner = std::uint32_t(mesh.vertices.size());
    for (int i = 0; i < 4; ++i) mesh.vertices.push_back({T(i & 1) * 4 - 2, T(i >> 1) * 4 - 2, T(1.5)});
    mesh.faces.push_back({corner, corner + 1, corner + 2});
    mesh.faces.push_back({corner + 3, corner + 2, corner + 1});
    struct Counting {
        std::size_t& nodes;
        void node() const { ++nodes; }
        bool operator()(std::uint32_t, T, T, T) const { return true; }
    };
    for (const BuildQuality quality : {BuildQuality::fast, BuildQuality::balanced, BuildQuality::best}) {
        const auto bvh = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces), {.quality = quality});
        Random random(11);
        std::size_t nodes = 0, occluded = 0;
        for (int i = 0; i < 1000; ++i) {
            Vec3<T> from = random.in_box<T>(-1, 1), to = random.in_box<T>(-1, 1);
            from.z = -2;
            to.z = 2;
            occluded += bvh.occluded({from, to - from}, Counting{nodes});
        }
        CHECK(occluded == 1000);
        CHECK(nodes < 1200); // a leaf with the wall is a child of the root
    }
}
