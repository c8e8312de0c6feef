#include <render/seeds.hpp>
#include <doctest/doctest.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

using namespace lambent_test;

/// What multiple importance sampling is for: glossy plates under lights of different size (Veach's test, in a scene of
/// our own), and images without outliers.
namespace {

constexpr std::array<double, 4> plate_alphas{0.004, 0.02, 0.08, 0.25};

/// Metal plates, one behind the other and each turned so that the camera sees the lights in it; four spheres of the
/// same power above, from a speck to one as large as a plate is deep. Each camera sees a plate alone.
struct Plates {
    Scene<float> scene;
    std::array<Camera, 4> cameras;

    Plates() {
        const Vec3d eye(0, 2, 9), lights(0, 4, -4);
        for (std::size_t i = 0; i < plate_alphas.size(); ++i) {
            const auto material = add_material(scene, Vec3f(0.8f));
            scene.materials[material].metallic = 1;
            scene.materials[material].roughness = float(std::sqrt(plate_alphas[i]));
            const Vec3d center(0, 1.2 - 0.5 * double(i), -1.5 + 1.4 * double(i));
            const Vec3d normal = normalize(normalize(eye - center) + normalize(lights - center));
            const Vec3d right(1, 0, 0), back = cross(normal, right);
            const double width = 4, depth = 0.5;
            lambent::detail::add_quad(scene,
                                      {center - width * right - depth * back, center + width * right - depth * back,
                                       center + width * right + depth * back, center - width * right + depth * back},
                                      material);
            cameras[i] = {eye, center, {0, 1, 0}, 3, "plate"};
        }
        const std::array<double, 4> radii{0.03, 0.1, 0.3, 0.9};
        for (std::size_t i = 0; i < radii.size(); ++i) {
            const double r = radii[i];
            scene.spheres.push_back({Vec3f(lights + Vec3d(-3.75 + 2.5 * double(i), 0, 0)), float(r),
                                     add_material(scene, Vec3f(0), Vec3f(float(1 / (r * r))))});
        }
    }
};

/// Variance of one sample's share in the image's mean, by groups of samples that know nothing of each other.
std::vector<double> variances(const PreparedScene<float>& scene, const Camera& camera, ImageSize size,
                              PathStrategy strategy, std::size_t groups, int samples) {
    std::vector<double> found(groups);
    ThreadExecutor threads;
    threads.parallel_for(groups, 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t g = begin; g < end; ++g) {
            const auto sampler_of = [&](std::uint32_t seed) {
                return IndependentSampler<float>(seed + std::uint32_t(g) * std::uint32_t(samples));
            };
            const auto noise = [&](const auto& integrator) {
                return image_mean(scene, camera, size, integrator, 1, samples, sampler_of).grey_error;
            };
            const double error = strategy == PathStrategy::both    ? noise(PathIntegrator<>{})
                                 : strategy == PathStrategy::light ? noise(PathIntegrator<PathStrategy::light>{})
                                                                   : noise(PathIntegrator<PathStrategy::bsdf>{});
            found[g] = error * error * samples;
        }
    });
    return found;
}

Moments moments_of(const std::vector<double>& values) {
    Moments m;
    for (const double v : values) m.add(v);
    return m;
}

/// Pixels whose reflected light, after `spp` samples, is above 25 times the mean of the 48 around them.
int outliers(const PreparedScene<float>& scene, const Way& way, int size, int spp, std::uint32_t seed) {
    const CameraRays<float> rays(scene.scene().cameras[0], size, size, scene.scene().origin);
    std::vector<double> image(std::size_t(size * size));
    const auto fill = [&](const auto& integrator, const auto& sampler) {
        ThreadExecutor threads;
        threads.parallel_for(std::size_t(size), 1, [&](std::size_t y, std::size_t) {
            RayCounts counts;
            for (int x = 0; x < size; ++x)
                for (int i = 0; i < spp; ++i) {
                    const auto stream = sampler.at(std::uint32_t(x), std::uint32_t(y), std::uint32_t(i));
                    const Vec2f at = Vec2f(float(x), float(y)) + stream.get_2d(dimensions::pixel);
                    const auto s = integrator.sample(scene, rays.ray(at.x, at.y), stream, counts);
                    const Vec3d reflected(s.radiance - s.emission);
                    image[y * std::size_t(size) + std::size_t(x)] += (reflected.x + reflected.y + reflected.z) / spp;
                }
        });
    };
    const auto by = [&](const auto& sampler) {
        if (way.strategy == PathStrategy::both)
            fill(PathIntegrator<>{}, sampler);
        else if (way.strategy == PathStrategy::light)
            fill(PathIntegrator<PathStrategy::light>{}, sampler);
        else
            fill(PathIntegrator<PathStrategy::bsdf>{}, sampler);
    };
    if (way.sampler == SamplerName::sobol)
        by(SobolSampler<float>(seed));
    else if (way.sampler == SamplerName::stratified)
        by(StratifiedSampler<float>(seed, std::uint32_t(spp)));
    else
        by(IndependentSampler<float>(seed));

    int found = 0;
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
            double around = 0;
            int pixels = 0;
            for (int v = std::max(0, y - 3); v <= std::min(size - 1, y + 3); ++v)
                for (int u = std::max(0, x - 3); u <= std::min(size - 1, x + 3); ++u) {
                    if (u == x && v == y) continue;
                    around += image[std::size_t(v * size + u)];
                    ++pixels;
                }
            found += image[std::size_t(y * size + x)] > 25 * around / pixels;
        }
    return found;
}

} // namespace

