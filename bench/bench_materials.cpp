// The shared set's material scenes beside Blender's Cycles, which imports the same glTF files: a picture of each with
// ours, Cycles' and their difference, and how far the two are from each other. Materials that mean the same in both
// agree to the noise; where they don't, the scene's row says why.
#include "../examples/support/command_line.hpp"
#include "../examples/support/preview.hpp"
#include "lamp.hpp"
#include "output.hpp"
#include "peers/export.hpp"
#include "peers/peer.hpp"
#include "process.hpp"
#include "renderer.hpp"
#include "scene_files.hpp"
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <lambent/core/parallel.hpp>
#include <lambent/render/render.hpp>
#include <optional>

namespace {

using namespace lambent;
using Image = Plane<float, 3>;

struct Options {
    std::vector<std::string> scenes;
    std::filesystem::path pictures = ".";
    std::string python;
    int spp = 256, side = 256;
    bool as_gltf = false, json = false, quick = false;
};

/// A scene with what lights and shows it, and by how much the images' means may differ. Files lie in the shared set.
struct View {
    const char *file, *sky = "scenes/environments/venice_sunset_256.hdr";
    std::optional<Vec3d> eye{}, target{};
    double vertical_fov = 0; ///< degrees; 0: the scene's
    std::optional<Lamp> lamp{};
    double apart = 0.02;
    const char* why = ""; ///< what differs, and is meant to
};

const std::vector<View> views = {
    {"scenes/box_vertex_colors/BoxVertexColors.glb"},
    {"scenes/box_textured/BoxTextured.glb"},
    {.file = "scenes/texture_settings_test/TextureSettingsTest.glb",
     .why = "Cycles shows the back of what is one-sided: its quad over the first mark hides it"},
    {"scenes/texture_transform_test/TextureTransformTest.gltf"},
    {"scenes/normal_tangent_test/NormalTangentTest.glb"},
    {"scenes/alpha_blend_mode_test/AlphaBlendModeTest.glb"},
    {.file = "scenes/metallic_roughness_chart/Material_MetallicRoughness_07.gltf",
     .apart = 0.04,
     .why = "what rough metal's facets pass on to each other is tinted by another formula"},
    {"scenes/metallic_roughness_chart/Material_MetallicRoughness_11.gltf"},
    {"scenes/specular_test/SpecularTest.glb"},
    {.file = "scenes/transmission_roughness_test/TransmissionRoughnessTest.glb",
     .apart = 0.04,
     .why = "glTF tints light at each of glass' two sides, Cycles once for both"},
    {.file = "scenes/lights_punctual/Lights.glb",
     .sky = "",
     .apart = 0.04,
     .why = "what plastic's facets leave to be scattered goes by another formula; a spot's edge is as glTF has it"},
    {.file = "scenes/cornell_box_emissive/CornellBox.glb",
     .sky = "",
     .eye = Vec3d(-278, 273, 800),
     .target = Vec3d(-278, 273, -280),
     .vertical_fov = 39},
    {.file = "scenes/damaged_helmet/DamagedHelmet.glb",
     .eye = Vec3d(0, 0, 3.2),
     .target = Vec3d(0, 0, 0),
     .vertical_fov = 45},
    {"scenes/node_negative_scale/Node_NegativeScale_05.gltf"},
    {.file = "scenes/fox/Fox.glb", .apart = 0.05, .why = "Blender poses the skin, we show it as it was modelled"},
    {.file = "scenes/sponza_crytek/sponza.glb",
     .sky = "reference/sky_soft.exr",
     .eye = Vec3d(-11, 2.5, -0.5),
     .target = Vec3d(0, 3.5, -0.3),
     .vertical_fov = 70},
    {.file = "scenes/hotel_room/hotel_room.glb",
     .sky = "",
     .eye = Vec3d(10032, 1000, -2500),
     .target = Vec3d(10032, 900, -8000),
     .vertical_fov = 60,
     .lamp = Lamp{{10032, 1900, -6128}, 600, 40}},
    {.file = "reference/materials.glb", .sky = "reference/sky_soft.exr"},
};

/// Means of squares of 4 × 4 pixels, in which noise is a quarter of the pixels'.
Image squares(const PixelView<const float, 3>& image) {
    Image out(image.width() / 4, image.height() / 4);
    for (int y = 0; y < out.height(); ++y)
        for (int x = 0; x < out.width(); ++x) {
            Vec3f sum(0);
            for (int i = 0; i < 16; ++i) sum += image.load(4 * x + i % 4, 4 * y + i / 4);
            out.view().store(x, y, sum / 16.0f);
        }
    return out;
}

/// Prints the scene's row and writes its picture. Returns whether the means are as close as they may be apart.
bool measure(const Options& o, const View& view, ThreadExecutor& threads) {
    const std::filesystem::path shared = LAMBENT_SHARED_DIR;
    const std::string file = (shared / view.file).string(), name = std::filesystem::path(file).stem().string();
    Scene<float> scene = scene_of_file(file);
    const std::size_t own_triangles = scene.triangles.size();
    if (view.lamp) add_lamp(scene, *view.lamp);
    scene.compensated = !o.as_gltf;
    if (*view.sky != 0) scene.environment = sky_of_file((shared / view.sky).string());
    Camera camera = scene.cameras.empty() ? framing_camera(scene.bounds(), 1) : scene.cameras[0];
    if (view.eye) camera.eye = *view.eye;
    if (view.target) camera.target = *view.target;
    if (view.vertical_fov > 0) camera.vertical_fov = view.vertical_fov;

    const auto prepared = prepare(scene, threads);
    const RenderOptions options{.width = o.side, .height = o.side, .end_sample = std::uint64_t(o.spp)};
    const Image ours = trace_paths(*prepared, camera, 1, options, threads).radiance;

    const TemporaryFolder folder;
    export_scene(folder.path, scene, camera, o.side, o.side, file, own_triangles);
    Peer cycles(o.python, LAMBENT_PEERS_DIR "/cycles_render.py", folder.path, "TABULATED_SOBOL");
    const Peer::Answer answer = cycles.render(std::uint64_t(o.spp), 1);
    const PixelView<const float, 3> theirs = rgb_view(answer.rgb.data(), o.side, o.side);

    const Image a = squares(ours.view()), b = squares(theirs);
    std::array<double, 2> mean{};
    double logarithms = 0;
    std::vector<double> apart;
    for (int y = 0; y < a.height(); ++y)
        for (int x = 0; x < a.width(); ++x) {
            const Vec3f p = a.view().load(x, y), q = b.view().load(x, y);
            const double both = double(luminance(p) + luminance(q)) / 2;
            mean[0] += double(luminance(p)), mean[1] += double(luminance(q));
            logarithms += std::log2(both + 1e-3);
            for (int k = 0; k < 3; ++k) apart.push_back(std::abs(double(p[k] - q[k])) / (both + 0.01));
        }
    std::sort(apart.begin(), apart.end());
    const auto quantile = [&](double q) { return apart[std::size_t(q * double(apart.size() - 1))]; };
    const double exposure = -2 - logarithms / double(a.width() * a.height()); // the mean's logarithm to 1/4
    Image difference(o.side, o.side);                                         // grey where equal
    for (int y = 0; y < o.side; ++y)
        for (int x = 0; x < o.side; ++x)
            difference.view().store(x, y, Vec3f(float(std::exp2(-2 - exposure))) + ours.view().load(x, y) - theirs.load(x, y));
    write_preview((o.pictures / (name + "_beside_cycles.png")).string(), {ours.view(), theirs, difference.view()}, exposure);
    const double ratio = mean[0] / mean[1];
    const bool wrong = !(std::abs(ratio - 1) <= view.apart);
    Line line(o.json);
    line.add("scene", name).add("differs", view.why).add("mean_ratio", ratio).add("median_apart", quantile(0.5));
    line.add("apart_90", quantile(0.9)).add("apart_99", quantile(0.99)).add("wrong", wrong ? 1 : 0);
    return !wrong;
}

} // namespace

