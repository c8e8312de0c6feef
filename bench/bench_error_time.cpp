// Error against run time: estimators and denoisers by samples a pixel. CPU time of all threads; pixels that
// see an emitter are left out.
#include "../examples/support/command_line.hpp"
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <lambent/denoise/denoise.hpp>
#include <lambent/film/metrics.hpp>
#include <lambent/io/environment.hpp>
#include <lambent/io/exr_frame.hpp>
#include <lambent/io/scene_file.hpp>
#include <lambent/render/path.hpp>
#include <lambent/render/render.hpp>
#include <lambent/sampling/independent.hpp>
#include <lambent/sampling/sobol.hpp>
#include <lambent/sampling/stratified.hpp>
#include <lambent/scene/builtin.hpp>
#include <map>

namespace {

using namespace lambent;

struct Options {
    std::vector<std::string> scenes,
        methods = {"path", "light", "bsdf", "independent", "path+best", "path+balanced", "path+fast"};
    std::vector<std::uint64_t> spp = {1, 4, 16, 64, 256};
    std::string reference, environment;
    int rounds = 3;
    bool json = false, quick = false;
};

/// "path+best" is the estimator "path" and then the denoiser "best".
struct Method {
    std::string name, estimator, denoiser;
};

const std::vector<std::string> estimators = {"path", "light", "bsdf", "stratified", "independent"};

Method to_method(const std::string& name) {
    const std::size_t plus = name.find('+');
    Method m{name, name.substr(0, plus), plus == std::string::npos ? "" : name.substr(plus + 1)};
    to_choice(m.estimator, estimators);
    if (!m.denoiser.empty()) denoise_options(m.denoiser);
    return m;
}

struct Subject {
    std::string name;
    Scene<float> scene;
    Camera camera;
    int width = 128, height = 128;
    Plane<float, 3> reference;
    Plane<std::uint8_t, 1> mask{};
};

PixelData<float> trace(const Subject& s, const PreparedScene<float>& prepared, const std::string& estimator,
                       std::uint64_t spp, std::uint32_t seed, ThreadExecutor& threads) {
    const RenderOptions options{.width = s.width, .height = s.height, .end_sample = spp};
    const auto go = [&](const auto& integrator, const auto& sampler) {
        return render(prepared, s.camera, integrator, sampler, options, threads);
    };
    if (estimator == "light") return go(PathIntegrator<PathStrategy::light>{}, SobolSampler<float>(seed));
    if (estimator == "bsdf") return go(PathIntegrator<PathStrategy::bsdf>{}, SobolSampler<float>(seed));
    if (estimator == "stratified")
        return go(PathIntegrator<>{}, StratifiedSampler<float>(seed, std::uint32_t(spp)));
    if (estimator == "independent") return go(PathIntegrator<>{}, IndependentSampler<float>(seed));
    return go(PathIntegrator<>{}, SobolSampler<float>(seed));
}

double cpu_seconds() { return double(std::clock()) / CLOCKS_PER_SEC; }

double median(std::vector<double> v) {
    std::sort(v.begin(), v.end());
    return v.size() % 2 == 1 ? v[v.size() / 2] : (v[v.size() / 2 - 1] + v[v.size() / 2]) / 2;
}

/// A builtin scene, or one with its converged image NAME_128.exr and its sky beside it.
Subject make_subject(const Options& o, const std::string& name) {
    namespace fs = std::filesystem;
    Subject s;
    s.name = fs::path(name).stem().string();
    std::string reference = o.reference, environment = o.environment;
    if (name == "builtin:cornell" || name == "builtin:room") {
        s.name = name;
        s.scene = name == "builtin:room" ? room_scene<float>() : cornell_scene<float>();
    } else {
        s.scene = load_scene<float>(name);
        const fs::path folder = fs::path(name).parent_path();
        const std::map<std::string, std::string> skies = {{"atrium", "sky_sun.exr"},
                                                          {"materials", "sky_soft.exr"}};
        if (environment.empty() && skies.count(s.name) == 1)
            environment = (folder / skies.at(s.name)).string();
        if (reference.empty() && fs::exists(folder / (s.name + "_128.exr")))
            reference = (folder / (s.name + "_128.exr")).string();
    }
    if (!environment.empty()) s.scene.environment = read_environment(environment);
    if (!reference.empty()) {
        PixelData<float> frame = frame_from_exr(read_exr(reference));
        s.width = frame.width;
        s.height = frame.height;
        s.reference = std::move(frame.radiance);
    }
    s.camera = s.scene.cameras.empty() ? framing_camera(s.scene.bounds(), double(s.width) / s.height)
                                       : s.scene.cameras[0];
    return s;
}

/// Mean over pixels and channels that count.
double mean(const Subject& s, const PixelView<const float, 3>& image) {
    double sum = 0, n = 0;
    for (int y = 0; y < s.height; ++y)
        for (int x = 0; x < s.width; ++x) {
            if (s.mask.view().load(x, y) != 0) continue;
            const Vec3f v = image.load(x, y);
            sum += double(v.x + v.y + v.z) / 3;
            n += 1;
        }
    return n > 0 ? sum / n : 0;
}

/// Measures one scene and prints its rows. Returns whether the path tracer's mean is the reference's.
bool measure(const Options& o, const std::string& name, ThreadExecutor& threads) {
    Subject s = make_subject(o, name);
    const PreparedScene<float> prepared(s.scene, threads);
    const std::uint64_t most = *std::max_element(o.spp.begin(), o.spp.end());
    if (s.reference.view().absent()) { // our own: 16 times the samples, and other ones
        std::fprintf(stderr, "%s: renders a reference with %llu samples a pixel\n", s.name.c_str(),
                     (unsigned long long)(16 * most));
        s.reference = trace(s, prepared, "path", 16 * most, 1000, threads).radiance;
    }
    s.mask = emitter_mask(trace(s, prepared, "path", 64, 2000, threads).emission.view());
    const Plane<float, 3>& reference = s.reference;

    std::vector<Method> methods;
    for (const std::string& m : o.methods) methods.push_back(to_method(m));
    struct Result {
        std::vector<double> seconds;
        double rel_mse = 0, mse = 0;
    };
    bool agrees = true;
    for (const std::uint64_t spp : o.spp) {
        std::map<std::string, Result> results;
        double path_mean = 0;
        for (int round = 0; round < o.rounds; ++round)
            for (const std::string& estimator : estimators) {
                if (std::none_of(methods.begin(), methods.end(),
                                 [&](const Method& m) { return m.estimator == estimator; }))
                    continue;
                const double start = cpu_seconds();
                const PixelData<float> frame =
                    trace(s, prepared, estimator, spp, std::uint32_t(round) + 1, threads);
                const double render_s = cpu_seconds() - start;
                if (estimator == "path") path_mean += mean(s, frame.radiance.view()) / o.rounds;
                for (const Method& m : methods) {
                    if (m.estimator != estimator) continue;
                    Result& r = results[m.name];
                    const auto take = [&](const PixelView<const float, 3>& image, double seconds) {
                        r.seconds.push_back(seconds);
                        r.rel_mse += rel_mse(image, reference.view(), s.mask.view()) / o.rounds;
                        r.mse += mse(image, reference.view(), s.mask.view()) / o.rounds;
                    };
                    if (m.denoiser.empty()) {
                        take(frame.radiance.view(), render_s);
                        continue;
                    }
                    const double filter_start = cpu_seconds();
                    const auto clean = denoise(frame, denoise_options(m.denoiser), threads);
                    take(clean.radiance.view(), render_s + cpu_seconds() - filter_start);
                }
            }
        for (const Method& m : methods) {
            const Result& r = results.at(m.name);
            const double seconds = median(r.seconds), efficiency = 1 / (r.rel_mse * seconds);
            std::printf(o.json ? "{\"scene\": \"%s\", \"method\": \"%s\", \"spp\": %llu, \"seconds\": %.6g, "
                                 "\"rel_mse\": %.6g, "
                                 "\"rmse\": %.6g, \"efficiency\": %.6g}\n"
                               : "%-16s %-16s %6llu %10.4g %10.4g %10.4g %10.4g\n",
                        s.name.c_str(), m.name.c_str(), (unsigned long long)spp, seconds, r.rel_mse,
                        std::sqrt(r.mse), efficiency);
        }
        std::fflush(stdout);
        const double truth = mean(s, reference.view());
        if (spp == most && path_mean > 0 && !(std::abs(path_mean / truth - 1) < 0.03)) {
            std::fprintf(stderr, "%s: the path tracer's mean is %.5g, the reference's %.5g\n", s.name.c_str(),
                         path_mean, truth);
            agrees = false;
        }
    }
    return agrees;
}

/// The builtin scenes, and those with references where they were found when the project was configured.
std::vector<std::string> default_scenes(bool quick) {
    std::vector<std::string> scenes = {"builtin:cornell", "builtin:room"};
    if (quick) scenes.pop_back();
    const std::filesystem::path folder = LAMBENT_SHARED_DIR "/reference";
    for (const char* file : {"cornell.glb", "atrium.glb", "many_lights.glb"})
        if (std::filesystem::exists(folder / file)) scenes.push_back((folder / file).string());
    return scenes;
}

} // namespace

