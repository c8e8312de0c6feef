#include "support/brute_force.hpp"
#include "support/meshes.hpp"
#include "support/random.hpp"
#include <cmath>
#include <cstdint>
#include <doctest/doctest.h>
#include <lambent/bvh/bvh.hpp>
#include <lambent/bvh/compact.hpp>
#include <lambent/bvh/instance.hpp>
#include <lambent/bvh/primitive_leaves.hpp>
#include <lambent/bvh/serialize.hpp>
#include <lambent/bvh/sphere.hpp>
#include <lambent/bvh/statistics.hpp>
#include <limits>
#include <string>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

using Wide = long double;

/// An orthonormal frame at random, in columns.
void rotation(Random& random, Vec3d (&r)[3]) {
    r[0] = normalize(random.in_box<double>(-1, 1) + Vec3d(1e-3, 0, 0));
    r[1] = normalize(cross(r[0], random.in_box<double>(-1, 1) + Vec3d(0, 1e-3, 0)));
    r[2] = cross(r[0], r[1]);
}

/// Rotation, scales of either sign between 1/stretch and stretch, another rotation, and a translation. Boxes
/// stay as tight as they are without the rotations, and those of needles along z with one about z.
enum class Turn { any, about_z, none };
template <class T>
Affine<T> transform(Random& random, double stretch, double offset, Turn turn = Turn::any) {
    Vec3d a[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, b[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    if (turn == Turn::any) {
        rotation(random, a);
        rotation(random, b);
    }
    if (turn == Turn::about_z) {
        const double angle = random.uniform(0, 6.28);
        b[0] = {std::cos(angle), std::sin(angle), 0};
        b[1] = {-std::sin(angle), std::cos(angle), 0};
    }
    Affine<T> m;
    double scale[3];
    for (double& s : scale)
        s = std::pow(stretch, random.uniform(-1, 1)) * (random.index(2) ? 1 : -1);
    for (int k = 0; k < 3; ++k) {
        Vec3d column(0);
        for (int j = 0; j < 3; ++j) column += a[j] * (scale[j] * b[k][j]);
        m.column[k] = Vec3<T>(column);
    }
    m.translation = random.in_box<T>(-offset, offset);
    return m;
}

template <class T>
Vec3d in_world(const Affine<T>& m, const Vec3<T>& p) {
    return Vec3d(m.column[0]) * double(p.x) + Vec3d(m.column[1]) * double(p.y) + Vec3d(m.column[2]) * double(p.z) +
           Vec3d(m.translation);
}

/// The nearest hit among all instances, each asked on its own: no tree above them.
template <class T, class Tree>
Hit<T> ask_all(const InstanceSet<Tree>& set, Ray<T> ray) {
    Hit<T> best;
    for (std::size_t i = 0; i < set.count(); ++i) {
        const auto& placed = set.placed()[i];
        if (placed.tree == nullptr) continue;
        const Hit<T> hit = placed.tree->intersect(placed.to_object_space(ray));
        if (!hit) continue;
        ray.t_max = hit.t;
        best = hit;
        best.instance = std::uint32_t(i);
    }
    return best;
}

} // namespace

TEST_CASE_TEMPLATE("Instances are hit where their transformed triangles are, by another formula in double", T, float, double) {
    const lambent_test::Mesh<T> mesh = soup<T>(40, 0.5, 3);
    const auto object = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
    Random random(4);
    std::vector<Instance<BasicBvh<T>>> list;
    struct World {
        Corners<double> corners;
        std::uint32_t primitive, instance;
    };
    std::vector<World> world;
    for (std::uint32_t i = 0; i < 25; ++i) {
        list.push_back({&object, transform<T>(random, 3, 3)});
        for (std::uint32_t k = 0; k < 40; ++k) {
            World w{{}, k, i};
            for (std::size_t c = 0; c < 3; ++c) w.corners[c] = in_world(list[i].to_world, mesh.triangle(k)[c]);
            world.push_back(w);
        }
    }
    const auto top = InstancedBvh<BasicBvh<T>>::build(InstanceSet(list));
    CHECK(statistics(top).triangles == 25);
    const double tolerance = sizeof(T) == 4 ? 1e-3 : 1e-10, margin = sizeof(T) == 4 ? 1e-2 : 1e-9;
    std::size_t checked = 0, wrong = 0;
    for (int i = 0; i < 6000; ++i) {
        const Ray<T> ray{random.in_box<T>(-4, 4), random.in_box<T>(-1, 1), T(random.uniform(-1, 1)),
                         T(random.uniform(2, 30))};
        const Ray<double> exact{Vec3d(ray.origin), Vec3d(ray.direction)};
        const Hit<T> hit = top.intersect(ray);
        wrong += std::size_t(top.occluded(ray) != bool(hit));
        double sure = double(ray.t_max); // of the nearest hit that rounding cannot take away
        const World* first = nullptr;
        for (const World& w : world) {
            const DoubleTest d = moller_trumbore(w.corners, exact);
            if (!d.plane || d.sharpness < 0.05) continue;
            if (hit && hit.primitive == w.primitive && hit.instance == w.instance) {
                ++checked;
                wrong += std::size_t(std::abs(d.t - double(hit.t)) > tolerance * (1 + std::abs(d.t)));
                wrong += std::size_t(std::abs(d.u - double(hit.u)) > 10 * margin ||
                                     std::abs(d.v - double(hit.v)) > 10 * margin);
            }
            if (d.u > margin && d.v > margin && d.u + d.v < 1 - margin && d.t > double(ray.t_min) + tolerance &&
                d.t < sure) {
                sure = d.t;
                first = &w;
            }
        }
        if (first != nullptr) wrong += std::size_t(!hit || double(hit.t) > sure + tolerance * (1 + std::abs(sure)));
    }
    CHECK(checked > 2000);
    CHECK(wrong == 0);
}

TEST_CASE_TEMPLATE("The upper tree loses no hit that asking every instance finds, to the bit, however skewed", T, float, double) {
    const lambent_test::Mesh<T> round = sphere<T>(12, 8, 0.3, 1);
    const T far = 1 / (64 * std::numeric_limits<T>::epsilon()); // from its own origin
    const lambent_test::Mesh<T> square{"square",
                                       {{far, far, far}, {far + 2, far, far}, {far + 2, far + 2, far}, {far, far + 2, far}},
                                       {{0, 1, 2}, {0, 2, 3}}};
    const T thin = 16 * std::numeric_limits<T>::epsilon();
    const lambent_test::Mesh<T> needle{
        "needle", {{-thin, 0, -1}, {thin, 0, -1}, {0, 0, 1}, {0, -thin, -1}, {0, thin, -1}}, {{0, 1, 2}, {3, 4, 2}}};
    const lambent_test::Mesh<T>* const meshes[] = {&round, &square, &needle};
    const BasicBvh<T> objects[] = {BasicBvh<T>::build(triangles(round.vertices, round.faces)),
                                   BasicBvh<T>::build(triangles(square.vertices, square.faces)),
                                   BasicBvh<T>::build(triangles(needle.vertices, needle.faces))};
    std::size_t rays = 0, hits = 0, different = 0;
    for (const double stretch : {1.0, 4.0, 300.0}) {
        Random random(8);
        std::vector<Instance<BasicBvh<T>>> list;
        struct Edge {
            Vec3d from, to, center;
        };
        std::vector<Edge> edges;
        for (int i = 0; i < 60; ++i) {
            const int kind = i % 3;
            const lambent_test::Mesh<T>& mesh = *meshes[kind];
            const Turn turns[] = {Turn::any, i % 2 == 0 ? Turn::none : Turn::any, Turn::about_z};
            Affine<T> m = transform<T>(random, stretch, 3, turns[kind]);
            if (kind == 1) m.translation -= m.vector(Vec3<T>(far));
            list.push_back({&objects[kind], m});
            for (std::size_t k = 0; k < (kind == 2 ? 40 : mesh.faces.size()); ++k) {
                const UVec3 f = mesh.faces[k % mesh.faces.size()];
                edges.push_back({in_world(m, mesh.vertices[f.y]), in_world(m, mesh.vertices[f.z]),
                                 in_world(m, kind == 1 ? Vec3<T>(far + 1, far + 1, far) : Vec3<T>(0))});
            }
        }
        const InstanceSet set(list);
        const auto top = InstancedBvh<BasicBvh<T>>::build(set);
        for (int i = 0; i < 60000; ++i) { // at edges or a little outside: met or missed by the rounding errors
            const Edge& e = edges[random.index(edges.size())];
            Vec3d at = e.from + (e.to - e.from) * random.uniform();
            at += (at - e.center + random.in_box<double>(-0.1, 0.1)) * double(std::numeric_limits<T>::epsilon()) * std::pow(10, random.uniform(-1, 5.5));
            Ray<T> ray{random.in_box<T>(-6, 6)};
            ray.direction = Vec3<T>(at - Vec3d(ray.origin));
            ray.t_min = T(0.99); // nothing before it, and soon nothing behind
            if (i % 4 == 0) ray.t_max = T(1.01);
            const Hit<T> hit = top.intersect(ray), expected = ask_all(set, ray);
            ++rays;
            hits += std::size_t(bool(hit));
            different += std::size_t(hit.t != expected.t || top.occluded(ray) != bool(expected));
        }
    }
    CHECK(hits > rays / 3);
    CHECK(different == 0);
}

TEST_CASE_TEMPLATE("Hits lie no further outside of a transformed triangle than boxes are widened for them", T, float, double) {
    // Squares that are parallel to the world's axes, and in their own space are not.
    constexpr double u = double(std::numeric_limits<T>::epsilon()) / 2;
    double worst = 0;
    std::size_t outside = 0;
    Random random(8);
    for (int i = 0; i < 300; ++i) {
        const Affine<T> m = transform<T>(random, i % 2 == 0 ? 2 : 30, 3);
        Mat4d matrix(1);
        for (int k = 0; k < 3; ++k) matrix[k] = Vec4<double>(Vec3d(m.column[k]), 0);
        matrix[3] = Vec4<double>(Vec3d(m.translation), 1);
        const Mat4d inverse = glm::inverse(matrix);
        lambent_test::Mesh<T> mesh{"square", {}, {{0, 1, 2}, {0, 2, 3}}};
        for (const Vec3d& p : {Vec3d(1, 1, 0), Vec3d(-1, 1, 0), Vec3d(-1, -1, 0), Vec3d(1, -1, 0)})
            mesh.vertices.push_back(Vec3<T>(Vec3d(inverse * Vec4<double>(p, 1))));
        Bounds3<double> box;
        for (const Vec3<T>& v : mesh.vertices) box.add(in_world(m, v));
        const auto object = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
        const InstanceSet set(std::vector<Instance<BasicBvh<T>>>{{&object, m}});
        const double margin = double(InstancedBvh<BasicBvh<T>>::build(set).tree().margin);
        for (int k = 0; k < 200; ++k) {
            Vec3d at(random.uniform(-1, 1), 1, 0);
            at *= 1 + u * std::pow(10, random.uniform(-1, 4));
            Ray<T> ray{random.in_box<T>(-6, 6)};
            ray.direction = Vec3<T>(at - Vec3d(ray.origin));
            const Hit<T> hit = ask_all(set, ray);
            if (!hit) continue;
            const Vec3d origin(ray.origin), p = origin + double(hit.t) * Vec3d(ray.direction);
            const double reach = std::max(max_component(abs(box.min - origin)), max_component(abs(box.max - origin)));
            const double out = std::max(max_component(box.min - p), max_component(p - box.max)) / (u * reach);
            worst = std::max(worst, out);
            outside += std::size_t(out > margin);
        }
    }
    CHECK(outside == 0);
    CHECK(worst > 100); // so the default margin would not do
}

TEST_CASE_TEMPLATE("Watertight: no ray at transformed edges and vertices gets out of an instance", T, float, double) {
    std::size_t rays = 0, closest = 0, any = 0;
    Random random(12);
    for (const lambent_test::Mesh<T>& mesh : {sphere<T>(40, 20, 0.5, 1), cube<T>(8)}) {
        const auto object = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
        for (const double offset : {0.0, 3.0, 1e3}) {
            for (const double stretch : {1.0, 2.0, 30.0}) {
                for (int place = 0; place < 20; ++place) {
                    const std::vector<Instance<BasicBvh<T>>> list = {{&object, transform<T>(random, stretch, offset)}};
                    const Affine<T>& m = list[0].to_world;
                    const auto top = InstancedBvh<BasicBvh<T>>::build(InstanceSet(list));
                    for (int i = 0; i < 2800; ++i) {
                        const UVec3 face = mesh.faces[random.index(mesh.faces.size())];
                        const int k = int(random.index(3));
                        const Vec3d p = in_world(m, mesh.vertices[face[k]]), q = in_world(m, mesh.vertices[face[(k + 1) % 3]]);
                        Ray<T> ray;
                        ray.origin = Vec3<T>(in_world(m, random.in_box<T>(-0.4, 0.4)));
                        const Vec3d at = i % 2 == 0 ? p : p + (q - p) * random.uniform();
                        ray.direction = Vec3<T>(at - Vec3d(ray.origin));
                        if (i % 3 == 0) ray.direction = normalize(ray.direction);
                        ++rays;
                        closest += std::size_t(!top.intersect(ray));
                        any += std::size_t(!top.occluded(ray));
                    }
                }
            }
        }
    }
    CHECK(rays >= 1000000); // of each type
    CHECK(closest == 0);
    CHECK(any == 0);
}

TEST_CASE_TEMPLATE("Bounds of instances hold every transformed vertex", T, float, double) {
    const lambent_test::Mesh<T> mesh = soup<T>(100, 0.3, 3);
    const auto object = BasicBvh<T>::build(triangles(mesh.vertices, mesh.faces));
    Random random(4);
    std::size_t outside = 0;
    double loose = 0;
    for (int i = 0; i < 300; ++i) {
        const std::vector<Instance<BasicBvh<T>>> list = {{&object, transform<T>(random, 20, i % 3 * 1e4, i % 2 == 0 ? Turn::any : Turn::none)}};
        const InstanceSet set(list);
        const auto& placed = set.placed()[0];
        Vec3<Wide> low(1e300L), high(-1e300L);
        for (const Vec3<T>& v : mesh.vertices) {
            Vec3<Wide> w(placed.world_center); // the centres are tied as they are rounded
            for (int k = 0; k < 3; ++k)
                w += Vec3<Wide>(list[0].to_world.column[k]) * (Wide(v[k]) - Wide(placed.object_center[k]));
            low = min(low, w);
            high = max(high, w);
        }
        for (int k = 0; k < 3; ++k)
            outside += std::size_t(Wide(set.bounds(0).min[k]) > low[k] || Wide(set.bounds(0).max[k]) < high[k]);
        loose = std::max(loose, double(length(Vec3d(set.bounds(0).size())) / length(Vec3d(high - low))));
    }
    CHECK(outside == 0);
    CHECK(loose < 1.6);
}

TEST_CASE_TEMPLATE("Masks and filters choose among instances; a plain tree is instance 0", T, float, double) {
    const std::vector<Vec3<T>> vertices = {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}};
    const std::vector<UVec3> faces = {{0, 1, 2}};
    const auto object = BasicBvh<T>::build(triangles(vertices, faces));
    std::vector<Instance<BasicBvh<T>>> list(4, {&object});
    for (int i = 0; i < 4; ++i) {
        list[std::size_t(i)].to_world.translation.z = T(i + 1);
        list[std::size_t(i)].mask = 1u << i;
    }
    const auto top = InstancedBvh<BasicBvh<T>>::build(InstanceSet(list));
    const Ray<T> ray;
    CHECK(top.intersect(ray).t == 1);
    for (std::uint32_t mask = 0; mask < 16; ++mask) {
        const Hit<T> hit = top.intersect(ray, RayMask{mask});
        std::uint32_t expected = 0;
        while (expected < 4 && (mask >> expected & 1) == 0) ++expected;
        CHECK(bool(hit) == (mask != 0));
        CHECK(top.occluded(ray, RayMask{mask}) == (mask != 0));
        if (hit) CHECK(hit.instance == expected);
        const auto not_two = [](std::uint32_t primitive, T, T, T t, std::uint32_t instance) {
            CHECK(primitive == 0);
            CHECK(t == T(instance + 1));
            return instance != 2;
        };
        CHECK(bool(top.intersect(ray, RayMask{mask, not_two})) == ((mask & ~4u) != 0));
    }
    CHECK(top.intersect(ray, [](std::uint32_t, T, T, T t) { return t > 2; }).instance == 2);
    CHECK(top.intersect(ray, [](std::uint32_t, T, T, T, std::uint32_t i) { return i == 3; }).t == 4);
    CHECK_FALSE(top.occluded(ray, [](std::uint32_t, T, T, T, std::uint32_t) { return false; }));
    CHECK(object.occluded({{0, 0, -1}, {0, 0, 1}}, [](std::uint32_t, T, T, T, std::uint32_t i) { return i == 0; }));
    CHECK_FALSE(object.intersect({{0, 0, -1}, {0, 0, 1}}, [](std::uint32_t, T, T, T, std::uint32_t i) { return i != 0; }));
}

