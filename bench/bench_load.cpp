// How fast scene files load, on one thread: glTF beside tinygltf alone with a bare copy of the arrays, OBJ beside
// tinyobjloader where it is found. Interleaved, medians; every answer's triangles are counted. Large blocks of memory come
// fresh from the system each time, as in a program that loads one scene.
#include "../examples/support/command_line.hpp"
#include "timing.hpp"
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <functional>
#include <lambent/io/scene_file.hpp>
#if __has_include(<malloc.h>)
#include <malloc.h>
#endif
#include <string>
#include <vector>
#if defined(LAMBENT_BENCH_TINYOBJ)
#include <tiny_obj_loader.h>
#endif

namespace {

using namespace lambent;

struct Options {
    std::vector<std::string> scenes;
    int rounds = 9;
    bool json = false, quick = false;
};

Options parse_options(int argc, char** argv) {
    Options o;
    CommandLine line("bench_load [SCENE...] [options]   .gltf .glb .obj; default: scenes of ../shared, where they are");
    line.add("--rounds N", "how often each loads (9)", [&](auto& v) { o.rounds = int(to_integer(v, 1, 1000)); });
    line.add("--json", "an object a line", [&](auto&) { o.json = true; });
    line.add("--quick", "three rounds", [&](auto&) { o.quick = true; });
    line.add("--help", "this text", [&](auto&) {
        line.print_help();
        std::exit(0);
    });
    o.scenes = line.parse(argc, argv);
    if (o.quick) o.rounds = 3;
    if (o.scenes.empty())
        for (const char* name : {"sponza_crytek/sponza.glb", "hotel_room/hotel_room.glb", "deep_hierarchy/InfiniteSkinnedTentacle.glb",
                                 "sibenik/sibenik.obj"})
            o.scenes.push_back(std::string(LAMBENT_SHARED_DIR) + "/scenes/" + name);
    return o;
}

/// One way of loading a file; gives its triangles.
struct Contender {
    std::string name;
    std::function<std::size_t(const std::string&)> load;
};

std::size_t load_ours(const std::string& path, ImageLoading images) {
    LoadOptions options;
    options.images = images;
    return load_scene(path, options).triangles.size();
}

/// tinygltf as it comes, or with images left encoded; then every primitive's arrays are copied as they are stored, once a
/// primitive, whatever the number of its instances.
std::size_t load_tinygltf(const std::string& path, bool decode) {
    tinygltf::TinyGLTF parser;
    if (!decode)
        parser.SetImageLoader([](tinygltf::Image*, int, std::string*, std::string*, int, int, const unsigned char*, int,
                                 void*) { return true; },
                              nullptr);
    tinygltf::Model model;
    std::string error, warning;
    if (!parser.LoadBinaryFromFile(&model, &error, &warning, path)) return 0;
    std::size_t triangles = 0;
    std::vector<std::vector<unsigned char>> arrays;
    const auto copy = [&](int accessor) {
        const tinygltf::Accessor& a = model.accessors[std::size_t(accessor)];
        const tinygltf::BufferView& view = model.bufferViews[std::size_t(a.bufferView)];
        const std::size_t size = std::size_t(tinygltf::GetComponentSizeInBytes(std::uint32_t(a.componentType))) *
                                 std::size_t(tinygltf::GetNumComponentsInType(std::uint32_t(a.type)));
        const std::size_t stride = view.byteStride == 0 ? size : view.byteStride;
        const unsigned char* in = model.buffers[std::size_t(view.buffer)].data.data() + view.byteOffset + a.byteOffset;
        std::vector<unsigned char>& out = arrays.emplace_back(size * a.count);
        if (stride == size) std::memcpy(out.data(), in, out.size());
        else
            for (std::size_t i = 0; i < a.count; ++i) std::memcpy(out.data() + i * size, in + i * stride, size);
    };
    for (const tinygltf::Mesh& mesh : model.meshes)
        for (const tinygltf::Primitive& p : mesh.primitives) {
            if (p.mode != -1 && p.mode < TINYGLTF_MODE_TRIANGLES) continue;
            for (const auto& [name, accessor] : p.attributes) copy(accessor);
            if (p.indices >= 0) copy(p.indices);
            triangles += model.accessors[std::size_t(p.indices >= 0 ? p.indices : p.attributes.at("POSITION"))].count / 3;
        }
    return triangles;
}

#if defined(LAMBENT_BENCH_TINYOBJ)
std::size_t load_tinyobj(const std::string& path) {
    tinyobj::ObjReader reader;
    tinyobj::ObjReaderConfig config;
    config.vertex_color = false;
    if (!reader.ParseFromFile(path, config)) return 0;
    std::size_t triangles = 0;
    for (const tinyobj::shape_t& shape : reader.GetShapes()) triangles += shape.mesh.num_face_vertices.size();
    return triangles;
}
#endif

std::vector<Contender> contenders(const std::string& path) {
    const auto ours = [](ImageLoading images) { return [images](const std::string& p) { return load_ours(p, images); }; };
    if (lambent::detail::extension_of(path) == "obj") {
        std::vector<Contender> all;
#if defined(LAMBENT_BENCH_TINYOBJ)
        all.push_back({"tinyobjloader", load_tinyobj});
#endif
        all.push_back({"lambent", ours(ImageLoading::none)});
        return all;
    }
    return {{"tinygltf", [](const std::string& p) { return load_tinygltf(p, false); }},
            {"lambent", ours(ImageLoading::none)},
            {"tinygltf_images", [](const std::string& p) { return load_tinygltf(p, true); }},
            {"lambent_images", ours(ImageLoading::used)}};
}

int run(const Options& o) {
    bool all_right = true;
    for (const std::string& path : o.scenes) {
        if (!std::filesystem::exists(path)) {
            std::fprintf(stderr, "bench_load: %s is absent and left out\n", path.c_str());
            continue;
        }
        const std::vector<Contender> all = contenders(path);
        std::vector<std::vector<double>> seconds(all.size());
        std::vector<std::size_t> triangles(all.size());
        for (int round = 0; round <= o.rounds; ++round) // the first brings the file into memory
            for (std::size_t k = 0; k < all.size(); ++k) {
                const double start = cpu_seconds();
                triangles[k] = all[k].load(path);
                if (round > 0) seconds[k].push_back(cpu_seconds() - start);
            }
        const double megabytes = double(std::filesystem::file_size(path)) * 1e-6;
        for (std::size_t k = 0; k < all.size(); ++k) {
            const double time = median(seconds[k]), peer = median(seconds[k - k % 2]);
            // Instances are unrolled by us alone.
            const bool right = triangles[k] >= triangles[0] && triangles[k] > 0;
            all_right &= right;
            const std::string scene = std::filesystem::path(path).filename().string();
            std::printf(o.json ? "{\"scene\": \"%s\", \"library\": \"%s\", \"seconds\": %.6f, \"mb_per_s\": %.2f, "
                                 "\"time_to_peer\": %.3f, \"triangles\": %zu, \"right\": %s}\n"
                               : "%-28s %-16s %9.5f s %9.2f MB/s   %.3f of its peer's time   %zu triangles   right: %s\n",
                        scene.c_str(), all[k].name.c_str(), time, megabytes / time, time / peer, triangles[k],
                        right ? "true" : "false");
        }
    }
    return all_right ? 0 : 1;
}

} // namespace

int main(int argc, char** argv) {
#if defined(M_MMAP_THRESHOLD)
    mallopt(M_MMAP_THRESHOLD, 1 << 17); // and no longer by what was freed last
#endif
    try {
        return run(parse_options(argc, argv));
    } catch (const UsageError& e) {
        std::fprintf(stderr, "bench_load: %s\n", e.what());
        return 2;
    } catch (const std::exception& e) {
        std::fprintf(stderr, "bench_load: %s\n", e.what());
    }
    return 1;
}
