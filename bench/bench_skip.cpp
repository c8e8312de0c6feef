// What is left out for a scene that doesn't need it, and what that saves: each row has the same image by code that
// leaves it out and by code that does not, in turns, on one pinned thread, CPU time, medians.
#include "../examples/support/command_line.hpp"
#include "bvh/affinity.hpp"
#include "error_curve.hpp"
#include "instructions.hpp"
#include "output.hpp"
#include "timing.hpp"
#include <algorithm>
#include <cstdio>
#include <cmath>
#include <lambent/core/parallel.hpp>
#include <lambent/film/metrics.hpp>
#include <lambent/render/adaptive.hpp>
#include <lambent/render/path.hpp>
#include <lambent/render/render.hpp>
#include <lambent/sampling/sobol.hpp>
#include <lambent/scene/builtin.hpp>
#include <lambent/scene/specialised_scene.hpp>

namespace {

using namespace lambent;

struct Options {
    int rounds = 7, side = 128;
    std::uint64_t spp = 32, reference_spp = 2048;
    bool json = false, instructions = false;
};

/// A scene like ours that leaves nothing out. Which question it answers the long way is `Feature`.
enum class Feature { bsdf, alpha, camera, light_sampling };
template <Feature feature>
struct Everything {
    using Scalar = float;
    const PreparedScene<float>& scene;

    Hit<float> intersect(const Ray<float>& ray) const {
        if constexpr (feature == Feature::alpha) return scene.bvh().intersect(ray, alpha(ray));
        else return scene.intersect(ray);
    }
    Hit<float> intersect_camera(const Ray<float>& ray) const {
        if constexpr (feature == Feature::alpha) return intersect(ray);
        else if constexpr (feature == Feature::camera)
            return scene.bvh().intersect(ray, [&](std::uint32_t triangle, float, float, float) {
                return !material(triangle).front_only || dot(normal(triangle), ray.direction) < 0;
            });
        else return scene.intersect_camera(ray);
    }
    bool occluded(const Ray<float>& ray) const {
        if constexpr (feature == Feature::alpha) return scene.bvh().occluded(ray, alpha(ray));
        else return scene.occluded(ray);
    }
    template <class F>
    void with_bsdf(const Surface<float>& surface, F&& f) const {
        if (is_black(surface.albedo)) return;
        if constexpr (feature == Feature::bsdf) f(StandardBsdf<float>(surface.point));
        else if (surface.point.diffuse()) f(Lambert<float>{surface.albedo});
        else f(StandardBsdf<float>(surface.point));
    }
    Surface<float> surface(const Ray<float>& ray, const Hit<float>& hit) const { return scene.surface(ray, hit); }
    Vec3f background(const Vec3f& d) const { return scene.background(d); }
    bool has_lights(Companion c) const { return feature == Feature::light_sampling || scene.has_lights(c); }
    LightSample<float> sample_light(const Vec3f& p, const Vec3f& n, const Vec2f& u, Companion c) const {
        return scene.sample_light(p, n, u, c);
    }
    float hit_light_pdf(const Ray<float>& r, const Hit<float>& h, const Vec3f& n) const {
        return scene.hit_light_pdf(r, h, n);
    }
    float background_pdf(const Vec3f& d) const { return scene.background_pdf(d); }

private:
    const Material& material(std::uint32_t triangle) const {
        return scene.scene().materials[scene.scene().triangle_materials[triangle]];
    }
    Vec3f normal(std::uint32_t triangle) const {
        const UVec3 t = scene.scene().triangles[triangle];
        const auto& p = scene.scene().positions;
        return cross(p[t[1]] - p[t[0]], p[t[2]] - p[t[0]]);
    }
    auto alpha(const Ray<float>&) const {
        return [this](std::uint32_t triangle, float u, float v, float) {
            const Material& m = material(triangle);
            return m.alpha_mode == AlphaMode::opaque ||
                   coverage_at(scene.scene(), m, attributes_at(scene.scene(), triangle, u, v)) > 0;
        };
    }
};

/// Nothing but what a plain scene of flat triangles needs, written for it: what specialisations are held against.
struct HandCut {
    using Scalar = float;
    const PreparedScene<float>& scene;

