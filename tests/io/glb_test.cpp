#include <lambent/io/gltf.hpp>
#include <lambent/scene/fingerprint.hpp>
#include <io/gltf_text.hpp>
#include <support/temporary_folder.hpp>
#include <doctest/doctest.h>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

using namespace lambent;
using namespace lambent_test;
using lambent::detail::binary_length;
using lambent::detail::PartialFile;

namespace {

std::string glb(std::string json, std::string_view binary) {
    json.resize((json.size() + 3) / 4 * 4, ' ');
    std::string body = word(std::uint32_t(json.size())) + "JSON" + json;
    body += word(std::uint32_t(binary.size())) + std::string("BIN\0", 4) + std::string(binary);
    return "glTF" + word(2) + word(std::uint32_t(12 + body.size())) + body;
}

/// One triangle behind `gap` bytes that a view is made of that nobody uses. `key` spells "buffers".
std::string triangle_behind(std::size_t gap, const std::string& key = "buffers") {
    std::string binary(gap, '\x7f');
    for (const float x : {0.0f, 0.0f, 0.0f, 2.0f, 0.0f, 0.0f, 0.0f, 3.0f, 0.0f})
        binary.append(reinterpret_cast<const char*>(&x), 4);
    const std::string json =
        R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
        R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],)"
        R"("accessors":[{"bufferView":1,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[2,3,0]}],)"
        R"("bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":)" + std::to_string(gap) +
        R"(},{"buffer":0,"byteOffset":)" + std::to_string(gap) + R"(,"byteLength":36}],)"
        R"("images":[{"bufferView":0,"mimeType":"image/png"}],"textures":[{"source":0}],)"
        R"("materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],")" + key +
        R"(":[{"byteLength":)" + std::to_string(binary.size()) + "}]}";
    return glb(json, binary);
}

std::string digits(std::string_view json) {
    const auto [begin, length] = binary_length(json);
    return std::string(json.substr(begin, length));
}

} // namespace

TEST_CASE("a binary glTF is read where its triangles need it: what no triangle looks up stays in the file") {
    const TemporaryFolder folder;
    constexpr std::size_t gap = 4 << 20;
    SerialExecutor serial;
    const auto load = [&](const PartialFile& file) {
        return lambent::detail::GltfLoader<float>(file, "a.glb", {}).load(serial);
    };
    const PartialFile file(folder.write("a.glb", triangle_behind(gap)));
    const Scene<float> scene = load(file);
    CHECK(scene.triangles.size() == 1);
    CHECK(scene.images.empty()); // no triangle has its material
    CHECK(file.blocks_read() <= 3);

    // A reader that has to see everything, and one of bytes in memory, make the same scene.
    const PartialFile whole(folder.write("b.glb", triangle_behind(gap, "buff\\u0065rs")));
    CHECK(fingerprint(load(whole)) == fingerprint(scene));
    CHECK(whole.blocks_read() > 64);
    CHECK(fingerprint(load(PartialFile(std::string_view(triangle_behind(gap))))) == fingerprint(scene));
}

TEST_CASE("a buffer that claims more than its chunk, and a file that shrinks while it is read, are refused") {
    const TemporaryFolder folder;
    std::string bytes = triangle_behind(100);
    const std::size_t at = bytes.find(R"("byteLength":136)");
    REQUIRE(at != std::string::npos);
    bytes.replace(at, 16, R"("byteLength":137)");
    CHECK_THROWS_WITH_AS(load_gltf(folder.write("a.glb", bytes)), doctest::Contains("a.glb: "), Error);

    const std::string path = folder.write("b.glb", triangle_behind(4 << 20));
    const PartialFile file(path);
    CHECK(file.range(0, 4) == "glTF");
    std::filesystem::resize_file(path, 1 << 20);
    CHECK_THROWS_WITH_AS(file.range(3 << 20, 8), doctest::Contains("b.glb: read 0 of 65536 bytes from byte 3145728"), Error);
    CHECK_THROWS_AS(file.range(4 << 20, 1 << 20), Error);
    CHECK_THROWS_AS(file.range(0, std::size_t(0) - 1), Error);
    CHECK_THROWS_AS(PartialFile(folder.file("none.glb")), Error);
}

TEST_CASE("where a document says how long its binary chunk is: found, or left to the parser") {
    CHECK(digits(R"({"buffers":[{"byteLength":123}]})") == "123");
    CHECK(digits("{ \"a\" : [ { \"byteLength\" : 1 } ] ,\n\t\"buffers\" : [ { \"name\" : \"]}\\\"\" , \"byteLength\" :  42 } ] }") ==
          "42");
    CHECK(digits(R"({"buffers":[{"byteLength":12},{"byteLength":13,"uri":"b.bin"}],"x":{"buffers":[{"byteLength":9}]}})") == "12");
    CHECK(digits(R"({"buffers":[{"extras":{"byteLength":7,"uri":""},"byteLength":12}]})") == "12");
    for (const char* unclear :
         {"", "{", "{\"buffers", R"({"buffers":[]})", R"({"buffers":[{}]})", R"({"buffers":{"byteLength":1}})",
          R"({"buffers":[{"uri":"a.bin","byteLength":1}]})", R"({"buffers":[{"byteLength":1,"uri":"a.bin"}]})",
          R"({"buffers":[{"byteLength":1,"byteLength":2}]})", R"({"buffers":[{"byteLength":1.5}]})", R"({"buffers":[{"byteLength":01}]})",
          R"({"buffers":[{"byteLength":1e3}]})", R"({"buffers":[{"byteLength":"1"}]})", R"({"buffers":[{"byteLength":-1}]})",
          R"({"buffers":[{"byteLength":1}],"buffers":[{"byteLength":2}]})", R"({"b\u0075ffers":[{"byteLength":1}]})",
          R"({"buffers":[{"byteL\u0065ngth":1}]})", R"({"buffers":[[{"byteLength":1}]]})",
          R"({"meshes":[{"byteLength":1}]})", R"({"buffers":[{"byteLength)"})
        CHECK(digits(unclear) == "");
}
