#include <render/seeds.hpp>
#include <doctest/doctest.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

using namespace lambent_test;

/// Radiance on paper against every sampler and every strategy that can see it: |z| < 4, and within a thousandth where
/// the noise is small enough to tell. The quick version spends little on chance that seldom meets a small light; the
/// full one, which tests/stress.sh runs, gets below the thousandth but for independent samples of small lights.
namespace {

/// Most images of one way to render.
enum class Effort : int { quick = 32, full = 6000 };

struct Known {
    std::string name;
    Camera camera;
    double expected = 0;
    std::uint32_t depth = 1;
    int spp = 4096; ///< of the full version; an eighth in the quick one, but a quarter by Sobol with both strategies
    bool by_light = true, by_chance = true;
    int light_factor = 1; ///< on the full version's spp by light samples alone, which scatter where all is beside lights
    Scene<float> scene{};
};

void check_known(const Known& known, Effort effort) {
    constexpr double precision = 2.4e-4;
    SerialExecutor serial;
    const PreparedScene<float> prepared(known.scene, serial);
    for (const SamplerName sampler : all_samplers)
        for (const PathStrategy strategy : all_strategies) {
            if (strategy == PathStrategy::light && !known.by_light) continue;
            if (strategy == PathStrategy::bsdf && !known.by_chance) continue;
            const bool surest = sampler == SamplerName::sobol && strategy == PathStrategy::both && known.spp == 4096;
            const int full_spp = known.spp * (strategy == PathStrategy::light ? known.light_factor : 1);
            const int spp = effort == Effort::full ? full_spp : surest ? known.spp / 4 : std::max(known.spp / 8, 4);
            const Way way{sampler, strategy, {known.depth, PathOptions::unlimited}};
            const Estimate e = mean_to_precision(prepared, known.camera, {2, 2}, way, spp, precision, int(effort));
            CAPTURE(known.name);
            CAPTURE(way.name());
            INFO("radiance " << e.grey << " of " << known.expected << ", standard error " << e.grey_error << ", rays "
                             << e.rays);
            CHECK(e.finite);
            CHECK(std::abs(e.z(known.expected)) < max_z);
            const bool precise = e.grey_error < 1.3 * precision * known.expected;
            if (precise)
                CHECK(std::abs(e.grey / known.expected - 1) < 1e-3);
            else
                CHECK(e.grey_error < 0.03 * known.expected);
            if (surest || (effort == Effort::full && sampler != SamplerName::independent)) CHECK(precise);
        }
}

constexpr double floor_albedo = 0.7;
constexpr double turn = 2 * pi<double>;

/// A large floor y = 0, and the ray that all pixels share: down to the origin.
Known floor_lit(const std::string& name, double half_size = 50) {
    Known known;
    known.name = name;
    const double s = half_size;
    lambent::detail::add_quad(known.scene, {Vec3d{-s, 0, s}, Vec3d{s, 0, s}, Vec3d{s, 0, -s}, Vec3d{-s, 0, -s}},
                              add_material(known.scene, Vec3f(float(floor_albedo))));
    known.camera = {{0.03, 0.02, 0.025}, {0, 0, 0}, {0, 1, 0}, 1e-3, ""};
    return known;
}

/// A flat convex polygon that emits to the side from which its corners go round counter-clockwise.
void add_polygon_light(Scene<float>& scene, const std::vector<Vec3d>& corners, double radiance) {
    const auto light = add_material(scene, Vec3f(0), Vec3f(float(radiance)));
    const auto first = std::uint32_t(scene.positions.size());
    for (const Vec3d& p : corners) {
        scene.positions.push_back(Vec3f(p));
        scene.texcoords.push_back(Vec2f(0));
    }
    for (std::uint32_t i = 2; i < corners.size(); ++i) {
        scene.triangles.push_back({first, first + i - 1, first + i});
        scene.triangle_materials.push_back(light);
    }
}

/// Lambert's formula: the view factor of a polygon above the floor from the origin.
double polygon_factor(const std::vector<Vec3d>& corners) {
    double sum = 0;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const Vec3d a = normalize(corners[i]), b = normalize(corners[(i + 1) % corners.size()]), c = cross(a, b);
        sum += std::atan2(length(c), dot(a, b)) * c.y / length(c);
    }
    return std::abs(sum) / turn;
}

