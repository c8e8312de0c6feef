// Rays against triangles that stay in your own containers.
#include <array>
#include <cstdint>
#include <cstdio>
#include <lambent/bvh/bvh.hpp>
#include <vector>

struct MyVertex {
    float position[3];
    float texcoord[2];
};

int main() {
    const std::vector<MyVertex> vertices = {
        {{0, 0, 2}, {0, 0}}, {{1, 0, 2}, {1, 0}}, {{1, 1, 2}, {1, 1}}, {{0, 1, 2}, {0, 1}}};
    const std::vector<std::uint16_t> indices = {0, 1, 2, 0, 2, 3}; // or arrays of three, or lambent::UVec3

    const auto mesh = lambent::triangles(vertices, indices, [](const MyVertex& v) {
        return lambent::Vec3f(v.position[0], v.position[1], v.position[2]);
    });
    const lambent::Bvh bvh = lambent::Bvh::build(mesh);

    const lambent::Rayf ray{.origin = {0.75f, 0.25f, 0}, .direction = {0, 0, 1}};
    if (const auto hit = bvh.intersect(ray)) {
        const lambent::Vec3f n = geometric_normal(mesh, hit.primitive);
        std::printf("triangle %u at t = %g, u = %g, v = %g, normal (%g, %g, %g)\n", hit.primitive, double(hit.t),
                    double(hit.u), double(hit.v), double(n.x), double(n.y), double(n.z));
    }
    const lambent::Rayf segment{.origin = {0.75f, 0.25f, 0}, .direction = {0, 0, 1}, .t_max = 1};
    std::printf("something within one unit: %s\n", bvh.occluded(segment) ? "yes" : "no");
    // A filter makes holes: here everything to the right of x = 0.5 on the first triangle.
    const auto hole = [](std::uint32_t triangle, float u, float v, float) { return triangle != 0 || u + v < 0.5f; };
    std::printf("through the hole: %s\n", bvh.occluded(ray, hole) ? "no" : "yes");
}
