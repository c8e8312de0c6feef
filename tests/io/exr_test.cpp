#include <lambent/io/environment.hpp>
#include <lambent/io/exr.hpp>
#include <lambent/denoise/denoise_light.hpp>
#include <lambent/film/film.hpp>
#include <lambent/film/film_pass.hpp>
#include <lambent/io/exr_frame.hpp>
#include <support/skip.hpp>
#include <support/temporary_folder.hpp>
#include <doctest/doctest.h>
#include <algorithm>
#include <bit>
#include <cmath>
#include <filesystem>
#include <limits>
#include <random>
#include <string>

using namespace lambent;
using lambent_test::file_bytes;
using lambent_test::TemporaryFolder;

namespace {

const std::string exr_scenes = std::string(LAMBENT_SHARED_DIR) + "/scenes/";

ExrImage noise_image(ExrType type) {
    std::mt19937 random(3);
    ExrImage image{37, 21, {}, {}};
    for (const char* name : {"R", "G", "albedo.R", "Z"}) {
        ExrChannel channel{name, type, {}};
        for (int i = 0; i < 37 * 21; ++i)
            channel.values.push_back(std::ldexp(float(random()) / 4.0e9f - 0.5f, int(random() % 20) - 10));
        image.channels.push_back(channel);
    }
    return image;
}

/// Rounds to the nearest half with ties to even, in arithmetic of its own: 11 bits of mantissa, down to
/// 2^-24.
float nearest_half(float x) {
    if (x == 0) return x;
    const int exponent = std::max(std::ilogb(x) - 10, -24);
    const double units = std::ldexp(double(x), -exponent);
    return float(std::clamp(std::ldexp(std::nearbyint(units), exponent), -65504.0, 65504.0));
}

PixelData<float> small_frame() {
    PixelData<float> frame;
    frame.width = 5;
    frame.height = 3;
    float next = 0.1f;
    const auto fill = [&](auto& plane) {
        plane.allocate(5, 3);
        for (float& v : plane.values()) v = next += 0.37f;
    };
    fill(frame.radiance);
    fill(frame.emission);
    fill(frame.albedo);
    fill(frame.illumination);
    fill(frame.normal);
    fill(frame.position);
    fill(frame.depth);
    fill(frame.material);
    fill(frame.alpha);
    fill(frame.samples);
    fill(frame.variance);
    return frame;
}

} // namespace

TEST_CASE("EXR: float channels come back to the bit, in any order, with attributes") {
    const TemporaryFolder folder;
    ExrImage image = noise_image(ExrType::float32);
    image.channels[0].values[5] = std::numeric_limits<float>::infinity();
    image.channels[0].values[6] = std::numeric_limits<float>::denorm_min();
    Mat4d matrix(1.0);
    matrix[3] = {1, 2, 3, 1};
    image.attributes = {{"spp", 64},
                        {"seconds", 1.5},
                        {"seed", std::string("18446744073709551615")},
                        {"worldToCamera", matrix}};
    write_exr(folder.file("a.exr"), image);
    const ExrImage back = read_exr(folder.file("a.exr"));
    CHECK(back.width == 37);
    CHECK(back.height == 21);
    CHECK(back.channels.size() == 4);
    for (const ExrChannel& channel : image.channels) {
        CAPTURE(channel.name);
        const ExrChannel* same = back.find(channel.name);
        REQUIRE(same != nullptr);
        CHECK(same->type == ExrType::float32);
        CHECK(std::equal(channel.values.begin(), channel.values.end(), same->values.begin(),
                         same->values.end(), [](float a, float b) {
                             return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
                         }));
    }
    CHECK(back.attributes.at("spp") == image.attributes.at("spp"));
    CHECK(back.attributes.at("seconds") == image.attributes.at("seconds"));
    CHECK(back.attributes.at("seed") == image.attributes.at("seed"));
    CHECK(back.attributes.at("worldToCamera") == image.attributes.at("worldToCamera"));
}

