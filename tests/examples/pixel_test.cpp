#include "desk.hpp"
#include <lambent/core/vec.hpp>
#include <lambent/io/exr.hpp>
#include <doctest/doctest.h>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

using namespace lambent;
using lambent_test::Desk;

namespace {

/// The numbers in the first parentheses behind `word`.
Vec3d vector_after(const std::string& line, const std::string& word) {
    Vec3d v(-1);
    const std::size_t begin = line.find('(', line.find(word));
    REQUIRE(begin != std::string::npos);
    REQUIRE(std::sscanf(line.c_str() + begin, "(%lf, %lf, %lf)", &v.x, &v.y, &v.z) == 3);
    return v;
}
double number_after(const std::string& line, const std::string& word) {
    const std::size_t begin = line.find(word);
    REQUIRE(begin != std::string::npos);
    return std::strtod(line.c_str() + begin + word.size(), nullptr);
}
void check_close(const Vec3d& a, const Vec3d& b) {
    for (int c = 0; c < 3; ++c) CHECK(a[c] == doctest::Approx(b[c]).epsilon(1e-5).scale(1e-6));
}

/// Checks what is printed of each path against itself: throughputs are products of weights over chances, a path's
/// radiance is the sum of what it adds, and the mean is that of the paths. Returns the pixel in the image.
Vec3d checked_pixel(const std::string& text, std::size_t samples) {
    std::istringstream lines(text);
    Vec3d throughput(1), light(0), sum(0), image(-1), mean(-1);
    double survival = 1, weight = 1;
    std::size_t vertices = 0, paths = 0;
    for (std::string line; std::getline(lines, line);) {
        const auto says = [&](const char* word) { return line.find(word) != std::string::npos; };
        if (says("camera ray ")) {
            throughput = Vec3d(1);
            light = Vec3d(0);
            survival = 1;
        }
        vertices += says("  vertex ") || says("  leaves ") ? 1u : 0u;
        if (says("throughput")) {
            throughput /= survival;
            survival = 1;
            check_close(vector_after(line, "throughput"), throughput);
        }
        if (says("weight (")) throughput *= vector_after(line, ", weight");
        if (says("roulette ")) survival = number_after(line, "a chance of ");
        if (says("MIS weight")) weight = number_after(line, "MIS weight ");
        CHECK(weight >= 0);
        CHECK(weight <= 1);
        if (says("  adds ") && !says("it is not") && !says("nothing")) light += vector_after(line, "adds");
        if (says("  radiance  ")) {
            check_close(vector_after(line, "radiance"), light);
            sum += light;
            ++paths;
        }
        if (says("mean of samples")) mean = vector_after(line, "samples");
        if (says("in the image")) image = vector_after(line, "image");
    }
    CHECK(paths == samples);
    CHECK(vertices >= samples);
    check_close(mean, sum / double(samples));
    CHECK(mean == image);
    return image;
}

} // namespace

TEST_CASE("render --pixel: paths that add up to the image's pixel, to the bit, and no file") {
    for (const std::string scene : {"builtin:cornell", "builtin:room", "builtin:door --firefly clamp:2 --compensation"})
        for (const std::string how : {"", "--strategy light --sampler stratified", "--strategy bsdf --sampler independent",
                                      "--mis balance --roulette-depth 1", "--integrator direct --pixel-filter tent"}) {
            Desk desk;
            const std::string options = scene + " " + how + " --size 32x24 --spp 11 --seed 3 ";
            INFO(options);
            REQUIRE(desk.run(LAMBENT_RENDER, options + "--denoise none --float --quiet --out a.exr") == 0);
            const ExrImage image = read_exr(desk.path("a.exr"));
            std::filesystem::remove(desk.path("a.exr"));
            for (const auto& [x, y] : {std::pair{3, 20}, {16, 12}, {9, 17}}) {
                REQUIRE(desk.run(LAMBENT_RENDER, options + "--pixel " + std::to_string(x) + "," + std::to_string(y)) == 0);
                CHECK(desk.count() == 0);
                const bool clamped = scene.find("clamp") != std::string::npos; // the sum of a path is not its radiance then
                const Vec3d pixel = clamped ? vector_after(desk.said(), "in the image") : checked_pixel(desk.said(), 11);
                for (int c = 0; c < 3; ++c)
                    CHECK(float(pixel[c]) == image.find(std::string(1, "RGB"[c]))->values[std::size_t(y * 32 + x)]);
            }
        }
}

