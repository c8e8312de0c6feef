#include <lambent/core/parallel.hpp>
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
/// it is added from rays of its own. The quick version, which runs with the suite, asks for less of fewer combinations;
/// tests/stress.sh runs all of them.
namespace {

enum class Effort : int { quick, full };

struct Case {
    const char* name;
    const char* environment;
    double full, quick; ///< tolerance of the image's mean; a third of it is the standard error that is aimed at
    /// Standard error of the reference's mean over the mean: from the other renderer's squared error at one sample a
    /// pixel (0.92, 1.9 and 28 of the squared mean) over the number of its samples, and what emitters that pixels see
    /// in part add to it.
    double reference_error;
    int quick_cells; ///< of light that is seen directly, a side; 1536 of the full version
};
constexpr Case cornell{"cornell", "", 0.003, 0.006, 1.5e-4, 512};
constexpr Case atrium{"atrium", "sky_sun.exr", 0.003, 0.006, 2e-4, 256};
constexpr Case many_lights{"many_lights", "", 0.006, 0.008, 9e-4, 1280};

/// Mean of the light that camera rays meet, one ray in each of cells x cells of the image; eight such images tell its
/// error.
Estimate seen_directly(const PreparedScene<float>& scene, ThreadExecutor& threads, int cells) {
    constexpr int images = 8;
    const CameraRays<float> rays(scene.scene().cameras.at(0), cells, cells, scene.scene().origin);
    std::vector<Vec3d> rows(std::size_t(images * cells));
    threads.parallel_for(rows.size(), 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t row = begin; row < end; ++row) {
            Random random(row);
            for (int x = 0; x < cells; ++x) {
                const auto y = float(row % std::size_t(cells));
                const auto ray = rays.ray(float(x) + random.uniform_float(), y + random.uniform_float());
                const Hit<float> hit = scene.intersect(ray);
                rows[row] += Vec3d(hit ? scene.surface(ray, hit).emission : scene.background(ray.direction));
            }
        }
    });
    std::array<Moments, 4> moments;
    for (std::size_t i = 0; i < images; ++i) {
        Vec3d sum(0);
        for (std::size_t y = 0; y < std::size_t(cells); ++y)
            sum += rows[i * std::size_t(cells) + y] / (double(cells) * cells);
        for (int c = 0; c < 3; ++c) moments[std::size_t(c)].add(sum[c]);
        moments[3].add((sum.x + sum.y + sum.z) / 3);
    }
    return estimate_of(moments);
}

Estimate added(const Estimate& a, const Estimate& b) {
    Estimate e = a;
    e.mean += b.mean;
    e.grey += b.grey;
    for (int c = 0; c < 3; ++c) e.error[c] = std::hypot(a.error[c], b.error[c]);
    e.grey_error = std::hypot(a.grey_error, b.grey_error);
    return e;
}

void check_means(const Case& c, Effort effort) {
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
    const bool full = effort == Effort::full;
    const double tolerance = full ? c.full : c.quick;
    const Estimate direct = seen_directly(prepared, threads, full ? 1536 : c.quick_cells);
    MESSAGE("seen directly: " << direct.grey << " +- " << direct.grey_error << " of " << grey);
    // What the light that is seen directly leaves of the standard error, over the mean of the rest.
    const double left = std::sqrt(std::pow(tolerance / 3 * grey, 2) - std::pow(direct.grey_error, 2));
    const double precision = 0.9 * left / (grey - direct.grey);
    for (const SamplerName sampler : all_samplers)
        for (const int spp : {1, 4, 16, 64}) {
            if (!full && (sampler == SamplerName::sobol ? spp == 64 : spp != 4)) continue;
            const Way way{.sampler = sampler, .reflected_only = true};
            const int side = spp == 64 ? 8 : spp == 16 || !full ? 16 : 32;
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
            CHECK(e.relative_error() <= tolerance / 3);
            CHECK(std::abs(e.grey / grey - 1) < tolerance);
            CHECK(std::abs(e.grey - grey) < max_z * std::hypot(e.grey_error, c.reference_error * grey));
            for (int k = 0; k < 3; ++k)
                CHECK(std::abs(e.mean[k] - reference[k]) <
                      max_z * std::hypot(e.error[k], c.reference_error * reference[k]));
        }
}

} // namespace

TEST_CASE("reference/cornell: means at 1, 4 and 16 samples by Sobol, at 4 by the others within 0.6 %") {
    check_means(cornell, Effort::quick);
}
TEST_CASE("reference/atrium: means at 1, 4 and 16 samples by Sobol, at 4 by the others within 0.6 %") {
    check_means(atrium, Effort::quick);
}
TEST_CASE("reference/many_lights: means at 1, 4 and 16 samples by Sobol, at 4 by the others within 0.8 %") {
    check_means(many_lights, Effort::quick);
}

TEST_CASE("stress: means at 1, 4, 16 and 64 samples by every sampler within 0.3 %, many_lights 0.6 %" *
          doctest::skip()) {
    for (const Case& c : {cornell, atrium, many_lights}) check_means(c, Effort::full);
}
