#include "support/brute_force.hpp"
#include "support/meshes.hpp"
#include "support/random.hpp"
#include <bit>
#include <doctest/doctest.h>
#include <fstream>
#include <lambent/bvh/bvh.hpp>
#include <lambent/bvh/for_each_hit.hpp>
#include <lambent/bvh/statistics.hpp>
#include <limits>
#include <string>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

template <class T> constexpr T inf = std::numeric_limits<T>::infinity();

template <class T>
BasicBvh<T> build(const lambent_test::Mesh<T>& mesh) {
    return BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
}

/// t of the nearest hit, infinity for none; -1 where intersect, occluded and for_each_hit don't agree.
template <class T>
T nearest(const BasicBvh<T>& bvh, const Ray<T>& ray) {
    const Hit<T> hit = bvh.intersect(ray);
    T least = inf<T>;
    for_each_hit(bvh, ray, [&](const Hit<T>& h) { least = std::min(least, h.t); });
    return bvh.occluded(ray) == bool(hit) && least == hit.t ? hit.t : T(-1);
}

template <class T>
T brute_nearest(const lambent_test::Mesh<T>& mesh, const Ray<T>& ray) {
    std::vector<Corners<T>> all;
    for (std::size_t i = 0; i < mesh.faces.size(); ++i)
        if (finite_triangle(mesh.triangle(i))) all.push_back(mesh.triangle(i));
    return brute_force<T>(all, ray);
}

/// Squares of two triangles across the z axis, at z = 1, 2, 3 ...
template <class T>
lambent_test::Mesh<T> layers(int count) {
    lambent_test::Mesh<T> mesh{"layers", {}, {}};
    for (int i = 1; i <= count; ++i) {
        const auto n = std::uint32_t(mesh.vertices.size());
        for (const Vec3<T>& v : {Vec3<T>(-1, -1, i), Vec3<T>(1, -1, i), Vec3<T>(1, 1, i), Vec3<T>(-1, 1, i)})
            mesh.vertices.push_back(v);
        mesh.faces.push_back({n, n + 1, n + 2});
        mesh.faces.push_back({n, n + 2, n + 3});
    }
    return mesh;
}

} // namespace

TEST_CASE_TEMPLATE("t_min belongs to the range and t_max does not, to the bit", T, float, double) {
    const auto bvh = build(layers<T>(100));
    for (const Vec3<T>& from : {Vec3<T>(0), Vec3<T>(T(0.25), T(-0.5), 0), Vec3<T>(1, 1, 0), Vec3<T>(-1, T(0.5), 0)})
        for (int layer = 1; layer <= 100; ++layer) {
            const T t = T(layer);
            Ray<T> ray{from, {0, 0, 1}};
            const auto in = [&](T t_min, T t_max) {
                ray.t_min = t_min;
                ray.t_max = t_max;
                return nearest(bvh, ray);
            };
            REQUIRE(in(t, inf<T>) == t);
            REQUIRE(in(next_up(t), inf<T>) == (layer < 100 ? t + 1 : inf<T>));
            REQUIRE(in(next_up(t), t + 1) == inf<T>);
            REQUIRE(in(next_up(t), next_up(t + 1)) == (layer < 100 ? t + 1 : inf<T>));
            REQUIRE(in(t, t) == inf<T>);
            REQUIRE(in(next_down(t), t) == inf<T>);
            REQUIRE(in(t, next_up(t)) == t);
            REQUIRE(in(next_up(t), t) == inf<T>);
            ray.direction = {0, 0, T(0.5)}; // t counts directions
            REQUIRE(in(2 * t, inf<T>) == 2 * t);
            REQUIRE(in(2 * t, 2 * t) == inf<T>);
            REQUIRE(in(next_up(2 * t), 2 * t + 2) == inf<T>);
            ray.direction = {0, 0, -1};
            REQUIRE(in(-t, 0) == -t); // behind the origin
            REQUIRE(in(-inf<T>, -t) == (layer < 100 ? T(-100) : inf<T>));
            REQUIRE(in(-inf<T>, next_up(-t)) == T(-100));
        }
}

