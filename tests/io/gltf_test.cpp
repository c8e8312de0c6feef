#include <lambent/io/scene_file.hpp>
#include <io/gltf_text.hpp>
#include <io/notes.hpp>
#include <doctest/doctest.h>
#include <cmath>
#include <filesystem>
#include <string>

using namespace lambent;
using namespace lambent_test;

namespace {

Vec3d face_normal(const Scene<float>& scene, std::size_t i) {
    const UVec3 t = scene.triangles[i];
    const Vec3d a(scene.positions[t.x]), b(scene.positions[t.y]), c(scene.positions[t.z]);
    return normalize(cross(b - a, c - a));
}

} // namespace

TEST_CASE("glTF: lists, strips and fans, with and without indices of each size") {
    using Triangles = std::vector<UVec3>;
    GltfBuilder b = square();
    const std::string p = R"({"attributes":{"POSITION":0})";
    CHECK(load_text(b.mesh(p + "}")).triangles == Triangles{{0, 1, 2}});
    CHECK(noted(load_text(b.mesh(p + "}")), "1 vertices at the end"));
    CHECK(load_text(b.mesh(p + R"(,"mode":5})")).triangles == Triangles{{0, 1, 2}, {1, 3, 2}});
    CHECK(load_text(b.mesh(p + R"(,"mode":6})")).triangles == Triangles{{1, 2, 0}, {2, 3, 0}});
    for (const char* mode : {"0", "1", "2", "3"}) {
        const Scene<float> scene = load_text(b.mesh(p + R"(,"mode":)" + mode + "}"));
        CHECK(scene.triangles.empty());
        CHECK(noted(scene, "1 primitives of points or lines"));
    }
    b.accessor(b.view<std::uint8_t>({3, 2, 1}), 5121, "SCALAR", 3);
    b.accessor(b.view<std::uint16_t>({3, 2, 1}), 5123, "SCALAR", 3);
    b.accessor(b.view<std::uint32_t>({3, 2, 1}), 5125, "SCALAR", 3);
    b.accessor(b.view<std::uint16_t>({3, 9, 2, 9, 1}, 4), 5123, "SCALAR", 3);
    for (const char* indices : {"1", "2", "3", "4"})
        CHECK(load_text(b.mesh(p + R"(,"indices":)" + indices + "}")).triangles == Triangles{{3, 2, 1}});
    const Scene<float> strip = load_text(b.mesh(p + R"(,"mode":5},{"attributes":{"POSITION":0},"mode":5})"));
    CHECK(strip.triangles == Triangles{{0, 1, 2}, {1, 3, 2}, {0, 1, 2}, {1, 3, 2}});
    CHECK(face_normal(strip, 0) == Vec3d(0, 0, 1));
    CHECK(face_normal(strip, 1) == Vec3d(0, 0, 1));
}