TEST_CASE("Veach's plates: every strategy sees the same light on every plate, by every sampler") {
    SerialExecutor serial;
    const Plates plates;
    const PreparedScene<float> prepared(plates.scene, serial);
    for (std::size_t i = 0; i < plate_alphas.size(); ++i)
        for (const SamplerName sampler : all_samplers) {
            std::array<Estimate, 3> seen;
            for (std::size_t k = 0; k < 3; ++k)
                seen[k] = mean_over_seeds(prepared, plates.cameras[i], {48, 8}, {sampler, all_strategies[k]}, 8, 0, 24);
            CAPTURE(plate_alphas[i]);
            CAPTURE(Way{sampler}.name());
            INFO("both " << seen[0].grey << " +- " << seen[0].grey_error << ", light " << seen[1].grey << " +- "
                         << seen[1].grey_error << ", bsdf " << seen[2].grey << " +- " << seen[2].grey_error);
            for (std::size_t k = 0; k < 3; ++k) {
                CHECK(seen[k].finite);
                CHECK(std::abs(seen[k].z(seen[(k + 1) % 3])) < max_z);
            }
            // Both strategies together tell the mean to a percent and a half, the better one alone to three.
            CHECK(seen[0].relative_error() < 0.015);
            CHECK(std::min(seen[1].relative_error(), seen[2].relative_error()) < 0.03);
        }
}

TEST_CASE("Veach's plates: variance with both strategies at most 1.1 of the better one's, on every plate") {
    SerialExecutor serial;
    const Plates plates;
    const PreparedScene<float> prepared(plates.scene, serial);
    for (std::size_t i = 0; i < plate_alphas.size(); ++i) {
        const auto of = [&](PathStrategy strategy) {
            return variances(prepared, plates.cameras[i], {24, 4}, strategy, 24, 64);
        };
        const std::vector<double> both = of(PathStrategy::both), light = of(PathStrategy::light),
                                  bsdf = of(PathStrategy::bsdf);
        const double mean_light = moments_of(light).mean(), mean_bsdf = moments_of(bsdf).mean();
        const std::vector<double>& better = mean_light < mean_bsdf ? light : bsdf;
        Moments excess; // negative where the bar is kept
        for (std::size_t g = 0; g < both.size(); ++g) excess.add(both[g] - 1.1 * better[g]);
        const double ratio = moments_of(both).mean() / moments_of(better).mean();
        CAPTURE(plate_alphas[i]);
        MESSAGE("alpha " << plate_alphas[i] << ": variance over the better one's " << ratio << ", light's over bsdf's "
                         << mean_light / mean_bsdf << ", below the bar by z = " << -excess.z(0));
        CHECK(excess.z(0) < -3); // it holds with 99.9 %
    }
}

TEST_CASE("builtin:room at 20 samples: no pixel stands out 25 times, and light samples alone make none fewer") {
    SerialExecutor serial;
    const Scene<float> scene = room_scene<float>();
    const PreparedScene<float> prepared(scene, serial);
    constexpr int size = 64, spp = 20;
    int by_chance = 0, by_light = 0;
    std::uint32_t seed = 0;
    for (const SamplerName sampler : all_samplers) {
        const int both = outliers(prepared, {sampler, PathStrategy::both}, size, spp, seed);
        const int light = outliers(prepared, {sampler, PathStrategy::light}, size, spp, seed);
        CAPTURE(Way{sampler}.name());
        CHECK(both == 0);
        CHECK(both <= light);
        by_light += light;
        by_chance += outliers(prepared, {sampler, PathStrategy::bsdf}, size, spp, seed++);
    }
    CHECK(by_chance > 0); // the measure finds them where they are
    MESSAGE("outliers in three images: light samples alone " << by_light << ", chance alone " << by_chance);
}
