// Light through clear sheets: what light samples find behind them, what bounces find, and that it is the same.
#include <doctest/doctest.h>
#include <lambent/material/fresnel.hpp>
#include <lambent/render/path.hpp>
#include <render/transport.hpp>

using namespace lambent_test;

namespace {

void add_square(Scene<float>& scene, double height, double half_side, std::uint32_t material) { // its front looks down
    lambent::detail::add_quad(scene,
                              {Vec3d{-half_side, height, -half_side}, Vec3d{half_side, height, -half_side},
                               Vec3d{half_side, height, half_side}, Vec3d{-half_side, height, half_side}},
                              material);
}

std::uint32_t add_pane(Scene<float>& scene, const Vec3f& color) {
    const std::uint32_t index = add_material(scene, color);
    Material& m = scene.materials[index];
    m.specular = m.transmission = 1;
    m.roughness = 0;
    return index;
}

/// A floor, so many tinted panes over it, and a camera between the two that looks down.
struct Floor {
    Scene<float> scene;
    Camera camera{{0.1, 0.5, 0.1}, {0.1, 0, 0.1}, {1, 0, 0}, 1, ""};
    static constexpr double albedo = 0.6;
    static inline const Vec3d tint{0.9, 0.7, 0.4};

    explicit Floor(int panes) {
        add_square(scene, 0, 50, add_material(scene, Vec3f(float(albedo))));
        const std::uint32_t pane = add_pane(scene, Vec3f(tint));
        for (int i = 0; i < panes; ++i) add_square(scene, 1 + i, 50, pane);
    }
    template <class I>
    Vec3d seen(const I& integrator, int samples = 16) const {
        SerialExecutor serial;
        const PreparedScene<float> prepared(scene, serial);
        return image_mean(prepared, camera, {2, 2}, integrator, samples).mean;
    }
};

/// A closed room with a window, and a lamp of some size before it.
Scene<float> room_with_window(double lamp_size) {
    Scene<float> scene;
    const std::uint32_t wall = add_material(scene, Vec3f(0.6f)), lamp = add_material(scene, Vec3f(0), Vec3f(5));
    const std::uint32_t glass = add_pane(scene, Vec3f(0.9f, 0.8f, 0.7f));
    lambent::detail::add_box(scene, Vec3d(0), Vec3d(1), 0, lambent::detail::BoxFront::inside,
                             {wall, wall, wall, wall, glass, wall});
    const double s = lamp_size / 2;
    const auto facing = [&](double z) {
        return std::array<Vec3d, 4>{Vec3d(0.5 - s, 0.5 - s, z), Vec3d(0.5 + s, 0.5 - s, z), Vec3d(0.5 + s, 0.5 + s, z), Vec3d(0.5 - s, 0.5 + s, z)};
    };
    lambent::detail::add_quad(scene, facing(-1), lamp);
    lambent::detail::add_quad(scene, facing(-0.5), glass); // a second pane, just before the lamp
    for (Material& m : scene.materials) m.double_sided = true;
    return scene;
}

} // namespace

TEST_CASE("panes: the sun lights a floor through them, each with its tint and what it doesn't mirror") {
    for (const int panes : {0, 1, 2, 5})
        for (const double angle : {0.0, 0.6, 1.3}) {
            Floor floor(panes);
            PunctualLight sun;
            sun.kind = PunctualLight::Kind::directional;
            sun.direction = {std::sin(angle), -std::cos(angle), 0};
            floor.scene.punctual_lights = {sun};
            const double mirrored = lambent::schlick(Vec3d(0.04), 1.0, std::cos(angle)).x;
            CAPTURE(panes);
            CAPTURE(angle);
            // Paths so short that nothing but the sun's own light counts: a scattering event for the floor and each pane.
            const Vec3d seen = floor.seen(PathIntegrator<>{{.max_depth = std::uint32_t(panes) + 1}});
            for (int c = 0; c < 3; ++c) {
                const double passed = std::pow(Floor::tint[c] * (1 - mirrored), panes);
                CHECK(seen[c] == doctest::Approx(Floor::albedo / pi<double> * std::cos(angle) * passed).epsilon(2e-5));
            }
            if (panes > 0) CHECK(floor.seen(PathIntegrator<>{{.max_depth = std::uint32_t(panes)}}) == Vec3d(0));
        }
}

TEST_CASE("panes: analytic spheres are some too, and those that are not still hide the sun") {
    PunctualLight sun;
    sun.kind = PunctualLight::Kind::directional;
    sun.direction = {0, -1, 0};
    Floor domed(0);
    domed.scene.punctual_lights = {sun};
    const std::uint32_t pane = add_pane(domed.scene, Vec3f(Floor::tint));
    domed.scene.spheres.push_back({.center = Vec3f(0), .radius = 100, .material = pane});
    const Vec3d seen = domed.seen(PathIntegrator<>{{.max_depth = 2}});
    for (int c = 0; c < 3; ++c)
        CHECK(seen[c] == doctest::Approx(Floor::albedo / pi<double> * Floor::tint[c] * 0.96).epsilon(2e-5));
    domed.scene.spheres.push_back({.center = Vec3f(0, 50, 0), .radius = 2, .material = 0});
    CHECK(domed.seen(PathIntegrator<>{{.max_depth = 2}}) == Vec3d(0));
}