TEST_CASE("glTF: interleaved, sparse, quantised and normalised accessors") {
    GltfBuilder b;
    const int view = b.view<float>({0, 0, 0, 9, 1, 0, 0, 9, 0, 1, 0, 9}, 16);
    b.accessor(view, 5126, "VEC3", 3);
    const int at = b.view<std::uint16_t>({2}), values = b.view<float>({7, 8, 9});
    const std::string sparse = R"(,"sparse":{"count":1,"indices":{"bufferView":)" + std::to_string(at) +
                               R"(,"componentType":5123},"values":{"bufferView":)" + std::to_string(values) +
                               "}}";
    b.accessor(view, 5126, "VEC3", 3, sparse);
    b.accessor(-1, 5126, "VEC3", 3, sparse);
    b.accessor(b.view<std::int16_t>({0, 0, 0, 0, 100, 0, 0, 0, 0, -100, 0, 0}, 8), 5122, "VEC3", 3);
    b.accessor(b.view<std::int8_t>({127, 0, 0, 0, 0, -127, -128, 0, 0, 0, 127, 0}, 4), 5120, "VEC3", 3,
               R"(,"normalized":true)");
    b.accessor(b.view<std::uint8_t>({255, 0, 51, 0}), 5121, "VEC4", 1, R"(,"normalized":true)");
    b.accessor(b.view<std::uint16_t>({65535, 0, 13107, 0, 0, 0, 0, 0, 0}), 5123, "VEC3", 3,
               R"(,"normalized":true)");
    const auto positions = [&](const char* accessor) {
        return load_text(b.mesh(R"({"attributes":{"POSITION":)" + std::string(accessor) + "}}")).positions;
    };
    CHECK(positions("0") == std::vector<Vec3f>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    CHECK(positions("1") == std::vector<Vec3f>{{0, 0, 0}, {1, 0, 0}, {7, 8, 9}});
    CHECK(positions("2") == std::vector<Vec3f>{{0, 0, 0}, {0, 0, 0}, {7, 8, 9}});
    CHECK(positions("3") == std::vector<Vec3f>{{0, 0, 0}, {100, 0, 0}, {0, -100, 0}});
    CHECK(positions("4") == std::vector<Vec3f>{{1, 0, 0}, {0, -1, -1}, {0, 0, 1}});
    const Scene<float> scene = load_text(b.mesh(R"({"attributes":{"POSITION":0,"NORMAL":4,"COLOR_0":6}})"));
    CHECK(scene.normals[0] == Vec3f(1, 0, 0));
    CHECK(scene.normals[1].z < -0.7f);
    CHECK(scene.colors[0].x == 1);
    CHECK(scene.colors[0].z == doctest::Approx(0.2));
    CHECK(scene.colors[0].w == 1);
    CHECK(scene.texcoords.empty());
    // An element count that differs from POSITION's is refused.
    CHECK(contains(gltf_refusal(b.mesh(R"({"attributes":{"POSITION":0,"COLOR_0":5}})")),
                   "1 elements for 3 positions"));
}

TEST_CASE("glTF: node transforms; a mirrored mesh keeps its front") {
    GltfBuilder b;
    b.floats("VEC3", 3, {0, 0, 0, 1, 0, 0, 0, 1, 0});
    b.floats("VEC3", 3, {0, 0, 1, 0, 0, 1, 0, 0, 1});
    const std::string p = R"({"attributes":{"POSITION":0,"NORMAL":1}})";
    // A turn of 90 degrees about z, after a scale of (2, 3, 1), then a shift.
    const Scene<float> trs = load_text(b.mesh(
        p,
        R"(,"translation":[10,20,30],"rotation":[0,0,0.70710678118654752,0.70710678118654752],"scale":[2,3,1])"));
    const Vec3d moved[3] = {{10, 20, 30}, {10, 22, 30}, {7, 20, 30}};
    for (std::size_t i = 0; i < 3; ++i)
        CHECK(max_component(abs(Vec3d(trs.positions[i]) + trs.origin - moved[i])) < 1e-6);
    const std::pair<const char*, double> turned[] = {{R"(,"scale":[-1,1,1])", 1},
                                                     {R"(,"matrix":[1,0,0,0,0,-1,0,0,0,0,1,0,0,0,0,1])", 1},
                                                     {R"(,"scale":[-1,-1,-1])", -1},
                                                     {R"(,"scale":[1,1,-1])", -1},
                                                     {R"(,"scale":[2,1,1])", 1}};
    for (const auto& turn : turned) { // clang 14 captures no structured bindings
        const auto& node = turn.first;
        const double z = turn.second;
        CAPTURE(node);
        const Scene<float> scene = load_text(b.mesh(p, node));
        CHECK(face_normal(scene, 0) == Vec3d(0, 0, z));
        CHECK(scene.normals[0] == Vec3f(0, 0, float(z)));
    }
    // Normals of a slanted face under a stretch go by the inverse transpose.
    GltfBuilder slanted;
    slanted.floats("VEC3", 3, {0, 0, 0, 1, 0, 1, 0, 1, 0});
    const float h = std::sqrt(0.5f);
    slanted.floats("VEC3", 3, {-h, 0, h, -h, 0, h, -h, 0, h});
    const Scene<float> stretched = load_text(slanted.mesh(p, R"(,"scale":[3,1,-0.5])"));
    CHECK(dot(face_normal(stretched, 0), Vec3d(stretched.normals[0])) == doctest::Approx(1));
    const Scene<float> flat = load_text(b.mesh(p, R"(,"scale":[1,0,0])"));
    CHECK(flat.triangles.size() == 1);

    const std::string chain = b.json(
        R"("scenes":[{"nodes":[1]}],"nodes":[{"mesh":0,"translation":[0,0,1]},{"children":[0,2],"scale":[2,2,2]},)"
        R"({"mesh":0,"translation":[5,0,0]}],"meshes":[{"primitives":[)" +
        p + "]}]");
    const Scene<float> unrolled = load_text(chain);
    CHECK(unrolled.triangles.size() == 2);
    CHECK(unrolled.bounds().min == Vec3d(0, 0, 0));
    CHECK(unrolled.bounds().max == Vec3d(12, 2, 2));
    CHECK_THROWS_AS(load_text(chain, {.max_triangles = 1}), Error);
    CHECK_THROWS_AS(load_text(chain, {.max_vertices = 5}), Error);
}

TEST_CASE("glTF: ten thousand nodes deep") {
    GltfBuilder b = square();
    std::string nodes;
    const int deep = 10000;
    for (int i = 0; i < deep; ++i)
        nodes += R"({"children":[)" + std::to_string(i + 1) + R"(],"translation":[0,0,1]},)";
    const Scene<float> scene =
        load_text(b.json(R"("scenes":[{"nodes":[0]}],"nodes":[)" + nodes +
                         R"({"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}])"));
    CHECK(scene.bounds().min.z == deep);
}