/// View factor of an a × b rectangle at height h, from a parallel surface under one of its corners.
double rectangle_factor(double a, double b, double h) {
    const double x = std::hypot(a, h), y = std::hypot(b, h);
    return (a / x * std::atan(b / x) + b / y * std::atan(a / y)) / turn;
}

Known floor_under_polygon(const std::string& name, const std::vector<Vec3d>& corners, double radiance, double factor) {
    Known known = floor_lit(name);
    add_polygon_light(known.scene, corners, radiance);
    known.expected = floor_albedo * radiance * factor;
    return known;
}

std::vector<Vec3d> rectangle(double x0, double z0, double a, double b, double h) {
    return {{x0, h, z0}, {x0 + a, h, z0}, {x0 + a, h, z0 + b}, {x0, h, z0 + b}};
}

std::vector<Known> floors_under_polygons() {
    std::vector<Known> all;
    for (const auto& [a, b, h] : {std::array{1.0, 1.0, 1.0}, {1.0, 1.0, 0.1}, {2.0, 0.5, 3.0}})
        all.push_back(floor_under_polygon("rectangle from under its corner, height " + std::to_string(h),
                                          rectangle(0, 0, a, b, h), 5, rectangle_factor(a, b, h)));
    all.push_back(floor_under_polygon("rectangle from under its middle", rectangle(-0.5, -0.5, 1, 1, 1), 1,
                                      4 * rectangle_factor(0.5, 0.5, 1)));
    std::vector<Vec3d> disk; // 1024 corners: a circle but for 6e-6 of its area
    for (int i = 0; i < 1024; ++i)
        disk.push_back({0.5 * std::cos(turn * i / 1024), 2, 0.5 * std::sin(turn * i / 1024)});
    all.push_back(floor_under_polygon("disk on its axis", disk, 3, 0.25 / (0.25 + 4)));
    const std::vector<Vec3d> wall{{2, 0, -1}, {2, 0, 1}, {2, 3, 1}, {2, 3, -1}}; // stands on the floor
    all.push_back(floor_under_polygon("wall", wall, 2, polygon_factor(wall)));
    const std::vector<Vec3d> tilted{{-0.7, 0.4, 0.2}, {0.9, 1.6, 0.1}, {0.3, 1.1, 1.5}};
    all.push_back(floor_under_polygon("tilted triangle", tilted, 4, polygon_factor(tilted)));
    return all;
}

std::vector<Known> floors_under_spheres() {
    std::vector<Known> all;
    Known sphere = floor_lit("sphere light");
    sphere.scene.spheres.push_back({{0, 2, 1}, 0.5f, add_material(sphere.scene, Vec3f(0), Vec3f(5))});
    sphere.expected = floor_albedo * 5 * (0.25 / 5) * (2 / std::sqrt(5.0));
    all.push_back(std::move(sphere));
    Known large = floor_lit("large sphere light");
    large.scene.spheres.push_back({{0.5, 3, -1}, 2.5f, add_material(large.scene, Vec3f(0), Vec3f(2))});
    large.expected = floor_albedo * 2 * (6.25 / 10.25) * (3 / std::sqrt(10.25));
    all.push_back(std::move(large));
    return all;
}

std::vector<Known> floors_under_points() {
    std::vector<Known> all;
    const auto add = [&](const std::string& name, const PunctualLight& light, double expected) {
        Known known = floor_lit(name);
        known.scene.punctual_lights = {light};
        known.expected = expected;
        known.by_chance = false;
        known.spp = 16;
        all.push_back(std::move(known));
    };
    PunctualLight light;
    light.position = {0, 2, 1};
    light.intensity = Vec3f(4);
    add("point light", light, floor_albedo * 4 * (2 / std::sqrt(5.0)) / (pi<double> * 5));
    light.kind = PunctualLight::Kind::spot;
    light.direction = normalize(Vec3d(0.1, -2, -1));
    light.inner_cone_cos = 0.99f;
    light.outer_cone_cos = 0.9f;
    add("spot light", light, floor_albedo * 4 * (2 / std::sqrt(5.0)) / (pi<double> * 5));
    light.kind = PunctualLight::Kind::directional;
    light.direction = {0, -std::cos(pi<double> / 6), std::sin(pi<double> / 6)};
    light.intensity = Vec3f(3);
    add("directional light", light, floor_albedo * 3 * std::cos(pi<double> / 6) / pi<double>);
    return all;
}