int main(int argc, char** argv) try {
    Options o;
    bool spp_chosen = false, help = false;
    CommandLine line(
        "bench_error_time [SCENE...] [options]   SCENE: builtin:cornell, builtin:room, .gltf, .glb, .obj");
    line.add("--spp LIST", "samples a pixel (1,4,16,64,256)", [&](const std::string& v) {
        o.spp.clear();
        for (const std::string& n : split(v, ',')) o.spp.push_back(std::uint64_t(to_integer(n, 1, 1 << 20)));
        spp_chosen = true;
    });
    line.add("--methods LIST", "path, light, bsdf, stratified, independent; each with +DENOISER or not",
             [&](const std::string& v) {
                 o.methods = split(v, ',');
                 for (const std::string& m : o.methods) try {
                         to_method(m);
                     } catch (const Error& e) {
                         throw UsageError(e.what());
                     }
             });
    line.add("--reference F.exr",
             "converged image of the scene; without it NAME_128.exr beside it, or our own",
             [&](const std::string& v) { o.reference = v; });
    line.add("--env F", "environment map of the scene", [&](const std::string& v) { o.environment = v; });
    line.add("--rounds N", "seeds: errors are averaged over them, the time is their median (3)",
             [&](const std::string& v) { o.rounds = int(to_integer(v, 1, 1000)); });
    line.add("--quick", "one round, up to 16 samples a pixel", [&](const std::string&) { o.quick = true; });
    line.add("--json", "one object a line", [&](const std::string&) { o.json = true; });
    line.add("--help", "this list", [&](const std::string&) { help = true; });
    o.scenes = line.parse(argc, argv);
    if (help) return line.print_help(), 0;
    if (!o.reference.empty() && o.scenes.size() != 1) throw UsageError("--reference is for one scene");
    if (o.quick) {
        o.rounds = 1;
        if (!spp_chosen) o.spp = {1, 4, 16};
    }
    if (o.scenes.empty()) o.scenes = default_scenes(o.quick);

    if (!o.json)
        std::printf("%-16s %-16s %6s %10s %10s %10s %10s\n", "scene", "method", "spp", "seconds", "rel_mse",
                    "rmse", "efficiency");
    ThreadExecutor threads;
    bool agree = true;
    for (const std::string& scene : o.scenes) agree = measure(o, scene, threads) && agree;
    return agree ? 0 : 1;
} catch (const UsageError& e) {
    std::fprintf(stderr, "bench_error_time: %s\n", e.what());
    return 2;
} catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
}