TEST_CASE("EXR: half channels are the nearest halves and saturate") {
    const TemporaryFolder folder;
    ExrImage image = noise_image(ExrType::half);
    std::vector<float>& values = image.channels[0].values;
    values[0] = 1e9f;
    values[1] = -std::numeric_limits<float>::infinity();
    values[2] = 65519.9f;
    values[3] = 1 + 0x1p-11f;
    values[4] = 3e-8f;
    values[5] = std::numeric_limits<float>::quiet_NaN();
    write_exr(folder.file("a.exr"), image);
    const ExrImage back = read_exr(folder.file("a.exr"));
    const std::vector<float>& read = back.find("R")->values;
    CHECK(read[0] == 65504);
    CHECK(read[1] == -65504);
    CHECK(read[2] == 65504);
    CHECK(read[3] == 1);
    CHECK(!is_finite(read[5]));
    for (std::size_t i = 6; i < values.size(); ++i) REQUIRE(read[i] == nearest_half(values[i]));
}

TEST_CASE("EXR: equal images are equal files, whole or not there") {
    const TemporaryFolder folder;
    write_exr(folder.file("a.exr"), noise_image(ExrType::half));
    write_exr(folder.file("b.exr"), noise_image(ExrType::half));
    CHECK(file_bytes(folder.file("a.exr")) == file_bytes(folder.file("b.exr")));
    CHECK(folder.count() == 2);

    ExrImage broken = noise_image(ExrType::half);
    broken.channels[2].values.pop_back();
    const std::string before = file_bytes(folder.file("a.exr"));
    CHECK_THROWS_AS(write_exr(folder.file("a.exr"), broken), Error);
    CHECK(file_bytes(folder.file("a.exr")) == before);
    CHECK_THROWS_AS(write_exr(folder.file("none/a.exr"), noise_image(ExrType::half)), Error);
    CHECK_THROWS_AS(write_exr(folder.file("c.exr"), ExrImage{}), Error);
    std::filesystem::create_directory(folder.file("d.exr"));
    CHECK_THROWS_AS(write_exr(folder.file("d.exr"), noise_image(ExrType::half)), Error);
    CHECK(folder.count() == 3);
}

TEST_CASE("EXR: a frame's channels, their types and back") {
    const TemporaryFolder folder;
    const PixelData<float> frame = small_frame();
    write_exr(folder.file("a.exr"), frame, {.precision = ExrPrecision::full});
    const ExrImage image = read_exr(folder.file("a.exr"));
    for (const char* name : {"R", "G", "B", "A", "albedo.R", "illumination.G", "emission.B", "N.X", "N.Y",
                             "N.Z", "P.X", "P.Z", "Z", "material.Y", "samples.Y", "variance.R"}) {
        CAPTURE(name);
        CHECK(image.find(name) != nullptr);
    }
    CHECK(image.channels.size() == 4 + 3 * 6 + 3); // RGBA; six vectors; Z, material, samples
    const PixelData<float> back = frame_from_exr(image);
    CHECK(back.radiance.values() == frame.radiance.values());
    CHECK(back.emission.values() == frame.emission.values());
    CHECK(back.albedo.values() == frame.albedo.values());
    CHECK(back.illumination.values() == frame.illumination.values());
    CHECK(back.normal.values() == frame.normal.values());
    CHECK(back.position.values() == frame.position.values());
    CHECK(back.depth.values() == frame.depth.values());
    CHECK(back.material.values() == frame.material.values());
    CHECK(back.alpha.values() == frame.alpha.values());
    CHECK(back.samples.values() == frame.samples.values());
    CHECK(back.variance.values() == frame.variance.values());
}

