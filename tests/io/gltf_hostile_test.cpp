#include <lambent/io/scene_file.hpp>
#include <io/gltf_text.hpp>
#include <io/notes.hpp>
#include <doctest/doctest.h>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <string>
#include <sys/resource.h>
#include <sys/stat.h>

using namespace lambent;
using namespace lambent_test;

namespace {

/// Largest resident size so far, in MiB.
double peak_mib() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return double(usage.ru_maxrss) / 1024;
}

/// Seconds that f takes: bounds on hangs, far above what is expected.
template <class F>
double seconds(F&& f) {
    const auto start = std::chrono::steady_clock::now();
    f();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::string document(const std::string& rest) { return R"({"asset":{"version":"2.0"},)" + rest + "}"; }

std::string repeated(const std::string& part, std::size_t count, const std::string& between = "") {
    std::string out;
    for (std::size_t i = 0; i < count; ++i) out += (i > 0 ? between : "") + part;
    return out;
}

/// A binary glTF of raw chunks.
std::string glb(const std::string& json, const std::string& after = "", std::uint32_t version = 2) {
    std::string body = word(std::uint32_t(json.size())) + "JSON" + json + after;
    return "glTF" + word(version) + word(std::uint32_t(12 + body.size())) + body;
}

std::string glb_refusal(const std::string& bytes) {
    SerialExecutor serial;
    try {
        load_gltf_bytes(bytes, "a.glb", {}, serial);
    } catch (const Error& error) {
        return error.what();
    }
    return "loaded";
}

const std::string triangle = R"({"attributes":{"POSITION":0}})";

} // namespace

TEST_CASE("hostile glTF: counts that the type allows but no file has are refused before memory is taken") {
    GltfBuilder b = square();
    const double before = peak_mib();
    const auto counted = [&](const std::string& accessor) {
        GltfBuilder copy = b;
        copy.accessor(-1, 5126, "VEC3", 0, accessor);
        return gltf_refusal(copy.mesh(R"({"attributes":{"POSITION":1}})"));
    };
    CHECK(contains(counted(R"(,"count":4294967295)"), "elements without data"));
    CHECK(contains(counted(R"(,"count":4294967295,"bufferView":0)"), "do not fit in a view"));
    CHECK(contains(counted(R"(,"count":4294967295,"bufferView":0,"byteOffset":4294967295)"), "do not fit in a view"));
    CHECK(contains(counted(R"(,"count":1e300)"), "scene.gltf"));
    CHECK(contains(gltf_refusal(document(R"("buffers":[{"byteLength":4294967295,"uri":"data:application/octet-stream;base64,AAAA"}])")),
                   "scene.gltf"));
    CHECK(contains(gltf_refusal(document(R"("buffers":[{"byteLength":4294967295}])")), "scene.gltf"));
    // Sparse elements over an accessor without data: a byte a thousand elements.
    LoadOptions few;
    few.max_vertices = 1000;
    GltfBuilder zeros;
    zeros.view<float>({0});
    zeros.accessor(-1, 5126, "VEC3", 1001);
    CHECK(contains(gltf_refusal(zeros.mesh(triangle), few), "1001 elements without data"));
    CHECK(peak_mib() - before < 200);
}

TEST_CASE("hostile glTF: a small file that unrolls to a large one is refused by its totals") {
    GltfBuilder b;
    b.view<float>({0});
    b.accessor(-1, 5126, "VEC3", 3 << 20);
    const std::string nodes = repeated(R"({"mesh":0})", 1000, ",");
    std::string list;
    for (int i = 0; i < 1000; ++i) list += (i > 0 ? "," : "") + std::to_string(i);
    const std::string text = b.json(R"("scenes":[{"nodes":[)" + list + R"(]}],"nodes":[)" + nodes +
                                    R"(],"meshes":[{"primitives":[)" + triangle + "]}]");
    const double before = peak_mib();
    CHECK(contains(gltf_refusal(text), "unroll to more than"));
    CHECK(peak_mib() - before < 200);
    LoadOptions few;
    few.max_nodes = 999;
    CHECK(contains(gltf_refusal(text, few), "1000 nodes, over the limit of 999"));
}

