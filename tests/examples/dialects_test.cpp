#include "desk.hpp"
#include <lambent/io/exr.hpp>
#include <doctest/doctest.h>
#include <map>
#include <string>
#include <utility>
#include <vector>

using namespace lambent;
using lambent_test::Desk;

namespace {

/// Some channels of ours under names of others'.
ExrImage renamed(const ExrImage& ours, const std::vector<std::pair<std::string, std::string>>& names) {
    ExrImage image{ours.width, ours.height, {}, {}};
    for (const auto& [from, to] : names) {
        REQUIRE(ours.find(from) != nullptr);
        image.channels.push_back({to, ExrType::float32, ours.find(from)->values});
    }
    return image;
}

struct Dialect {
    std::string name;
    std::vector<std::pair<std::string, std::string>> names; ///< ours, theirs
    std::string without;                                    ///< what denoise says that it lacks
    std::string error;                                      ///< and of the error
};

} // namespace

TEST_CASE("denoise: files of Blender, Mitsuba and pbrt are denoised as ours with the same planes") {
    const std::vector<Dialect> dialects = {
        {"Blender",
         {{"R", "ViewLayer.Noisy Image.R"}, {"G", "ViewLayer.Noisy Image.G"}, {"B", "ViewLayer.Noisy Image.B"},
          {"A", "ViewLayer.Combined.A"}, {"albedo.R", "ViewLayer.Denoising Albedo.R"},
          {"albedo.G", "ViewLayer.Denoising Albedo.G"}, {"albedo.B", "ViewLayer.Denoising Albedo.B"},
          {"N.X", "ViewLayer.Denoising Normal.X"}, {"N.Y", "ViewLayer.Denoising Normal.Y"},
          {"N.Z", "ViewLayer.Denoising Normal.Z"}, {"Z", "ViewLayer.Depth.Z"},
          {"samples.Y", "ViewLayer.Debug Sample Count.X"}},
         "without position, material, emission, variance, statistics", "unknown: the file has no variance"},
        {"Mitsuba",
         {{"R", "R"}, {"G", "G"}, {"B", "B"}, {"A", "A"}, {"albedo.R", "albedo.R"}, {"albedo.G", "albedo.G"},
          {"albedo.B", "albedo.B"}, {"N.X", "sh_normal.X"}, {"N.Y", "sh_normal.Y"}, {"N.Z", "sh_normal.Z"},
          {"P.X", "position.X"}, {"P.Y", "position.Y"}, {"P.Z", "position.Z"}, {"Z", "depth.T"}},
         "without material, emission, variance, statistics", "unknown: the file has no variance"},
        {"pbrt",
         {{"R", "R"}, {"G", "G"}, {"B", "B"}, {"albedo.R", "Albedo.R"}, {"albedo.G", "Albedo.G"}, {"albedo.B", "Albedo.B"},
          {"N.X", "Ns.X"}, {"N.Y", "Ns.Y"}, {"N.Z", "Ns.Z"}, {"P.X", "P.X"}, {"P.Y", "P.Y"}, {"P.Z", "P.Z"},
          {"variance.R", "Variance.R"}, {"variance.G", "Variance.G"}, {"variance.B", "Variance.B"},
          {"samples.Y", "RelativeVariance.R"}},
         "without material, emission, statistics", "by the pixels' variance; denoised unknown"}};
    Desk desk;
    REQUIRE(desk.render("--spp 8 --denoise none --float --out noisy.exr") == 0);
    const ExrImage noisy = read_exr(desk.path("noisy.exr"));
    for (const Dialect& dialect : dialects) {
        INFO(dialect.name);
        std::vector<std::pair<std::string, std::string>> same;
        for (const auto& [ours, theirs] : dialect.names) same.emplace_back(ours, ours);
        write_exr(desk.path("ours.exr"), renamed(noisy, same));
        ExrImage theirs = renamed(noisy, dialect.names);
        if (dialect.name == "Blender") { // what Blender has denoised itself is not what we start with
            for (const char c : {'R', 'G', 'B'})
                theirs.channels.push_back({std::string("ViewLayer.Combined.") + c, ExrType::half, noisy.find("Z")->values});
        }
        if (dialect.name == "pbrt") { // the variance of single samples, and normals of facets
            theirs.attributes["samplesPerPixel"] = 8;
            for (ExrChannel& c : theirs.channels)
                if (c.name.starts_with("Variance."))
                    for (float& v : c.values) v *= 8;
            for (const char c : {'X', 'Y', 'Z'})
                theirs.channels.push_back({std::string("N.") + c, ExrType::half, noisy.find("Z")->values});
        }
        write_exr(desk.path("theirs.exr"), theirs);
        for (const std::string method : {"auto", "fast"}) {
            INFO(method);
            const std::string options = " --aov none --float --method " + method;
            REQUIRE(desk.run(LAMBENT_DENOISE, "ours.exr --out a.exr" + options) == 0);
            REQUIRE(desk.run(LAMBENT_DENOISE, "theirs.exr --out b.exr" + options) == 0);
            CHECK_MESSAGE(desk.says(dialect.without), desk.said());
            CHECK_MESSAGE(desk.says(dialect.error), desk.said());
            const ExrImage a = read_exr(desk.path("a.exr")), b = read_exr(desk.path("b.exr"));
            for (const char* c : {"R", "G", "B"}) {
                CHECK(a.find(c)->values == b.find(c)->values);
                CHECK(a.find(c)->values != noisy.find(c)->values);
            }
        }
    }
}