TEST_CASE("EXR: compact types, denoised frames, chosen layers") {
    PixelData<float> frame = small_frame();
    ExrImage image = to_exr(frame);
    CHECK(image.find("R")->type == ExrType::half);
    CHECK(image.find("N.X")->type == ExrType::half);
    CHECK(image.find("P.X")->type == ExrType::float32);
    CHECK(image.find("Z")->type == ExrType::float32);
    CHECK(image.find("samples.Y")->type == ExrType::float32);
    CHECK(image.find("noisy.R") == nullptr);
    frame.radiance.values()[4] = 1e5f; // half would lose it, in all three channels alike
    CHECK(to_exr(frame).find("R")->type == ExrType::float32);

    Plane<float, 3> denoised(5, 3, 0.5f);
    frame.albedo = {};
    image = to_exr(frame, {.denoised = denoised.view(), .layers = std::vector<std::string>{"noisy", "N"}});
    CHECK(image.find("R")->values[0] == 0.5f);
    CHECK(image.find("noisy.G")->values[0] == frame.radiance.values()[1]);
    CHECK(image.find("P.X") == nullptr);
    CHECK(image.channels.size() == 3 + 1 + 3 + 3);
    CHECK(frame_from_exr(image).radiance.values() == frame.radiance.values());
    CHECK(frame_from_exr(image).albedo.absent());

    frame.radiance = {};
    CHECK_THROWS_AS(to_exr(frame), Error);
    Plane<float, 3> wrong(4, 3);
    CHECK_THROWS_AS(to_exr(small_frame(), {.denoised = wrong.view()}), Error);
}

TEST_CASE("EXR: statistics and the error of denoising are written when asked for, and read back to the bit") {
    FilmPass<float> pass(4, 3, FilmPlanes::statistics, 0, 8);
    for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 4; ++x) {
            FilmPass<float>::Pixel pixel(pass, x, y);
            for (int i = 0; i < 8; ++i) {
                const float v = 0.1f * float(1 + x + 4 * y) + 0.01f * float((i * 5) % 8);
                pixel.add({.radiance = Vec3f(3 * v, v, v), .direct = Vec3f(2 * v, v, 0), .indirect = Vec3f(v, 0, v),
                           .albedo = Vec3f(v / 4), .normal = Vec3f(0, v / 2, 0), .depth = v, .hit = true});
            }
        }
    const PixelData<float> frame = pass.finish().resolve();
    const Plane<float, 3> error(4, 3, 0.125f);
    CHECK(to_exr(frame).find("direct.R") == nullptr);
    const ExrImage image = to_exr(frame, {.error = error.view(), .layers = std::vector<std::string>{
        "albedo", "N", "Z", "samples", "variance", "error", "statistics"}});
    CHECK(image.find("error.B")->values[11] == 0.125f);
    CHECK(image.find("direct.R")->type == ExrType::float32);
    const PixelData<float> back = frame_from_exr(image);
    CHECK(has_light_statistics(back.view()));
    const auto same = [](const auto& a, const auto& b) { return !a.absent() && a.values() == b.values(); };
    CHECK(same(back.direct, frame.direct));
    CHECK(same(back.indirect, frame.indirect));
    CHECK(same(back.root_direct, frame.root_direct));
    CHECK(same(back.root_direct_variance, frame.root_direct_variance));
    CHECK(same(back.root_indirect, frame.root_indirect));
    CHECK(same(back.root_indirect_variance, frame.root_indirect_variance));
    CHECK(same(back.halves, frame.halves));
    CHECK(same(back.root_direct_halves, frame.root_direct_halves));
    CHECK(same(back.root_indirect_halves, frame.root_indirect_halves));
    CHECK(same(back.albedo_variance, frame.albedo_variance));
    CHECK(same(back.normal_variance, frame.normal_variance));
    CHECK(same(back.depth_variance, frame.depth_variance));
}

