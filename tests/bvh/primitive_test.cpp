#include "support/meshes.hpp"
#include "support/random.hpp"
#include <cmath>
#include <cstdint>
#include <doctest/doctest.h>
#include <lambent/bvh/primitive_leaves.hpp>
#include <lambent/bvh/sphere.hpp>
#include <lambent/bvh/statistics.hpp>
#include <limits>
#include <span>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

/// Axis-parallel plates and, to have several hits each, pairs of them at z and z + gap: not the library's own.
template <class T>
struct Plates {
    using Scalar = T;
    struct Plate {
        Vec3<T> low;
        T side, gap;
    };
    std::span<const Plate> plates;
    std::size_t* shadow_calls = nullptr;

    std::size_t count() const { return plates.size(); }
    Bounds3<T> bounds(std::size_t i) const {
        const Plate& p = plates[i];
        return {p.low, p.low + Vec3<T>(p.side, p.side, p.gap)};
    }
    Hit<T> intersect(std::size_t i, const Ray<T>& ray) const {
        const Plate& p = plates[i];
        Hit<T> hit;
        for (const T z : {p.low.z, p.low.z + p.gap}) {
            const T t = (z - ray.origin.z) / ray.direction.z;
            const T x = ray.origin.x + t * ray.direction.x - p.low.x, y = ray.origin.y + t * ray.direction.y - p.low.y;
            if (t >= ray.t_min && t < ray.t_max && t < hit.t && x >= 0 && x <= p.side && y >= 0 && y <= p.side)
                hit = {.t = t, .u = x, .v = y};
        }
        return hit;
    }
    bool occluded(std::size_t i, const Ray<T>& ray) const {
        if (shadow_calls != nullptr) ++*shadow_calls;
        return intersect(i, ray).t < ray.t_max;
    }
};

/// The nearest of all hits of all primitives; every primitive is asked.
template <class Set, class T>
Hit<T> nearest(const Set& set, Ray<T> ray) {
    Hit<T> best;
    for (std::size_t i = 0; i < set.count(); ++i) {
        if (set.bounds(i).empty()) continue;
        Hit<T> hit = set.intersect(i, ray);
        if (!(hit.t < ray.t_max)) continue;
        ray.t_max = hit.t;
        best = hit;
        best.primitive = std::uint32_t(i);
    }
    return best;
}

template <class T>
struct Balls {
    std::vector<Vec3<T>> centers;
    std::vector<T> radii;
};

template <class T>
Balls<T> balls(std::size_t n, double size, double scale, double offset, std::uint64_t seed) {
    Random random(seed);
    Balls<T> b;
    for (std::size_t i = 0; i < n; ++i) {
        b.centers.push_back(Vec3<T>((random.in_box<double>(-1, 1) + offset) * scale));
        b.radii.push_back(T(scale * size * std::exp2(random.uniform(-6, 0))));
    }
    return b;
}

/// Rays of all kinds at a sphere of the set: through it, close to its silhouette, from its surface, along axes, and
/// past it where its box is no larger than itself.
template <class T>
Ray<T> ray_at(const Balls<T>& set, std::size_t i, double scale, double offset, Random& random) {
    const std::size_t k = random.index(set.centers.size());
    const Vec3<double> c(set.centers[k]);
    const double r = double(set.radii[k]);
    const auto around = [&] { return normalize(random.in_box<double>(-1, 1) + Vec3<double>(1e-9)); };
    Vec3<double> from = (random.in_box<double>(-2, 2) + offset) * scale, to = c + r * random.uniform() * around();
    if (i % 4 == 1) { // where the silhouette is
        const Vec3<double> d = normalize(c - from);
        const Vec3<double> across = normalize(cross(d, around()));
        to = c + across * r * (1 + random.uniform(-2, 2) * double(std::numeric_limits<T>::epsilon()));
    }
    if (i % 8 == 5) { // and where that touches the box
        const int axis = int(random.index(3));
        Vec3<double> along = around();
        along[axis] = 0;
        to = c;
        to[axis] += (random.index(2) ? r : -r) * (1 - 1e-6 * random.uniform());
        from = to - along * random.uniform(0.1, 3) * scale;
    }
    if (i % 4 == 2) from = c + r * around();
    Ray<T> ray{Vec3<T>(from), Vec3<T>(to - from)};
    if (i % 4 == 3) {
        const int axis = int(random.index(3));
        ray.direction = Vec3<T>(0);
        ray.direction[axis] = random.index(2) ? T(1) : T(-1);
    }
    if (random.index(2)) {
        ray.t_min = T(random.uniform(-1, 1));
        ray.t_max = ray.t_min + T(random.uniform(0, 2));
    }
    return ray;
}

} // namespace