Environment white_sky() {
    Environment sky;
    sky.scale = Vec3f(1);
    return sky;
}

std::vector<Known> under_skies() {
    std::vector<Known> all;
    Known cosine = floor_lit("cosine sky");
    Environment& sky = cosine.scene.environment = white_sky();
    sky.width = 8;
    sky.height = 512;
    for (int y = 0; y < sky.height; ++y)
        for (int x = 0; x < sky.width; ++x)
            sky.map.push_back(Vec3f(std::max(0.0f, std::cos((float(y) + 0.5f) / float(sky.height) * pi<float>))));
    cosine.expected = 2 * floor_albedo / 3;
    all.push_back(std::move(cosine));

    Known convex{
        .name = "convex furnace", .camera = {{0.3, 0.4, 2}, {0, 0, 0}, {0, 1, 0}, 20, ""}, .expected = 0.5, .spp = 256};
    add_icosphere(convex.scene, Vec3d(0), 1, 3, false, add_material(convex.scene, Vec3f(0.5f)));
    convex.scene.environment = white_sky();
    all.push_back(std::move(convex));

    Known glass{.name = "glass sphere",
                .camera = {{0, 0, 3}, {0, 0, 0}, {0, 1, 0}, 45, ""},
                .expected = 1,
                .depth = 64,
                .spp = 64};
    const auto material = add_material(glass.scene, Vec3f(1));
    Material& m = glass.scene.materials[material];
    m.roughness = 0;
    m.specular = m.transmission = m.thickness = 1;
    glass.scene.spheres.push_back({{0, 0, 0}, 1, material});
    glass.scene.environment = white_sky();
    all.push_back(std::move(glass));
    return all;
}

/// What a GGX conductor that reflects all gives back of a white sky, seen from straight above, by one scattering:
/// Simpson's rule over the angle of the mirrored direction.
double ggx_albedo_from_above(double alpha) {
    const auto integrand = [&](double theta) {
        const double half = std::cos(theta / 2), c2 = half * half, d = c2 * (alpha * alpha - 1) + 1;
        const double facets = alpha * alpha / (pi<double> * d * d), tangent = std::tan(theta);
        const double masking = 2 / (1 + std::sqrt(1 + alpha * alpha * tangent * tangent));
        return facets * masking / 4 * turn * std::sin(theta);
    };
    constexpr int steps = 200000;
    const double end = pi<double> / 2 * (1 - 1e-9), h = end / steps;
    double sum = integrand(0) + integrand(end);
    for (int i = 1; i < steps; ++i) sum += integrand(h * i) * (i % 2 == 1 ? 4 : 2);
    return sum * h / 3;
}

std::vector<Known> conductors() {
    std::vector<Known> all;
    for (const auto& [alpha, rounded] : {std::array{0.1, 0.9882}, {0.25, 0.9155}, {0.5, 0.6878}, {1.0, 0.3072}}) {
        Known known = floor_lit("conductor, alpha " + std::to_string(alpha));
        Material& m = known.scene.materials[0];
        m.base_color = Vec3f(1);
        m.metallic = 1;
        m.roughness = float(std::sqrt(alpha));
        known.camera = {{0, 0.03, 0}, {0, 0, 0}, {0, 0, -1}, 1e-3, ""};
        known.scene.environment = white_sky();
        known.expected = ggx_albedo_from_above(alpha);
        CHECK(std::abs(known.expected - rounded) < 5e-4);
        all.push_back(std::move(known));
    }
    return all;
}

/// Closed furnaces: without roulette, down to where the rest of the series is below 1e-5 of the whole.
std::uint32_t depth_for(double albedo) { return std::uint32_t(std::log(1e-5) / std::log(albedo)); }

