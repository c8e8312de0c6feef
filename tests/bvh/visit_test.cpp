#include "support/brute_force.hpp"
#include "support/doubled.hpp"
#include "support/meshes.hpp"
#include "support/random.hpp"
#include <algorithm>
#include <array>
#include <cmath>
#include <doctest/doctest.h>
#include <lambent/bvh/closest_point.hpp>
#include <lambent/bvh/visit.hpp>
#include <limits>
#include <utility>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

/// What a camera may see, box by box.
struct Frustum {
    std::array<Vec4f, 6> planes; // xyz points inwards
    std::vector<std::uint32_t> visible;
    int asked = 0;

    bool enter(const Bounds3<float>& box) {
        ++asked;
        for (const Vec4f& p : planes) {
            const float radius = dot(abs(Vec3f(p)), box.size()) / 2;
            if (dot(Vec3f(p), box.center()) + p.w < -radius) return false;
        }
        return true;
    }
    void visit(std::uint32_t primitive) { visible.push_back(primitive); }
};

/// The k triangles whose centres are nearest to a point.
template <class T>
struct NearestCenters {
    Vec3<T> p;
    std::size_t k;
    const lambent_test::Mesh<T>& mesh;
    std::vector<std::pair<T, std::uint32_t>> heap; // the farthest on top
    int visits = 0;

    T distance_to(std::uint32_t primitive) const {
        const Corners<T> c = mesh.triangle(primitive);
        return length((c[0] + c[1] + c[2]) / T(3) - p);
    }
    T enter(const Bounds3<T>& box) const { return length(p - glm::clamp(p, box.min, box.max)); }
    T limit() const { return heap.size() < k ? std::numeric_limits<T>::infinity() : heap.front().first; }
    void visit(std::uint32_t primitive) {
        ++visits;
        heap.push_back({distance_to(primitive), primitive});
        std::push_heap(heap.begin(), heap.end());
        if (heap.size() > k) {
            std::pop_heap(heap.begin(), heap.end());
            heap.pop_back();
        }
    }
};

} // namespace

TEST_CASE("A visitor culls by a frustum: nothing seen is lost, little else is visited") {
    const lambent_test::Mesh<float> mesh = soup<float>(20000, 0.01, 2);
    const Bvh bvh = Bvh::build(triangles(mesh.vertices, mesh.faces));
    Random random(3);
    for (int i = 0; i < 20; ++i) {
        // From eye along `forward`, 60 degrees wide and high.
        const Vec3f eye = random.in_box<float>(-1, 1), forward = normalize(random.in_box<float>(-1, 1));
        const Vec3f right = normalize(cross(forward, Vec3f(0, 1, 0))), up = cross(right, forward);
        const auto plane = [&](Vec3f n, Vec3f at) { return Vec4f(n, -dot(n, at)); };
        const float s = std::sin(0.5236f), c = std::cos(0.5236f);
        Frustum frustum{{plane(forward, eye), plane(-forward, eye + forward), plane(s * forward + c * right, eye),
                         plane(s * forward - c * right, eye), plane(s * forward + c * up, eye),
                         plane(s * forward - c * up, eye)}, {}};
        traverse(bvh, frustum);
        std::vector<int> times(mesh.faces.size());
        for (const std::uint32_t p : frustum.visible) ++times[p];
        std::size_t inside = 0, lost = 0;
        for (std::size_t k = 0; k < times.size(); ++k) {
            const auto sees = [&](const Vec3f& v) {
                return std::all_of(frustum.planes.begin(), frustum.planes.end(),
                                   [&](const Vec4f& p) { return dot(Vec3f(p), v) + p.w > 1e-5f; });
            };
            const Corners<float> t = mesh.triangle(k);
            if (!sees(t[0]) && !sees(t[1]) && !sees(t[2])) continue;
            ++inside;
            lost += std::size_t(times[k] == 0);
        }
        CHECK(lost == 0);
        CHECK(*std::max_element(times.begin(), times.end()) <= 1);
        CHECK(frustum.visible.size() < 2 * inside + 1000);
    }
}

