#include <lambent/io/image.hpp>
#include <lambent/core/parallel.hpp>
#include <lambent/io/scene_file.hpp>
#include <lambent/scene/fingerprint.hpp>
#include <io/gltf_builder.hpp>
#include <support/skip.hpp>
#include <support/temporary_folder.hpp>
#include <doctest/doctest.h>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

#if defined(LAMBENT_HAS_OIIO)
/// A PNG of the given channels; values are floats in [0, 1].
std::string png(int width, int height, int channels, OIIO::TypeDesc type, const std::vector<float>& values) {
    const TemporaryFolder folder;
    auto out = OIIO::ImageOutput::create("png");
    OIIO::ImageSpec spec(width, height, channels, type);
    spec.attribute("oiio:UnassociatedAlpha", 1);
    if (channels % 2 == 0) spec.alpha_channel = channels - 1;
    REQUIRE(out->open(folder.file("a.png"), spec));
    REQUIRE(out->write_image(OIIO::TypeDesc::FLOAT, values.data()));
    out->close();
    return file_bytes(folder.file("a.png"));
}

/// A palette PNG of 2 × 1 pixels: red, and green with alpha 128.
constexpr unsigned char palette_png[] = {
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44, 0x52, 0x00,
    0x00, 0x00, 0x02, 0x00, 0x00, 0x00, 0x01, 0x08, 0x03, 0x00, 0x00, 0x00, 0xc3, 0xfc, 0x8f, 0xb8, 0x00,
    0x00, 0x00, 0x06, 0x50, 0x4c, 0x54, 0x45, 0xff, 0x00, 0x00, 0x00, 0xff, 0x00, 0xd2, 0x87, 0xef, 0x71,
    0x00, 0x00, 0x00, 0x02, 0x74, 0x52, 0x4e, 0x53, 0xff, 0x80, 0x08, 0x0f, 0xb3, 0x6a, 0x00, 0x00, 0x00,
    0x0b, 0x49, 0x44, 0x41, 0x54, 0x78, 0x9c, 0x63, 0x60, 0x60, 0x04, 0x00, 0x00, 0x04, 0x00, 0x02, 0xbf,
    0x7a, 0x3f, 0x4a, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};
#endif

} // namespace

TEST_CASE("images: what is no PNG or JPEG is refused by its bytes, whatever its name") {
    const TemporaryFolder folder;
    CHECK_THROWS_AS(read_texture(folder.file("absent.png")), Error);
    CHECK_THROWS_AS(read_texture(folder.write("empty.png", "")), Error);
    CHECK_THROWS_AS(read_texture(folder.write("text.png", "not an image")), Error);
    CHECK_THROWS_AS(read_texture(folder.write("gif.png", "GIF89a\1\0\1\0")), Error);
    CHECK_THROWS_WITH_AS(decode_texture("\xabKTX 20\xbb\r\n\x1a\n", "x"),
                         "x: KTX2 images are not supported, only PNG and JPEG", Error);
    CHECK_THROWS_AS(read_texture(folder.write("cut.png", "\x89PNG\r\n\x1a\n")), Error);
}

#if defined(LAMBENT_HAS_OIIO)
TEST_CASE("images: grey, grey-alpha, RGB and RGBA of 8 and 16 bits become RGBA8, alpha unassociated") {
    const auto bytes = [](const std::string& file) { return decode_texture(file, "test").rgba; };
    using Bytes = std::vector<std::uint8_t>;
    for (const OIIO::TypeDesc type : {OIIO::TypeDesc::UINT8, OIIO::TypeDesc::UINT16}) {
        CHECK(bytes(png(2, 1, 1, type, {0, 0.2f})) == Bytes{0, 0, 0, 255, 51, 51, 51, 255});
        CHECK(bytes(png(1, 2, 2, type, {0.2f, 0.4f, 1, 0})) == Bytes{51, 51, 51, 102, 255, 255, 255, 0});
        CHECK(bytes(png(1, 1, 3, type, {0.2f, 0.4f, 1})) == Bytes{51, 102, 255, 255});
        CHECK(bytes(png(1, 1, 4, type, {0.2f, 0.4f, 1, 0.2f})) == Bytes{51, 102, 255, 51});
    }
    const std::string_view palette(reinterpret_cast<const char*>(palette_png), sizeof palette_png);
    CHECK(bytes(std::string(palette)) == Bytes{255, 0, 0, 255, 0, 255, 0, 128});
    const std::string whole = png(64, 64, 3, OIIO::TypeDesc::UINT8, std::vector<float>(64 * 64 * 3, 0.5f));
    CHECK_NOTHROW(decode_texture(whole, "whole", 64 * 64));
    CHECK_THROWS_AS(decode_texture(whole, "limit", 64 * 64 - 1), Error);
    for (std::size_t size = 8; size < whole.size(); ++size)
        CHECK_THROWS_AS(decode_texture(std::string_view(whole).substr(0, size), "cut"), Error);
    std::string lying = whole;
    lying[8] = '\xff'; // the first chunk's length
    CHECK_THROWS_AS(decode_texture(lying, "lying"), Error);
}