TEST_CASE("render --pixel: mirrors, glass, a sky and lights without surface are named; samples can be picked") {
    Desk desk;
    const std::string scene = "builtin:room --size 32x24 --sphere-light 1,1,1,0.1,50 ";
    REQUIRE(desk.run(LAMBENT_RENDER, scene + "--spp 64 --pixel 20,8") == 0);
    for (const std::string text : {"light      sphere", "vertex 0     t ", "triangle", "'light'", "'sphere light'", "MIS weight",
                                   "which it is:", "by roulette", "seen from the front"})
        CHECK_MESSAGE(desk.says(text), text);
    std::string file = R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0}, {"translation": [0, 0, 2], "extensions": {"KHR_lights_punctual": {"light": 0}}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "materials": [{"name": "glass", "pbrMetallicRoughness": {"roughnessFactor": 0},
                       "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}}}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}],
        "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_transmission"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 5}]}}})";
    desk.write("scene.gltf", file);
    const std::string glass = "scene.gltf --size 9x9 --strategy light --env constant:1,1,1 --eye 0.3,0.3,1 --target 0.3,0.3,0 --spp 32 ";
    REQUIRE(desk.run(LAMBENT_RENDER, glass + "--pixel 4,4") == 0);
    for (const std::string text : {"'glass'", "as a mirror or smooth glass", "leaves"}) CHECK_MESSAGE(desk.says(text), desk.said());
    file.replace(file.find("\"roughnessFactor\": 0"), 20, "\"roughnessFactor\": 1");
    desk.write("scene.gltf", file);
    REQUIRE(desk.run(LAMBENT_RENDER, glass + "--pixel 4,4") == 0);
    CHECK_MESSAGE(desk.says("light      punctual light 0, "), desk.said());
    desk.write("pane.mtl", "newmtl floor\nKd .5 .5 .5\nnewmtl pane\nillum 6\nNi 1\nTf .5 .6 .7\n");
    desk.write("pane.obj", "mtllib pane.mtl\nv -9 0 9\nv 9 0 9\nv 9 0 -9\nv -9 0 -9\nv -9 1 9\nv 9 1 9\nv 9 1 -9\nv -9 1 -9\n"
                           "usemtl floor\nf 1 2 3 4\nusemtl pane\nf 5 6 7 8\n");
    REQUIRE(desk.run(LAMBENT_RENDER, "pane.obj --size 9x9 --sphere-light 0,3,0,0.5,50 --eye 0,0.5,2 --target 0,0,0 --spp 8 --pixel 4,4") == 0);
    CHECK_MESSAGE(desk.says("which it is through panes: BSDF"), desk.said());
    CHECK(min_component(checked_pixel(desk.said(), 8)) > 0);
    REQUIRE(desk.run(LAMBENT_RENDER, "builtin:cornell --size 9x9 --strategy light --env constant:1,1,1 --spp 64 --pixel 4,4") == 0);
    CHECK(desk.says("light      environment"));
    REQUIRE(desk.run(LAMBENT_RENDER, scene + "--sample-range 5:6 --pixel 20,8") == 0);
    CHECK(desk.says("sample 5\n"));
    CHECK(!desk.says("sample 4\n"));
    REQUIRE(desk.run(LAMBENT_RENDER, scene + "--integrator ao --spp 2 --pixel 20,8") == 0);
    for (const std::string bad : {"--pixel 20", "--pixel 32,8", "--pixel -1,8", "--pixel 1,1 --error-target 0.1"})
        CHECK(desk.run(LAMBENT_RENDER, scene + bad) == 2);
}