TEST_CASE_TEMPLATE("Own primitives: nearest hits, any hits and filtered hits are those of asking all of them", T, float,
                   double) {
    Random random(5);
    std::vector<typename Plates<T>::Plate> plates;
    for (int i = 0; i < 300; ++i)
        plates.push_back({random.in_box<T>(-1, 1), T(random.uniform(0, 0.4)), T(random.uniform(0, 0.3))});
    std::size_t shadow_calls = 0;
    const Plates<T> set{plates, &shadow_calls};
    const auto bvh = PrimitiveBvh<Plates<T>>::build(set);
    CHECK(statistics(bvh).triangles == 300);
    const auto accept = [](std::uint32_t primitive, T u, T, T) { return primitive % 3 != 0 && u > T(0.05); };
    struct Filtered : Plates<T> { // the same filter, hit by hit, without the tree
        Hit<T> intersect(std::size_t i, Ray<T> ray) const {
            for (;;) {
                const Hit<T> hit = Plates<T>::intersect(i, ray);
                if (!(hit.t < ray.t_max) || (i % 3 != 0 && hit.u > T(0.05))) return hit;
                ray.t_min = next_up(hit.t);
            }
        }
    };
    std::size_t different = 0, hits = 0;
    for (int i = 0; i < 20000; ++i) {
        Ray<T> ray{random.in_box<T>(-1.5, 1.5), random.in_box<T>(-1, 1)};
        if (i % 3 == 0) ray.t_max = T(random.uniform(0, 2));
        const Hit<T> hit = bvh.intersect(ray), expected = nearest(set, ray);
        hits += std::size_t(bool(hit));
        different += std::size_t(hit.t != expected.t || hit.primitive != expected.primitive || hit.u != expected.u ||
                                 hit.v != expected.v || hit.instance != 0);
        different += std::size_t(bvh.occluded(ray) != bool(expected));
        const Hit<T> rest = nearest(Filtered{set}, ray), found = bvh.intersect(ray, accept);
        different += std::size_t(found.t != rest.t || found.primitive != rest.primitive);
        different += std::size_t(bvh.occluded(ray, accept) != bool(rest));
    }
    CHECK(hits > 4000);
    CHECK(different == 0);
    CHECK(shadow_calls > 0);
}

TEST_CASE("Own primitives without a finite box are left out, and absurd distances are no hits") {
    struct Odd {
        using Scalar = float;
        std::size_t count() const { return 6; }
        Bounds3<float> bounds(std::size_t i) const {
            constexpr float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
            Bounds3<float> box{Vec3f(-1, -1, 1), Vec3f(1, 1, 1)};
            if (i == 1) box = {};
            if (i == 2) box.max.y = inf;
            if (i == 3) box.min.x = nan;
            return box;
        }
        Hit<float> intersect(std::size_t i, const Rayf& ray) const {
            constexpr float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
            if (i == 0) return {.t = -inf};
            if (i == 4) return {.t = nan};
            if (i == 5) return {.t = ray.t_max}; // one past the end
            return {.t = 0};
        }
    };
    const auto bvh = PrimitiveBvh<Odd>::build(Odd{});
    CHECK(bvh.dropped() == 3);
    CHECK_FALSE(bvh.intersect(Rayf{{0, 0, 0}, {0, 0, 1}, -std::numeric_limits<float>::infinity(), 10}));
    CHECK_FALSE(bvh.occluded({}));
    CHECK_FALSE(bvh.intersect({}, [](std::uint32_t, float, float, float) { return false; }));
}

TEST_CASE_TEMPLATE("Spheres: the tree's hits are those of asking all of them, at silhouettes too, far away, tiny and huge",
                   T, float, double) {
    std::size_t different = 0, hits = 0, rays = 0;
    const double places[][2] = {{1, 0}, {1, 30}, {1, 1e4}, {0x1p-60, 0}, {0x1p60, 0}, {0x1p100, 0.5}};
    for (const auto& [scale, offset] : places) {
        const Balls<T> b = balls<T>(200, 0.3, scale, offset, 3);
        const auto set = spheres(b.centers, b.radii);
        const auto bvh = PrimitiveBvh<decltype(set)>::build(set);
        CHECK(bvh.dropped() == 0);
        Random random(8);
        for (std::size_t i = 0; i < 20000; ++i) {
            const Ray<T> ray = ray_at(b, i, scale, offset, random);
            const Hit<T> hit = bvh.intersect(ray), expected = nearest(set, ray);
            ++rays;
            hits += std::size_t(bool(hit));
            different += std::size_t(hit.t != expected.t || hit.u != 0 || hit.v != 0);
            different += std::size_t(bvh.occluded(ray) != bool(expected));
        }
    }
    CHECK(hits > rays / 3);
    CHECK(hits < rays);
    CHECK(different == 0);
}

