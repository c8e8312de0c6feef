#include <lambent/io/gltf_summary.hpp>
#include <lambent/io/scene_file.hpp>
#include <support/json.hpp>
#include <support/skip.hpp>
#include <support/temporary_folder.hpp>
#include <doctest/doctest.h>
#include <cmath>
#include <filesystem>
#include <string>

using namespace lambent;
using namespace lambent_test;

namespace {
const std::string scenes = std::string(LAMBENT_SHARED_DIR) + "/scenes/";
}

TEST_CASE("every shared scene loads with its triangles, bounds and materials") {
    if (!std::filesystem::exists(scenes + "facts.json")) return skip("shared scenes: no facts.json");
    const Json facts = Json::parse(file_bytes(scenes + "facts.json"));
    CHECK(facts.object.size() == 91);
    for (const auto& entry : facts.object) { // clang 14 captures no structured bindings
        const auto& name = entry.first;
        const auto& fact = entry.second;
        CAPTURE(name);
        Scene<float> scene;
        REQUIRE_NOTHROW(scene = load_scene(scenes + name));
        CHECK(double(scene.triangles.size()) == fact["triangles"].number);
        const Bounds3<double> bounds = scene.bounds();
        const bool boxed = fact.has("bbox_min") && fact["bbox_min"].array.size() == 3;
        CHECK(bounds.empty() == !boxed);
        for (int k = 0; boxed && k < 3; ++k) {
            const double low = fact["bbox_min"].array[std::size_t(k)].number;
            const double high = fact["bbox_max"].array[std::size_t(k)].number;
            // The table has six digits; positions are floats about a centre that is a coarse grid point.
            CHECK(std::abs(bounds.min[k] - low) <=
                  6e-6 * std::abs(low) + 1e-6 * max_component(bounds.size()));
            CHECK(std::abs(bounds.max[k] - high) <=
                  6e-6 * std::abs(high) + 1e-6 * max_component(bounds.size()));
        }
        if (!name.ends_with(".obj")) {
            const GltfSummary file = summarize_gltf(scenes + name);
            CHECK(double(file.materials) == fact["materials"].number);
            CHECK(double(file.textures) == fact["textures"].number);
            CHECK(double(file.images) == fact["images"].number);
            CHECK(double(file.nodes) == fact["nodes"].number);
            CHECK(double(file.depth) == fact["depth"].number);
            CHECK(double(file.mesh_nodes) == fact["mesh_instances"].number);
        }
        if (fact.has("materials") && !name.ends_with(".obj")) {
            const std::size_t default_one =
                !scene.materials.empty() && scene.materials.back().name == "default";
            CHECK(double(scene.materials.size() - default_one) == fact["materials"].number);
        }
    }
}

TEST_CASE("shared scenes hold what their pictures need") {
    if (!std::filesystem::exists(scenes + "facts.json")) return skip("shared scenes: no facts.json");
    const std::size_t with_images = can_read_images() ? 1 : 0;

    const Scene<float> sponza = load_scene(scenes + "sponza_crytek/sponza.glb");
    CHECK(sponza.images.size() == 24 * with_images);
    CHECK(sponza.materials[0].alpha_mode == AlphaMode::mask);
    CHECK(sponza.texcoords.size() == sponza.positions.size());
    CHECK(sponza.origin == Vec3d(0));

    const Scene<float> hotel = load_scene(scenes + "hotel_room/hotel_room.glb");
    CHECK(hotel.origin != Vec3d(0));
    for (const Vec3f& p : hotel.positions) REQUIRE(max_component(abs(p)) < 0.52f * 9994.9f);

    const Scene<float> cornell = load_scene(scenes + "cornell_box_emissive/CornellBox.glb");
    CHECK(cornell.materials[0].emission == Vec3f(100));
    CHECK(cornell.materials[0].double_sided);

    const Scene<float> sibenik = load_scene(scenes + "sibenik/sibenik.obj");
    CHECK(sibenik.images.size() == 2 * with_images);
    CHECK(sibenik.materials.size() == 14);

    const Scene<float> lights = load_scene(scenes + "lights_punctual/Lights.glb");
    CHECK(lights.punctual_lights.size() == 4);
    CHECK(lights.cameras.size() == 1);
}

TEST_CASE("malformed scenes are refused with the file's name, or load without their broken part") {
    const std::string folder = scenes + "malformed/";
    if (!std::filesystem::exists(folder)) return skip("malformed scenes: no folder");
    std::size_t refused = 0, loaded = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
        const std::string path = entry.path().string(), extension = entry.path().extension().string();
        if (extension != ".gltf" && extension != ".glb" && extension != ".obj") continue;
        CAPTURE(path);
        try {
            const Scene<float> scene = load_scene(path);
            ++loaded;
            for (const Vec3f& p : scene.positions) CHECK(is_finite(p));
        } catch (const Error& error) {
            ++refused;
            CHECK(std::string(error.what()).find(entry.path().filename().string()) != std::string::npos);
        }
    }
    CHECK(refused + loaded == 28);
    for (const char* name :
         {"IndexOutOfRange.gltf", "RecursiveNodes.gltf", "BoxWithInfinites.glb",
          "missing_bin/BoxTextured.gltf", "integer-out-of-bounds.gltf", "invalid-buffer-view-index.gltf",
          "invalid-primitive-indices.gltf", "truncated_chunk_data.glb", "chunk_too_big.glb",
          "only_header.glb", "empty_file.glb", "invalid_magic.glb", "invalid_json_chunk.glb",
          "node_loop_scene.gltf", "invalid_length.gltf", "invalid_uri_data_bytelength.gltf", "test-nan.obj",
          "malformed.obj", "nancolor.obj"}) {
        CAPTURE(name);
        CHECK_THROWS_AS(load_scene(folder + name), Error);
    }
    CHECK(load_scene(folder + "SceneWithoutNodes.gltf").triangles.empty());
    CHECK(load_scene(folder + "invalid-face-definition.obj").triangles.empty());
    CHECK(load_scene(folder + "notenoughindices.obj").triangles.size() == 1);
}
