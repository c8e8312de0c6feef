// Boxes that must be met, rays and triangles of any bits. Rays at edges and vertices are shot by watertight.cpp, which
// tests/stress.sh runs, and in small numbers by tests/bvh/watertight_test.cpp; the 729 slab cases against brute force
// are in tests/bvh/oracle_test.cpp, and of all layouts alike in layouts.cpp.
#include "stress/table.hpp"
#include "support/meshes.hpp"
#include "support/random.hpp"
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <doctest/doctest.h>
#include <lambent/bvh/bvh.hpp>
#include <lambent/bvh/statistics.hpp>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

/// Flat needles across the box from -1 to 1, in planes of the axes: their boxes have no thickness and hardly a width.
lambent_test::Mesh<float> flat_needles(std::size_t count, std::uint64_t seed) {
    lambent_test::Mesh<float> mesh{"needles", {}, {}};
    Random random(seed);
    for (std::size_t i = 0; i < count; ++i) {
        const int axis = int(i % 3), along = (axis + 1) % 3, thin = (axis + 2) % 3;
        Vec3f a = random.in_box<float>(-1, 1), b = a, c = a;
        b[along] = float(random.uniform(-1, 1));
        c[along] = a[along] / 2 + b[along] / 2;
        c[thin] += float(std::exp(random.uniform(std::log(3e-7), std::log(1e-3))));
        for (const Vec3f& v : {a, b, c}) mesh.vertices.push_back(v);
        const auto first = std::uint32_t(3 * i);
        mesh.faces.push_back({first, first + 1, first + 2});
    }
    return mesh;
}

/// A box as most programs meet it: planes minus origin times the reciprocal, no margin.
bool naive_slab(const detail::WideNode<float>& node, int lane, const Rayf& ray) {
    float near = 0, far = std::numeric_limits<float>::infinity();
    for (int k = 0; k < 3; ++k) {
        const float inverse = 1 / ray.direction[k];
        const float a = (node.plane[2 * k][lane] - ray.origin[k]) * inverse,
                    b = (node.plane[2 * k + 1][lane] - ray.origin[k]) * inverse;
        near = std::max(near, std::min(a, b));
        far = std::min(far, std::max(a, b));
    }
    return near <= far;
}

/// Where a tree's nodes and triangles hang.
struct Ancestors {
    std::vector<std::pair<std::uint32_t, int>> of_node, of_triangle; ///< node and lane; node 0 has none

    Ancestors(const Bvh& bvh, std::size_t faces) : of_node(bvh.tree().nodes.size()), of_triangle(faces) {
        using detail::Child;
        const auto& tree = bvh.tree();
        for (std::uint32_t n = 0; n < tree.nodes.size(); ++n)
            for (int lane = 0; lane < node_width<float>; ++lane) {
                if (!(tree.nodes[n].plane[0][lane] <= tree.nodes[n].plane[1][lane])) continue;
                const std::uint32_t child = tree.nodes[n].child[lane];
                if ((child & Child::leaf_bit) == 0) {
                    of_node[child] = {n, lane};
                    continue;
                }
                const std::uint32_t first = child & Child::index_mask;
                for (std::uint32_t b = first; b < first + ((child & Child::second_block_bit) != 0 ? 2 : 1); ++b)
                    for (const std::uint32_t id : tree.blocks[b].primitive)
                        if (id != no_primitive) of_triangle[id & ~detail::hidden_bit] = {n, lane};
            }
    }
};

/// Whether a ray passes the inside of a triangle by a margin of its barycentric coordinates, in double.
bool passes(const Rayf& ray, const std::array<Vec3f, 3>& v, double margin) {
    const Vec3d o(ray.origin), d(ray.direction), a = Vec3d(v[0]) - o, b = Vec3d(v[1]) - o, c = Vec3d(v[2]) - o;
    const double u = dot(d, cross(b, c)), w = dot(d, cross(c, a)), x = dot(d, cross(a, b)), sum = u + w + x;
    return sum != 0 && u / sum > margin && w / sum > margin && x / sum > margin;
}

} // namespace

TEST_CASE("rays: through the inside of triangles -> every ancestor's box is met") {
    Random random(5);
    const std::uint64_t wanted = inputs(1e6, 1e8);
    std::size_t rays = 0, missed = 0, naive_missed = 0, lost = 0;
    for (std::uint64_t round = 0; rays < wanted; ++round) {
        const lambent_test::Mesh<float> mesh = round % 4 == 0   ? slivers<float>(4000, round)
                                               : round % 4 == 1 ? sphere<float>(80, 40, 0.5, round)
                                                                : flat_needles(4000, round);
        const Bvh bvh = Bvh::build(triangles(mesh.vertices, mesh.faces));
        const Ancestors ancestors(bvh, mesh.faces.size());
        for (std::uint64_t i = 0; i < wanted / 8 + 1; ++i) {
            const std::size_t face = random.index(mesh.faces.size());
            const std::array<Vec3f, 3> v = mesh.triangle(face);
            double a = random.uniform(0.05, 0.9), b = random.uniform(0.05, 0.9);
            if (a + b > 0.95) continue;
            const Vec3d target = a * Vec3d(v[0]) + b * Vec3d(v[1]) + (1 - a - b) * Vec3d(v[2]);
            Rayf ray;
            ray.origin = random.in_box<float>(-3, 3);
            ray.direction = Vec3f(target - Vec3d(ray.origin));
            if (i % 8 == 0) { // along an axis, with zeros of both signs
                const int axis = int(random.index(3));
                ray.origin = Vec3f(target);
                ray.origin[axis] = -3;
                ray.direction = Vec3f(random.below(2) == 0 ? 0.0f : -0.0f);
                ray.direction[axis] = 1;
            }
            if (!passes(ray, v, 0.01)) continue;
            detail::SlabRay<float> slabs;
            if (!slabs.start(ray, bvh.tree())) continue;
            ++rays;
            bool all = true, naive_all = true;
            for (auto [node, lane] = ancestors.of_triangle[face];;) {
                detail::SlabRay<float>::Lanes entry;
                all = all &&
                      (bits(slabs.meets(bvh.tree().nodes[node], slabs.limit_of(ray.t_max), entry)) >> lane & 1) != 0;
                naive_all = naive_all && naive_slab(bvh.tree().nodes[node], lane, ray);
                if (node == 0) break;
                std::tie(node, lane) = ancestors.of_node[node];
            }
            missed += std::size_t(!all);
            naive_missed += std::size_t(!naive_all);
            if (round % 4 == 1)
                lost += std::size_t(!bvh.occluded(ray)); // the others are thinner than vertices are rounded
        }
    }
    record({"rays", "rays through triangles -> share that misses an ancestor's box; naive: slabs without margin",
            double(rays), double(missed + lost), double(missed) / double(rays), 0,
            double(naive_missed) / double(rays)});
}