TEST_CASE("hostile glTF: deep, wide and cyclic node graphs neither hang nor overflow the stack") {
    constexpr int deep = 10000;
    std::string chain, star;
    for (int i = 0; i < deep; ++i) {
        chain += R"({"translation":[0,0,1],"children":[)" + std::to_string(i + 1) + "]},";
        star += (i > 0 ? "," : "") + std::to_string(i + 1);
    }
    const std::string meshes = R"(],"meshes":[{"primitives":[)" + triangle + "]}]";
    GltfBuilder b = square();
    CHECK(seconds([&] {
              const Scene<float> scene = load_text(b.json(R"("scenes":[{"nodes":[0]}],"nodes":[)" + chain + R"({"mesh":0})" + meshes));
              CHECK(scene.triangles.size() == 1);
              CHECK(scene.bounds().min.z == deep);
          }) < 2);
    CHECK(seconds([&] {
              const std::string nodes = R"({"children":[)" + star + "]}," + repeated(R"({"mesh":0})", deep, ",");
              CHECK(load_text(b.json(R"("scenes":[{"nodes":[0]}],"nodes":[)" + nodes + meshes)).triangles.size() == deep);
          }) < 2);
    chain.erase(chain.size() - 1);
    std::string loop = chain;
    loop.replace(loop.rfind(std::to_string(deep)), std::to_string(deep).size(), "0");
    CHECK(contains(gltf_refusal(b.json(R"("scenes":[{"nodes":[0]}],"nodes":[)" + loop + meshes)), "reached twice"));
}

