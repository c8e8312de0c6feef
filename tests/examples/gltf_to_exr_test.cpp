#include <lambent/io/exr_frame.hpp>
#include <io/gltf_builder.hpp>
#include <support/temporary_folder.hpp>
#include <doctest/doctest.h>
#include <cmath>
#include <cstdlib>
#include <string>
#include <sys/wait.h>

using namespace lambent;
using namespace lambent_test;

namespace {

int run(const std::string& arguments, const std::string& out) {
    const int status = std::system((LAMBENT_GLTF_TO_EXR " " + arguments + " >'" + out + "' 2>&1").c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// A cube of side 2, seen from inside: it emits 1, 0.5 and 0.25 and reflects a half of what falls on it.
std::string furnace() {
    GltfBuilder b;
    b.floats("VEC3", 8, {-1, -1, -1, 1, -1, -1, -1, 1, -1, 1, 1, -1, -1, -1, 1, 1, -1, 1, -1, 1, 1, 1, 1, 1});
    b.accessor(b.view<std::uint8_t>({0, 1, 2, 1, 3, 2, 4, 6, 5, 5, 6, 7, 0, 2, 4, 2, 6, 4,
                                     1, 5, 3, 3, 5, 7, 0, 4, 1, 1, 4, 5, 2, 3, 6, 3, 7, 6}),
               5121, "SCALAR", 36);
    return b.json(R"("scene":0,"scenes":[{"nodes":[0,1]}],"nodes":[{"mesh":0},{"camera":0}],
        "cameras":[{"type":"perspective","perspective":{"yfov":1.2,"znear":0.01}}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],
        "extensionsUsed":["KHR_materials_specular"],
        "materials":[{"emissiveFactor":[1,0.5,0.25],"extensions":{"KHR_materials_specular":{"specularFactor":0}},
            "pbrMetallicRoughness":{"baseColorFactor":[0.5,0.5,0.5,1],"metallicFactor":0,"roughnessFactor":1}}])");
}

} // namespace

TEST_CASE("gltf_to_exr: a closed room that emits E and reflects a half is 2 E bright, denoised and written") {
    const TemporaryFolder folder;
    const std::string in = folder.write("furnace.gltf", furnace()), out = folder.file("out.exr");
    REQUIRE_MESSAGE(run(in + " " + out + " 8", folder.file("log")) == 0, file_bytes(folder.file("log")));
    const ExrImage image = read_exr(out);
    REQUIRE(image.width == 640);
    REQUIRE(image.height == 360);
    for (const char* layer : {"", "noisy."})
        for (const auto& [suffix, expected] : {std::pair("R", 2.0), std::pair("G", 1.0), std::pair("B", 0.5)}) {
            const std::string name = std::string(layer) + suffix;
            INFO(name);
            const ExrChannel* channel = image.find(name);
            REQUIRE(channel != nullptr);
            double sum = 0, squares = 0;
            for (const float v : channel->values) sum += v, squares += double(v) * v;
            const double n = double(channel->values.size()), mean = sum / n;
            CHECK(mean == doctest::Approx(expected).epsilon(0.002));
            if (*layer == '\0') // denoised: hardly any noise left
                CHECK(std::sqrt(std::max(0.0, squares / n - mean * mean)) < 0.05 * expected);
        }
    for (const char* name : {"albedo.R", "N.X", "P.Z", "Z", "variance.G", "samples.Y", "A"})
        CHECK_MESSAGE(image.find(name) != nullptr, name);
    CHECK(image.find("albedo.R")->values[1000] == doctest::Approx(0.5).epsilon(1e-3));
}

TEST_CASE("gltf_to_exr: wrong use and a missing file are told, and leave no file") {
    const TemporaryFolder folder;
    const std::string log = folder.file("log"), out = folder.file("out.exr");
    CHECK(run("", log) == 2);
    CHECK(file_bytes(log).find("usage: ") == 0);
    CHECK(run(folder.file("none.gltf") + " " + out, log) == 1);
    CHECK(file_bytes(log).find("none.gltf") != std::string::npos);
    CHECK(file_bytes(out).empty());
}
