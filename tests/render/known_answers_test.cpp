#include <render/transport.hpp>
#include <doctest/doctest.h>
#include <algorithm>
#include <array>
#include <vector>

using namespace lambent_test;

/// Scenes whose radiance has a closed form: a floor lit directly, seen at one point.
namespace {

constexpr double albedo = 0.7;

/// A large floor y = 0 around the origin.
Scene<float> floor_scene(double half_size = 50) {
    Scene<float> scene;
    const double s = half_size;
    lambent::detail::add_quad(scene, {Vec3d{-s, 0, s}, Vec3d{s, 0, s}, Vec3d{s, 0, -s}, Vec3d{-s, 0, -s}},
                              add_material(scene, Vec3f(float(albedo))));
    return scene;
}

/// Radiance of the floor at the origin, seen along one and the same ray.
template <class I>
Estimate at_origin(const Scene<float>& scene, const I& integrator, int samples) {
    SerialExecutor serial;
    const PreparedScene<float> prepared(scene, serial);
    const Camera camera{{0.03, 0.02, 0.025}, {0, 0, 0}, {0, 1, 0}, 1e-3, ""};
    return image_mean(prepared, camera, {8, 8}, integrator, samples / 4);
}

/// Both heuristics and both single strategies must see the same.
void check_radiance(const Scene<float>& scene, double expected, int samples, bool by_chance_too = true) {
    const auto check = [&](const Estimate& e, const char* name, double tolerance) {
        INFO(name << ": radiance " << e.grey << " of " << expected << ", standard error " << e.grey_error);
        CHECK(e.finite);
        CHECK(std::abs(e.z(expected)) < max_z);
        CHECK(std::abs(e.grey / expected - 1) < tolerance);
    };
    check(at_origin(scene, PathIntegrator<>{{1}}, samples), "both, power", 2e-3);
    check(at_origin(scene, PathIntegrator<PathStrategy::both, MisHeuristic::balance>{{1}}, samples), "both, balance", 2e-3);
    check(at_origin(scene, PathIntegrator<PathStrategy::light>{{1}}, samples), "light", 2e-3);
    if (by_chance_too) check(at_origin(scene, PathIntegrator<PathStrategy::bsdf>{{1}}, 4 * samples), "bsdf", 0.02);
}

/// View factor of an a × b rectangle at height h, from a parallel surface under one of its corners.
double corner_factor(double a, double b, double h) {
    const double x = std::hypot(a, h), y = std::hypot(b, h);
    return (a / x * std::atan(b / x) + b / y * std::atan(a / y)) / (2 * pi<double>);
}

} // namespace

TEST_CASE("S3: floor under a rectangle: the view factor, from the corner and from the middle") {
    struct Case {
        double a, b, h;
    };
    for (const Case& c : {Case{1, 1, 1}, Case{1, 1, 0.1}, Case{2, 0.5, 3}}) {
        CAPTURE(c.h);
        Scene<float> scene = floor_scene();
        const auto light = add_material(scene, Vec3f(0), Vec3f(5));
        lambent::detail::add_quad(scene, {Vec3d{0, c.h, 0}, Vec3d{c.a, c.h, 0}, Vec3d{c.a, c.h, c.b}, Vec3d{0, c.h, c.b}}, light);
        check_radiance(scene, albedo * 5 * corner_factor(c.a, c.b, c.h), 4096);
    }
    CHECK(corner_factor(1, 1, 1) == doctest::Approx(0.13853161));
    Scene<float> scene = floor_scene();
    const auto light = add_material(scene, Vec3f(0), Vec3f(1));
    lambent::detail::add_quad(scene, {Vec3d{-0.5, 1, -0.5}, Vec3d{0.5, 1, -0.5}, Vec3d{0.5, 1, 0.5}, Vec3d{-0.5, 1, 0.5}}, light);
    check_radiance(scene, albedo * 0.23945647, 4096);
}

