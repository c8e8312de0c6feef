#include "desk.hpp"
#include <lambent/io/exr.hpp>
#include <support/json.hpp>
#include <doctest/doctest.h>
#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <string>
#include <vector>

using namespace lambent;
using lambent_test::Desk;
using lambent_test::Json;

namespace {

std::vector<std::string> channel_names(const ExrImage& image) {
    std::vector<std::string> names;
    for (const ExrChannel& c : image.channels) names.push_back(c.name);
    return names;
}

} // namespace

TEST_CASE("G3: render: 1, 2 and 7 threads write the same file") {
    for (const std::string sampler : {"sobol", "stratified", "independent"}) {
        Desk desk;
        const std::string options = "--spp 5 --sampler " + sampler;
        REQUIRE(desk.render(options + " --threads 1 --out one.exr") == 0);
        REQUIRE(desk.render(options + " --threads 2 --out two.exr") == 0);
        REQUIRE(desk.render(options + " --threads 7 --out seven.exr") == 0);
        CHECK(desk.same("one.exr", "two.exr"));
        CHECK(desk.same("one.exr", "seven.exr"));
        REQUIRE(desk.render(options + " --seed 1 --out other.exr") == 0);
        CHECK(!desk.same("one.exr", "other.exr"));
    }
}

TEST_CASE("render: any split of the samples, merged in any order or resumed, writes the same files") {
    for (const std::string sampler : {"sobol", "stratified", "independent"})
        for (const std::string image : {"", "--denoise none --aov N,Z --float"}) {
            INFO("sampler ", sampler, " ", image);
            Desk desk;
            const std::string options = "--spp 13 --sampler " + sampler + " " + image;
            REQUIRE(desk.render(options + " --checkpoint --out whole.exr") == 0);
            REQUIRE(desk.render(options + " --sample-range 0:3 --out a.exr") == 0);
            REQUIRE(desk.render(options + " --sample-range 3:8 --out b.exr --threads 2") == 0);
            REQUIRE(desk.render(options + " --sample-range=8:13 --out c.exr --threads 7") == 0);
            REQUIRE(desk.merge("abc.film a.film b.film c.film") == 0);
            REQUIRE(desk.merge("bca.film b.film c.film a.film") == 0);
            REQUIRE(desk.merge("ca.film c.film a.film") == 0);
            REQUIRE(desk.merge("ca_b.film ca.film b.film") == 0);
            REQUIRE(desk.render(options + " --resume ca.film --out resumed.exr") == 0);
            REQUIRE(desk.render(options + " --resume whole.film --out again.exr") == 0);
            for (const std::string name : {"abc", "bca", "ca_b", "resumed", "again"}) {
                INFO(name);
                CHECK(desk.same("whole.exr", name + ".exr"));
                CHECK(desk.same("whole.film", name + ".film"));
            }
            CHECK(!desk.same("whole.exr", "ca.exr"));
        }
}

TEST_CASE("render: interrupted, it saves what there is, says how to go on, and goes on to the same bits") {
    Desk desk;
    REQUIRE(desk.render_until(SIGINT) == 130);
    CHECK(desk.says("--resume out.film"));
    REQUIRE(desk.exists("out.exr"));
    const ExrImage image = read_exr(desk.path("out.exr"));
    const int spp = std::get<int>(image.attributes.at("spp"));
    CHECK(spp >= 1);
    const std::string more = std::to_string(spp + 5);
    REQUIRE(desk.render("--spp " + more + " --resume out.film --out resumed.exr") == 0);
    REQUIRE(desk.render("--spp " + more + " --out whole.exr") == 0);
    CHECK(desk.same("whole.exr", "resumed.exr"));
}

TEST_CASE("render: killed, the last checkpoint is whole and can be gone on with") {
    Desk desk;
    REQUIRE(desk.render_until(SIGKILL) == -SIGKILL);
    REQUIRE(desk.render("--spp 4 --resume out.film --out resumed.exr") == 0); // has more than that already
    CHECK(desk.exists("resumed.exr"));
}

