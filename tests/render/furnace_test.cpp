#include <render/transport.hpp>
#include <doctest/doctest.h>
#include <initializer_list>

using namespace lambent_test;

/// White furnaces: where light comes equally from everywhere, what is seen follows from the albedo alone,
/// whatever the shape. Every check asks for |z| < 4 and 0.2 %, and that the noise is small enough to tell.
namespace {

void check_level(const Estimate& e, double expected) {
    INFO("mean " << e.grey << " of " << expected << ", standard error " << e.grey_error << ", rays " << e.rays);
    CHECK(e.finite);
    CHECK(std::abs(e.z(expected)) < max_z);
    CHECK(std::abs(e.grey / expected - 1) < 0.002);
    CHECK(e.grey_error < 0.0015 * expected);
}

/// Runs check(integrator, samples, name) for every strategy, heuristic and roulette, which makes most of the noise.
struct Samples {
    int with_roulette, without;
};
template <class Check>
void for_all_integrators(std::uint32_t max_depth, std::uint32_t roulette_depth, Samples samples, Check&& check) {
    for (const std::uint32_t roulette : {roulette_depth, PathOptions::unlimited}) {
        const PathOptions options{max_depth, roulette};
        const bool on = roulette == roulette_depth;
        const int n = on ? samples.with_roulette : samples.without;
        const std::string suffix = on ? ", roulette" : ", no roulette";
        check(PathIntegrator<PathStrategy::both>{options}, n, "both, power" + suffix);
        check(PathIntegrator<PathStrategy::both, MisHeuristic::balance>{options}, n, "both, balance" + suffix);
        check(PathIntegrator<PathStrategy::light>{options}, 6 * n, "light" + suffix); // noisier near edges
        check(PathIntegrator<PathStrategy::bsdf>{options}, n, "bsdf" + suffix);
    }
}

/// Convex shapes that fill the whole image: an icosphere or a sphere close to the camera.
Scene<float> open_furnace(double albedo, bool analytic) {
    Scene<float> scene;
    const auto material = add_material(scene, Vec3f(float(albedo)));
    if (analytic) scene.spheres.push_back({Vec3f(0), 1, material});
    else add_icosphere(scene, Vec3d(0), 1, 3, false, material);
    scene.environment.scale = Vec3f(1);
    return scene;
}
const Camera close_up{{0.3, 0.4, 2}, {0, 0, 0}, {0, 1, 0}, 20, ""};

Scene<float> closed_furnace(double albedo) {
    Scene<float> scene;
    add_icosphere(scene, Vec3d(0), 1, 2, true, add_material(scene, Vec3f(float(albedo)), Vec3f(1)));
    return scene;
}
const Camera within{{0.3, 0.2, 0.1}, {0, 0, -1}, {0, 1, 0}, 90, ""};

} // namespace

TEST_CASE("G5: an open white furnace shows the albedo: 1 and 0.5") {
    SerialExecutor serial;
    for (const double albedo : {1.0, 0.5})
        for (const bool analytic : {false, true}) {
            const Scene<float> scene = open_furnace(albedo, analytic);
            const PreparedScene<float> prepared(scene, serial);
            for_all_integrators(PathOptions::unlimited, 1, {512, 512}, [&](const auto& integrator, int n, const std::string& name) {
                CAPTURE(name);
                CAPTURE(albedo);
                CAPTURE(analytic);
                check_level(image_mean(prepared, close_up, {8, 8}, integrator, n), albedo);
            });
        }
}

TEST_CASE("open furnace: a rough white metal shows what its facets lose, unless the scene compensates for it") {
    SerialExecutor serial;
    Scene<float> scene = open_furnace(1, true);
    scene.materials[0].metallic = scene.materials[0].roughness = 1;
    for (const bool compensated : {false, true}) {
        CAPTURE(compensated);
        scene.compensated = compensated;
        const PreparedScene<float> prepared(scene, serial);
        const Estimate e = image_mean(prepared, close_up, {8, 8}, PathIntegrator<>{}, 512);
        CHECK(e.grey_error < 0.002);
        if (compensated) CHECK(std::abs(e.grey - 1) < 0.005);
        else CHECK(e.grey < 0.8);
    }
}