TEST_CASE("S3: floor under a sphere light: pi L (R/d)^2 cos, from close by to a speck far away") {
    Scene<float> scene = floor_scene();
    scene.spheres.push_back({{0, 2, 1}, 0.5f, add_material(scene, Vec3f(0), Vec3f(5))});
    check_radiance(scene, 0.15652476, 4096);
    for (const double radius : {1e-1, 1e-2, 1e-3})
        for (const double cosine : {0.9, 0.3}) {
            const double distance = 30;
            CAPTURE(radius);
            CAPTURE(cosine);
            Scene<float> far = floor_scene(60);
            far.spheres.push_back({Vec3f(Vec3d(std::sqrt(1 - cosine * cosine), cosine, 0) * distance), float(radius),
                                   add_material(far, Vec3f(0), Vec3f(1))});
            const double expected = albedo * radius * radius / (distance * distance) * cosine;
            check_radiance(far, expected, 256, false);
        }
}

TEST_CASE("S3: floor far from a small light, face on and nearly edge on: its own surface is no occluder") {
    for (const bool square : {false, true})
        for (const double cosine : {0.9, 0.2, 0.02})
            for (const double distance : {1.0, 30.0, 1000.0}) {
                CAPTURE(square);
                CAPTURE(cosine);
                CAPTURE(distance);
                // Low above the floor, its front turned away from the floor's point by the angle of this cosine.
                const Vec3d way = normalize(Vec3d(1, 1, 0)), up = normalize(cross(cross(way, Vec3d(0, 0, 1)), way));
                const Vec3d normal = -way * cosine + Vec3d(0, 0, 1) * std::sqrt(1 - cosine * cosine);
                const Vec3d a = normalize(cross(normal, up)), b = cross(normal, a), center = way * distance;
                Scene<float> scene = floor_scene(2 * distance);
                const auto light = add_material(scene, Vec3f(0), Vec3f(1));
                const auto first = std::uint32_t(scene.positions.size());
                std::vector<Vec3d> corners = {center - 0.01 * a - 0.01 * b, center + 0.01 * a - 0.01 * b, center + 0.01 * b};
                if (square) { // large enough for floats to make a parallelogram of it
                    const Vec3d u = 0.002 * distance * a, v = 0.002 * distance * b;
                    corners = {center - u - v, center + u - v, center - u + v, center + u + v};
                }
                for (const Vec3d& p : corners) {
                    scene.positions.push_back(Vec3f(p));
                    scene.texcoords.push_back(Vec2f(0));
                }
                scene.triangles.push_back({first, first + 1, first + 2});
                if (square) scene.triangles.push_back({first + 3, first + 2, first + 1});
                scene.triangle_materials.resize(scene.triangles.size(), light);
                // What floats made of it, exactly, as seen from the origin: area · cos · cos / d².
                const Vec3d p0(scene.positions[first]), p1(scene.positions[first + 1]), p2(scene.positions[first + 2]);
                const Vec3d middle = square ? (p1 + p2) / 2.0 : (p0 + p1 + p2) / 3.0;
                const Vec3d area = cross(p1 - p0, p2 - p0) / (square ? 1.0 : 2.0);
                const double d2 = dot(middle, middle);
                const double expected = albedo / pi<double> * -dot(area, middle) * middle.y / (d2 * d2);
                SerialExecutor serial;
                const PreparedScene<float> prepared(scene, serial);
                CHECK(prepared.light_count() == 1);
                const Estimate e = at_origin(scene, PathIntegrator<PathStrategy::light>{{1}}, 4096);
                INFO("radiance " << e.grey << " of " << expected << ", standard error " << e.grey_error);
                CHECK(std::abs(e.grey / expected - 1) < 0.003);
            }
}

TEST_CASE("floor under punctual lights: point, spot, directional") {
    Scene<float> scene = floor_scene();
    PunctualLight light;
    light.position = {0, 2, 1};
    light.intensity = Vec3f(4);
    scene.punctual_lights = {light};
    check_radiance(scene, 0.15943481, 64, false);
    light.kind = PunctualLight::Kind::spot;
    light.direction = normalize(Vec3d(0.1, -2, -1));
    light.inner_cone_cos = 0.99f;
    light.outer_cone_cos = 0.9f;
    scene.punctual_lights = {light};
    check_radiance(scene, 0.15943481, 64, false);
    light.kind = PunctualLight::Kind::directional;
    light.direction = {0, -std::cos(pi<double> / 6), std::sin(pi<double> / 6)};
    light.intensity = Vec3f(3);
    scene.punctual_lights = {light};
    check_radiance(scene, 0.57889534, 64, false);
    SerialExecutor serial;
    const PreparedScene<float> prepared(scene, serial);
    CHECK(at_origin(scene, PathIntegrator<PathStrategy::bsdf>{{1}}, 64).grey == 0); // never met by chance
}