TEST_CASE("merge: the image's settings are those of the film with the first sample, in any order") {
    Desk desk;
    REQUIRE(desk.render("--sample-range 0:2 --denoise none --float --out a.exr") == 0);
    REQUIRE(desk.render("--sample-range 2:4 --denoise fast --out b.exr") == 0);
    REQUIRE(desk.render("--spp 4 --denoise none --float --out whole.exr") == 0);
    REQUIRE(desk.merge("ab.film a.film b.film") == 0);
    REQUIRE(desk.merge("ba.film b.film a.film") == 0);
    CHECK(desk.same("ab.film", "ba.film"));
    CHECK(desk.same("ab.exr", "whole.exr"));
    CHECK(desk.same("ba.exr", "whole.exr"));
}

TEST_CASE("render --resume and merge refuse what does not belong together, naming the files") {
    Desk desk;
    REQUIRE(desk.render("--sample-range 0:4 --out a.exr") == 0);
    const auto refuses_to_resume = [&](const std::string& options, const std::string& because) {
        INFO(options);
        CHECK(desk.render("--spp 8 --resume a.film --out no.exr " + options) == 1);
        CHECK(desk.says("a.film"));
        CHECK(desk.says(because));
        CHECK(!desk.exists("no.exr"));
    };
    refuses_to_resume("--seed 4", "seed is 0, not 4");
    refuses_to_resume("--size 33x24", "size is 32 x 24, not 33 x 24");
    refuses_to_resume("--crop 0,0,8,8", "crop is 0,0,32,24, not 0,0,8,8");
    refuses_to_resume("--vfov 30", "camera is");
    refuses_to_resume("--max-depth 3", "max depth unlimited");
    refuses_to_resume("--integrator direct", "integrator is path");
    refuses_to_resume("--sampler independent", "sampler is sobol, not independent");
    refuses_to_resume("--firefly clamp:10", "clamp is off, not 10");
    refuses_to_resume("--env constant:1,1,1", "scene is content");
    refuses_to_resume("--sphere-light 0,1,0,0.1,1", "scene is content");
    CHECK(desk.render("--spp 8 --resume b.film --out no.exr") == 1);
    CHECK(desk.says("b.film: no such file"));

    REQUIRE(desk.render("--sample-range 3:5 --out b.exr") == 0);
    REQUIRE(desk.render("--sample-range 4:5 --seed 9 --out c.exr") == 0);
    REQUIRE(desk.render("--sample-range 4:5 --aov none --denoise none --out d.exr") == 0);
    const auto refuses_to_merge = [&](const std::string& other, const std::string& because) {
        CHECK(desk.merge("no.film a.film " + other) == 1);
        CHECK(desk.says("a.film"));
        CHECK(desk.says(other));
        CHECK(desk.says(because));
        CHECK(!desk.exists("no.film"));
    };
    refuses_to_merge("b.film", "[3, 5) and [0, 4)");
    refuses_to_merge("c.film", "seed is 9, not 0");
    refuses_to_merge("d.film", "cannot merge");
    std::ofstream(desk.path("e.film"), std::ios::binary) << desk.bytes("a.film").substr(0, 3000);
    CHECK(desk.merge("no.film a.film e.film") == 1);
    CHECK(desk.says("e.film"));
    CHECK(desk.merge("no.film") == 2);
    CHECK(desk.merge("no.exr a.film") == 2);
}

TEST_CASE("render --crop: the pixels of the whole image, in their place") {
    Desk desk;
    REQUIRE(desk.render("--spp 3 --denoise none --out whole.exr") == 0);
    REQUIRE(desk.render("--spp 3 --denoise none --crop 5,6,20,9 --out part.exr") == 0);
    const ExrImage whole = read_exr(desk.path("whole.exr")), part = read_exr(desk.path("part.exr"));
    CHECK(part.width == 15);
    CHECK(part.height == 3);
    CHECK(part.left == 5);
    CHECK(part.top == 6);
    CHECK(part.display_width == 32);
    CHECK(part.display_height == 24);
    CHECK(std::get<Mat4d>(part.attributes.at("worldToNDC")) == std::get<Mat4d>(whole.attributes.at("worldToNDC")));
    REQUIRE(channel_names(part) == channel_names(whole));
    for (std::size_t c = 0; c < part.channels.size(); ++c)
        for (int y = 0; y < part.height; ++y)
            for (int x = 0; x < part.width; ++x)
                REQUIRE(part.channels[c].values[std::size_t(y * part.width + x)] ==
                        whole.channels[c].values[std::size_t((y + 6) * whole.width + x + 5)]);
}

