// Rays against primitives of your own, here the discs of a point cloud, and against spheres that you have already.
#include <cmath>
#include <cstdio>
#include <lambent/bvh/primitive_leaves.hpp>
#include <lambent/bvh/sphere.hpp>
#include <vector>

struct Disc {
    lambent::Vec3f center, normal; // of unit length
    float radius;
};

/// What a tree wants to know of primitives: see lambent::PrimitiveSet.
struct PointCloud {
    using Scalar = float;
    const std::vector<Disc>* discs;

    std::size_t count() const { return discs->size(); }

    lambent::Bounds3<float> bounds(std::size_t i) const {
        const Disc& disc = (*discs)[i];
        const lambent::Vec3f n = disc.normal;
        const lambent::Vec3f half = disc.radius * sqrt(max(1.0f - n * n, lambent::Vec3f(1e-6f)));
        return {disc.center - half, disc.center + half};
    }

    lambent::Hit<float> intersect(std::size_t i, const lambent::Rayf& ray) const {
        const Disc& disc = (*discs)[i];
        const float slope = dot(ray.direction, disc.normal);
        const float t = dot(disc.center - ray.origin, disc.normal) / slope;
        const lambent::Vec3f from_center = ray.origin + t * ray.direction - disc.center;
        const float distance = length(from_center);
        if (slope == 0 || !(distance <= disc.radius) || !(t >= ray.t_min && t < ray.t_max)) return {};
        return {.t = t, .u = distance / disc.radius}; // u and v are yours; the tree fills in which disc
    }
};

int main() {
    std::vector<Disc> discs;
    for (int i = 0; i < 1000; ++i) { // a spiral up the z axis, facing down
        const float angle = 0.1f * float(i);
        discs.push_back({{std::cos(angle), std::sin(angle), 1 + 0.01f * float(i)}, {0, 0, -1}, 0.25f});
    }
    const auto cloud = lambent::PrimitiveBvh<PointCloud>::build(PointCloud{&discs});
    const lambent::Rayf ray{.origin = {1, 0, 0}, .direction = {0, 0, 1}};
    const lambent::Hit<float> hit = cloud.intersect(ray);
    std::printf("disc %u at t = %g\n", hit.primitive, double(hit.t));

    const std::vector<lambent::Vec3f> centers = {{1, 0, 9}, {0, 1, 9}};
    const std::vector<double> radii = {2, 0.5};
    const auto balls = lambent::spheres(centers, radii);
    const auto tree = lambent::PrimitiveBvh<decltype(balls)>::build(balls);
    const lambent::Hit<float> ball = tree.intersect(ray);
    std::printf("sphere %u at t = %g; blocked within one unit: %s\n", ball.primitive, double(ball.t),
                tree.occluded({ray.origin, ray.direction, 0, 1}) ? "yes" : "no");
}
