#pragma once
#include "soup.hpp"
#include <lambent/bvh/bvh.hpp>
#include <lambent/core/frame.hpp>
#include <lambent/sampling/hash.hpp>
#include <lambent/sampling/warp.hpp>
#include <lambent/scene/camera.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

/// Makes the classes that path tracers shoot: camera rays in tiles of 8 × 8, cosine rays from what they hit
/// (near: ao, any hit; far: bounce), the next bounce, and shadow rays to a square light under the scene's top.
class RayMaker {
public:
    RayMaker(const Soup& soup, const lambent::BasicBvh<float>& bvh, const lambent::Camera& camera, int side)
        : mesh_(lambent::triangles(soup.vertices, soup.faces)), bvh_(bvh),
          diagonal_(length(bvh.bounds().max - bvh.bounds().min)) {
        const lambent::CameraRays<float> camera_rays(camera, side, side, lambent::Vec3d(0));
        for (int tile = 0; tile < (side / 8) * (side / 8); ++tile)
            for (int i = 0; i < 64; ++i) {
                const int x = tile % (side / 8) * 8 + i % 8, y = tile / (side / 8) * 8 + i / 8;
                primary_.push_back(camera_rays.ray(float(x) + 0.5f, float(y) + 0.5f));
            }
    }

    /// An empty name where there is no such class.
    RayClass make(const std::string& name) {
        if (name == "primary") return {name, false, true, primary_};
        if (name == "ao") return {name, true, false, bounces(primary_, 0.05f * diagonal_, 1)};
        if (name == "shadow") return {name, true, false, shadows()};
        if (name != "bounce" && name != "bounce2") return {};
        const std::vector<lambent::Rayf> first = bounces(primary_, infinity, 2);
        return {name, false, false, name == "bounce" ? first : bounces(first, infinity, 3)};
    }

private:
    static constexpr float infinity = std::numeric_limits<float>::infinity();

    struct Point {
        lambent::Vec3f position, normal;
    };

    /// Where rays hit, off the surface by 1e-4 of the scene's diagonal, on the ray's side.
    std::vector<Point> hits(const std::vector<lambent::Rayf>& rays) const {
        std::vector<Point> points;
        for (const lambent::Rayf& ray : rays) {
            const lambent::Hit<float> hit = bvh_.intersect(ray);
            if (!hit) continue;
            lambent::Vec3f n = normalize(geometric_normal(mesh_, hit.primitive));
            if (!lambent::is_finite(n)) continue;
            if (dot(n, ray.direction) > 0) n = -n;
            points.push_back({ray.origin + hit.t * ray.direction + 1e-4f * diagonal_ * n, n});
        }
        return points;
    }

    std::vector<lambent::Rayf> bounces(const std::vector<lambent::Rayf>& from, float t_max, std::uint32_t seed) const {
        std::vector<lambent::Rayf> rays;
        for (const Point& p : hits(from)) {
            const lambent::Vec2f u = random(std::uint32_t(rays.size()), seed);
            const lambent::Frame<float> frame(p.normal);
            rays.push_back({p.position, normalize(frame.to_world(lambent::square_to_cosine_hemisphere(u))), 0, t_max});
        }
        return rays;
    }

    std::vector<lambent::Rayf> shadows() const {
        const lambent::Bounds3<float> box = bvh_.bounds();
        const lambent::Vec3f center = 0.5f * (box.min + box.max), size = box.max - box.min;
        std::vector<lambent::Rayf> rays;
        for (const Point& p : hits(primary_)) {
            const lambent::Vec2f u = random(std::uint32_t(rays.size()), 4);
            const lambent::Vec3f light = center + lambent::Vec3f((u.x - 0.5f) * 0.2f * size.x, 0.45f * size.y,
                                                                 (u.y - 0.5f) * 0.2f * size.z);
            const float distance = length(light - p.position);
            if (distance > 0) rays.push_back({p.position, (light - p.position) / distance, 0, distance});
        }
        return rays;
    }

    static lambent::Vec2f random(std::uint32_t index, std::uint32_t seed) {
        const std::uint64_t key = lambent::derive_key(seed, index);
        return {lambent::to_unit<float>(lambent::derive_key(key, 0)),
                lambent::to_unit<float>(lambent::derive_key(key, 1))};
    }

    decltype(lambent::triangles(std::declval<const std::vector<lambent::Vec3f>&>(),
                                std::declval<const std::vector<lambent::UVec3>&>())) mesh_;
    const lambent::BasicBvh<float>& bvh_;
    float diagonal_;
    std::vector<lambent::Rayf> primary_;
};