TEST_CASE("Impossible instances are refused by number; empty ones and those scaled to nothing are left out") {
    const lambent_test::Mesh<float> mesh = cube<float>(1);
    const Bvh object = Bvh::build(triangles(mesh.vertices, mesh.faces)), nothing;
    std::vector<Instance<Bvh>> list(3, {&object});
    const auto refusal = [&]() -> std::string {
        try {
            const InstanceSet set(list);
        } catch (const Error& error) {
            return error.what();
        }
        return "";
    };
    CHECK(refusal() == "");
    list[1].tree = nullptr;
    CHECK(refusal() == "instance 1 has no tree");
    list[1].tree = &object;
    list[2].to_world.column[1].y = std::numeric_limits<float>::quiet_NaN();
    CHECK(refusal() == "instance 2 has a transform that is not finite");
    list[2].to_world.column[1] = {0, 0, 0};
    CHECK(refusal() == "instance 2 has a transform that flattens space");
    list[2].to_world.column[1] = {1, 0, 0}; // two columns alike
    CHECK(refusal() == "instance 2 has a transform that flattens space");
    list[2].to_world.column[1] = {1, 1e-7f, 0};
    CHECK(refusal().find("instance 2 has a transform that flattens space: its condition") == 0);
    list[2].to_world = {};
    list[2].to_world.translation.x = 3.3e38f;
    for (Vec3f& column : list[2].to_world.column) column *= 1e38f;
    CHECK(refusal() == "instance 2 has a transform that reaches out of the numbers' range");
    list[2].to_world = {};
    for (Vec3f& column : list[2].to_world.column) column *= 1e-30f; // small is not flat
    CHECK(refusal() == "");

    for (Vec3f& column : list[0].to_world.column) column = {0, 0, 0};
    list[1].tree = &nothing;
    list[2].to_world = {};
    const auto top = InstancedBvh<Bvh>::build(InstanceSet(list));
    CHECK(top.dropped() == 2);
    CHECK(top.intersect({}).instance == 2);
    CHECK(InstancedBvh<Bvh>::build(InstanceSet(std::vector<Instance<Bvh>>())).empty());
}