TEST_CASE("panes: not what refracts, nor volumes that keep light; what hides by chance hides by chance") {
    Floor floor(1);
    PunctualLight sun;
    sun.kind = PunctualLight::Kind::directional;
    sun.direction = {0, -1, 0};
    floor.scene.punctual_lights = {sun};
    Material& pane = floor.scene.materials[1];
    const PathIntegrator<> two{{.max_depth = 2}};
    const double clear = floor.seen(two).y;
    CHECK(clear > 0.1);
    pane.thickness = 1;
    CHECK(floor.seen(two) == Vec3d(0));
    pane.ior = 1; // a volume, but one that does not bend: without its mirror
    CHECK(floor.seen(two).y == doctest::Approx(clear / 0.96).epsilon(1e-5));
    pane.attenuation_color = Vec3f(0.5f); // and one that light is lost in is none
    pane.attenuation_distance = 1;
    CHECK(floor.seen(two) == Vec3d(0));

    Floor veiled(1);
    veiled.scene.punctual_lights = {sun};
    Material veil;
    veil.alpha_mode = AlphaMode::blend;
    veil.alpha = 0.3f;
    veiled.scene.materials.push_back(veil);
    add_square(veiled.scene, 2, 50, 2);
    SerialExecutor serial;
    const PreparedScene<float> prepared(veiled.scene, serial);
    const Estimate e = image_mean(prepared, veiled.camera, {16, 16}, two, 64, 4, [](std::uint32_t seed) { return SobolSampler<float>(seed); });
    CHECK(std::abs(e.mean.y - 0.7 * clear) < 4 * e.error.y);
    CHECK(e.error.y < 0.01 * clear);
}

TEST_CASE("panes: light samples, bounces and both find the same light behind them") {
    for (const double size : {0.2, 0.8}) {
        const Scene<float> scene = room_with_window(size);
        SerialExecutor serial;
        const PreparedScene<float> prepared(scene, serial);
        const Camera camera{{0.5, 0.5, 0.4}, {0.5, 0.45, 1}, {0, 1, 0}, 80, ""};
        const auto mean = [&](const auto& integrator, int spp) {
            return image_mean(prepared, camera, {12, 12}, Reflected{integrator}, spp, 8, [](std::uint32_t seed) { return SobolSampler<float>(seed); });
        };
        for (const std::uint32_t depth : {2u, 4u, 20u}) {
            const PathOptions options{.max_depth = depth};
            const Estimate both = mean(PathIntegrator<>{options}, 256);
            const Estimate light = mean(PathIntegrator<PathStrategy::light>{options}, 256);
            const Estimate bsdf = mean(PathIntegrator<PathStrategy::bsdf>{options}, 2048);
            CAPTURE(size);
            CAPTURE(depth);
            CHECK(std::abs(both.z(bsdf)) < 4);
            CHECK(std::abs(light.z(bsdf)) < 4);
            CHECK(std::abs(both.z(light)) < 4);
            CHECK(both.relative_error() < 0.02);
        }
    }
}

TEST_CASE("panes: one in a coloured volume takes its share, and the volume all of its way") {
    Scene<float> scene;
    scene.environment.scale = Vec3f(1);
    const std::uint32_t juice = add_pane(scene, Vec3f(1)), pane = add_pane(scene, Vec3f(0.5f));
    Material& m = scene.materials[juice];
    m.thickness = 1;
    m.ior = 1;
    m.attenuation_color = Vec3f(0.5f, 0.25f, 0.125f);
    m.attenuation_distance = 1;
    lambent::detail::add_box(scene, Vec3d(-1), Vec3d(1), 0, lambent::detail::BoxFront::outside, {juice, juice, juice, juice, juice, juice});
    add_square(scene, 0.25, 0.9, pane);
    SerialExecutor serial;
    const PreparedScene<float> prepared(scene, serial);
    const Camera camera{{0, 5, 0}, {0, 0, 0}, {1, 0, 0}, 0.1, ""};
    // What the pane mirrors leaves the volume upwards: twice the way above it.
    const Vec3d seen = image_mean(prepared, camera, {8, 8}, PathIntegrator<>{{.roulette_depth = PathOptions::unlimited}}, 4096).mean;
    for (int c = 0; c < 3; ++c) {
        const double left = std::pow(0.5, c + 1); // of light, a metre on
        CHECK(seen[c] == doctest::Approx(0.96 * 0.5 * left * left + 0.04 * std::pow(left, 1.5)).epsilon(0.004));
    }
}