TEST_CASE("rays: NaN, infinity, denormals in any field -> no hit where the ray is none") {
    const lambent_test::Mesh<float> mesh = sphere<float>(40, 20, 0.3, 1);
    const Bvh bvh = Bvh::build(triangles(mesh.vertices, mesh.faces));
    Random random(6);
    const float values[] = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                            -std::numeric_limits<float>::infinity()};
    std::size_t rays = 0, hits = 0, naive_hits = 0, disagree = 0;
    for (std::uint64_t i = 0; i < inputs(1e5, 1e7); ++i) {
        Rayf ray{random.in_box<float>(-0.3, 0.3), random.in_box<float>(-1, 1)};
        const std::uint32_t field = random.below(7);
        const float value = values[random.below(field == 6 ? 1 : 3)];
        if (field < 3)
            ray.origin[int(field)] = value;
        else if (field < 6)
            ray.direction[int(field) - 3] = value;
        else
            (random.below(2) == 0 ? ray.t_min : ray.t_max) = value;
        hits += std::size_t(bool(bvh.intersect(ray))) + std::size_t(bvh.occluded(ray));
        ++rays;
        // A triangle test that refuses what is outside, instead of accepting what is inside.
        const std::array<Vec3f, 3> v = mesh.triangle(random.index(mesh.faces.size()));
        const Vec3f e1 = v[1] - v[0], e2 = v[2] - v[0], p = cross(ray.direction, e2), s = ray.origin - v[0],
                    q = cross(s, e1);
        const float f = 1 / dot(e1, p), u = f * dot(s, p), w = f * dot(ray.direction, q), t = f * dot(e2, q);
        naive_hits += std::size_t(!(u < 0 || w < 0 || u + w > 1 || t < ray.t_min || t > ray.t_max));
        // whatever bits: the queries agree
        Rayf any;
        for (int k = 0; k < 3; ++k) {
            any.origin[k] = std::bit_cast<float>(random.bits32());
            any.direction[k] = std::bit_cast<float>(random.bits32());
        }
        disagree += std::size_t(bool(bvh.intersect(any)) != bvh.occluded(any));
    }
    record({"rays", "rays with NaN or infinity -> share that hits; naive: outside is refused", double(rays),
            double(hits + disagree), double(hits) / double(rays), 0, double(naive_hits) / double(rays)});
}

TEST_CASE("rays: triangles of random bits -> a sound tree, sound triangles among them are hit") {
    Random random(6);
    constexpr std::size_t sound = 3000;
    lambent_test::Mesh<float> mesh = soup<float>(sound, 0.1, 3);
    const std::uint64_t count = inputs(20000, 1e6);
    std::size_t naive_dropped = 0;
    for (std::uint64_t i = 0; i < count; ++i) {
        bool finite = true;
        for (int k = 0; k < 3; ++k) {
            Vec3f v;
            for (int c = 0; c < 3; ++c) v[c] = std::bit_cast<float>(random.bits32());
            mesh.vertices.push_back(v);
            finite = finite && is_finite(v);
        }
        naive_dropped += std::size_t(!finite); // what a builder that trusts its input would take
        const auto first = std::uint32_t(mesh.vertices.size() - 3);
        mesh.faces.push_back({first, first + 1, first + 2});
    }
    std::size_t failures = 0;
    for (const BuildQuality quality : {BuildQuality::fast, BuildQuality::balanced}) {
        const Bvh bvh = Bvh::build(triangles(mesh.vertices, mesh.faces), {.quality = quality});
        failures += std::size_t(statistics(bvh).depth > detail::max_depth) + std::size_t(bvh.dropped() < naive_dropped);
        for (std::size_t i = 0; i < sound; ++i) {
            const std::array<Vec3f, 3> p = mesh.triangle(i);
            const Vec3f center = (p[0] + p[1] + p[2]) / 3.0f, n = cross(p[1] - p[0], p[2] - p[0]);
            failures += std::size_t(!is_black(n) && !bvh.occluded(Rayf{center - n, n, 0.5f, 1.5f}));
        }
    }
    record({"rays", "triangles of random bits -> lost sound triangles, unsound trees; naive: boxes not finite",
            double(count), double(failures), double(failures), 0, double(naive_dropped)});
}
