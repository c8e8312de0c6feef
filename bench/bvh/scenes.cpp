// Files of scenes: their loaders are most of what compiling this benchmark takes, and so have a file of their own.
#include "scenes.hpp"
#include "../scene_files.hpp"
#include <lambent/scene/builtin.hpp>
#include <filesystem>

using namespace lambent;

BenchScene load_bench_scene(const std::string& name) {
    const Scene<float> scene = name == "builtin:cornell" ? cornell_scene<float>() : scene_of_file(name);
    BenchScene bench;
    bench.soup.name = name;
    bench.soup.origin = scene.origin;
    for (const UVec3& t : scene.triangles)
        bench.soup.add(scene.positions[t.x], scene.positions[t.y], scene.positions[t.z]);
    bench.camera = scene.cameras.empty() ? framing_camera(scene.bounds(), 1) : scene.cameras.front();
    bench.camera.eye -= scene.origin;
    bench.camera.target -= scene.origin;
    return bench;
}

BenchScene soup_scene(const std::string& path) {
    BenchScene bench{read_soup(path), {}};
    Bounds3<double> box;
    for (const Vec3f& v : bench.soup.vertices)
        if (is_finite(v)) box.add(Vec3d(v));
    bench.camera = framing_camera(box, 1);
    return bench;
}

std::vector<std::function<BenchScene()>> default_scenes(const std::string& folder, int strands) {
    struct View {
        const char *name, *file;
        Vec3d eye, target;
        double vertical_fov;
    };
    const View views[] = {
        {"sponza", "sponza_crytek/sponza.glb", {-5, 2, 0}, {5, 2.5, 0}, 70},
        {"sibenik", "sibenik/sibenik.obj", {-15, -12, 0}, {0, -11, 0}, 70},
        {"hotel_room", "hotel_room/hotel_room.glb", {12500, 1500, -2200}, {8500, 700, -8500}, 75},
    };
    std::vector<std::function<BenchScene()>> scenes;
    for (const View& view : views) {
        const std::string path = folder + "/" + view.file;
        if (!std::filesystem::exists(path)) continue;
        scenes.push_back([view, path] {
            BenchScene bench = load_bench_scene(path);
            bench.soup.name = view.name;
            bench.camera = {};
            bench.camera.eye = view.eye - bench.soup.origin;
            bench.camera.target = view.target - bench.soup.origin;
            bench.camera.vertical_fov = view.vertical_fov;
            return bench;
        });
    }
    if (scenes.empty()) scenes.push_back([] { return blob(100000); });
    scenes.push_back([strands] { return hair(strands); });
    return scenes;
}
