#include <lambent/render/counting_scene.hpp>
#include <render/transport.hpp>
#include <doctest/doctest.h>

using namespace lambent_test;

TEST_CASE("back sides of front-only materials: cameras look through, light and bounces do not") {
    for (const bool masks_elsewhere : {false, true}) {
        CAPTURE(masks_elsewhere);
        Scene<float> scene;
        const std::uint32_t floor = add_material(scene, Vec3f(0.5f)), sheet = add_material(scene, Vec3f(0.9f));
        scene.materials[sheet].front_only = true;
        const auto square = [&](double height, double side, std::uint32_t material) { // the front looks down
            lambent::detail::add_quad(scene, {Vec3d{-side, height, -side}, Vec3d{side, height, -side}, Vec3d{side, height, side}, Vec3d{-side, height, side}}, material);
        };
        square(0, 9, floor);
        square(1, 1, sheet);
        if (masks_elsewhere) {
            Material mask = scene.materials[floor];
            mask.alpha_mode = AlphaMode::mask;
            mask.alpha = 0;
            scene.materials.push_back(mask);
            square(1.5, 9, std::uint32_t(scene.materials.size() - 1)); // not there at all
        }
        PunctualLight sun;
        sun.kind = PunctualLight::Kind::directional;
        sun.direction = {0, -1, 0};
        scene.punctual_lights = {sun};
        SerialExecutor serial;
        const PreparedScene<float> prepared(scene, serial);
        const CountingScene<float> counting(prepared);
        const auto seen = [&](const Vec3d& eye, const Vec3d& target) {
            const Camera camera{eye, target, {1, 0, 0}, 1, ""};
            const double radiance = image_mean(prepared, camera, {4, 4}, PathIntegrator<>{{1}}, 16).grey;
            CHECK(image_mean(counting, camera, {4, 4}, PathIntegrator<>{{1}}, 16).grey == radiance);
            return radiance;
        };
        const double lit = 0.5 / pi<double>;
        CHECK(seen({0.1, 5, 0.1}, {0.1, 0, 0.1}) == 0);                                 // through the back, onto the sheet's shadow
        CHECK(seen({4, 5, 0.1}, {4, 0, 0.1}) == doctest::Approx(lit).epsilon(1e-5));    // beside it
        CHECK(seen({4, 2.2, 0.1}, {-3, -0.1, 0.1}) == doctest::Approx(lit).epsilon(1e-4)); // through the back, to lit floor
    }
}