TEST_CASE("render --aov: the planes asked for and no others; all are finite") {
    Desk desk;
    const auto names = [&](const std::string& options) {
        REQUIRE(desk.render("--spp 2 --out a.exr " + options) == 0);
        return channel_names(read_exr(desk.path("a.exr")));
    };
    using Names = std::vector<std::string>;
    CHECK(names("--aov none --denoise none") == Names{"A", "B", "G", "R"});
    CHECK(names("--aov none") == Names{"A", "B", "G", "R", "noisy.B", "noisy.G", "noisy.R"});
    CHECK(names("--aov Z,N --denoise none") == Names{"A", "B", "G", "N.X", "N.Y", "N.Z", "R", "Z"});
    CHECK(names("--aov illumination --denoise none") ==
          Names{"A", "B", "G", "R", "illumination.B", "illumination.G", "illumination.R"});
    CHECK(names("") == Names{"A",          "B",          "G",        "N.X",      "N.Y",      "N.Z",
                             "P.X",        "P.Y",        "P.Z",      "R",        "Z",        "albedo.B",
                             "albedo.G",   "albedo.R",   "emission.B", "emission.G", "emission.R", "illumination.B",
                             "illumination.G", "illumination.R", "material.Y", "noisy.B", "noisy.G", "noisy.R",
                             "samples.Y",  "variance.B", "variance.G", "variance.R"});
    const ExrImage all = read_exr(desk.path("a.exr"));
    for (const ExrChannel& c : all.channels)
        for (const float v : c.values) REQUIRE(is_finite(v));
    CHECK(std::get<int>(all.attributes.at("spp")) == 2);
    CHECK(std::get<double>(all.attributes.at("seed")) == 0);
    CHECK(std::get<std::string>(all.attributes.at("version")).find("lambent") == 0);
    CHECK(all.attributes.count("worldToCamera") == 1);
    for (const ExrChannel& c : (names("--float"), read_exr(desk.path("a.exr"))).channels) CHECK(c.type == ExrType::float32);
}

TEST_CASE("F12: render --kernel 0 is the same file as --denoise none; denoising changes R G B and keeps noisy") {
    Desk desk;
    REQUIRE(desk.render("--spp 2 --out off.exr --denoise none") == 0);
    REQUIRE(desk.render("--spp 2 --out zero.exr --kernel 0") == 0);
    REQUIRE(desk.render("--spp 2 --out on.exr --denoise fast") == 0);
    REQUIRE(desk.render("--spp 2 --out wide.exr --denoise fast --kernel 33 --sigma-illumination off") == 0);
    CHECK(desk.same("off.exr", "zero.exr"));
    CHECK(!desk.same("on.exr", "wide.exr"));
    const ExrImage off = read_exr(desk.path("off.exr")), on = read_exr(desk.path("on.exr"));
    CHECK(off.find("R")->values == on.find("noisy.R")->values);
    CHECK(on.find("R")->values != on.find("noisy.R")->values);
    CHECK(off.find("noisy.R") == nullptr);
}

