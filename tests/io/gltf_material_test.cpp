#include <lambent/io/scene_file.hpp>
#include <lambent/scene/attributes.hpp>
#include <io/gltf_text.hpp>
#include <io/notes.hpp>
#include <doctest/doctest.h>
#include <string>

using namespace lambent;
using namespace lambent_test;

TEST_CASE("glTF: materials") {
    GltfBuilder b = square();
    const std::string p = R"({"attributes":{"POSITION":0},"material":0},{"attributes":{"POSITION":0}})";
    const auto material = [&](const std::string& m) {
        return load_text(b.mesh(p, "",
                                R"(,"materials":[{)" + m +
                                    R"(}],"textures":[{"source":0}],"images":[{"uri":"absent.png"}])"));
    };
    const Scene<float> full = material(
        R"("name":"m","doubleSided":true,"alphaMode":"MASK","alphaCutoff":0.75,"emissiveFactor":[1,0.5,0],)"
        R"("pbrMetallicRoughness":{"baseColorFactor":[0.1,0.2,0.3,0.4],"metallicFactor":0},)"
        R"("extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":8},"KHR_materials_specular":{"specularFactor":0}})");
    REQUIRE(full.materials.size() == 2);
    const Material& m = full.materials[0];
    CHECK(m.name == "m");
    CHECK(m.base_color == Vec3f(0.1f, 0.2f, 0.3f));
    CHECK(m.alpha == 0.4f);
    CHECK(m.emission == Vec3f(8, 4, 0));
    CHECK(m.alpha_mode == AlphaMode::mask);
    CHECK(m.alpha_cutoff == 0.75f);
    CHECK(m.double_sided);
    CHECK(full.materials[1].base_color == Vec3f(1));
    CHECK(full.triangle_materials == std::vector<std::uint32_t>{0, 1});
    CHECK(full.notes.size() == 1); // the list's left-over vertices only

    const Scene<float> untextured = material(
        R"("pbrMetallicRoughness":{"baseColorTexture":{"index":0},"baseColorFactor":[0.5,0.5,0.5,1]})");
    CHECK(noted(untextured, "absent.png"));
    CHECK(!untextured.materials[0].base_color_texture);
    CHECK(untextured.materials[0].base_color == Vec3f(0.5f));
    CHECK(contains(
        gltf_refusal(b.mesh(p, "", R"(,"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":3}}}])")),
        "/materials/0: index 3 of 0"));
}

TEST_CASE("glTF: the extensions of materials, and what is left out of them, counted") {
    GltfBuilder b = square();
    const auto material = [&](const std::string& m) {
        const Scene<float> scene = load_text(b.mesh(R"({"attributes":{"POSITION":0},"material":0,"mode":5})", "",
                                                    R"(,"materials":[{)" + m + "}]"));
        CHECK(scene.notes.empty());
        return scene.materials.at(0);
    };
    const Material plain = material("");
    CHECK(plain.metallic == 1);
    CHECK(plain.roughness == 1);
    CHECK(plain.specular == 1);
    CHECK(plain.ior == 1.5f);
    CHECK(plain.transmission == 0);
    CHECK(material(R"("alphaMode":"BLEND")").alpha_mode == AlphaMode::opaque); // full alpha
    const std::string faint = R"("pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.5]},"alphaMode":)";
    CHECK(material(faint + R"("BLEND")").alpha_mode == AlphaMode::blend);
    CHECK(material(faint + R"("MASK")").alpha_mode == AlphaMode::opaque);
    CHECK(material(faint + R"("MASK","alphaCutoff":0.75)").alpha_mode == AlphaMode::mask);
    const Material rough = material(R"("pbrMetallicRoughness":{"metallicFactor":0.25,"roughnessFactor":0.75})");
    CHECK(rough.metallic == 0.25f);
    CHECK(rough.roughness == 0.75f);
    const Material m = material(
        R"("extensions":{"KHR_materials_specular":{"specularFactor":0.5,"specularColorFactor":[1,2,0.5]},)"
        R"("KHR_materials_ior":{"ior":1.25},"KHR_materials_transmission":{"transmissionFactor":0.75},)"
        R"("KHR_materials_volume":{"thicknessFactor":2,"attenuationColor":[0.5,0.25,1],"attenuationDistance":3},)"
        R"("KHR_materials_clearcoat":{"clearcoatFactor":0.5,"clearcoatRoughnessFactor":0.25},)"
        R"("KHR_materials_sheen":{"sheenColorFactor":[0.25,0.5,1],"sheenRoughnessFactor":0.5},"KHR_materials_unlit":{}})");
    CHECK(m.specular == 0.5f);
    CHECK(m.specular_color == Vec3f(1, 2, 0.5f));
    CHECK(m.ior == 1.25f);
    CHECK(m.transmission == 0.75f);
    CHECK(m.thickness == 2);
    CHECK(m.attenuation_color == Vec3f(0.5f, 0.25f, 1));
    CHECK(m.attenuation_distance == 3);
    CHECK(m.clearcoat == 0.5f);
    CHECK(m.clearcoat_roughness == 0.25f);
    CHECK(m.sheen_color == Vec3f(0.25f, 0.5f, 1));
    CHECK(m.sheen_roughness == 0.5f);
    CHECK(m.unlit);
    const Scene<float> unknown = load_text(b.mesh(R"({"attributes":{"POSITION":0},"mode":5})", "",
                                                  R"(,"extensionsUsed":["ACME_glow","KHR_materials_variants"])"));
    CHECK(unknown.notes.size() == 1);
    CHECK(noted(unknown, "ACME_glow"));
}

