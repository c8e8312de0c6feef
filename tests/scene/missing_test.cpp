#include <doctest/doctest.h>
#include <lambent/scene/builtin.hpp>
#include <lambent/scene/missing.hpp>

using namespace lambent;

TEST_CASE("what files leave out: a sky where nothing shines, a camera that sees all; nothing where it is there") {
    Scene<float> scene = cornell_scene<float>();
    const std::size_t cameras = scene.cameras.size();
    add_missing_light(scene);
    add_missing_camera(scene);
    CHECK(scene.environment.black());
    CHECK(scene.cameras.size() == cameras);
    CHECK(scene.notes.empty());

    for (Material& m : scene.materials) m.emission = Vec3f(0);
    scene.cameras.clear();
    CHECK_FALSE(has_light(scene));
    add_missing_light(scene);
    add_missing_camera(scene);
    CHECK(has_light(scene));
    CHECK(scene.notes.size() == 1);
    REQUIRE(scene.cameras.size() == 1);
    const Bounds3<double> box = scene.bounds();
    const Camera& camera = scene.cameras[0];
    const Vec3d forward = normalize(camera.target - camera.eye);
    for (int corner = 0; corner < 8; ++corner) { // within the cone of the smaller angle of view
        const Vec3d p((corner & 1 ? box.max : box.min).x, (corner & 2 ? box.max : box.min).y,
                      (corner & 4 ? box.max : box.min).z);
        CHECK(dot(normalize(p - camera.eye), forward) >= std::cos(camera.vertical_fov * pi<double> / 360) - 1e-9);
    }

    Scene<float> empty;
    add_missing_light(empty);
    add_missing_camera(empty);
    CHECK(empty.cameras.size() == 1);
}
