#include "support/random.hpp"
#include <lambent/sampling/warp.hpp>
#include <lambent/scene/camera.hpp>
#include <doctest/doctest.h>
#include <cmath>

using namespace lambent;
using namespace lambent_test;

TEST_CASE("thin lens: rays of one image position meet in the sharp plane and come from a disk of the radius") {
    Random random(7);
    Camera camera;
    camera.eye = {1, 2, 3};
    camera.target = {4, 1, -2};
    camera.lens_radius = 0.25;
    camera.focus_distance = 3;
    const Vec3d forward = normalize(camera.target - camera.eye);
    const CameraRays<double> lens(camera, 40, 30, Vec3d(0.5));
    camera.lens_radius = 0;
    const CameraRays<double> pinhole(camera, 40, 30, Vec3d(0.5));
    REQUIRE(lens.has_lens());
    CHECK(!pinhole.has_lens());
    double farthest = 0;
    for (int i = 0; i < 200; ++i) {
        const double x = random.uniform(0, 40), y = random.uniform(0, 30);
        const Ray<double> sharp = pinhole.ray(x, y);
        const Vec3d meeting = sharp.origin + sharp.direction * (3 / dot(sharp.direction, forward));
        const Ray<double> ray = lens.ray(x, y, square_to_disk(Vec2d(random.uniform(0, 1), random.uniform(0, 1))));
        CHECK(length(ray.direction) == doctest::Approx(1));
        const double t = dot(meeting - ray.origin, ray.direction);
        CHECK(length(ray.origin + t * ray.direction - meeting) < 1e-12);
        const Vec3d off = ray.origin - sharp.origin;
        CHECK(std::abs(dot(off, forward)) < 1e-12);
        farthest = std::max(farthest, length(off));
        CHECK(length(off) <= 0.25 + 1e-12);
        // The middle of the lens is the pinhole.
        const Ray<double> middle = lens.ray(x, y, {0, 0});
        CHECK(length(middle.direction - sharp.direction) < 1e-12);
    }
    CHECK(farthest > 0.24);
}

TEST_CASE("thin lens: without a distance the target's plane is the sharp one") {
    Camera camera;
    camera.target = {0, 0, -7};
    camera.lens_radius = 1;
    const CameraRays<double> rays(camera, 2, 2, Vec3d(0));
    const Ray<double> ray = rays.ray(1, 1, {1, 0});
    CHECK(length(ray.origin + ray.direction * (7 / -ray.direction.z) - camera.target) < 1e-12);
}