std::vector<Known> closed_furnaces() {
    std::vector<Known> all;
    const Camera inside_camera{{0.3, 0.2, 0.1}, {0, 0, -1}, {0, 1, 0}, 90, ""};
    Known cube{.name = "cube",
               .camera = {{0.4, 0.6, 0.3}, {0.5, 0.5, 1}, {0, 1, 0}, 90, ""},
               .expected = 8,
               .depth = depth_for(0.75),
               .spp = 64,
               .by_light = false}; // where two walls that shine meet, light samples have no finite variance
    add_room(cube.scene, 1, add_material(cube.scene, Vec3f(0.75f), Vec3f(2)));
    all.push_back(std::move(cube));
    Known icosphere{.name = "icosphere",
                    .camera = inside_camera,
                    .expected = 5,
                    .depth = depth_for(0.8),
                    .spp = 64,
                    .light_factor = 4};
    add_icosphere(icosphere.scene, Vec3d(0), 1, 2, true, add_material(icosphere.scene, Vec3f(0.8f), Vec3f(1)));
    all.push_back(std::move(icosphere));
    for (const double albedo : {0.5, 0.8, 0.9}) { // from inside, nothing samples a sphere's light
        Known sphere{.name = "analytic sphere, albedo " + std::to_string(albedo),
                     .camera = inside_camera,
                     .expected = 1 / (1 - albedo),
                     .depth = depth_for(albedo),
                     .spp = 16,
                     .by_light = false};
        const auto wall = add_material(sphere.scene, Vec3f(float(albedo)), Vec3f(1));
        sphere.scene.materials[wall].double_sided = true; // a sphere's front is its outside
        sphere.scene.spheres.push_back({{0, 0, 0}, 1, wall});
        all.push_back(std::move(sphere));
    }
    for (const std::uint32_t terms : {1u, 2u, 4u}) {
        Known series{.name = "series, terms " + std::to_string(terms),
                     .camera = inside_camera,
                     .expected = 2 - std::pow(0.5, terms - 1.0),
                     .depth = terms - 1,
                     .spp = 64,
                     .light_factor = 16};
        add_icosphere(series.scene, Vec3d(0), 1, 2, true, add_material(series.scene, Vec3f(0.5f), Vec3f(1)));
        all.push_back(std::move(series));
    }
    Known point{.name = "point light in a sphere",
                .camera = inside_camera,
                .expected = 0.6 * 3 / (pi<double> * 4 * 0.4),
                .depth = depth_for(0.6),
                .spp = 16,
                .by_chance = false};
    point.scene.spheres.push_back({{0, 0, 0}, 2, add_material(point.scene, Vec3f(0.6f))});
    PunctualLight light;
    light.intensity = Vec3f(3);
    point.scene.punctual_lights = {light};
    all.push_back(std::move(point));
    return all;
}

void check_all(const std::vector<Known>& all, Effort effort) {
    for (const Known& known : all) check_known(known, effort);
}

} // namespace

TEST_CASE("closed forms by every sampler and strategy: floor under polygons") {
    check_all(floors_under_polygons(), Effort::quick);
}
TEST_CASE("closed forms by every sampler and strategy: floor under spheres") {
    check_all(floors_under_spheres(), Effort::quick);
}
TEST_CASE("closed forms by every sampler and strategy: floor under punctual lights") {
    check_all(floors_under_points(), Effort::quick);
}
TEST_CASE("closed forms by every sampler and strategy: under skies") { check_all(under_skies(), Effort::quick); }
TEST_CASE("closed forms by every sampler and strategy: conductors in a furnace") {
    check_all(conductors(), Effort::quick);
}
TEST_CASE("closed forms by every sampler and strategy: closed furnaces") {
    check_all(closed_furnaces(), Effort::quick);
}

TEST_CASE("stress: closed forms within a thousandth by every sampler and strategy" * doctest::skip()) {
    check_all(floors_under_polygons(), Effort::full);
    check_all(floors_under_spheres(), Effort::full);
    check_all(floors_under_points(), Effort::full);
    check_all(under_skies(), Effort::full);
    check_all(conductors(), Effort::full);
    check_all(closed_furnaces(), Effort::full);
}