TEST_CASE("point light in the middle of a closed sphere: rho I / (pi R^2 (1 - rho)), all bounces") {
    Scene<float> scene;
    scene.spheres.push_back({{0, 0, 0}, 2, add_material(scene, Vec3f(0.6f))});
    PunctualLight light;
    light.intensity = Vec3f(3);
    scene.punctual_lights = {light};
    SerialExecutor serial;
    const PreparedScene<float> prepared(scene, serial);
    const Camera camera{{0.5, 0.2, 0.1}, {0, 0, -1}, {0, 1, 0}, 90, ""};
    for (const std::uint32_t roulette : {4u, 12u}) {
        const Estimate e = image_mean(prepared, camera, {16, 16}, PathIntegrator<>{{PathOptions::unlimited, roulette}}, 1024);
        INFO(e.grey << " +- " << e.grey_error);
        CHECK(std::abs(e.z(0.358099)) < max_z);
        CHECK(std::abs(e.grey / 0.358099 - 1) < 1e-3);
    }
}

TEST_CASE("floor under an environment map: cosine sky, a sun, turned") {
    Environment sky; // L = max(0, cos), 256 rows: 2 rho / 3
    sky.scale = Vec3f(1);
    sky.width = 512;
    sky.height = 256;
    for (int y = 0; y < sky.height; ++y)
        for (int x = 0; x < sky.width; ++x)
            sky.map.push_back(Vec3f(std::max(0.0f, std::cos((float(y) + 0.5f) / 256 * pi<float>))));
    Scene<float> scene = floor_scene();
    scene.environment = sky;
    check_radiance(scene, 2 * albedo / 3, 4096);

    // A sun of one row and two columns, low and turned: irradiance by quadrature of the map as it is looked up.
    for (Vec3f& texel : scene.environment.map) texel = Vec3f(0.1f);
    for (const std::size_t x : {100u, 101u}) scene.environment.map[50 * 512 + x] = Vec3f(3000, 2000, 1000);
    for (const double rotation : {0.0, 123.0}) {
        scene.environment.rotation = rotation;
        const EnvironmentLight<double> exact(scene.environment.map, 512, 256, Vec3f(1), rotation);
        double irradiance = 0;
        constexpr int rows = 1024, columns = 4096;
        for (int y = 0; y < rows / 2; ++y)
            for (int x = 0; x < columns; ++x) {
                const double theta = (y + 0.5) / rows * pi<double>, phi = (x + 0.5) / columns * 2 * pi<double>;
                const Vec3d d(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi));
                const Vec3d l = exact.radiance(d);
                irradiance += (l.x + l.y + l.z) / 3 * d.y * std::sin(theta) * (pi<double> / rows) * (2 * pi<double> / columns);
            }
        CAPTURE(rotation);
        check_radiance(scene, albedo / pi<double> * irradiance, 4096, false);
    }
}