int main(int argc, char** argv) try {
    Options o;
    bool help = false;
    CommandLine line("bench_materials [SCENE...] --peers PYTHON [options]   SCENE: part of a file's name (all)");
    line.add("--peers PYTHON", "an interpreter that has bpy and numpy", [&](const std::string& v) { o.python = v; });
    line.add("--pictures DIR", "where NAME_beside_cycles.png go: ours, Cycles', ours - Cycles' + grey (.)",
             [&](const std::string& v) { o.pictures = v; });
    line.add("--spp N", "samples a pixel (256)", [&](const std::string& v) { o.spp = int(to_integer(v, 1, 1 << 20)); });
    line.add("--side N", "pixels, a multiple of 4 (256)", [&](const std::string& v) { o.side = int(to_integer(v, 4, 4096)) / 4 * 4; });
    line.add("--as-gltf", "ours without compensation for multiple scattering, which Cycles' materials have",
             [&](const std::string&) { o.as_gltf = true; });
    line.add("--quick", "three scenes, 16 samples a pixel", [&](const std::string&) { o.quick = true; });
    line.add("--json", "one object a line", [&](const std::string&) { o.json = true; });
    line.add("--help", "this list", [&](const std::string&) { help = true; });
    o.scenes = line.parse(argc, argv);
    if (help) return line.print_help(), 0;
    if (o.python.empty()) return std::fprintf(stderr, "materials beside Cycles are left out: no --peers\n"), 0;
    if (o.quick) {
        o.spp = 16;
        if (o.scenes.empty()) o.scenes = {"Roughness_11", "helmet", "materials.glb"};
    }
    std::filesystem::create_directories(o.pictures);
    if (!o.json)
        std::printf("%-26s %-26s %10s %10s %10s %10s %10s\n", "scene", "differs", "mean ratio", "median", "90 %", "99 % apart", "wrong");
    ThreadExecutor threads;
    bool agree = true, any = false;
    for (const View& view : views) {
        const auto named = [&](const std::string& part) { return std::string(view.file).find(part) != std::string::npos; };
        if (!o.scenes.empty() && std::none_of(o.scenes.begin(), o.scenes.end(), named)) continue;
        any = true;
        agree = measure(o, view, threads) && agree;
    }
    if (!any) throw UsageError("no scene has that in its name");
    return agree ? 0 : 1;
} catch (const UsageError& e) {
    std::fprintf(stderr, "bench_materials: %s\n", e.what());
    return 2;
} catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
}