TEST_CASE("render: a wrong command line ends with 2, says what is wrong, and leaves nothing behind") {
    Desk desk;
    const auto refused = [&](const std::string& arguments, const std::string& because) {
        INFO(arguments);
        CHECK(desk.run(LAMBENT_RENDER, arguments) == 2);
        INFO(desk.said());
        CHECK(desk.says(because));
        CHECK(desk.count() == 0);
    };
    refused("", "no scene");
    refused("a.glb b.glb", "more than one scene");
    refused("builtin:cornel", "there are builtin:cornell");
    refused("builtin:room:0", "must lie in");
    const std::string scene = "builtin:cornell ";
    refused(scene + "--sp 3", "did you mean '--spp'?");
    refused(scene + "--denoize fast", "did you mean '--denoise'?");
    refused(scene + "-spp 3", "did you mean '--spp'?");
    for (const std::string bad : {"--spp 0", "--spp -1", "--spp 1.5", "--spp x", "--spp 99999999999", "--spp", "--spp=", "--seed -1",
                                  "--size 10", "--size 0x10", "--size 10x", "--size 10x10x10", "--size 99999999x2",
                                  "--threads -1", "--integrator pathh", "--sampler sobl", "--strategy nee", "--mis none",
                                  "--max-depth -1", "--roulette-depth on", "--env constant:1,2", "--env constant:1,2,-3",
                                  "--env constant:a,b,c", "--env-rotate nan", "--env-scale 0", "--env-scale inf",
                                  "--sphere-light 1,2,3,4", "--sphere-light 0,0,0,0,1", "--camera -1", "--camera 7",
                                  "--eye 1,2", "--eye 1,2,3,4", "--eye 1,,3", "--target a,b,c", "--vfov 0", "--vfov 180",
                                  "--vfov -20", "--denoise bestest", "--kernel 4", "--kernel -3", "--sigma-normal 0",
                                  "--sigma-position -1", "--sigma-spatial off", "--firefly clamp", "--firefly clamp:0",
                                  "--firefly seed:x", "--aov colour", "--aov ,", "--aov N,,Z", "--float=1", "--exposure x",
                                  "--time-limit 0", "--sample-range 4", "--sample-range 4:4", "--sample-range 5:4",
                                  "--sample-range -1:4", "--sample-range 1:2:3", "--crop 0,0,1", "--crop 0,0,0,5",
                                  "--crop 0,0,5000,5", "--crop 0.5,0,5,5", "--out a.png", "--out .exr", "--preview a.jpg",
                                  "--resume a.exr", "--out --spp", "--eye 1,1,1 --target 1,1,1"})
        refused(scene + bad, "render: ");
    refused(scene + "--error-target 0", "--error-target");
    refused(scene + "--error-target 0.1 --sample-range 0:8", "--sample-range and --error-target");
}

TEST_CASE("render: what cannot be read or written is found before rendering, and ends with 1") {
    Desk desk;
    const auto fails = [&](const std::string& arguments, const std::string& because) {
        INFO(arguments);
        CHECK(desk.run(LAMBENT_RENDER, arguments + " --spp 1000000") == 1);
        INFO(desk.said());
        CHECK(desk.says(because));
        CHECK(desk.count() == 0);
    };
    fails("none.glb", "none.glb");
    fails("scene.xyz", "scene.xyz");
    fails("builtin:cornell --out no/such/folder/a.exr", "no folder no/such/folder");
    fails("builtin:cornell --out said/a.exr", "no folder said");
    fails("builtin:cornell --preview no/a.png", "no folder no");
    fails("builtin:cornell --stats no/a.json", "no folder no");
    fails("builtin:cornell --out /proc/a.exr", "/proc/a.exr");
    fails("builtin:cornell --env none.hdr", "none.hdr");
    fails("builtin:cornell --resume none.film", "none.film");
}