TEST_CASE("many lights of many kinds: the chance of the pick is in the pdf") {
    Scene<float> scene = floor_scene();
    double expected = 0;
    const auto add_sphere = [&](const Vec3d& center, double radius, double radiance) {
        scene.spheres.push_back({Vec3f(center), float(radius), add_material(scene, Vec3f(0), Vec3f(float(radiance)))});
        const double d2 = dot(center, center);
        expected += albedo * radiance * radius * radius / d2 * center.y / std::sqrt(d2);
    };
    add_sphere({0, 2, 1}, 0.5, 5);
    add_sphere({-2, 3, 0}, 0.2, 50);
    add_sphere({3, 1, 2}, 0.1, 200);
    add_sphere({-5, 40, 0}, 2, 1);
    lambent::detail::add_quad(scene, {Vec3d{0, 1, -1}, Vec3d{1, 1, -1}, Vec3d{1, 1, 0}, Vec3d{0, 1, 0}},
                              add_material(scene, Vec3f(0), Vec3f(2)));
    expected += albedo * 2 * corner_factor(1, 1, 1);
    PunctualLight light;
    light.position = {-1, 2, -2};
    light.intensity = Vec3f(4);
    scene.punctual_lights = {light};
    expected += albedo / pi<double> * 4 * 2 / 27;
    check_radiance(scene, expected, 16384, false);
}

TEST_CASE("emitters with sides and holes: light and chance agree on what shines") {
    // A mask, opaque in one half, on a quad that emits; seen from the front and, where double-sided, from behind.
    for (const bool double_sided : {false, true})
        for (const bool from_behind : {false, true})
            for (const bool masked : {false, true}) {
                CAPTURE(double_sided);
                CAPTURE(from_behind);
                CAPTURE(masked);
                Scene<float> scene = floor_scene();
                const auto light = add_material(scene, Vec3f(0), Vec3f(5));
                Material& m = scene.materials[light];
                m.double_sided = double_sided;
                m.alpha_mode = masked ? AlphaMode::mask : AlphaMode::opaque;
                Image half;
                half.width = 2;
                half.height = 1;
                half.rgba = {255, 255, 255, 255, 255, 255, 255, 0};
                scene.images.push_back(half);
                m.base_color_texture.image = 0;
                std::array<Vec3d, 4> quad{Vec3d{-1, 1, -1}, Vec3d{1, 1, -1}, Vec3d{1, 1, 1}, Vec3d{-1, 1, 1}};
                if (from_behind) std::reverse(quad.begin(), quad.end());
                lambent::detail::add_quad(scene, quad, light);
                const Estimate by_light = at_origin(scene, PathIntegrator<PathStrategy::light>{{1}}, 4096);
                const Estimate by_chance = at_origin(scene, PathIntegrator<PathStrategy::bsdf>{{1}}, 16384);
                const Estimate both = at_origin(scene, PathIntegrator<>{{1}}, 4096);
                INFO(by_light.grey << ' ' << by_chance.grey << ' ' << both.grey);
                const bool shines = double_sided || !from_behind;
                CHECK((both.grey > 0) == shines);
                if (shines) {
                    CHECK(std::abs(by_light.z(by_chance)) < max_z);
                    CHECK(std::abs(both.z(by_chance)) < max_z);
                    CHECK(std::abs(by_light.grey / by_chance.grey - 1) < 0.01);
                    CHECK(both.grey < (masked ? 0.7 : 1.1) * albedo * 5 * 4 * corner_factor(1, 1, 1));
                } else {
                    CHECK(by_light.grey == 0);
                    CHECK(by_chance.grey == 0);
                }
            }
}

TEST_CASE("B3: what stands between is a shadow, but for the holes of a mask") {
    for (const bool masked : {false, true}) {
        Scene<float> scene = floor_scene();
        scene.spheres.push_back({{0, 5, 0}, 0.1f, add_material(scene, Vec3f(0), Vec3f(100))});
        const auto screen = add_material(scene, Vec3f(0));
        scene.materials[screen].alpha_mode = AlphaMode::mask;
        scene.materials[screen].alpha = masked ? 0.2f : 0.8f;
        lambent::detail::add_quad(scene, {Vec3d{-1, 3, 1}, Vec3d{1, 3, 1}, Vec3d{1, 3, -1}, Vec3d{-1, 3, -1}}, screen);
        for (const Estimate& e : {at_origin(scene, PathIntegrator<>{{1}}, 256),
                                  at_origin(scene, PathIntegrator<PathStrategy::light>{{1}}, 256)}) {
            CAPTURE(masked);
            if (masked) CHECK(e.grey == doctest::Approx(albedo * 100 * 0.01 / 25).epsilon(1e-3));
            else CHECK(e.grey == 0);
        }
    }
}