TEST_CASE("glTF: each texture has coordinates of its own") {
    GltfBuilder b = square();
    b.floats("VEC2", 4, {0, 0, 1, 0, 0, 1, 1, 1});
    b.floats("VEC2", 4, {5, 5, 5, 5, 5, 5, 5, 5});
    const std::string p =
        R"({"attributes":{"POSITION":0,"TEXCOORD_0":1,"TEXCOORD_1":2},"mode":5,"material":0})";
    const auto load = [&](const std::string& info) {
        const TemporaryFolder folder;
        const std::string text =
            b.mesh(p, "",
                   R"(,"materials":[{"emissiveFactor":[1,1,1],"emissiveTexture":{"index":0)" + info +
                       R"(},"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],)"
                       R"("textures":[{"source":0}],"images":[{"uri":"absent.png"}])");
        const std::string path = folder.write("scene.gltf", text);
        const lambent::detail::PartialFile file{std::string_view(text)};
        const lambent::detail::GltfModel model = lambent::detail::parse_gltf(file, path, {});
        Scene<float> scene;
        lambent::detail::Notes notes(path);
        const LoadOptions options;
        const lambent::detail::GltfMaterials<float> materials(model, path, options, scene, notes);
        notes.store(scene.notes);
        return scene;
    };
    const Scene<float> whole = load_text(b.mesh(p, "", R"(,"materials":[{}])"));
    CHECK(whole.texcoords[1] == Vec2f(1, 0));
    CHECK(whole.texcoords1[1] == Vec2f(5, 5));
    CHECK(load("").materials[0].emission_texture.set == 0);
    CHECK(load(R"(,"texCoord":1)").materials[0].emission_texture.set == 1);
    CHECK(load(R"(,"texCoord":1)").materials[0].base_color_texture.set == 0);
    const auto transform = [&](const std::string& t) {
        return load(R"(,"extensions":{"KHR_texture_transform":{)" + t + "}}").materials[0].emission_texture;
    };
    CHECK(transform(R"("texCoord":1)").set == 1);
    CHECK(transform(R"("offset":[0.5,0.25],"scale":[2,3])").transformed({1, 1}) == Vec2f(2.5f, 3.25f));
    // Counter-clockwise with v downwards: (1, 0) goes to (0, -1) at 90 degrees, after the scale, before the
    // offset.
    const Vec2f turned = transform(R"("rotation":1.5707963267948966,"scale":[2,1],"offset":[0,1])").transformed({1, 0});
    CHECK(turned.x == doctest::Approx(0).epsilon(1e-6));
    CHECK(turned.y == doctest::Approx(-1));
    CHECK(noted(load(R"(,"texCoord":7)"), "1 textures are looked up with texture coordinates beyond TEXCOORD_1"));
}

TEST_CASE("glTF: tangents keep their handedness under mirrors and are made where a normal map lacks them") {
    GltfBuilder b;
    b.floats("VEC3", 3, {0, 0, 0, 1, 0, 0, 0, 1, 0});
    b.floats("VEC3", 3, {0, 0, 1, 0, 0, 1, 0, 0, 1});
    b.floats("VEC2", 3, {0, 1, 1, 1, 0, 0}); // u to the right, v down: the picture stands upright
    b.floats("VEC4", 3, {1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1});
    const auto load = [&](const std::string& tangent, const std::string& node) {
        const Scene<float> scene = load_text(
            b.mesh(R"({"attributes":{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2)" + tangent + R"(},"material":0})", node,
                   R"(,"materials":[{}])"));
        return scene;
    };
    CHECK(load("", "").tangents.empty());
    CHECK(load(R"(,"TANGENT":3)", "").tangents[0] == Vec4f(1, 0, 0, 1));
    CHECK(load(R"(,"TANGENT":3)", R"(,"scale":[-2,1,1])").tangents[0] == Vec4f(-1, 0, 0, -1));
    for (const char* node : {"", R"(,"scale":[-2,1,1])"}) {
        Scene<float> scene = load("", node), stored = load(R"(,"TANGENT":3)", node);
        scene.images.resize(1);
        scene.materials[0].normal_texture.image = 0;
        add_tangents(scene);
        REQUIRE(scene.tangents.size() == 3);
        for (std::size_t i = 0; i < 3; ++i)
            for (int c = 0; c < 4; ++c) CHECK(scene.tangents[i][c] == doctest::Approx(stored.tangents[i][c]));
    }
}
