#include "scene_setup.hpp"
#include "../support/command_line.hpp"
#include <lambent/core/parallel.hpp>
#include <lambent/io/environment.hpp>
#include <lambent/io/scene_file.hpp>
#include <lambent/scene/builtin.hpp>
#include <lambent/scene/missing.hpp>
#include <algorithm>

using namespace lambent;

namespace {

Environment make_environment(const Options& o, std::vector<std::string>& notes) {
    Environment environment;
    if (o.constant_environment) environment.scale = Vec3f(*o.constant_environment);
    else environment = read_environment(o.environment, &notes);
    environment.scale *= float(o.environment_scale);
    environment.rotation = o.environment_rotation;
    return environment;
}

} // namespace

Scene<float> load_named_scene(const Options& o, ThreadExecutor& threads) {
    const std::string& name = o.scene;
    if (name == "builtin:cornell") return cornell_scene<float>();
    if (name == "builtin:door") return door_scene<float>();
    const std::string room = "builtin:room";
    if (name == room) return room_scene<float>();
    if (name.rfind(room + ":", 0) == 0) return room_scene<float>(int(to_integer(name.substr(room.size() + 1), 1, 64)));
    if (name.rfind("builtin:", 0) == 0) throw UsageError(name + ": there are builtin:cornell, builtin:door and builtin:room");
    return load_scene<float>(name, o.load, threads);
}

Scene<float> make_scene(const Options& o, ThreadExecutor& threads) {
    Scene<float> scene = load_named_scene(o, threads);
    scene.compensated = o.compensated;
    if (!o.environment.empty() || o.constant_environment) scene.environment = make_environment(o, scene.notes);
    for (const SphereLightOption& light : o.sphere_lights) {
        Material m;
        m.name = "sphere light";
        m.base_color = Vec3f(0);
        m.emission = Vec3f(float(light.radiance));
        scene.materials.push_back(m);
        scene.spheres.push_back({Vec3f(light.center - scene.origin), float(light.radius),
                                 std::uint32_t(scene.materials.size() - 1)});
    }
    add_missing_light(scene);
    return scene;
}

Camera choose_camera(const Scene<float>& scene, const Options& o) {
    if (o.camera_chosen && std::size_t(o.camera) >= scene.cameras.size())
        throw UsageError("--camera " + std::to_string(o.camera) + ": the scene has " +
                         std::to_string(scene.cameras.size()));
    Camera camera = scene.cameras.empty() ? framing_camera(scene.bounds(), double(o.width) / o.height)
                                          : scene.cameras[std::size_t(o.camera)];
    if (o.eye) camera.eye = *o.eye;
    if (o.target) camera.target = *o.target;
    if (o.up) camera.up = *o.up;
    if (o.vertical_fov) camera.vertical_fov = *o.vertical_fov;
    if (o.focus_distance) camera.focus_distance = *o.focus_distance;
    camera.lens_radius = o.lens_radius;
    if (!(length(camera.target - camera.eye) > 0)) throw UsageError("the camera's eye and target coincide");
    return camera;
}