TEST_CASE("G1: render --stats: every field, and stage times that add up to the whole") {
    Desk desk;
    REQUIRE(desk.run(LAMBENT_RENDER, "builtin:cornell --size 64x48 --spp 32 --stats s.json --preview p.png --threads 2") == 0);
    for (const std::string text : {"triangles", "seconds", "Msamples/s", "Mrays/s", "estimated error", "out.exr", "p.png", "s.json"})
        CHECK(desk.says(text));
    const Json stats = Json::parse(desk.bytes("s.json"));
    for (const std::string key : {"triangles", "dropped", "load_s", "build_s", "render_s", "denoise_s", "samples", "rays",
                                  "mrays_per_s", "threads", "spp", "peak_mib", "facts", "skipped", "estimated_error"}) {
        INFO(key);
        CHECK(stats.has(key));
    }
    CHECK(stats["samples"].number == 64 * 48 * 32);
    CHECK(stats["spp"].number == 32);
    CHECK(stats["threads"].number == 2);
    CHECK(stats["rays"].number >= stats["samples"].number);
    CHECK(stats["mrays_per_s"].number == doctest::Approx(stats["rays"].number / stats["render_s"].number * 1e-6).epsilon(1e-6));
    CHECK(stats["estimated_error"].number > 0);
    CHECK(stats["peak_mib"].number > 1);
    double stages = 0;
    for (const std::string key : {"load_s", "build_s", "render_s", "denoise_s", "write_s"}) stages += stats[key].number;
    CHECK(stages == doctest::Approx(stats["total_s"].number).epsilon(0.02));
    REQUIRE(desk.render("--spp 1 --stats one.json") == 0);
    CHECK(Json::parse(desk.bytes("one.json"))["estimated_error"].text == "null");
    REQUIRE(desk.render("--spp 1 --stats three.json --denoise seed --kernel 3 --size 5x3") == 0);
    const Json three = Json::parse(desk.bytes("three.json")); // pairs of neighbours in 3 rows of 4 and 5 columns of 2
    CHECK(three["filter_exponentials"].number == 3 * 4 + 5 * 2);
    CHECK(three["filter_taps"].number == 2 * (3 * 4 + 5 * 2));
}

TEST_CASE("render --compensation: another scene's light, so films of one without it do not go on with it") {
    Desk desk;
    REQUIRE(desk.render("--sample-range 0:2 --out a.exr") == 0);
    CHECK(desk.render("--compensation --resume a.film --out b.exr") == 1);
    CHECK(desk.says("a.film is of another render: its scene"));
}

TEST_CASE(
    "render --explain: facts, specialisation, what was left out and what that saved; in --stats and the image too") {
    Desk desk;
    REQUIRE(desk.render("--spp 2 --explain --aov none --denoise none --stats s.json --out a.exr") == 0);
    for (const std::string text :
         {"facts            triangles, textures, emissive_surfaces", "integrator       path, strategy both",
          "skipped          normal_maps", "skipped          standard_bsdf", "planes           radiance, emission"})
        CHECK(desk.says(text));
    for (const std::string text : {"light_sampling", "mis  ", "stopped"}) CHECK(!desk.says(text));
    const Json stats = Json::parse(desk.bytes("s.json"));
    CHECK(stats["planes_saved_mib"].number == doctest::Approx((50 - 10) * 4 * 32 * 24 / 1048576.0));
    CHECK(stats["integrator"].text.find("strategy both") != std::string::npos);
    CHECK(stats["shadow_rays_saved"].number > 0.1 * stats["shadow_rays"].number);
    CHECK(desk.says("% of the light samples were not worth one"));
    CHECK(stats["filter_taps"].number == 0);
    const ExrImage image = read_exr(desk.path("a.exr"));
    CHECK(std::get<std::string>(image.attributes.at("facts")) == "triangles textures emissive_surfaces");
    CHECK(std::get<std::string>(image.attributes.at("skipped")) == "normal_maps alpha standard_bsdf");
    REQUIRE(desk.render("--spp 2 --strategy bsdf --explain") == 0);
    CHECK(desk.says("light_sampling"));
    CHECK(desk.says("skipped          mis"));
    CHECK(!desk.says("light samples"));
    REQUIRE(desk.render("--error-target 0.2 --explain") == 0);
    CHECK(desk.says("% of the pixels, which saves"));
    CHECK(!desk.says("general_code"));
    const std::string wide = " --size 128x48 --spp 16 --quiet --explain --denoise none --stats s.json";
    REQUIRE(desk.run(LAMBENT_RENDER, "builtin:cornell" + wide) == 0);
    CHECK(desk.says("samples were not traced: their tiles see one colour alone")); // left and right of the box
    CHECK(Json::parse(desk.bytes("s.json"))["background_samples"].number > 1000);
    REQUIRE(desk.run(LAMBENT_RENDER, "builtin:door" + wide) == 0);
    CHECK(desk.says("skipped          general_code"));
    CHECK(Json::parse(desk.bytes("s.json"))["background_samples"].number == 0);
    REQUIRE(desk.render("--spp 2") == 0);
    CHECK(desk.said().empty());
}