TEST_CASE("EXR: the camera matrices take the target to the image's middle") {
    Camera camera;
    camera.eye = {1, 2, 3};
    camera.target = {4, 3, -5};
    camera.vertical_fov = 50;
    const auto attributes = camera_attributes(camera, 320, 180);
    const Mat4d to_camera = std::get<Mat4d>(attributes.at("worldToCamera"));
    const Mat4d to_ndc = std::get<Mat4d>(attributes.at("worldToNDC"));
    const CameraRays<double> rays(camera, 320, 180, Vec3d(0));
    for (const Vec2d pixel : {Vec2d(160, 90), Vec2d(0, 0), Vec2d(320, 0), Vec2d(17.5, 140.25)}) {
        const Ray<double> ray = rays.ray(pixel.x, pixel.y);
        const Vec4<double> point(ray.origin + ray.direction * 7.0, 1);
        const Vec4<double> ndc = to_ndc * point, seen = to_camera * point;
        CHECK(ndc.x / ndc.w * 320 == doctest::Approx(pixel.x).epsilon(1e-9));
        CHECK(ndc.y / ndc.w * 180 == doctest::Approx(pixel.y).epsilon(1e-9));
        CHECK(seen.z > 0);
        CHECK((seen.x > 0) == (pixel.x > 160));
        CHECK(std::sqrt(seen.x * seen.x + seen.y * seen.y + seen.z * seen.z) == doctest::Approx(7));
    }
}

TEST_CASE("EXR: other renderers' names") {
    const auto image_of = [](std::initializer_list<const char*> names) {
        ExrImage image{1, 1, {}, {}};
        float value = 0;
        for (const char* name : names) image.channels.push_back({name, ExrType::float32, {value += 1}});
        return image;
    };
    const PixelData<float> blender = frame_from_exr(
        image_of({"ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B",
                  "ViewLayer.Combined.A", "ViewLayer.Denoising Albedo.R", "ViewLayer.Denoising Albedo.G",
                  "ViewLayer.Denoising Albedo.B", "ViewLayer.Denoising Normal.X",
                  "ViewLayer.Denoising Normal.Y", "ViewLayer.Denoising Normal.Z", "ViewLayer.Noisy Image.R",
                  "ViewLayer.Noisy Image.G", "ViewLayer.Noisy Image.B", "ViewLayer.Depth.Z"}));
    CHECK(blender.radiance.load(0, 0) == Vec3f(11, 12, 13));
    CHECK(blender.albedo.load(0, 0) == Vec3f(5, 6, 7));
    CHECK(blender.normal.load(0, 0) == Vec3f(8, 9, 10));
    CHECK(blender.depth.load(0, 0) == 14);
    ExrImage of_pbrt =
        image_of({"R", "G", "B", "Albedo.R", "Albedo.G", "Albedo.B", "N.X", "N.Y", "N.Z", "Ns.X", "Ns.Y",
                  "Ns.Z", "P.X", "P.Y", "P.Z", "Variance.R", "Variance.G", "Variance.B",
                  "RelativeVariance.R", "RelativeVariance.G", "RelativeVariance.B"});
    CHECK(frame_from_exr(of_pbrt).variance.absent()); // of single samples, and nobody says how many
    of_pbrt.attributes["samplesPerPixel"] = 4;
    const PixelData<float> pbrt = frame_from_exr(of_pbrt);
    CHECK(pbrt.radiance.load(0, 0) == Vec3f(1, 2, 3));
    CHECK(pbrt.albedo.load(0, 0) == Vec3f(4, 5, 6));
    CHECK(pbrt.normal.load(0, 0) == Vec3f(10, 11, 12));
    CHECK(pbrt.variance.load(0, 0) == Vec3f(4, 4.25f, 4.5f));
    CHECK(pbrt.samples.load(0, 0) == 4);
    CHECK(pbrt.depth.absent());
    const PixelData<float> mitsuba =
        frame_from_exr(image_of({"R", "G", "B", "albedo.R", "albedo.G", "albedo.B", "sh_normal.X",
                                 "sh_normal.Y", "sh_normal.Z", "depth.T", "Y"}));
    CHECK(mitsuba.normal.load(0, 0) == Vec3f(7, 8, 9));
    CHECK(mitsuba.depth.load(0, 0) == 10);
    CHECK_THROWS_AS(frame_from_exr(image_of({"N.X", "N.Y", "N.Z"})), Error);
}

