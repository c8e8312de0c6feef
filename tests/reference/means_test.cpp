#include <lambent/io/environment.hpp>
#include <lambent/io/exr.hpp>
#include <lambent/io/scene_file.hpp>
#include <render/seeds.hpp>
#include <support/random.hpp>
#include <support/skip.hpp>
#include <doctest/doctest.h>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <vector>

using namespace lambent_test;

/// At any number of samples a pixel and by every sampler, images have the mean of another renderer's converged image.
/// An image's mean does not depend on its size, so small images of many seeds serve, which tell their own standard
/// error. Light that is seen directly, most of the noise where it comes from specks, is the same in every one of them:
/// it is added from rays of its own.
namespace {

struct Case {
    const char* name;
    const char* environment;
    double tolerance; ///< of the image's mean; a third of it is the standard error that is aimed at
    /// Standard error of the reference's mean over the mean: from the other renderer's squared error at one sample a
    /// pixel (0.92, 1.9 and 28 of the squared mean) over the number of its samples, and what emitters that pixels see
    /// in part add to it.
    double reference_error;
};
constexpr Case cornell{"cornell", "", 0.003, 1.5e-4};
constexpr Case atrium{"atrium", "sky_sun.exr", 0.003, 2e-4};
constexpr Case many_lights{"many_lights", "", 0.006, 9e-4};

/// Mean of the light that camera rays meet, one ray in each of 1536 x 1536 cells of the image; eight such images tell
/// its error.
Estimate seen_directly(const PreparedScene<float>& scene, ThreadExecutor& threads) {
    constexpr int cells = 1536, images = 8;
    const CameraRays<float> rays(scene.scene().cameras.at(0), cells, cells, scene.scene().origin);
    std::vector<Vec3d> rows(images * cells);
    threads.parallel_for(rows.size(), 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t row = begin; row < end; ++row) {
            Random random(row);
            for (int x = 0; x < cells; ++x) {
                const auto y = float(row % cells);
                const auto ray = rays.ray(float(x) + random.uniform_float(), y + random.uniform_float());
                const Hit<float> hit = scene.intersect(ray);
                rows[row] += Vec3d(hit ? scene.surface(ray, hit).emission : scene.background(ray.direction));
            }
        }
    });
    std::array<Moments, 4> moments;
    for (std::size_t i = 0; i < images; ++i) {
        Vec3d sum(0);
        for (std::size_t y = 0; y < cells; ++y) sum += rows[i * cells + y] / (double(cells) * cells);
        for (int c = 0; c < 3; ++c) moments[std::size_t(c)].add(sum[c]);
        moments[3].add((sum.x + sum.y + sum.z) / 3);
    }
    Estimate e;
    for (int c = 0; c < 3; ++c) {
        e.mean[c] = moments[std::size_t(c)].mean();
        e.error[c] = moments[std::size_t(c)].standard_error();
    }
    e.grey = moments[3].mean();
    e.grey_error = moments[3].standard_error();
    return e;
}

Estimate added(const Estimate& a, const Estimate& b) {
    Estimate e = a;
    e.mean += b.mean;
    e.grey += b.grey;
    for (int c = 0; c < 3; ++c) e.error[c] = std::hypot(a.error[c], b.error[c]);
    e.grey_error = std::hypot(a.grey_error, b.grey_error);
    return e;
}

void check_all_means(const Case& c) {
    const std::string folder = LAMBENT_SHARED_DIR "/reference/";
    if (!std::filesystem::exists(folder + c.name + ".glb")) {
        skip(std::string("means of reference scenes: no ") + c.name + ".glb");
        return;
    }
    Scene<float> scene = load_scene(folder + c.name + ".glb");
    if (*c.environment != 0) scene.environment = read_environment(folder + c.environment);
    const ExrImage exr = read_exr(folder + c.name + "_128.exr");
    Vec3d reference(0);
    const char* const channels[] = {"R", "G", "B"};
    for (int k = 0; k < 3; ++k)
        for (const float value : exr.find(channels[k])->values)
            reference[k] += double(value) / (double(exr.width) * double(exr.height));
    const double grey = (reference.x + reference.y + reference.z) / 3;

    ThreadExecutor threads;
    const PreparedScene<float> prepared(scene, threads);
    const Estimate direct = seen_directly(prepared, threads);
    MESSAGE("seen directly: " << direct.grey << " +- " << direct.grey_error << " of " << grey);
    for (const SamplerName sampler : all_samplers)
        for (const int spp : {1, 4, 16, 64}) {
            const Way way{.sampler = sampler, .reflected_only = true};
            const int side = spp == 64 ? 8 : spp == 16 ? 16 : 32;
            const double precision = 0.9 * c.tolerance / 3 * grey / (grey - direct.grey);
            const Estimate reflected =
                mean_to_precision(prepared, scene.cameras.at(0), {side, side}, way, spp, precision, 16384);
            const Estimate e = added(reflected, direct);
            CAPTURE(std::string(c.name));
            CAPTURE(way.name());
            CAPTURE(spp);
            MESSAGE(std::string(c.name) << ", " << way.name() << ", " << spp << " samples: off by "
                                        << 100 * (e.grey / grey - 1) << " %, standard error "
                                        << 100 * e.relative_error() << " %, z "
                                        << (e.grey - grey) / std::hypot(e.grey_error, c.reference_error * grey)
                                        << ", rays " << e.rays);
            CHECK(e.finite);
            CHECK(e.relative_error() <= c.tolerance / 3);
            CHECK(std::abs(e.grey / grey - 1) < c.tolerance);
            CHECK(std::abs(e.grey - grey) < max_z * std::hypot(e.grey_error, c.reference_error * grey));
            for (int k = 0; k < 3; ++k)
                CHECK(std::abs(e.mean[k] - reference[k]) <
                      max_z * std::hypot(e.error[k], c.reference_error * reference[k]));
        }
}

} // namespace

TEST_CASE("reference/cornell: means at 1, 4, 16 and 64 samples by every sampler within 0.3 %") {
    check_all_means(cornell);
}
TEST_CASE("reference/atrium: means at 1, 4, 16 and 64 samples by every sampler within 0.3 %") {
    check_all_means(atrium);
}
TEST_CASE("reference/many_lights: means at 1, 4, 16 and 64 samples by every sampler within 0.6 %") {
    check_all_means(many_lights);
}