TEST_CASE("hostile glTF: JSON that nests beyond any file is refused, not recursed into") {
    for (const std::size_t depth : {std::size_t(300), std::size_t(1000000)}) {
        const std::string nested = repeated("[", depth) + repeated("]", depth);
        CHECK(contains(gltf_refusal(document(R"("extras":)" + nested)), "nested deeper than 256"));
        CHECK(contains(gltf_refusal(repeated(R"({"a":)", depth)), "nested deeper than 256"));
        CHECK(contains(glb_refusal(glb(document(R"("extras":)" + nested))), "nested deeper than 256"));
    }
    CHECK(load_text(document(R"("extras":)" + repeated("[", 200) + repeated("]", 200))).triangles.empty());
    CHECK(load_text(document(R"("extras":"[[[[ \" [[[[ \\")")).triangles.empty());
}

TEST_CASE("hostile glTF: numbers at the ends of their types") {
    GltfBuilder b;
    const float infinity = std::numeric_limits<float>::infinity(), tiny = std::numeric_limits<float>::denorm_min();
    const float huge = std::numeric_limits<float>::max();
    const auto positions = [](std::initializer_list<float> values) {
        GltfBuilder builder;
        builder.floats("VEC3", 3, values);
        return builder.mesh(triangle);
    };
    CHECK(contains(gltf_refusal(positions({0, 0, infinity, 1, 0, 0, 0, 1, 0})), "element 0 is not finite"));
    CHECK(contains(gltf_refusal(positions({0, 0, 0, 1, 0, 0, 0, std::nanf(""), 0})), "element 2 is not finite"));
    CHECK(load_text(positions({tiny, 0, 0, 0, tiny, 0, 0, 0, tiny})).triangles.size() == 1);
    const Scene<float> large = load_text(positions({huge, 0, 0, 0, huge, 0, 0, 0, -huge}));
    for (const Vec3f& p : large.positions) CHECK(is_finite(p));
    const auto node = [&](const std::string& n) { return gltf_refusal(square().mesh(triangle, n)); };
    CHECK(contains(node(R"(,"matrix":[1,0,0])"), "scene.gltf: /nodes/0/matrix: 3 numbers instead of 16"));
    CHECK(contains(node(R"(,"scale":[1e308,1e308,1e308],"translation":[1e999,0,0])"), "scene.gltf"));
    CHECK(contains(node(R"(,"rotation":[1,2,3])"), "3 numbers instead of 4"));
    CHECK(load_text(square().mesh(triangle, R"(,"scale":[1e-300,1e-300,1e-300])")).triangles.size() == 1);
    for (const char* stride : {"2", "253", "255", "4294967295"}) {
        GltfBuilder strided;
        strided.view<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}, std::stoi(std::string(stride).substr(0, 3)));
        strided.accessor(0, 5126, "VEC3", 3);
        CHECK(contains(gltf_refusal(strided.mesh(triangle)), "scene.gltf"));
    }
}

TEST_CASE("hostile glTF: wrong kinds of things in every place") {
    GltfBuilder b = square();
    for (const char* rest :
         {R"("nodes":{})", R"("nodes":[1])", R"("meshes":"x")", R"("scenes":[{"nodes":["a"]}])", R"("scene":-1)", R"("scene":7)",
          R"("scenes":[{"nodes":[-1]}])", R"("scenes":[{"nodes":[0.5]}])", R"("buffers":[{"byteLength":-1}])",
          R"("bufferViews":[{"buffer":0,"byteLength":1}])", R"("accessors":[{"bufferView":9,"componentType":5126,"count":1,"type":"VEC3"}])",
          R"("accessors":[{"componentType":1,"count":1,"type":"VEC3"}])", R"("accessors":[{"componentType":5126,"count":1,"type":"VEC9"}])",
          R"("textures":[{"source":1}])", R"("textures":[{"sampler":1}])", R"("images":[{"bufferView":3,"mimeType":"image/png"}])",
          R"("materials":[{"normalTexture":{"index":2}}])", R"("materials":[{"alphaMode":"GLASS"}])",
          R"("materials":[{"extensions":{"KHR_materials_specular":{"specularTexture":{"index":2}}}}])",
          R"("materials":[{"pbrMetallicRoughness":{"metallicRoughnessTexture":{"index":-5}}}])",
          R"("nodes":[{"skin":"a"}])", R"("nodes":[{"extensions":{"KHR_lights_punctual":{"light":3}}}],"scenes":[{"nodes":[0]}])",
          R"("nodes":[{"camera":0}],"cameras":[])"}) {
        CAPTURE(rest);
        const std::string refusal = gltf_refusal(document(rest));
        CHECK((contains(refusal, "scene.gltf") || refusal == "loaded")); // never anything else
    }
    CHECK(contains(gltf_refusal(std::string(1 << 20, '\xff')), "scene.gltf"));
    CHECK(contains(gltf_refusal(document("\"name\":\"\xc3\x28\"")), "scene.gltf"));
    CHECK(contains(gltf_refusal(std::string("{\0}", 3)), "scene.gltf"));
    CHECK(contains(gltf_refusal(R"({"asset":{"version":"2.0"},"asset":)"), "scene.gltf"));
}

TEST_CASE("hostile glTF: binary headers and chunks that lie") {
    const std::string json = document(R"("scenes":[])");
    CHECK(glb_refusal(glb(json)) == "loaded");
    CHECK(contains(glb_refusal(glb(json, "", 1)), "version 1"));
    CHECK(contains(glb_refusal(glb(json).substr(0, 40)), "claims"));
    std::string lying = glb(json);
    std::memcpy(lying.data() + 12, word(0xfffffff0u).data(), 4);
    CHECK(contains(glb_refusal(lying), "chunk 0 claims 4294967280 bytes"));
    std::memcpy(lying.data() + 12, word(0).data(), 4);
    CHECK(contains(glb_refusal(lying), "first chunk is not JSON"));
    CHECK(contains(glb_refusal(glb(json, word(100) + std::string("BIN\0", 4) + "abcd")), "chunk 1 claims 100"));
    CHECK(contains(glb_refusal("glTF"), "4 bytes are no binary glTF"));
    CHECK(contains(glb_refusal(""), "empty"));
}

TEST_CASE("hostile glTF: pipes, folders and files named a thousand times as buffers") {
    const TemporaryFolder folder;
    REQUIRE(mkfifo(folder.file("pipe.bin").c_str(), 0600) == 0);
    folder.write("big.bin", std::string(1 << 20, '\0'));
    const auto load = [&](const std::string& buffers, const LoadOptions& options = {}) -> std::string {
        try {
            load_gltf(folder.write("scene.gltf", document(R"("buffers":[)" + buffers + "]")), options);
        } catch (const Error& error) {
            return error.what();
        }
        return "loaded";
    };
    CHECK(contains(load(R"({"byteLength":4,"uri":"pipe.bin"})"), "not a regular file"));
    CHECK(contains(load(R"({"byteLength":4,"uri":"."})"), "scene.gltf"));
    CHECK(contains(load(R"({"byteLength":4,"uri":"/dev/zero"})"), "scene.gltf"));
    CHECK(contains(load(R"({"byteLength":2000000,"uri":"big.bin"})"), "scene.gltf"));
    LoadOptions small;
    small.max_bytes = 100 << 20;
    const double before = peak_mib();
    CHECK(contains(load(repeated(R"({"byteLength":1048576,"uri":"big.bin"})", 1000, ","), small), "more than 104857600 bytes"));
    CHECK(peak_mib() - before < 400);
    CHECK(contains(load(R"({"byteLength":4,"uri":")" + std::string(100000, 'a') + R"("})"), "scene.gltf"));
    CHECK(contains(load(R"({"byteLength":4,"uri":"%00.bin"})"), "scene.gltf"));
}

TEST_CASE("hostile glTF: what repeats a million times is said once") {
    GltfBuilder b = square();
    const Scene<float> scene = load_text(b.mesh(repeated(R"({"attributes":{"POSITION":0},"mode":0})", 20000, ",")));
    CHECK(scene.notes.size() == 1);
    CHECK(noted(scene, "20000 primitives of points or lines"));
    std::string textures, materials;
    for (int i = 0; i < 3000; ++i) {
        textures += std::string(i > 0 ? "," : "") + R"({"source":)" + std::to_string(i) + "}";
        materials += std::string(i > 0 ? "," : "") + R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":)" +
                     std::to_string(i) + "}}}";
    }
    LoadOptions all;
    all.images = ImageLoading::all;
    const Scene<float> textured =
        load_text(b.mesh(triangle, "", R"(,"materials":[)" + materials + R"(],"textures":[)" + textures + R"(],"images":[)" +
                                           repeated(R"({"uri":"absent.png"})", 3000, ",") + "]"),
                  all);
    CHECK(textured.notes.size() < 15);
    CHECK(noted(textured, "2990 more"));
}