TEST_CASE("glTF: EXT_mesh_gpu_instancing unrolls, with the node's own transform outside") {
    GltfBuilder b;
    b.floats("VEC3", 3, {0, 0, 0, 1, 0, 0, 0, 1, 0});
    b.floats("VEC3", 2, {10, 0, 0, 0, 20, 0});
    b.floats("VEC3", 2, {2, 2, 2, 1, 1, 1});
    b.floats("VEC4", 2, {0, 0, 0, 1, 0, 0, 0.70710678f, 0.70710678f});
    const auto load = [&](const std::string& attributes, const LoadOptions& options = {}) {
        return load_text(b.mesh(R"({"attributes":{"POSITION":0}})",
                                R"(,"scale":[3,3,3],"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{)" + attributes +
                                    "}}}",
                                R"(,"extensionsRequired":["EXT_mesh_gpu_instancing"])"),
                         options);
    };
    const Scene<float> scene = load(R"("TRANSLATION":1,"SCALE":2,"ROTATION":3)");
    REQUIRE(scene.triangles.size() == 2);
    CHECK(Vec3d(scene.positions[1]) + scene.origin == Vec3d(36, 0, 0));
    const Vec3d turned = Vec3d(scene.positions[4]) + scene.origin;
    CHECK(max_component(abs(turned - Vec3d(0, 63, 0))) < 1e-5);
    CHECK(load("").triangles.size() == 1);
    CHECK_THROWS_AS(load(R"("TRANSLATION":9)"), Error);
    CHECK_THROWS_AS(load(R"("TRANSLATION":3)"), Error);
    CHECK_THROWS_AS(load(R"("TRANSLATION":1,"SCALE":0)"), Error); // 2 and 3 of them
    LoadOptions few;
    few.max_nodes = 1;
    CHECK_THROWS_AS(load(R"("TRANSLATION":1)", few), Error);
}

TEST_CASE("glTF: several scenes; a file may name only files of its own folder and below") {
    GltfBuilder b = square();
    const std::string p = R"({"attributes":{"POSITION":0},"mode":5})";
    const std::string two = b.json(R"("scene":1,"scenes":[{"nodes":[0]},{"nodes":[0,1]}],"nodes":[{"mesh":0},{"mesh":0}],)"
                                   R"("meshes":[{"primitives":[)" + p + "]}]");
    CHECK(load_text(two).triangles.size() == 4);
    CHECK(load_text(two, {.scene = 0}).triangles.size() == 2);
    CHECK_THROWS_WITH_AS(load_text(two, {.scene = 2}), doctest::Contains("scene 2 of 2"), Error);

    const TemporaryFolder folder;
    std::filesystem::create_directories(folder.file("scene/in"));
    const std::string positions(36, '\0');
    folder.write("secret.bin", positions);
    folder.write("scene/a b.bin", positions);
    folder.write("scene/in/c.bin", positions);
    std::filesystem::create_symlink("../secret.bin", folder.file("scene/link.bin"));
    std::filesystem::create_symlink("a b.bin", folder.file("scene/inner.bin"));
    std::filesystem::create_symlink("loop.bin", folder.file("scene/loop.bin"));
    const auto load = [&](const std::string& uri, const LoadOptions& options = {}) {
        const std::string text =
            R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[)"
            R"({"attributes":{"POSITION":0}}]}],"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],)"
            R"("bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":")" + uri + R"("}]})";
        return load_gltf(folder.write("scene/scene.gltf", text), options).triangles.size();
    };
    for (const char* uri : {"a%20b.bin", "a b.bin", "in/c.bin", "./in/../a%20b.bin", "inner.bin"}) {
        CAPTURE(uri);
        CHECK(load(uri) == 1);
    }
    for (const char* uri : {"../secret.bin", "in/../../secret.bin", "link.bin", "..%2fsecret.bin"}) {
        CAPTURE(uri);
        CHECK_THROWS_WITH_AS(load(uri), doctest::Contains("outside of the folder"), Error);
        CHECK(load(uri, {.root = folder.file("")}) == 1);
    }
    for (const char* uri : {"/etc/passwd", "file:///etc/passwd", "http://localhost/a.bin", "loop.bin", "in", "absent.bin"}) {
        CAPTURE(uri);
        CHECK_THROWS_AS(load(uri), Error);
    }
    CHECK_THROWS_WITH_AS(load("in/c.bin", {.max_bytes = 35}), doctest::Contains("more than 35 bytes"), Error);
}

