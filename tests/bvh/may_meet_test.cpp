#include "support/meshes.hpp"
#include "support/random.hpp"
#include <algorithm>
#include <array>
#include <cmath>
#include <doctest/doctest.h>
#include <lambent/bvh/may_meet.hpp>
#include <limits>

using namespace lambent;
using namespace lambent_test;

namespace {

struct View {
    Vec3f eye;
    std::array<Vec3f, 4> corners;
};

/// A rectangle seen from somewhere around, from a speck to half of everything.
View random_view(Random& random, float scale, const Vec3f& shift) {
    const Vec3f forward = normalize(random.in_box<float>(-1, 1));
    const Vec3f side = normalize(cross(forward, normalize(random.in_box<float>(-1, 1)))), up = cross(side, forward);
    const float wide = std::exp2(float(random.uniform()) * 12 - 11), high = std::exp2(float(random.uniform()) * 12 - 11);
    const float length = std::exp2(float(random.uniform()) * 20 - 10); // directions need no unit length
    const Vec3f f = length * forward, s = length * wide * side, u = length * high * up;
    return {shift + scale * 2.0f * random.in_box<float>(-1, 1), {f - s - u, f + s - u, f + s + u, f - s + u}};
}

} // namespace

TEST_CASE("a pyramid that the tree is said not to meet holds no ray that hits, at any scale and far from the origin") {
    Random random(20);
    int empty = 0, full = 0;
    for (const float scale : {1e-6f, 1.0f, 1e6f})
        for (const float far_away : {0.0f, 1000.0f}) {
            const Vec3f shift = scale * far_away * Vec3f(1, -0.5f, 0.25f);
            lambent_test::Mesh<float> mesh = soup<float>(60, 0.5, 7);
            for (Vec3f& v : mesh.vertices) v = scale * v + shift;
            const Bvh bvh = Bvh::build(triangles(mesh.vertices, mesh.faces));
            for (int i = 0; i < 400; ++i) {
                const View view = random_view(random, scale, shift);
                if (may_meet(bvh, Pyramid<float>(view.eye, view.corners))) {
                    ++full;
                    continue;
                }
                ++empty;
                for (int j = 0; j < 64; ++j) { // edges and corners too
                    float a = float(random.uniform()), b = float(random.uniform());
                    if (j % 4 == 1) a = std::round(a);
                    if (j % 4 == 2) b = std::round(b);
                    if (j % 4 == 3) a = std::round(a), b = std::round(b);
                    const auto& c = view.corners;
                    const Vec3f d = (c[0] * (1 - a) + c[1] * a) * (1 - b) + (c[3] * (1 - a) + c[2] * a) * b;
                    CHECK_FALSE(bvh.occluded({.origin = view.eye, .direction = d}));
                }
            }
        }
    CHECK(empty > 300);
    CHECK(full > 300);
}

TEST_CASE("a pyramid that looks at a triangle, or from within its box, may meet it; what has a NaN may meet anything") {
    const std::array<Vec3f, 3> vertices{Vec3f(-1, -1, 0), Vec3f(1, -1, 0), Vec3f(0, 1, 0)};
    const std::array<UVec3, 1> faces{UVec3(0, 1, 2)};
    const Bvh bvh = Bvh::build(triangles(vertices, faces));
    const auto looking = [](const Vec3f& eye, float z, float nan = 0) {
        return Pyramid<float>(eye, {Vec3f(-0.1f + nan, -0.1f, z), Vec3f(0.1f, -0.1f, z), Vec3f(0.1f, 0.1f, z),
                                    Vec3f(-0.1f, 0.1f, z)});
    };
    CHECK(may_meet(bvh, looking({0, 0, 5}, -1)));
    CHECK(may_meet(bvh, looking({0, 0, 0}, -1)));
    CHECK_FALSE(may_meet(bvh, looking({0, 0, 5}, 1)));
    CHECK_FALSE(may_meet(bvh, looking({8, 0, 5}, -1)));
    CHECK(may_meet(bvh, looking({8, 0, 5}, -1, std::numeric_limits<float>::quiet_NaN())));
    CHECK_FALSE(may_meet(Bvh(), looking({0, 0, 5}, -1)));
}