TEST_CASE("images: PNG out and in again") {
    const TemporaryFolder folder;
    std::vector<std::uint8_t> rgb;
    for (int i = 0; i < 7 * 5 * 3; ++i) rgb.push_back(std::uint8_t(i * 37));
    write_png(folder.file("a.png"), 7, 5, rgb);
    write_png(folder.file("b.png"), 7, 5, rgb);
    CHECK(file_bytes(folder.file("a.png")) == file_bytes(folder.file("b.png")));
    const Image texture = read_texture(folder.file("a.png"));
    REQUIRE(texture.width == 7);
    REQUIRE(texture.height == 5);
    for (std::size_t i = 0; i < 35; ++i)
        for (std::size_t c = 0; c < 4; ++c)
            REQUIRE(texture.rgba[4 * i + c] == (c == 3 ? 255 : rgb[3 * i + c]));
    CHECK_THROWS_AS(write_png(folder.file("c.png"), 7, 6, rgb), Error);
    CHECK_THROWS_AS(write_png(folder.file("none/c.png"), 7, 5, rgb), Error);
    CHECK(folder.count() == 2);
}

TEST_CASE("glTF and OBJ: textures from files, data URIs and buffers, shared, with their samplers") {
    const TemporaryFolder folder;
    const std::string image = png(2, 2, 3, OIIO::TypeDesc::UINT8, {1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1});
    folder.write("my image.png", image);
    GltfBuilder b;
    b.floats("VEC3", 3, {0, 0, 0, 1, 0, 0, 0, 1, 0});
    const std::string document = b.mesh(
        R"({"attributes":{"POSITION":0},"material":0},{"attributes":{"POSITION":0},"material":1})", "",
        R"(,"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}},"emissiveFactor":[1,1,1],"emissiveTexture":{"index":1}},)"
        R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":2}},"emissiveFactor":[1,1,1],"emissiveTexture":{"index":0}}],)"
        R"("textures":[{"source":0},{"source":0,"sampler":0},{"source":1}],)"
        R"("samplers":[{"magFilter":9728,"wrapS":33071,"wrapT":33648}],)"
        R"("images":[{"uri":"my%20image.png"},{"uri":"data:image/png;base64,)" +
            base64(image) + R"("}])");
    const Scene<float> scene = load_gltf(folder.write("a.gltf", document));
    REQUIRE(scene.images.size() == 2);
    const Texture& base = scene.materials[0].base_color_texture;
    CHECK(base.image == scene.materials[1].emission_texture.image);
    const Texture& sampled = scene.materials[0].emission_texture;
    CHECK(sampled.image == base.image);
    CHECK(sampled.filter == TextureFilter::nearest);
    CHECK(sampled.wrap_u == Wrap::clamp);
    CHECK(sampled.wrap_v == Wrap::mirror);
    CHECK(base.filter == TextureFilter::bilinear);
    for (const Image& pixels : scene.images) {
        CHECK(pixels.width == 2);
        CHECK(base.texel(pixels, 0, 0) == Vec4f(1, 0, 0, 1));
        CHECK(base.texel(pixels, 1, 1) == Vec4f(1, 1, 1, 1));
    }
    ThreadExecutor threads(4);
    CHECK(fingerprint(load_gltf(folder.file("a.gltf"), {}, threads)) == fingerprint(scene));
    CHECK(load_gltf(folder.file("a.gltf"), {.images = ImageLoading::none}).images.empty());
    folder.write(
        "a.mtl",
        "newmtl m\nmap_Kd -clamp on my image.png\nmap_d my image.png\nmap_Ke my image.png\nKe 0 0 0\n");
    const Scene<float> obj = load_obj(folder.write(
        "a.obj",
        "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 1\nvt 1 1\nvt 0 0\nf 1/1 2/2 3/3\n"));
    REQUIRE(obj.images.size() == 1);
    const Material& m = obj.materials[0];
    CHECK(m.base_color_texture.wrap_u == Wrap::clamp);
    CHECK(m.base_color_texture.color_space == ColorSpace::srgb);
    CHECK(m.alpha_texture.color_space == ColorSpace::linear);
    CHECK(m.alpha_mode == AlphaMode::mask);
    CHECK(m.emission == Vec3f(1));
    // OBJ's (0, 1) is the picture's upper left corner.
    const Vec2f corner = obj.texcoords[obj.triangles[0].x];
    CHECK(m.base_color_texture.sample(obj.images[0], corner + 0.1f) == Vec4f(1, 0, 0, 1));
}
#else
TEST_CASE("images: without OpenImageIO they are a note") {
    const TemporaryFolder folder;
    CHECK_THROWS_AS(decode_texture("\x89PNG\r\n\x1a\n", "x"), Error);
    skip("PNG and JPEG: built without OpenImageIO");
}
#endif