TEST_CASE("glTF: cameras and lights, in world space") {
    GltfBuilder b = square();
    const std::string rest =
        R"("extensionsUsed":["KHR_lights_punctual"],"extensionsRequired":["KHR_lights_punctual"],)"
        R"("scenes":[{"nodes":[0,1,2,3]}],"cameras":[{"type":"perspective","perspective":{"yfov":0.5,"znear":0.1}}],)"
        R"("nodes":[{"camera":0,"name":"front","translation":[0,0,5],"rotation":[0,0.70710678118654752,0,0.70710678118654752]},)"
        R"({"extensions":{"KHR_lights_punctual":{"light":0}},"translation":[1,2,3]},)"
        R"({"extensions":{"KHR_lights_punctual":{"light":1}},"rotation":[0.70710678118654752,0,0,0.70710678118654752]},)"
        R"({"extensions":{"KHR_lights_punctual":{"light":2}}}],)"
        R"("extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","color":[1,0.5,0.25],"intensity":8},)"
        R"({"type":"spot","spot":{"innerConeAngle":0.25,"outerConeAngle":0.5}},{"type":"directional","intensity":3}]}})";
    const Scene<float> scene = load_text(b.json(rest));
    REQUIRE(scene.cameras.size() == 1);
    const Camera& camera = scene.cameras[0];
    CHECK(camera.name == "front");
    CHECK(camera.eye == Vec3d(0, 0, 5));
    CHECK(max_component(abs(camera.target - camera.eye - Vec3d(-1, 0, 0))) <
          1e-12); // -z turned by 90 degrees about y
    CHECK(max_component(abs(camera.up - Vec3d(0, 1, 0))) < 1e-12);
    CHECK(camera.vertical_fov == doctest::Approx(0.5 * 180 / 3.14159265358979));
    REQUIRE(scene.punctual_lights.size() == 3);
    CHECK(scene.punctual_lights[0].kind == PunctualLight::Kind::point);
    CHECK(scene.punctual_lights[0].position == Vec3d(1, 2, 3));
    CHECK(scene.punctual_lights[0].intensity == Vec3f(8, 4, 2));
    CHECK(scene.punctual_lights[1].kind == PunctualLight::Kind::spot);
    CHECK(max_component(abs(scene.punctual_lights[1].direction - Vec3d(0, 1, 0))) <
          1e-12); // -z about x by 90 degrees
    CHECK(scene.punctual_lights[1].inner_cone_cos == doctest::Approx(std::cos(0.25)));
    CHECK(scene.punctual_lights[1].outer_cone_cos == doctest::Approx(std::cos(0.5)));
    CHECK(scene.punctual_lights[2].kind == PunctualLight::Kind::directional);
    CHECK(scene.punctual_lights[2].intensity == Vec3f(3));
    CHECK(scene.punctual_lights[2].direction == Vec3d(0, 0, -1));
}