TEST_CASE_TEMPLATE("Instances of spheres and of compact trees; refit and reload follow transforms", T, float, double) {
    const std::vector<Vec3<T>> centers = {{0, 0, 0}, {0, 5, 0}};
    const std::vector<T> radii = {1, 2};
    const auto balls = spheres(centers, radii);
    using Balls = PrimitiveBvh<decltype(balls)>;
    const Balls object = Balls::build(balls);
    std::vector<Instance<Balls>> list(2, {&object});
    list[0].to_world.column[2] *= T(3); // an ellipsoid, and one mirrored
    list[0].to_world.translation = {0, 0, 10};
    list[1].to_world.column[1] *= T(-1);
    list[1].to_world.translation = {100, 0, 0};
    auto top = InstancedBvh<Balls>::build(InstanceSet(list));
    CHECK(double(top.intersect(Ray<T>{}).t) == doctest::Approx(7).epsilon(1e-6));
    CHECK(top.intersect(Ray<T>{{100, -5, -10}, {0, 0, 1}}).t == T(8));
    CHECK(top.intersect(Ray<T>{{100, -5, -10}, {0, 0, 1}}).primitive == 1);
    CHECK(top.intersect(Ray<T>{{100, -5, -10}, {0, 0, 1}}).instance == 1);

    const auto again = load<InstancedBvh<Balls>>(save(top), InstanceSet(list));
    CHECK(again.intersect(Ray<T>{}).t == top.intersect(Ray<T>{}).t);
    CHECK(again.tree().margin == top.tree().margin);
    list[0].to_world.translation = {0, 0, 50};
    top.refit(InstanceSet(list));
    CHECK(double(top.intersect(Ray<T>{}).t) == doctest::Approx(47).epsilon(1e-6));
    CHECK(top.bounds().max.z >= 53);

    const lambent_test::Mesh<T> mesh = cube<T>(2);
    const auto set = triangles(mesh.vertices, mesh.faces);
    using Compact = CompactBvh<decltype(set)>;
    const Compact compact = Compact::build(set);
    std::vector<Instance<Compact>> boxes(1, {&compact});
    boxes[0].to_world = Affine<T>::from(Mat4<T>(2, 0, 0, 0, 0, 1, 0, 0, 0, 0, -4, 0, 0, 0, 20, 1));
    CHECK(InstancedBvh<Compact>::build(InstanceSet(boxes)).intersect(Ray<T>{}).t == T(16));
}