TEST_CASE("EXR: shared images and damaged files") {
    if (!std::filesystem::exists(exr_scenes + "exr_images")) return lambent_test::skip("EXR images: no folder");
    const ExrImage all = read_exr(exr_scenes + "exr_images/AllHalfValues.exr");
    CHECK(all.width == 256);
    CHECK(all.find("G")->type == ExrType::half);
    CHECK(std::count_if(all.find("G")->values.begin(), all.find("G")->values.end(),
                        [](float v) { return !is_finite(v); }) == 2048);
    CHECK(read_exr(exr_scenes + "exr_images/WideFloatRange.exr").find("G")->values.size() == 250000);
    CHECK(read_exr(exr_scenes + "exr_images/BrightRingsNanInf.exr").width == 800);
    CHECK(read_exr(exr_scenes + "exr_images/GammaChart.exr").height == 800);
    std::size_t files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(exr_scenes + "malformed/exr")) {
        const std::string path = entry.path().string();
        CAPTURE(path);
        ++files;
        try {
            read_exr(path);
            FAIL_CHECK("a damaged file was read");
        } catch (const Error& error) {
            CHECK(std::string(error.what()).starts_with(path));
        }
    }
    CHECK(files == 10);
    CHECK_THROWS_AS(read_exr(exr_scenes + "exr_images/GammaChart.exr", 639999), Error);
    CHECK_THROWS_AS(read_exr(exr_scenes + "README.md"), Error);
}

TEST_CASE("environments: EXR and HDR agree with their pictures; bad values become 0 and are counted") {
    const TemporaryFolder folder;
    ExrImage image{2, 1, {}, {}};
    for (const char* name : {"R", "G", "B"}) image.channels.push_back({name, ExrType::float32, {1, 2}});
    image.channels[1].values = {-1, std::numeric_limits<float>::quiet_NaN()};
    write_exr(folder.file("sky.exr"), image);
    std::vector<std::string> notes;
    const Environment sky = read_environment(folder.file("sky.exr"), &notes);
    CHECK(sky.width == 2);
    CHECK(sky.height == 1);
    CHECK(sky.scale == Vec3f(1));
    CHECK(sky.map[0] == Vec3f(1, 0, 1));
    CHECK(sky.map[1] == Vec3f(2, 0, 2));
    REQUIRE(notes.size() == 1);
    CHECK(notes[0].find("2 negative or non-finite") != std::string::npos);
    image.channels.pop_back();
    write_exr(folder.file("rg.exr"), image);
    CHECK_THROWS_AS(read_environment(folder.file("rg.exr")), Error);
    CHECK_THROWS_AS(read_environment(folder.write("sky.png", "\x89PNG\r\n\x1a\n")), Error);

    if (!std::filesystem::exists(exr_scenes + "environments"))
        return lambent_test::skip("environments: no folder");
    const Environment courtyard = read_environment(exr_scenes + "environments/courtyard.exr"); // DWAB
    const Environment smaller = read_environment(exr_scenes + "environments/courtyard_512_zip.exr");
    CHECK(courtyard.width == 1024);
    CHECK(smaller.width == 512);
    Vec3d a(0), b(0);
    for (const Vec3f& p : courtyard.map) a += Vec3d(p) / double(courtyard.map.size());
    for (const Vec3f& p : smaller.map) b += Vec3d(p) / double(smaller.map.size());
    CHECK(max_component(abs(a - b)) < 1e-2 * max_component(a));
    const Environment puresky = read_environment(exr_scenes + "environments/qwantani_afternoon_puresky_1k.hdr");
    CHECK(puresky.width == 1024);
    CHECK(puresky.height == 512);
    double above = 0, below = 0, sun = 0;
    for (std::size_t i = 0; i < puresky.map.size(); ++i) {
        (i < puresky.map.size() / 2 ? above : below) += double(luminance(puresky.map[i]));
        sun = std::max(sun, double(luminance(puresky.map[i])));
    }
    CHECK(above > below); // row 0 is up
    CHECK(sun > 1000);
}