TEST_CASE("glTF: what contradicts itself is refused, with the place") {
    GltfBuilder b;
    const int view = b.view<float>({0, 0, 0, 1, 0, 0, 0, 1, 0});
    b.accessor(view, 5126, "VEC3", 3);
    b.accessor(b.view<std::uint8_t>({0, 1, 3}), 5121, "SCALAR", 3);
    const std::string p = R"({"attributes":{"POSITION":0}})";
    const auto with = [&](int component, const char* type, const std::string& count,
                          const std::string& more = "") {
        GltfBuilder copy = b;
        copy.accessor(view, component, type, 0, R"(,"count":)" + count + more); // the later "count" counts
        return gltf_refusal(copy.mesh(p));
    };
    CHECK(contains(gltf_refusal(b.mesh(R"({"attributes":{"POSITION":0},"indices":1})")),
                   "/meshes/0/primitives/0/indices: element 2 is vertex 3 of 3"));
    CHECK(contains(with(5126, "VEC3", "4"), "/accessors/2: 4 elements of 12 bytes"));
    CHECK(contains(with(5126, "VEC3", "3", R"(,"byteOffset":4)"), "/accessors/2"));
    CHECK(contains(with(5126, "VEC3", "4294967295"), "/accessors/2"));
    CHECK(contains(with(5126, "VEC3", "3", R"(,"byteOffset":9223372036854775807)"), "scene.gltf"));
    CHECK(contains(with(5126, "VEC3", "-1"), "scene.gltf"));
    CHECK(contains(with(5126, "MAT4", "1"), "/accessors/2"));
    CHECK(contains(with(5999, "VEC3", "1"), "scene.gltf"));
    CHECK(contains(
        with(
            5126, "VEC3", "3",
            R"(,"sparse":{"count":4,"indices":{"bufferView":0,"componentType":5121},"values":{"bufferView":0}})"),
        "sparse: count 4 of 3"));
    CHECK(contains(
        with(
            5126, "VEC3", "3",
            R"(,"sparse":{"count":2,"indices":{"bufferView":0,"byteOffset":-8,"componentType":5121},"values":{"bufferView":0}})"),
        "/accessors/2/sparse"));
    CHECK(contains(
        with(
            5126, "VEC3", "3",
            R"(,"sparse":{"count":1,"indices":{"bufferView":9,"componentType":5121},"values":{"bufferView":0}})"),
        "scene.gltf"));
    CHECK(contains(gltf_refusal(b.mesh(R"({"attributes":{"POSITION":1}})")), "/attributes/POSITION"));
    CHECK(contains(gltf_refusal(b.mesh(R"({"attributes":{"POSITION":9}})")), "scene.gltf"));
    CHECK(contains(gltf_refusal(b.mesh(R"({"attributes":{"POSITION":0},"indices":0})")), "/indices"));
    CHECK(contains(gltf_refusal(b.mesh(R"({"attributes":{"POSITION":0},"mode":7})")), "mode 7"));
    CHECK(contains(gltf_refusal(b.mesh(R"({"attributes":{"POSITION":0},"material":0})")), "/material"));
    CHECK(contains(gltf_refusal(b.mesh(p, R"(,"rotation":[0,0,0,0])")), "/nodes/0/rotation"));
    CHECK(contains(gltf_refusal(b.mesh(p, R"(,"camera":2)")), "/nodes/0/camera"));
    CHECK(contains(
        gltf_refusal(b.mesh(p, R"(,"scale":[1e300,1e300,1e300],"children":[1]},{"mesh":0,"scale":[1e300,1,1])")),
        "overflows"));
    for (const char* extension :
         {"KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_texture_basisu", "ACME_x"})
        CHECK(
            contains(gltf_refusal(b.mesh(p, "", R"(,"extensionsRequired":[")" + std::string(extension) + R"("])")),
                     extension));
    const auto nodes = [&](const std::string& text) {
        return gltf_refusal(b.json(R"("scenes":[{"nodes":[0]}],"nodes":[)" + text +
                              R"(],"meshes":[{"primitives":[)" + p + "]}]"));
    };
    CHECK(contains(nodes(R"({"children":[0]})"), "/nodes/0: the node is reached twice"));
    CHECK(contains(nodes(R"({"children":[1]},{"children":[2]},{"children":[1]})"),
                   "/nodes/1: the node is reached twice"));
    CHECK(contains(nodes(R"({"children":[1,2]},{"children":[3]},{"children":[3]},{"mesh":0})"),
                   "/nodes/3: the node is reached twice"));
    CHECK(contains(nodes(R"({"children":[4]})"), "/nodes/0/children: index 4 of 1"));
    CHECK(contains(nodes(R"({"mesh":4})"), "/nodes/0/mesh: index 4 of 1"));
    CHECK(contains(gltf_refusal(""), "empty"));
    CHECK(contains(gltf_refusal("{}"), "scene.gltf"));
    CHECK(contains(gltf_refusal("[1,2"), "scene.gltf"));
    CHECK(contains(gltf_refusal("glTF\1"), "no binary glTF"));
}

TEST_CASE("scene files are told apart by their extension") {
    const TemporaryFolder folder;
    CHECK(load_scene(folder.write("A.OBJ", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3")).triangles.size() == 1);
    CHECK(load_scene(folder.write("a.glTF", square().mesh(R"({"attributes":{"POSITION":0}})")))
              .triangles.size() == 1);
    CHECK_THROWS_WITH_AS(load_scene("b.stl"),
                         "b.stl: unknown kind of scene; supported are .gltf, .glb and .obj", Error);
    CHECK_THROWS_AS(load_scene(folder.file("absent.glb")), Error);
}
