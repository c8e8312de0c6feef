// Rays that leave a surface: they meet neither it, nor pass what stands close in front of it; and pictures of scenes of
// any size and place.
#include "stress/table.hpp"
#include "support/random.hpp"
#include "support/statistics.hpp"
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <doctest/doctest.h>
#include <lambent/core/frame.hpp>
#include <lambent/core/parallel.hpp>
#include <lambent/film/film.hpp>
#include <lambent/io/recentre.hpp>
#include <lambent/render/path.hpp>
#include <lambent/render/render.hpp>
#include <lambent/sampling/sobol.hpp>
#include <lambent/sampling/warp.hpp>
#include <lambent/scene/builtin.hpp>
#include <lambent/scene/prepared_scene.hpp>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

/// One triangle of about `size` about `center`, and where `gap` is > 0 a slightly larger copy of it there along
/// its normal: no ray from the first one's rim passes beside it.
template <class T>
Scene<T> sheet(double size, const Vec3d& center, double gap, Random& random) {
    const auto point = [&] { return Vec3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)); };
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
Ray<T> naive_ray(const Surface<T>& surface, const Vec3<T>& wi, T offset = T(sizeof(T) == 4 ? 1e-4 : 1e-13)) {
    return {surface.position + offset * surface.geometric_normal, wi};
}

struct Count {
    std::size_t rays = 0, ours = 0, naive = 0;
};

} // namespace

TEST_CASE_TEMPLATE("Spawned rays do not meet the triangle that they leave: sizes 1e-3 to 1e3, centres 0 to 1e6", T,
                   float, double) {
    SerialExecutor serial;
    Count all;
    for (const double size : {1e-3, 1e-1, 1.0, 1e1, 1e3})
        for (const double far : {0.0, 1.0, 1e2, 1e4, 1e6}) {
            if (sizeof(T) == 4 && far * 0x1p-24 > 1e-2 * size) continue; // the vertices would coincide
            Random random(std::uint64_t(size * 1000 + far));
            for (std::uint64_t i = 0; i < inputs(100, 20000); ++i) {
                const Vec3d center = far * Vec3d(random.uniform(0.5, 1), random.uniform(-1, 1), random.uniform(0.5, 1));
                const Scene<T> scene = sheet<T>(size, center, 0, random);
                const PreparedScene<T> prepared(scene, serial);
                for (int j = 0; j < 200; ++j) {
                    Surface<T> surface;
                    if (!meet(scene, prepared, size, 2, random, surface)) continue;
                    const Vec3<T> wi = bounce(surface, random);
                    ++all.rays;
                    all.ours += std::size_t(prepared.occluded(spawn_ray(surface, wi)));
                    all.naive += std::size_t(prepared.occluded(naive_ray(surface, wi)));
                }
            }
        }
    record({"spawned rays",
            sizeof(T) == 4 ? "bounces, float -> share that meets its own triangle; naive: offset of 1e-4"
                           : "bounces, double -> share that meets its own triangle; naive: offset of 1e-13",
            double(all.rays), double(all.ours), double(all.ours) / double(all.rays), 0,
            double(all.naive) / double(all.rays)});
}