TEST_CASE_TEMPLATE("Affine: points, and normals at right angles to the surface, on its side, also when mirrored", T, float, double) {
    Random random(3);
    double worst = 0;
    std::size_t wrong_side = 0;
    for (int i = 0; i < 2000; ++i) {
        Affine<T> m = transform<T>(random, 10, 0);
        const double scale = std::exp2(random.uniform(-60, 60));
        for (Vec3<T>& column : m.column) column *= T(scale);
        const Vec3<T> a = normalize(random.in_box<T>(-1, 1)), n = normalize(cross(a, random.in_box<T>(-1, 1)));
        const Vec3<T> b = cross(n, a), image = m.normal(n * T(random.uniform(0.1, 10)));
        const auto image_of = [&](const Vec3<T>& v) { return in_world(m, v) / scale; };
        worst = std::max(worst, std::abs(double(length(image)) - 1));
        for (const Vec3d& tangent : {normalize(image_of(a)), normalize(image_of(b))})
            worst = std::max(worst, std::abs(dot(tangent, Vec3d(image))));
        wrong_side += std::size_t(dot(image_of(n), Vec3d(image)) <= 0);
    }
    CHECK(worst < 1000 * double(std::numeric_limits<T>::epsilon()));
    CHECK(wrong_side == 0);
    const Affine<T> m = Affine<T>::from(Mat4d(1, 2, 3, 0, 4, 5, 6, 0, 7, 8, 10, 0, 11, 12, 13, 1));
    CHECK(m.point({1, 10, 100}) == Vec3<T>(752, 864, 1076));
    CHECK(m.vector({1, 10, 100}) == Vec3<T>(741, 852, 1063));
    CHECK_THROWS_AS((void)Affine<T>::from(Mat4d(2.0) * 1.0), Error);
}