    Hit<float> intersect(const Ray<float>& ray) const { return scene.bvh().intersect(ray); }
    bool occluded(const Ray<float>& ray) const { return scene.bvh().occluded(ray); }
    bool sees_only_background(const Pyramid<float>& view) const { return scene.sees_only_background(view); }
    Surface<float> surface(const Ray<float>& ray, const Hit<float>& hit) const {
        const Scene<float>& data = scene.scene();
        const UVec3 t = data.triangles[hit.primitive];
        const auto a = to_lanes(data.positions[t[0]]), b = to_lanes(data.positions[t[1]]), c = to_lanes(data.positions[t[2]]);
        const auto p0 = a * Lanes3<float>(1 - hit.u - hit.v), p1 = b * Lanes3<float>(hit.u), p2 = c * Lanes3<float>(hit.v);
        const auto n = robust_cross(b - a, c - a);
        Surface<float> s;
        s.material = data.triangle_materials[hit.primitive];
        const Material& material = data.materials[s.material];
        s.wo = -ray.direction;
        s.distance = hit.t;
        s.position = to_vec(p0 + p1 + p2);
        s.position_error = to_vec(triangle_error(p0, p1, p2, triangle_extent(b - a, c - a)));
        s.geometric_normal = to_vec(n / Lanes3<float>(std::sqrt(dot(n, n))));
        s.front = dot(s.geometric_normal, s.wo) >= 0;
        if (!s.front) s.geometric_normal = -s.geometric_normal;
        s.shading_normal = s.geometric_normal;
        s.albedo = clamp(material.base_color, 0.0f, 1.0f);
        if (s.front) s.emission = material.emission;
        return s;
    }
    template <class F>
    void with_bsdf(const Surface<float>& surface, F&& f) const {
        if (!is_black(surface.albedo)) f(Lambert<float>{surface.albedo});
    }
    Vec3f background(const Vec3f& d) const { return scene.background(d); }
    bool has_lights(Companion c) const { return scene.has_lights(c); }
    LightSample<float> sample_light(const Vec3f& p, const Vec3f& n, const Vec2f& u, Companion c) const {
        return scene.sample_light<no_feature>(p, n, u, c);
    }
    float hit_light_pdf(const Ray<float>& r, const Hit<float>& h, const Vec3f& n) const {
        return scene.hit_light_pdf(r, h, n);
    }
    float background_pdf(const Vec3f& d) const { return scene.background_pdf(d); }
};

/// A path tracer that does not say what it makes of a miss, so that every sample is traced.
struct EverySample {
    PathIntegrator<> path{};
    template <class S, class Stream>
    PixelSample<float> sample(const S& scene, const Ray<float>& ray, const Stream& stream, RayCounts& counts) const {
        return path.sample(scene, ray, stream, counts);
    }
};

struct Subject {
    std::string name;
    Scene<float> scene;
};

/// Without what a scene has beside opaque triangles of one colour each.
Subject plain(Subject s) {
    for (Material& m : s.scene.materials) m.base_color_texture = {};
    s.scene.images.clear();
    s.scene.normals.clear();
    s.name += " plain";
    return s;
}

/// No light but one of one colour from everywhere: bounces find it as well as light samples would.
Subject under_sky(Subject s) {
    for (Material& m : s.scene.materials) m.emission = Vec3f(0);
    s.scene.punctual_lights.clear();
    s.scene.environment.scale = Vec3f(1);
    s.name += " under a sky";
    return s;
}

class Bench {
public:
    explicit Bench(const Options& o) : o_(o) {}