TEST_CASE_TEMPLATE("No light leaks through a sheet in front at 1e-5 of the triangle's size", T, float, double) {
    SerialExecutor serial;
    Count all;
    for (const double size : {1e-3, 1e-1, 1.0, 1e1, 1e3})
        for (const double far : {0.0, 1.0, 1e2, 1e4, 1e6}) {
            const double gap = 1e-5 * size, ulp = (sizeof(T) == 4 ? 0x1p-23 : 0x1p-52) * (far + size);
            if (gap < 64 * ulp) continue; // within twice the error of a position: nothing could tell the two apart
            Random random(std::uint64_t(size * 1000 + far) + 7);
            for (std::uint64_t i = 0; i < inputs(100, 20000); ++i) {
                const Vec3d center = far * Vec3d(random.uniform(0.5, 1), random.uniform(-1, 1), random.uniform(0.5, 1));
                const Scene<T> scene = sheet<T>(size, center, gap, random);
                const PreparedScene<T> prepared(scene, serial);
                for (int j = 0; j < 200; ++j) {
                    Surface<T> surface; // the viewer stands between the two sheets
                    if (!meet(scene, prepared, size, 0.5e-5, random, surface)) continue;
                    const Vec3<T> wi = surface.geometric_normal;
                    ++all.rays;
                    all.ours += std::size_t(!prepared.occluded(spawn_ray(surface, wi)));
                    all.naive += std::size_t(!prepared.occluded(naive_ray<T>(surface, wi, T(1e-4))));
                }
            }
        }
    record({"spawned rays",
            sizeof(T) == 4 ? "sheets 1e-5 in front, float -> share of rays that pass; naive: offset of 1e-4"
                           : "sheets 1e-5 in front, double -> share of rays that pass; naive: offset of 1e-4",
            double(all.rays), double(all.ours), double(all.ours) / double(all.rays), 0,
            double(all.naive) / double(all.rays)});
}

namespace {

/// A picture of builtin:cornell, scaled and then moved as a scene file's root node would, in double.
/// recentred  whether positions are stored relative to an origin of the scene's own, as loaders do
Plane<float, 3> picture(double scale, double move, bool recentred) {
    Scene<float> scene = cornell_scene<float>();
    std::vector<Vec3d> positions;
    Bounds3<double> bounds;
    for (const Vec3f& p : scene.positions) {
        positions.push_back(Vec3d(p) * scale + Vec3d(move, -move, move / 3));
        bounds.add(positions.back());
    }
    scene.positions.clear();
    if (recentred)
        lambent::detail::store_positions(scene, positions, bounds);
    else
        for (const Vec3d& p : positions) scene.positions.push_back(Vec3f(p));
    Camera camera = scene.cameras[0];
    for (Vec3d* p : {&camera.eye, &camera.target}) *p = *p * scale + Vec3d(move, -move, move / 3);
    SerialExecutor serial;
    const PreparedScene<float> prepared(scene, serial);
    const int side = int(inputs(16, 64));
    const RenderOptions options{
        .width = side, .height = side, .end_sample = inputs(16, 256), .planes = FilmPlanes::radiance};
    return render(prepared, camera, PathIntegrator<>{}, SobolSampler<float>(1), options, serial).radiance;
}

/// Root mean square of the difference, over that of `b`.
double difference(const Plane<float, 3>& a, const Plane<float, 3>& b) {
    double squares = 0, size = 0;
    for (std::size_t i = 0; i < a.values().size(); ++i) {
        const double x = double(a.values()[i]), y = double(b.values()[i]);
        squares += (x - y) * (x - y);
        size += y * y;
    }
    return squares >= 0 ? std::sqrt(squares / size) : 1e9; // not a number: all wrong
}

} // namespace

TEST_CASE("Scenes 2^40 times larger or smaller, or a hundred thousand of their sizes away: the same picture") {
    const Plane<float, 3> home = picture(1, 0, true);
    double worst = 0, naive = 0, cases = 0;
    for (const int power : {-40, -20, -3, 3, 20, 40}) {
        worst = std::max(worst, difference(picture(std::exp2(power), 0, true), home));
        ++cases;
    }
    const float side = float(std::exp2(40.0)) * 0.24f; // of the light; its area by the length of a cross product
    const float area = length(cross(Vec3f(side, 0, 0), Vec3f(0, 0, side)));
    naive = is_finite(area) ? 0 : 1;
    record({"spawned rays", "scenes scaled by 2^-40 to 2^40 -> relative difference of pictures; naive: area infinite",
            cases, double(worst > 1e-3), worst, 1e-3, naive});
    double moved = 0, moves = 0;
    for (const double move : {-1e5, 1e3, 99999.7, 1e5}) {
        moved = std::max(moved, difference(picture(1, move, true), home));
        ++moves;
    }
    record({"spawned rays", "scenes moved by up to 1e5 sizes -> relative difference of pictures; naive: not recentred",
            moves, double(moved > 1e-3), moved, 1e-3, difference(picture(1, 1e5, false), home)});
}
