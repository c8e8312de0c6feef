// Rays against triangles that stay in your own containers.
// readme: begin
#include <cstdint>
#include <cstdio>
#include <lambent/bvh/bvh.hpp>
#include <vector>

struct MyVertex {
    float x, y, z, s, t;
};

int main() {
    const std::vector<MyVertex> vertices = {{0, 0, 2, 0, 0}, {1, 0, 2, 1, 0}, {1, 1, 2, 1, 1}, {0, 1, 2, 0, 1}};
    const std::vector<std::uint16_t> indices = {0, 1, 2, 0, 2, 3}; // or 32 bits, or arrays of three
    const auto position = [](const MyVertex& v) { return lambent::Vec3f(v.x, v.y, v.z); };
    const auto mesh = lambent::triangles(vertices, indices, position);
    const lambent::Bvh bvh = lambent::Bvh::build(mesh);

    const lambent::Rayf ray{.origin = {0.75f, 0.25f, 0}, .direction = {0, 0, 1}};
    if (const lambent::Hit<float> hit = bvh.intersect(ray)) {
        const lambent::Vec3f n = geometric_normal(mesh, hit.primitive);
        std::printf("triangle %u at t = %g, u = %g, v = %g, normal (%g, %g, %g)\n", hit.primitive, double(hit.t),
                    double(hit.u), double(hit.v), double(n.x), double(n.y), double(n.z));
    }
    const lambent::Rayf segment{.origin = {0.75f, 0.25f, 0}, .direction = {0, 0, 1}, .t_max = 1};
    std::printf("blocked within one unit: %s\n", bvh.occluded(segment) ? "yes" : "no");
}
// readme: end