TEST_CASE_TEMPLATE("Origins on a plane, an edge and a vertex: a hit at t = 0 of either sign", T, float, double) {
    const auto mesh = layers<T>(3);
    const auto bvh = build(mesh);
    const Vec3<T> points[] = {{T(0.5), T(0.25), 2}, {0, 0, 2}, {1, 0, 2}, {1, 1, 2}, {-1, 1, 2}};
    const Vec3<T> directions[] = {{0, 0, 1}, {0, 0, -1}, {T(0.1), T(-0.2), T(0.3)}, {T(-0.4), T(0.4), T(-0.4)}};
    for (const Vec3<T>& point : points)
        for (const Vec3<T>& d : directions) {
            REQUIRE(nearest(bvh, Ray<T>{point, d}) == 0);
            REQUIRE(nearest(bvh, Ray<T>{point, d, -T(0)}) == 0);
            REQUIRE(nearest(bvh, Ray<T>{point, d, 0, std::numeric_limits<T>::min()}) == 0);
            REQUIRE(nearest(bvh, Ray<T>{point, d, 0, 0}) == inf<T>);
            REQUIRE(nearest(bvh, Ray<T>{point, d, T(-0.5), -T(0)}) == inf<T>);
            const T next = nearest(bvh, Ray<T>{point, d, std::numeric_limits<T>::min()});
            REQUIRE(next > 0);
            REQUIRE(next == brute_nearest(mesh, Ray<T>{point, d, std::numeric_limits<T>::min()}));
        }
    for (const Vec3<T>& point : points) // t is a mean of depths along y: rounded, so only as good as brute force's
        for (const Vec3<T>& d : {Vec3<T>(1, 2, T(-0.01)), Vec3<T>(T(0.1), -3, T(0.3))})
            for (const T t_min : {-inf<T>, T(-1e-6), T(0), next_up(T(0)), T(1e-6)})
                REQUIRE(nearest(bvh, Ray<T>{point, d, t_min}) == brute_nearest(mesh, Ray<T>{point, d, t_min}));
    for (const T zero : {T(0), -T(0)}) { // in the plane: edge-on, no hit there
        REQUIRE(nearest(bvh, Ray<T>{{-2, 0, 2}, {1, zero, zero}}) == inf<T>);
        REQUIRE(nearest(bvh, Ray<T>{{0, 0, 2}, {1, 1, zero}}) == inf<T>);
    }
}

TEST_CASE_TEMPLATE("Whatever bits a ray is made of: no hit, or that of brute force", T, float, double) {
    constexpr T nan = std::numeric_limits<T>::quiet_NaN(), tiny = std::numeric_limits<T>::min(),
                tiniest = std::numeric_limits<T>::denorm_min(), huge = std::numeric_limits<T>::max();
    const lambent_test::Mesh<T> mesh = sphere<T>(30, 20, 0.3, 1);
    const auto bvh = build(mesh);
    const T values[] = {nan, -nan, inf<T>, -inf<T>, tiny, -tiny, tiniest, -tiniest, huge, -huge, 0, -T(0), 1};
    const auto bad = [](T x) { return !is_finite(x); };
    std::size_t rays = 0, wrong = 0, hits = 0;
    for (int i = 0; i < 8; ++i)
        for (const T x : values)
            for (int j = 0; j <= i; ++j)
                for (const T y : values) {
                    T fields[8] = {T(0.1), T(-0.2), T(0.3), T(0.5), T(-0.6), T(0.7), 0, inf<T>};
                    fields[i] = x;
                    fields[j] = y;
                    const Ray<T> ray{{fields[0], fields[1], fields[2]},
                                     {fields[3], fields[4], fields[5]}, fields[6], fields[7]};
                    bool none = fields[6] != fields[6] || fields[7] != fields[7];
                    for (int k = 0; k < 6; ++k) none |= bad(fields[k]);
                    const T t = nearest(bvh, ray);
                    ++rays;
                    hits += std::size_t(t != inf<T>);
                    // What differences with 1e38 overflow to is nobody's business; that all queries agree is.
                    bool far = false;
                    for (int k = 0; k < 6; ++k) far |= std::abs(fields[k]) > T(1e30);
                    if (none) wrong += std::size_t(t != inf<T>);
                    else if (far) wrong += std::size_t(t == -1);
                    else wrong += std::size_t(t != brute_nearest(mesh, ray));
                }
    CHECK(rays == 36 * 169);
    CHECK(hits > 1000);
    CHECK(wrong == 0);

    Random random(3); // all six and both bounds of random bits
    for (int i = 0; i < 20000; ++i) {
        T fields[8];
        for (T& f : fields)
            f = std::bit_cast<T>(typename detail::FloatBits<T>::Type(random.bits() >> (64 - 8 * sizeof(T))));
        const T t = nearest(bvh, Ray<T>{{fields[0], fields[1], fields[2]}, {fields[3], fields[4], fields[5]},
                                        fields[6], fields[7]});
        wrong += std::size_t(t == -1);
    }
    CHECK(wrong == 0);
}

TEST_CASE_TEMPLATE("Directions too short for a reciprocal hit nothing, the shortest usable ones hit", T, float, double) {
    const auto bvh = build(layers<T>(3));
    constexpr T tiny = std::numeric_limits<T>::min(), tiniest = std::numeric_limits<T>::denorm_min();
    for (const T z : {tiniest, 100 * tiniest, next_down(tiny)}) {
        CHECK(nearest(bvh, Ray<T>{{0, 0, 0}, {0, 0, z}}) == inf<T>);
        CHECK(nearest(bvh, Ray<T>{{0, 0, 0}, {z, -z, z}}) == inf<T>);
    }
    CHECK(nearest(bvh, Ray<T>{{0, 0, 0}, {0, 0, tiny}}) == 1 / tiny);
    CHECK(nearest(bvh, Ray<T>{{0, 0, 0}, {tiniest, -tiniest, tiny}}) == 1 / tiny);
    CHECK(nearest(bvh, Ray<T>{{0, 0, 0}, {tiniest, -T(0), 1}}) == 1); // denormal beside a sound one
}