    /// Everything for one scene. Returns whether all images were equal.
    bool measure(const Subject& s) {
        const Pinned pinned(sched_getcpu());
        const PreparedScene<float> scene(s.scene, serial_);
        const Camera& camera = s.scene.cameras[0];
        const auto trace_by = [&](const auto& integrator, const auto& what, FilmPlanes planes) {
            return render(what, camera, integrator, SobolSampler<float>(1),
                          {.width = o_.side, .height = o_.side, .end_sample = o_.spp, .planes = planes}, serial_);
        };
        const auto trace = [&](const auto& what, FilmPlanes planes) {
            return trace_by(PathIntegrator<>{}, what, planes);
        };
        constexpr auto few = FilmPlanes::radiance;
        const auto plain = [&] { return trace(scene, few); };
        bool all = true;
        if (s.scene.spheres.empty()) { // Everything asks the tree alone
            all &= compare(s.name, "alpha", plain, [&] { return trace(Everything<Feature::alpha>{scene}, few); });
            all &=
                compare(s.name, "front sides", plain, [&] { return trace(Everything<Feature::camera>{scene}, few); });
        }
        all &= compare(
            s.name, "standard material", plain, [&] { return trace(Everything<Feature::bsdf>{scene}, few); }, 0.02);
        all &= compare(s.name, "background", plain, [&] { return trace_by(EverySample{}, scene, few); });
        if (plain_features.hold(features_of(s.scene))) {
            const SpecialisedScene<float, plain_features> special(scene);
            constexpr double rounding = 1e-6; // of the same formulas in packs
            all &= compare(s.name, "general code", [&] { return trace(special, few); }, plain, rounding);
            if (s.scene.normals.empty()) // cut by hand, but path by path
                all &= compare(s.name, "all but by hand", [&] { return trace(HandCut{scene}, few); },
                               [&] { return trace(special, few); }, rounding);
        }
        all &= compare(s.name, "features", plain, [&] { return trace(scene, FilmPlanes::features); });
        all &= compare(s.name, "statistics", [&] { return trace(scene, FilmPlanes::features); },
                       [&] { return trace(scene, FilmPlanes::statistics); });
        if (!scene.has_lights(Companion::bsdf))
            all &= compare(s.name, "light sampling", plain,
                           [&] { return trace(Everything<Feature::light_sampling>{scene}, few); });
        return all;
    }

    /// Time to one error, by samples where it is noisy and by as many everywhere: the latter's is scaled along the line
    /// between two numbers of samples that hold the error between them.
    bool measure_adaptive(const Subject& s, double target) {
        const PreparedScene<float> scene(s.scene, serial_);
        const Camera& camera = s.scene.cameras[0];
        constexpr auto planes = FilmPlanes::halves;
        const auto uniform = [&](std::uint64_t spp, std::uint32_t seed) {
            return render(scene, camera, PathIntegrator<>{}, SobolSampler<float>(seed),
                          {.width = o_.side, .height = o_.side, .end_sample = spp, .planes = planes}, serial_);
        };
        const PixelData<float> truth = reference(scene, camera);
        const Pinned pinned(sched_getcpu());
        const auto mask = emitter_mask(truth.emission.view());
        const auto error = [&](const PixelData<float>& f) {
            return rel_mse(f.radiance.view(), truth.radiance.view(), mask.view());
        };
        std::vector<double> with, without, hits;
        for (int round = 0; round < std::max(3, o_.rounds / 2); ++round) {
            const auto seed = std::uint32_t(round) + 1;
            double start = cpu_seconds();
            const PixelData<float> frame = adaptive(scene, camera, target, seed);
            with.push_back(cpu_seconds() - start);
            const double reached = error(frame);
            hits.push_back(reached / (target * target));
            std::vector<Point> points;
            for (std::uint64_t spp = 8; points.empty() || points.back().rel_mse > reached; spp *= 2) {
                start = cpu_seconds();
                const PixelData<float> all = uniform(spp, seed);
                points.push_back({spp, cpu_seconds() - start, error(all)});
            }
            without.push_back(seconds_to(reached, points));
        }
        const double hit = median(hits);
        std::fprintf(stderr, "%s: rel_mse over target squared %.3f\n", s.name.c_str(), hit);
        print(s.name, "adaptive", median(with), median(without), hit >= 0.7 && hit <= 1.2);
        return hit >= 0.7 && hit <= 1.2;
    }

private:
    /// On all threads: it isn't timed.
    PixelData<float> reference(const PreparedScene<float>& scene, const Camera& camera) {
        ThreadExecutor threads;
        return render(scene, camera, PathIntegrator<>{}, SobolSampler<float>(1000),
                      {.width = o_.side, .height = o_.side, .end_sample = o_.reference_spp, .planes = FilmPlanes::features},
                      threads);
    }

    PixelData<float> adaptive(const PreparedScene<float>& scene, const Camera& camera, double target,
                              std::uint32_t seed) {
        Film<float> film;
        RenderOptions options{.width = o_.side, .height = o_.side, .end_sample = 8, .planes = FilmPlanes::halves};
        Plane<std::uint8_t, 1> active;
        for (;;) {
            options.active = std::as_const(active).view();
            render(film, scene, camera, PathIntegrator<>{}, SobolSampler<float>(seed), options, serial_,
                   [] { return true; });
            AdaptiveRound round = next_round(film, {.error_target = target}, serial_);
            if (round.count == 0) return film.resolve();
            active = std::move(round.active);
            options.first_sample = options.end_sample;
            options.end_sample *= 2;
        }
    }