TEST_CASE_TEMPLATE("A sphere's hits lie on it, and are the ones that long double finds", T, float, double) {
    using L = long double;
    std::size_t checked = 0, wrong = 0;
    double worst = 0;
    const double places[][2] = {{1, 0}, {1, 1e3}, {0x1p-60, 0}, {0x1p60, 0}};
    for (const auto& [scale, offset] : places) {
        const Balls<T> b = balls<T>(100, 0.5, scale, offset, 4);
        Random random(9);
        for (std::size_t i = 0; i < 50000; ++i) {
            const std::size_t k = i % 100;
            Ray<T> ray = ray_at(b, i, scale, offset, random);
            if (random.index(2)) { // aim at this one
                ray.direction = b.centers[k] - ray.origin + b.radii[k] * random.in_box<T>(-1, 1);
                ray.t_max = std::numeric_limits<T>::infinity();
            }
            const T t = intersect_sphere(ray, b.centers[k], b.radii[k]);
            L f[3], bq = 0, dd = 0, ff = 0;
            for (int a = 0; a < 3; ++a) {
                f[a] = L(ray.origin[a]) - L(b.centers[k][a]);
                bq -= f[a] * L(ray.direction[a]);
                dd += L(ray.direction[a]) * L(ray.direction[a]);
                ff += f[a] * f[a];
            }
            const L r = L(b.radii[k]), reach = std::max(std::sqrt(ff), r);
            if (t < ray.t_max) {
                L distance2 = 0;
                for (int a = 0; a < 3; ++a) {
                    const L x = f[a] + L(t) * L(ray.direction[a]);
                    distance2 += x * x;
                }
                const L off = std::abs(std::sqrt(distance2) - r) / reach / L(std::numeric_limits<T>::epsilon());
                worst = std::max(worst, double(off));
            }
            L across2 = 0; // squared distance of the line to the centre
            for (int a = 0; a < 3; ++a) {
                const L x = f[a] + bq / dd * L(ray.direction[a]);
                across2 += x * x;
            }
            const L margin = 16 * L(std::numeric_limits<T>::epsilon()) * reach;
            if (std::abs(std::sqrt(across2) - r) < 1e-3L * r + margin) continue; // grazing: either answer will do
            const L half = std::sqrt(std::max(L(0), (r * r - across2) * dd));
            const L roots[2] = {(bq - half) / dd, (bq + half) / dd};
            const L blur = (margin * std::sqrt(dd) * 40) / dd;
            L expected = std::numeric_limits<L>::infinity();
            bool sure = true;
            for (int a = 1; a >= 0 && across2 < r * r; --a) {
                const L x = roots[a];
                sure = sure && std::abs(x - L(ray.t_min)) > blur && std::abs(x - L(ray.t_max)) > blur;
                if (x >= L(ray.t_min) && x < L(ray.t_max)) expected = x;
            }
            if (!sure) continue;
            ++checked;
            const bool hit = t < ray.t_max;
            wrong += std::size_t(hit != (expected < L(ray.t_max)) || (hit && std::abs(L(t) - expected) > blur));
        }
    }
    CHECK(checked > 50000);
    CHECK(wrong == 0);
    CHECK(worst < 6);
}

TEST_CASE_TEMPLATE("Spheres in the caller's own types; rubbish is left out; a filter sees the far side", T, float, double) {
    constexpr T nan = std::numeric_limits<T>::quiet_NaN(), inf = std::numeric_limits<T>::infinity();
    struct Ball {
        double x, y, z;
        float radius;
    };
    std::vector<Ball> own = {{0, 0, 5, 1.0f}, {0, 0, 9, -1.0f}, {0, double(nan), 9, 1.0f}, {0, 0, 9, float(inf)},
                             {0, 0, 9, float(nan)}, {double(inf), 0, 9, 1.0f}, {0, 0, 20, 0.0f}, {0, 0, 30, 2.0f}};
    const auto set = spheres(std::span(own), own, [](const Ball& b) { return Vec3<T>(b.x, b.y, b.z); },
                             [](const Ball& b) { return b.radius; });
    const auto bvh = PrimitiveBvh<decltype(set)>::build(set);
    CHECK(bvh.dropped() == 5);
    const Ray<T> ray{{0, 0, 0}, {0, 0, 2}};
    CHECK(bvh.intersect(ray).t == 2);
    CHECK(bvh.intersect(ray).primitive == 0);
    CHECK(bvh.intersect(ray, [](std::uint32_t, T, T, T t) { return t > 2; }).t == 3);
    CHECK(bvh.intersect(Ray<T>{{0, 0, 5}, {0, 0, -1}}).t == 1); // from inside
    CHECK(bvh.intersect(Ray<T>{{0, 0, 7}, {0, 0, 1}}, [](std::uint32_t i, T, T, T) { return i != 6; }).t == 21);
    CHECK_FALSE(bvh.occluded(Ray<T>{{T(1.01), 0, 0}, {0, 0, 1}, 0, 10}));
    CHECK(length(set.normal(0, Vec3<T>(1, 0, 5)) - Vec3<T>(1, 0, 0)) < T(1e-6));

    const std::vector<Vec3<T>> centers(3);
    const std::vector<T> radii(2);
    CHECK_THROWS_WITH_AS(spheres(centers, radii), "spheres: 3 centres, but 2 radii", Error);
}