TEST_CASE("S4: a closed furnace of emission 1 shows 1 / (1 - albedo): 2 and 10") {
    SerialExecutor serial;
    for (const double albedo : {0.5, 0.9}) {
        const Scene<float> scene = closed_furnace(albedo);
        const PreparedScene<float> prepared(scene, serial);
        // Without roulette paths end where what is left, albedo^depth / (1 - albedo), is below 1e-5 of the whole.
        const auto enough = std::uint32_t(std::log(1e-5) / std::log(albedo));
        const Samples samples = albedo == 0.5 ? Samples{128, 40} : Samples{64, 28}; // in here a uniform choice of light would be best
        for_all_integrators(enough, albedo == 0.5 ? 6 : 50, samples, [&](const auto& integrator, int n, const std::string& name) {
            CAPTURE(name);
            CAPTURE(albedo);
            check_level(image_mean(prepared, within, {16, 16}, integrator, n), 1 / (1 - albedo));
        });
    }
}

TEST_CASE("S5: a closed furnace of albedo 1 and emission 1 shows as many terms as the depth lets through") {
    SerialExecutor serial;
    const Scene<float> scene = closed_furnace(1);
    const PreparedScene<float> prepared(scene, serial);
    for (const std::uint32_t terms : {1u, 2u, 8u})
        for_all_integrators(terms - 1, 2, {96, 72}, [&](const auto& integrator, int n, const std::string& name) {
            CAPTURE(name);
            CAPTURE(terms);
            check_level(image_mean(prepared, within, {16, 16}, integrator, n), terms);
        });
}

TEST_CASE("S5: depth d shows the first terms of the geometric series, in a box too") {
    SerialExecutor serial;
    const double albedo = 0.75;
    Scene<float> scene;
    add_room(scene, 1, add_material(scene, Vec3f(float(albedo)), Vec3f(2)));
    const PreparedScene<float> prepared(scene, serial);
    const Camera camera{{0.4, 0.6, 0.3}, {0.5, 0.5, 1}, {0, 1, 0}, 90, ""};
    for (const std::uint32_t depth : {0u, 1u, 3u, 7u}) {
        CAPTURE(depth);
        const double expected = 2 * (1 - std::pow(albedo, depth + 1)) / (1 - albedo);
        check_level(image_mean(prepared, camera, {8, 8}, PathIntegrator<>{{depth}}, 2048), expected);
    }
}

TEST_CASE("closed furnace of an analytic sphere, seen from inside: no bias at grazing bounces, at albedo 0.99 neither") {
    SerialExecutor serial;
    for (const double albedo : {0.8, 0.99}) {
        CAPTURE(albedo);
        Scene<float> scene;
        const auto wall = add_material(scene, Vec3f(float(albedo)), Vec3f(1));
        scene.materials[wall].double_sided = true; // a sphere's front is its outside
        scene.spheres.push_back({{10, -3, 5}, 2, wall});
        const PreparedScene<float> prepared(scene, serial);
        const Camera camera{{10.3, -3.2, 5.1}, {10, -3, 0}, {0, 1, 0}, 90, ""};
        const PathOptions no_roulette{std::uint32_t(std::log(1e-5) / std::log(albedo)), PathOptions::unlimited};
        check_level(image_mean(prepared, camera, {8, 8}, PathIntegrator<PathStrategy::bsdf>{no_roulette}, 16), 1 / (1 - albedo));
        // Unlimited depth; late roulette makes less noise of the same mean.
        const PathOptions roulette{PathOptions::unlimited, albedo == 0.99 ? 300u : 40u};
        check_level(image_mean(prepared, camera, {16, 16}, PathIntegrator<>{roulette}, 160), 1 / (1 - albedo));
    }
}
