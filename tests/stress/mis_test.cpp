// Weights of pdfs of all sizes, and paths whose throughput is not a number.
#include "render/transport.hpp"
#include "stress/table.hpp"
#include "support/random.hpp"
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <doctest/doctest.h>
#include <lambent/core/parallel.hpp>
#include <lambent/render/render.hpp>
#include <lambent/sampling/independent.hpp>
#include <lambent/sampling/mis.hpp>
#include <limits>

using namespace lambent;
using namespace lambent_test;

namespace {

float naive_power(float a, float b) { return a * a / (a * a + b * b); }

/// A scene of which all surfaces reflect nonsense but those that are seen from the eye.
struct NonsenseScene : PreparedScene<float> {
    using PreparedScene<float>::PreparedScene;
    Vec3f eye{0.4f, 0.6f, 0.3f};
    float nonsense = std::numeric_limits<float>::quiet_NaN();
    Surface<float> surface(const Ray<float>& ray, const Hit<float>& hit) const {
        Surface<float> s = PreparedScene<float>::surface(ray, hit);
        if (ray.origin != eye) s.point.base_color = s.albedo = Vec3f(0.5f, nonsense, 0.5f);
        return s;
    }
};

} // namespace

TEST_CASE("mis: pdfs of 1e-38 to 1e38, 0 and infinity -> finite weights that sum to 1") {
    Random random(3);
    constexpr float infinite = std::numeric_limits<float>::infinity(), ulp = std::numeric_limits<float>::epsilon();
    const std::uint64_t pairs = inputs(1e6, 1e8);
    std::size_t bad = 0, naive_bad = 0;
    double worst = 0;
    const auto draw = [&] {
        const std::uint32_t kind = random.below(16);
        return kind == 0 ? 0.0f : kind == 1 ? infinite : float(std::exp2(random.uniform(-126, 128)));
    };
    for (std::uint64_t i = 0; i < pairs; ++i) {
        const float a = draw(), b = i % 4 != 0 ? draw() : std::min(a, 1e37f) * float(random.uniform(0.1, 10));
        const auto sound = [&](float wa, float wb, double& error) {
            if (!is_finite(wa) || !is_finite(wb) || wa < 0 || wb < 0) return false;
            if (a == 0 && b == 0) return wa == 0 && wb == 0;
            error = std::max(error, std::abs(double(wa) + double(wb) - 1));
            return true;
        };
        bad += std::size_t(!sound(power_heuristic(a, b), power_heuristic(b, a), worst));
        bad += std::size_t(!sound(balance_heuristic(a, b), balance_heuristic(b, a), worst));
        double ignored = 0;
        naive_bad += std::size_t(!sound(naive_power(a, b), naive_power(b, a), ignored) || ignored > 2 * double(ulp));
    }
    record({"mis", "pairs of pdfs -> |sum of weights - 1|, finite; naive: a^2 / (a^2 + b^2), share wrong",
            double(pairs), double(bad), worst, 2 * double(ulp), double(naive_bad) / double(pairs)});
}

TEST_CASE("roulette: a throughput that is not a number -> the path ends and is counted") {
    Scene<float> scene;
    add_room(scene, 1, add_material(scene, Vec3f(0.5f), Vec3f(1)));
    SerialExecutor serial;
    NonsenseScene broken(scene, serial);
    const Camera camera{Vec3d(broken.eye), {0.5, 0.5, 1}, {0, 1, 0}, 90, ""};
    const std::uint64_t samples = inputs(64, 4096);
    double paths = 0, rays = 0;
    std::uint64_t lost = 0;
    for (const float nonsense : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        broken.nonsense = nonsense;
        Film<float> film;
        const RenderOptions options{.width = 8, .height = 8, .end_sample = samples, .planes = FilmPlanes::features};
        const RenderResult result = render(film, broken, camera, PathIntegrator<>{}, IndependentSampler<float>(1),
                                           options, serial, [] { return true; });
        paths += double(64 * samples);
        rays += double(result.rays.closest);
        lost += 64 * samples - film.rejected();
        const PixelData<float> frame = film.resolve();
        for (const float v : frame.radiance.values()) lost += std::uint64_t(!is_finite(v));
    }
    // Roulette as in many programs: ends where u is above the largest of the throughput, which no NaN is.
    const auto naive_bounces = [&] {
        Random random(1);
        Vec3f throughput(0.5f, std::numeric_limits<float>::quiet_NaN(), 0.5f);
        int bounces = 0;
        for (; bounces < 1000; ++bounces) {
            const float q = std::max(throughput.y, std::max(throughput.x, throughput.z));
            if (q < 1 && random.uniform_float() >= q) break;
            throughput /= q;
        }
        return bounces;
    };
    record({"roulette", "throughput NaN or infinite -> rays a path, each rejected; naive: bounces of one (of 1000)",
            paths, double(lost), rays / paths, 2, double(naive_bounces())});
}

TEST_CASE("roulette: furnace of albedo 0.99 at unlimited depth -> relative error of its light") {
    // A closed sphere of albedo a that emits 1 is 1 / (1 - a) bright.
    constexpr double albedo = 0.99;
    Scene<float> scene;
    const auto wall = add_material(scene, Vec3f(float(albedo)), Vec3f(1));
    scene.materials[wall].double_sided = true;
    scene.spheres.push_back({{10, -3, 5}, 2, wall});
    ThreadExecutor threads;
    const PreparedScene<float> prepared(scene, threads);
    const Camera camera{{10.3, -3.2, 5.1}, {10, -3, 0}, {0, 1, 0}, 90, ""};
    const std::uint64_t paths = inputs(1e5, 2e7);
    Film<float> film;
    const RenderOptions options{
        .width = 16, .height = 16, .end_sample = paths / 256, .planes = FilmPlanes::radiance, .tile = 4};
    render(film, prepared, camera, PathIntegrator<PathStrategy::bsdf>{}, IndependentSampler<float>(5), options, threads,
           [] { return true; });
    double mean = 0, naive = 0;
    const PixelData<float> frame = film.resolve();
    for (const float v : frame.radiance.values()) mean += double(v) / double(frame.radiance.values().size());
    Random random(4); // survives by its throughput, and forgets to divide by the chance of that
    for (int i = 0; i < 20000; ++i) {
        double throughput = 1;
        for (naive += 1.0 / 20000; random.uniform() < throughput; naive += throughput / 20000) throughput *= albedo;
    }
    // A path's light has a relative deviation of 1: half its share in the quick size.
    const double bound = stress_in_full() ? 0.001 : 0.015, worst = std::abs(mean * (1 - albedo) - 1);
    record({"roulette", "paths in a furnace of albedo 0.99 -> relative error; naive: survivors not scaled up",
            double(paths), double(!(worst <= bound)), worst, bound, std::abs(naive * (1 - albedo) - 1)});
}