TEST_CASE_TEMPLATE("A visitor finds the k nearest, nearest first, without looking at most of the tree", T, float, double) {
    const lambent_test::Mesh<T> mesh = soup<T>(5000, 0.02, 2);
    const auto bvh = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
    const auto twice = doubled_bvh(mesh);
    Random random(3);
    int visits = 0;
    for (int i = 0; i < 100; ++i) {
        const Vec3<T> p = random.in_box<T>(-1.2, 1.2);
        NearestCenters<T> search{p, 10, mesh, {}};
        traverse(bvh, search);
        visits += search.visits;
        std::vector<std::pair<T, std::uint32_t>> all;
        for (std::uint32_t k = 0; k < mesh.faces.size(); ++k) all.push_back({search.distance_to(k), k});
        std::partial_sort(all.begin(), all.begin() + 10, all.end());
        all.resize(10);
        std::sort_heap(search.heap.begin(), search.heap.end());
        CHECK(search.heap == all);

        NearestCenters<T> again{p, 10, mesh, {}};
        traverse(twice, again); // each once, or copies push out others
        std::sort_heap(again.heap.begin(), again.heap.end());
        CHECK(again.heap == all);
    }
    CHECK(visits < 100 * 100);
}

namespace {

struct Everything {
    std::vector<std::uint32_t> seen;
    std::size_t stop_at = std::numeric_limits<std::size_t>::max();
    bool enter(const Bounds3<float>&) const { return true; }
    bool visit(std::uint32_t primitive) {
        seen.push_back(primitive);
        return seen.size() < stop_at;
    }
};

struct ByHeight { // no limit; integers will do
    std::vector<std::uint32_t> seen;
    int enter(const Bounds3<float>& box) const { return int(box.min.z); }
    void visit(std::uint32_t primitive) { seen.push_back(primitive); }
};

struct Lowest : ByHeight { // once there is one, nothing else is of interest
    int limit() const { return seen.empty() ? std::numeric_limits<int>::max() : 0; }
};

} // namespace

TEST_CASE("A visitor that enters all boxes sees every primitive once, and may stop; keys alone decide the order") {
    const lambent_test::Mesh<float> mesh = soup<float>(1000, 0.3, 2);
    const Bvh bvh = Bvh::build(triangles(mesh.vertices, mesh.faces));
    Everything all;
    traverse(bvh, all);
    std::sort(all.seen.begin(), all.seen.end());
    CHECK(all.seen.size() == 1000);
    CHECK(std::adjacent_find(all.seen.begin(), all.seen.end()) == all.seen.end());
    Everything few{{}, 17};
    traverse(bvh, few);
    CHECK(few.seen.size() == 17);
    Everything none;
    traverse(Bvh(), none);
    CHECK(none.seen.empty());

    std::vector<Vec3f> vertices;
    std::vector<UVec3> faces;
    for (std::uint32_t i = 0; i < 500; ++i) {
        const float z = float((i * 7919) % 500 * 4);
        vertices.insert(vertices.end(), {{-1, -1, z}, {1, -1, z}, {0, 1, z + 1}});
        faces.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    ByHeight sorted;
    traverse(Bvh::build(triangles(vertices, faces)), sorted);
    REQUIRE(sorted.seen.size() == 500);
    std::size_t far = 0;
    for (std::size_t i = 1; i < 500; ++i) { // in order but for the eight at most of a leaf
        const float before = vertices[3 * sorted.seen[i - 1]].z, now = vertices[3 * sorted.seen[i]].z;
        far += std::size_t(before > now + 8 * 4);
    }
    CHECK(far == 0);
    Lowest lowest;
    traverse(Bvh::build(triangles(vertices, faces)), lowest);
    CHECK(lowest.seen.size() <= 8); // its leaf alone: what waited for its turn was asked about again
    CHECK(std::count(lowest.seen.begin(), lowest.seen.end(), 0u) == 1);
}