TEST_CASE_TEMPLATE("Flat scenes, and triangles without area among others", T, float, double) {
    for (int axis = 0; axis < 3; ++axis) { // a flat grid: a box without volume
        lambent_test::Mesh<T> grid{"grid", {}, {}};
        for (int i = 0; i <= 20; ++i)
            for (int j = 0; j <= 20; ++j) {
                Vec3<T> v(0);
                v[axis] = T(0.3);
                v[(axis + 1) % 3] = T(i);
                v[(axis + 2) % 3] = T(j);
                grid.vertices.push_back(v);
                const std::uint32_t n = std::uint32_t(21 * i + j);
                if (i == 20 || j == 20) continue;
                grid.faces.push_back({n, n + 1, n + 21});
                grid.faces.push_back({n + 1, n + 22, n + 21});
                grid.faces.push_back({n, n + 1, n + 1}); // a needle of two vertices: dropped
                if (i % 2 == 0 && i < 19) grid.faces.push_back({n, n + 21, n + 42}); // three on a line: not dropped
            }
        const auto bvh = build(grid);
        CHECK(bvh.dropped() == 400);
        std::size_t wrong = 0;
        for (int i = 0; i <= 40; ++i)
            for (int j = 0; j <= 40; ++j)
                for (const T side : {T(1), T(-1)}) {
                    Vec3<T> o, d(0);
                    o[axis] = T(0.3) + 2 * side;
                    o[(axis + 1) % 3] = T(i) / 2;
                    o[(axis + 2) % 3] = T(j) / 2;
                    d[axis] = -side;
                    const Ray<T> ray{o, d};
                    wrong += std::size_t(!(nearest(bvh, ray) < inf<T>));
                    wrong += std::size_t(nearest(bvh, ray) != brute_nearest(grid, ray));
                    Ray<T> along = ray; // in the plane
                    along.direction = Vec3<T>(1);
                    along.direction[axis] = side > 0 ? T(0) : -T(0);
                    along.origin[axis] = T(0.3);
                    wrong += std::size_t(nearest(bvh, along) != inf<T>);
                }
        CHECK(wrong == 0);
    }
}

namespace {

/// The largest that this process has been, in bytes; 0 where the system doesn't say.
std::size_t peak_memory() {
    std::ifstream status("/proc/self/status");
    for (std::string word; status >> word;)
        if (word == "VmHWM:") {
            std::size_t kib = 0;
            status >> kib;
            return kib * 1024;
        }
    return 0;
}

} // namespace

// Minutes and gigabytes, so run by hand:
//   build/release/tests/test_bvh --no-skip --test-case="More than 2^24*"
TEST_CASE("More than 2^24 triangles: indices that a float could not hold, and memory that a machine has" *
          doctest::skip()) {
    constexpr std::uint32_t side = 2900; // 2 · 2900² = 16.82 million > 2^24 = 16.78 million
    std::vector<Vec3f> vertices;
    std::vector<UVec3> faces;
    vertices.reserve((side + 1) * (side + 1));
    faces.reserve(2 * side * side);
    for (std::uint32_t i = 0; i <= side; ++i)
        for (std::uint32_t j = 0; j <= side; ++j)
            vertices.push_back({float(i), float(j), 40 * std::sin(float(i) * 0.01f) * std::cos(float(j) * 0.013f)});
    for (std::uint32_t i = 0; i < side; ++i)
        for (std::uint32_t j = 0; j < side; ++j) {
            const std::uint32_t n = i * (side + 1) + j;
            faces.push_back({n, n + 1, n + side + 1});
            faces.push_back({n + 1, n + side + 2, n + side + 1});
        }
    CHECK(faces.size() > (1u << 24));
    const auto mesh = triangles(vertices, faces);
    for (const BuildQuality quality : {BuildQuality::fast, BuildQuality::balanced}) {
        const Bvh bvh = Bvh::build(mesh, {.quality = quality});
        CHECK(bvh.triangle_count() == faces.size());
        CHECK(statistics(bvh).depth <= detail::max_depth);
        std::size_t wrong = 0;
        const auto shoot = [&](std::uint32_t face) {
            const auto p = mesh.vertices(face);
            const Vec3f center = (p[0] + p[1] + p[2]) / 3.0f;
            wrong += std::size_t(bvh.intersect({center + Vec3f(0, 0, 100), {0, 0, -1}}).primitive != face);
            wrong += std::size_t(!bvh.occluded({center + Vec3f(0, 0, 100), {0, 0, -1}, 0, 200}));
        };
        for (std::uint32_t face = 0; face < faces.size(); face += 997) shoot(face);
        for (std::uint32_t face = std::uint32_t(faces.size()) - 1000; face < faces.size(); ++face) shoot(face);
        CHECK(wrong == 0);
        MESSAGE("largest so far: ", double(peak_memory()) / double(1 << 30), " GiB");
        CHECK(peak_memory() < std::size_t(8) << 30);
    }
}
