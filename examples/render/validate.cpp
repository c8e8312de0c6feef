#include "validate.hpp"
#include "scene_setup.hpp"
#include <lambent/core/parallel.hpp>
#include <lambent/io/file.hpp>
#include <lambent/io/gltf_summary.hpp>
#include <lambent/scene/suspicions.hpp>
#include <cstdio>

using namespace lambent;

namespace {

void print_list(const char* name, const std::vector<std::string>& words) {
    if (words.empty()) return;
    std::printf("%-16s", name);
    for (std::size_t i = 0; i < words.size(); ++i) std::printf("%s%s", i > 0 ? ", " : " ", words[i].c_str());
    std::printf("\n");
}

void print_file(const GltfSummary& s) {
    std::printf("file             %zu scenes, %zu nodes (depth %zu), %zu meshes on %zu nodes, %zu primitives, %zu accessors, "
                "%zu bytes\n",
                s.scenes, s.nodes, s.depth, s.meshes, s.mesh_nodes, s.primitives, s.accessors, s.buffer_bytes);
    std::printf("                 %zu materials, %zu textures, %zu images, %zu cameras, %zu lights, %zu skins, %zu animations\n",
                s.materials, s.textures, s.images, s.cameras, s.lights, s.skins, s.animations);
    print_list("extensions", s.extensions_used);
    print_list("required", s.extensions_required);
}

void print_scene(const Scene<float>& scene) {
    std::printf("triangles        %zu of %zu vertices%s%s%s%s%s\n", scene.triangles.size(), scene.positions.size(),
                scene.normals.empty() ? "" : ", normals", scene.tangents.empty() ? "" : ", tangents",
                scene.texcoords.empty() ? "" : ", texture coordinates",
                scene.texcoords1.empty() ? "" : ", a second set of them", scene.colors.empty() ? "" : ", colours");
    const Bounds3<double> box = scene.bounds();
    if (!box.empty())
        std::printf("bounds           (%g, %g, %g) to (%g, %g, %g)\n", box.min.x, box.min.y, box.min.z, box.max.x, box.max.y,
                    box.max.z);
    std::size_t emissive = 0, masked = 0, blended = 0, transmissive = 0, mapped = 0, texels = 0;
    for (const Material& m : scene.materials) {
        emissive += m.emissive() ? 1u : 0u;
        masked += m.alpha_mode == AlphaMode::mask ? 1u : 0u;
        blended += m.alpha_mode == AlphaMode::blend ? 1u : 0u;
        transmissive += m.transmission > 0 ? 1u : 0u;
        mapped += m.normal_texture ? 1u : 0u;
    }
    std::printf("materials        %zu: %zu emit, %zu are masked, %zu blended, %zu transmissive, %zu normal-mapped\n",
                scene.materials.size(), emissive, masked, blended, transmissive, mapped);
    for (const Image& image : scene.images) texels += image.rgba.size() / 4;
    std::printf("images           %zu of %zu pixels\n", scene.images.size(), texels);
    for (const Camera& c : scene.cameras)
        std::printf("camera           '%s' at (%g, %g, %g), looks at (%g, %g, %g), %g degrees high\n", c.name.c_str(), c.eye.x,
                    c.eye.y, c.eye.z, c.target.x, c.target.y, c.target.z, c.vertical_fov);
    for (const PunctualLight& light : scene.punctual_lights) {
        const bool directional = light.kind == PunctualLight::Kind::directional;
        const char* kind = directional ? "directional" : light.kind == PunctualLight::Kind::spot ? "spot" : "point";
        std::printf("light            %s, (%g, %g, %g) %s\n", kind, double(light.intensity.x), double(light.intensity.y),
                    double(light.intensity.z), directional ? "lux" : "candela");
    }
}

} // namespace

int validate(const Options& o) {
    ThreadExecutor threads(o.threads);
    Options all = o;
    all.load.images = ImageLoading::all; // unused ones may be broken too
    const std::string extension = lambent::detail::extension_of(o.scene);
    const bool gltf = extension == "gltf" || extension == "glb";
    const Scene<float> scene = load_named_scene(all, threads);
    std::printf("scene            %s\n", o.scene.c_str());
    if (gltf) print_file(summarize_gltf(o.scene, o.load));
    print_scene(scene);
    for (const std::string& note : scene.notes) std::printf("note             %s\n", note.c_str());
    for (const std::string& what : suspicions(scene)) std::printf("suspicious       %s\n", what.c_str());
    return 0;
}
