#include "support/random.hpp"
#include "support/statistics.hpp"
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <doctest/doctest.h>
#include <lambent/core/frame.hpp>
#include <lambent/core/parallel.hpp>
#include <lambent/sampling/warp.hpp>
#include <lambent/scene/prepared_scene.hpp>
#include <string>

using namespace lambent;
using namespace lambent_test;

namespace {

/// One triangle of about `size` about `center`, and where `gap` is > 0 a slightly larger copy of it there along
/// its normal: no ray from the first one's rim passes beside it.
template <class T>
Scene<T> sheet(double size, const Vec3d& center, double gap, Random& random) {
    const auto point = [&] {
        return Vec3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    };
    Scene<T> scene;
    Vec3d corner[3], normal(0);
    while (!(length(normal) > 0.3)) { // neither needles nor dust
        for (Vec3d& c : corner) c = point();
        normal = cross(corner[1] - corner[0], corner[2] - corner[0]);
    }
    for (int layer = 0; layer < (gap > 0 ? 2 : 1); ++layer) {
        const Vec3d middle = (corner[0] + corner[1] + corner[2]) / 3.0;
        for (const Vec3d& c : corner) {
            const Vec3d grown = middle + (1 + 0.001 * layer) * (c - middle);
            scene.positions.push_back(Vec3<T>(center + size * grown + (layer * gap) * normalize(normal)));
        }
        const auto first = std::uint32_t(3 * layer);
        scene.triangles.push_back({first, first + 1, first + 2});
        scene.triangle_materials.push_back(0);
    }
    scene.materials.resize(1);
    return scene;
}

/// A point of triangle 0 as a ray of random direction from in front (normal's side) meets it; false for a miss.
template <class T>
bool meet(const Scene<T>& scene, const PreparedScene<T>& prepared, double size, double distance, Random& random,
          Surface<T>& surface) {
    Vec3d corner[3];
    for (int k = 0; k < 3; ++k) corner[k] = Vec3d(scene.positions[std::size_t(k)]);
    const Vec3d normal = normalize(cross(corner[1] - corner[0], corner[2] - corner[0]));
    const double a = random.uniform(0, 1), b = random.uniform(0, 1);
    const Vec3d weights = a + b > 1 ? Vec3d(1 - a, 1 - b, a + b - 1) : Vec3d(a, b, 1 - a - b);
    const Vec3d target = weights.x * corner[0] + weights.y * corner[1] + weights.z * corner[2];
    const Vec2<double> u(random.uniform(0, 1), random.uniform(0, 1));
    const Vec3d wo = Frame<double>(normal).to_world(square_to_cosine_hemisphere(u));
    const Vec3<T> eye(target + (distance * size) * wo);
    const Ray<T> ray{eye, normalize(Vec3<T>(target) - eye)};
    const Hit<T> hit = prepared.intersect(ray);
    if (!hit || hit.primitive != 0) return false;
    surface = prepared.surface(ray, hit);
    return dot(Vec3d(surface.geometric_normal), normal) > 0; // a grazing eye may be rounded to behind
}

template <class T>
Vec3<T> bounce(const Surface<T>& surface, Random& random) {
    const Vec2<T> u(T(random.uniform(0, 1)), T(random.uniform(0, 1)));
    return normalize(Frame<T>(surface.geometric_normal).to_world(square_to_cosine_hemisphere(u)));
}

/// The way most programs leave a surface: by a fixed length along the normal.
template <class T>
Ray<T> naive_ray(const Surface<T>& surface, const Vec3<T>& wi) {
    return {surface.position + T(1e-4) * surface.geometric_normal, wi};
}

struct Count {
    std::size_t rays = 0, ours = 0, naive = 0;
};

} // namespace

TEST_CASE_TEMPLATE("Spawned rays do not meet the triangle that they leave: sizes 1e-3 to 1e3, centres 0 to 1e6", T, float,
                   double) {
    SerialExecutor serial;
    Count all;
    for (const double size : {1e-3, 1e-1, 1.0, 1e1, 1e3})
        for (const double far : {0.0, 1.0, 1e2, 1e4, 1e6}) {
            if (sizeof(T) == 4 && far * 0x1p-24 > 1e-2 * size) continue; // the vertices would coincide
            Random random(std::uint64_t(size * 1000 + far));
            Count count;
            for (int i = 0; i < 100; ++i) {
                const Vec3d center = far * Vec3d(random.uniform(0.5, 1), random.uniform(-1, 1), random.uniform(0.5, 1));
                const Scene<T> scene = sheet<T>(size, center, 0, random);
                const PreparedScene<T> prepared(scene, serial);
                for (int j = 0; j < 200; ++j) {
                    Surface<T> surface;
                    if (!meet(scene, prepared, size, 2, random, surface)) continue;
                    const Vec3<T> wi = bounce(surface, random);
                    ++count.rays;
                    count.ours += std::size_t(prepared.occluded(spawn_ray(surface, wi)));
                    count.naive += std::size_t(prepared.occluded(naive_ray(surface, wi)));
                }
            }
            CAPTURE(size);
            CAPTURE(far);
            CHECK(count.ours == 0);
            all.rays += count.rays;
            all.naive += count.naive;
        }
    CHECK(all.rays > 150000);
    if (sizeof(T) == 4) CHECK(all.naive > all.rays / 100); // the negative control sees the fault
}

TEST_CASE_TEMPLATE("No light leaks through a sheet in front at 1e-5 of the triangle's size", T, float, double) {
    SerialExecutor serial;
    Count all;
    for (const double size : {1e-3, 1e-1, 1.0, 1e1, 1e3})
        for (const double far : {0.0, 1.0, 1e2, 1e4, 1e6}) {
            const double gap = 1e-5 * size, ulp = (sizeof(T) == 4 ? 0x1p-23 : 0x1p-52) * (far + size);
            if (gap < 64 * ulp) continue; // within twice the error of a position: nothing could tell the two apart
            Random random(std::uint64_t(size * 1000 + far) + 7);
            Count count;
            for (int i = 0; i < 100; ++i) {
                const Vec3d center = far * Vec3d(random.uniform(0.5, 1), random.uniform(-1, 1), random.uniform(0.5, 1));
                const Scene<T> scene = sheet<T>(size, center, gap, random);
                const PreparedScene<T> prepared(scene, serial);
                for (int j = 0; j < 200; ++j) {
                    Surface<T> surface; // the viewer stands between the two sheets
                    if (!meet(scene, prepared, size, 0.5e-5, random, surface)) continue;
                    const Vec3<T> wi = surface.geometric_normal;
                    ++count.rays;
                    count.ours += std::size_t(!prepared.occluded(spawn_ray(surface, wi)));
                    count.naive += std::size_t(!prepared.occluded(naive_ray(surface, wi)));
                }
            }
            CAPTURE(size);
            CAPTURE(far);
            CHECK(count.ours == 0);
            all.rays += count.rays;
            all.ours += count.ours;
            all.naive += count.naive;
        }
    CHECK(all.rays > 30000);
    CHECK(all.naive > all.rays / 10);
}