TEST_CASE("render --error-target: stops pixel by pixel where the error is met, on any threads, resumed or not") {
    Desk desk;
    const std::string options = "--error-target 0.15 --denoise none --float --checkpoint ";
    REQUIRE(desk.render(options + "--threads 1 --stats s.json --out one.exr") == 0);
    const Json stats = Json::parse(desk.bytes("s.json"));
    CHECK(stats["estimated_error"].number <= 0.15);
    CHECK(stats["estimated_error"].number > 0.1);
    CHECK(stats["error_target"].number == doctest::Approx(0.15));
    CHECK(stats["spp_min"].number < stats["spp"].number);
    CHECK(stats["spp_mean"].number == doctest::Approx(stats["samples"].number / (32 * 24)));
    const ExrImage image = read_exr(desk.path("one.exr"));
    double sum = 0, most = 0;
    for (const float n : image.find("samples.Y")->values) sum += double(n), most = std::max(most, double(n));
    CHECK(sum == stats["samples"].number);
    CHECK(most == stats["spp"].number);

    REQUIRE(desk.render(options + "--threads 7 --out seven.exr") == 0);
    CHECK(desk.same("one.exr", "seven.exr"));
    CHECK(desk.same("one.film", "seven.film"));
    for (const std::string until : {"5", "8", "13", "32", "41"}) { // in the midst of a round, and between two
        INFO("until ", until);
        REQUIRE(desk.render(options + "--spp " + until + " --out part.exr") == 0);
        REQUIRE(desk.render(options + "--resume part.film --out resumed.exr") == 0);
        CHECK(desk.same("one.exr", "resumed.exr"));
        CHECK(desk.same("one.film", "resumed.film"));
    }
    CHECK(desk.render("--error-target 0.1 --resume one.film") == 1);
    CHECK(desk.says("error target is "));
    REQUIRE(desk.render("--error-target 1e-9 --time-limit 0.2 --stats t.json") == 0);
    CHECK(Json::parse(desk.bytes("t.json"))["estimated_error"].number > 0);
}

TEST_CASE("render --time-limit ends in time with what there is; --quiet says nothing; --help names every option") {
    Desk desk;
    const auto start = std::chrono::steady_clock::now();
    REQUIRE(desk.render("--spp 1000000 --time-limit 0.3 --stats s.json") == 0);
    CHECK(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() < 20);
    CHECK(desk.said().empty());
    const Json stats = Json::parse(desk.bytes("s.json"));
    CHECK(stats["spp"].number >= 1);
    CHECK(stats["spp"].number < 1000000);
    CHECK(stats["render_s"].number < 5);
    CHECK(!desk.exists("out.film"));
    REQUIRE(desk.run(LAMBENT_RENDER, "--help") == 0);
    for (const std::string option :
         {"--out", "--preview", "--size", "--spp", "--seed", "--threads", "--integrator", "--sampler", "--strategy", "--mis",
          "--max-depth", "--roulette-depth", "--env", "--env-rotate", "--env-scale", "--sphere-light", "--camera", "--eye",
          "--target", "--up", "--vfov", "--denoise", "--kernel", "--sigma-", "--firefly", "--aov", "--float", "--exposure",
          "--time-limit", "--error-target", "--sample-range", "--resume", "--crop", "--stats", "--explain", "--quiet"})
        CHECK(desk.says("  " + option));
    CHECK(desk.says("(16)"));
    CHECK(desk.says("1280x720"));
}