    /// `difference`: of the means, relative; 0 = the same bits. Other formulas of one material round differently.
    template <class With, class Without>
    bool compare(const std::string& scene, const char* feature, With&& with, Without&& without, double difference = 0) {
        if (o_.instructions) return count(scene, feature, with, without, difference);
        std::vector<double> short_s, long_s;
        bool equal = true;
        for (int round = 0; round <= o_.rounds; ++round) {
            const double start = cpu_seconds();
            const PixelData<float> a = with();
            const double middle = cpu_seconds();
            const PixelData<float> b = without();
            const double end = cpu_seconds();
            if (round == 0) { // warms up, and compares
                equal = same(a, b, difference);
                continue;
            }
            short_s.push_back(middle - start);
            long_s.push_back(end - middle);
        }
        print(scene, feature, median(short_s), median(long_s), equal);
        return equal;
    }

    /// The same, for the instructions of a sample instead of seconds; the first calls, which are compared, warm up.
    template <class With, class Without>
    bool count(const std::string& scene, const char* feature, With&& with, Without&& without, double difference) {
        const bool equal = same(with(), without(), difference);
        const double samples = double(o_.side) * double(o_.side) * double(o_.spp);
        const double few = instructions_of(with), many = instructions_of(without);
        print(scene, feature, few / samples, many / samples, equal);
        return equal;
    }

    static bool same(const PixelData<float>& a, const PixelData<float>& b, double difference) {
        if (difference == 0) return a.radiance.values() == b.radiance.values();
        double sum_a = 0, sum_b = 0;
        for (const float v : a.radiance.values()) sum_a += double(v);
        for (const float v : b.radiance.values()) sum_b += double(v);
        return std::abs(sum_a - sum_b) <= difference * sum_b;
    }

    void print(const std::string& scene, const char* feature, double with, double without, bool equal) const {
        Line line(o_.json);
        line.add("scene", scene).add("feature", feature);
        line.add(o_.instructions ? "instructions_with_skip" : "seconds_with_skip", with);
        line.add(o_.instructions ? "instructions_without" : "seconds_without", without);
        line.add("ratio", without / with).add("equal", equal ? 1 : 0);
    }

    const Options& o_;
    SerialExecutor serial_;
};

} // namespace

int main(int argc, char** argv) try {
    Options o;
    CommandLine line("bench_skip [options]");
    bool help = false;
    line.add("--rounds N", "of which medians are taken (7)",
             [&](const std::string& v) { o.rounds = int(to_integer(v, 1, 1000)); });
    line.add("--quick", "one round of small images (off)", [&](const std::string&) { o = {1, 64, 8, 1024, o.json, o.instructions}; });
    line.add("--instructions", "count instructions a sample, by valgrind, in place of seconds; not of adaptive rows (off)",
             [&](const std::string&) { o.instructions = true; });
    line.add("--json", "one object a line", [&](const std::string&) { o.json = true; });
    line.add("--help", "this list", [&](const std::string&) { help = true; });
    if (!line.parse(argc, argv).empty()) throw UsageError("scenes are builtin ones");
    if (help) return line.print_help(), 0;
    if (o.instructions) {
        if (!is_counting()) return count_instructions({argv + 1, argv + argc}), 0;
        o.side = 32, o.spp = 8; // callgrind takes its time, and needs no rounds
    }

    if (!o.json)
        std::printf("%-26s %-26s %10s %10s %10s %10s\n", "scene", "feature", "with skip", "without", "ratio", "equal");
    Bench bench(o);
    const Subject cornell{"builtin:cornell", cornell_scene<float>()}, room{"builtin:room", room_scene<float>()};
    bool equal = true;
    for (const Subject& s : {cornell, plain(cornell), room, under_sky(cornell)}) equal = bench.measure(s) && equal;
    if (o.instructions) return equal ? 0 : 1;
    for (const Subject& s : {cornell, room, under_sky(cornell)}) equal = bench.measure_adaptive(s, 0.1) && equal;
    return equal ? 0 : 1;
} catch (const UsageError& e) {
    std::fprintf(stderr, "bench_skip: %s\n", e.what());
    return 2;
} catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
}
