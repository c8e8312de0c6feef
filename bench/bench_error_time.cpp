// Error against run time: estimators, denoisers and other renderers by samples a pixel. CPU time of all threads; pixels
// that see an emitter are left out. With --peers everyone has one thread on the same processor, and they take turns.
#include "../examples/support/command_line.hpp"
#include "bvh/affinity.hpp"
#include "error_curve.hpp"
#include "lamp.hpp"
#include "output.hpp"
#include "peers/export.hpp"
#include "peers/peer.hpp"
#include "process.hpp"
#include "renderer.hpp"
#include "scene_files.hpp"
#include "timing.hpp"
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise.hpp>
#include <lambent/film/metrics.hpp>
#include <lambent/io/exr_frame.hpp>
#include <lambent/render/path.hpp>
#include <lambent/render/render.hpp>
#include <lambent/sampling/independent.hpp>
#include <lambent/sampling/sobol.hpp>
#include <lambent/sampling/stratified.hpp>
#include <lambent/scene/builtin.hpp>
#include <map>
#include <memory>
#include <optional>

namespace {

using namespace lambent;

struct Options {
    std::vector<std::string> scenes, methods;
    std::vector<std::uint64_t> spp = {1, 4, 16, 64, 256};
    std::string reference, environment, python;
    std::optional<Vec3d> eye, look_at;
    std::optional<Lamp> lamp;
    double vertical_fov = 0; ///< degrees; 0: the scene's
    int rounds = 3, width = 128, height = 128;
    double target = 0; ///< 0: the scene's
    bool json = false, quick = false;
};

const std::vector<std::string> own_methods = {"path", "light", "bsdf", "independent", "path+best", "path+balanced",
                                              "path+fast"};

/// Other renderers, as the best that we found for each. Mitsuba is given diffuse scenes only.
struct PeerKind {
    const char *name, *script, *setting;
    bool diffuse_only;
};
constexpr PeerKind peer_kinds[] = {{"mitsuba_llvm_multijitter", "mitsuba_render.py", "llvm_ad_rgb:multijitter", true},
                                   {"mitsuba_llvm_independent", "mitsuba_render.py", "llvm_ad_rgb:independent", true},
                                   {"mitsuba_scalar", "mitsuba_render.py", "scalar_rgb:independent", true},
                                   {"cycles_blue_noise", "cycles_render.py", "BLUE_NOISE", false},
                                   {"cycles_sobol", "cycles_render.py", "TABULATED_SOBOL", false}};

/// The relative error that a scene's times are compared at.
const std::map<std::string, double> targets = {
    {"cornell", 0.01}, {"atrium", 0.02}, {"many_lights", 0.2}, {"builtin:cornell", 0.01}, {"builtin:door", 0.5}};

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
    std::string name, file{}, sky{};
    Scene<float> scene;
    std::size_t own_triangles = 0; ///< those of `file`; the rest was added
    Camera camera;
    int width = 128, height = 128;
    Plane<float, 3> reference;
    Plane<std::uint8_t, 1> mask{};
};

PixelData<float> trace(const Subject& s, const PreparedScene<float>& prepared, const std::string& estimator,
                       std::uint64_t spp, std::uint32_t seed, FilmPlanes planes, ThreadExecutor& threads) {
    const RenderOptions options{.width = s.width, .height = s.height, .end_sample = spp, .planes = planes};
    const auto go = [&](const auto& integrator, const auto& sampler) {
        return render(prepared, s.camera, integrator, sampler, options, threads);
    };
    if (estimator == "light") return go(PathIntegrator<PathStrategy::light>{}, SobolSampler<float>(seed));
    if (estimator == "bsdf") return go(PathIntegrator<PathStrategy::bsdf>{}, SobolSampler<float>(seed));
    if (estimator == "stratified")
        return go(PathIntegrator<>{}, StratifiedSampler<float>(seed, std::uint32_t(spp)));
    if (estimator == "independent") return go(PathIntegrator<>{}, IndependentSampler<float>(seed));
    return trace_paths(prepared, s.camera, seed, options, threads);
}

/// A builtin scene, or one with its converged image NAME_128.exr and its sky beside it.
Subject make_subject(const Options& o, const std::string& name) {
    namespace fs = std::filesystem;
    Subject s;
    s.name = fs::path(name).stem().string();
    s.width = o.width;
    s.height = o.height;
    std::string reference = o.reference, environment = o.environment;
    if (name.rfind("builtin:", 0) == 0) {
        s.name = name;
        if (name == "builtin:room") s.scene = room_scene<float>();
        else if (name == "builtin:door") s.scene = door_scene<float>();
        else if (name == "builtin:cornell") s.scene = cornell_scene<float>();
        else throw UsageError(name + ": there are builtin:cornell, builtin:door and builtin:room");
    } else {
        s.file = name;
        s.scene = scene_of_file(name);
        const fs::path folder = fs::path(name).parent_path();
        const std::map<std::string, std::string> skies = {{"atrium", "sky_sun.exr"},
                                                          {"materials", "sky_soft.exr"}};
        if (environment.empty() && skies.count(s.name) == 1)
            environment = (folder / skies.at(s.name)).string();
        if (reference.empty() && s.width == 128 && s.height == 128 && fs::exists(folder / (s.name + "_128.exr")))
            reference = (folder / (s.name + "_128.exr")).string();
    }
    s.sky = environment;
    s.own_triangles = s.scene.triangles.size();
    if (o.lamp) add_lamp(s.scene, *o.lamp);
    if (!environment.empty()) s.scene.environment = sky_of_file(environment);
    if (!reference.empty()) {
        PixelData<float> frame = frame_from_exr(read_exr(reference));
        require(frame.width == s.width && frame.height == s.height, [&] {
            return reference + ": has " + std::to_string(frame.width) + " x " + std::to_string(frame.height) +
                   " pixels, see --size";
        });
        s.reference = std::move(frame.radiance);
    }
    s.camera = s.scene.cameras.empty() ? framing_camera(s.scene.bounds(), double(s.width) / s.height)
                                       : s.scene.cameras[0];
    if (o.eye) s.camera.eye = *o.eye;
    if (o.look_at) s.camera.target = *o.look_at;
    if (o.vertical_fov > 0) s.camera.vertical_fov = o.vertical_fov;
    return s;
}

/// Means over pixels and channels that count, of the left and of the right half.
std::array<double, 2> means(const Subject& s, const PixelView<const float, 3>& image) {
    std::array<double, 2> sum{}, n{};
    for (int y = 0; y < s.height; ++y)
        for (int x = 0; x < s.width; ++x) {
            if (s.mask.view().load(x, y) != 0) continue;
            const Vec3f v = image.load(x, y);
            const std::size_t half = 2 * x < s.width ? 0 : 1;
            sum[half] += double(v.x + v.y + v.z) / 3;
            n[half] += 1;
        }
    return {sum[0] / std::max(n[0], 1.0), sum[1] / std::max(n[1], 1.0)};
}

void print_start(const Options& o, const Subject& s, const std::string& method, double first_image_s, double peak_mib) {
    Line line(o.json);
    line.add("scene", s.name).add("method", method).words().add("first_image_s", first_image_s);
    line.add("peak_mib", peak_mib);
}

/// Our program's time from start to end, for 8 x 8 pixels of one sample, and its memory at 512 x 512.
void measure_start(const Options& o, const Subject& s) {
    const std::string render = LAMBENT_RENDER;
    if (!std::filesystem::exists(render)) {
        std::fprintf(stderr, "%s: time to the first sample left out, %s is not built\n", s.name.c_str(), render.c_str());
        return;
    }
    const TemporaryFolder folder;
    const std::string out = (folder.path / "out.exr").string(), scene = s.file.empty() ? s.name : s.file;
    const auto run = [&](const char* size) {
        std::vector<std::string> words = {render, scene, "--size", size, "--spp", "1", "--denoise", "none", "--threads",
                                          "1", "--quiet", "--aov", "none", "--out", out};
        if (!s.sky.empty()) words.insert(words.end(), {"--env", s.sky});
        return run_process(words);
    };
    std::vector<double> seconds;
    for (int round = 0; round < o.rounds; ++round) seconds.push_back(run("8x8").wall_s);
    print_start(o, s, "render", median(seconds), run("512x512").peak_mib);
}

/// The last processor that we may run on: others like the first.
int last_processor() {
    cpu_set_t set;
    CPU_ZERO(&set);
    int last = 0;
    if (sched_getaffinity(0, sizeof set, &set) == 0)
        for (int i = 0; i < CPU_SETSIZE; ++i)
            if (CPU_ISSET(std::size_t(i), &set)) last = i;
    return last;
}

/// Each denoised image beside what the same time would have given as samples: the ratio of the errors, more than 1
/// where denoising wins.
void print_equal_time(const Options& o, const Subject& s, const std::map<std::string, std::vector<Point>>& curves) {
    for (const auto& [method, curve] : curves) {
        const auto raw = curves.find(method.substr(0, method.find('+')));
        if (method.find('+') == method.npos || raw == curves.end()) continue;
        for (const Point& p : curve) {
            const double samples_alone = error_after(p.seconds, raw->second);
            Line line(o.json);
            line.add("scene", s.name).add("method", method).words().add("denoised_spp", double(p.spp));
            line.add("error", std::sqrt(p.rel_mse)).add("error_of_samples_in_that_time", std::sqrt(samples_alone));
            line.add("equal_time_gain", samples_alone / p.rel_mse);
        }
    }
}

/// Measures one scene and prints its rows. Returns whether everyone's image is the reference's in the mean.
bool measure(const Options& o, const std::string& name, ThreadExecutor& threads) {
    Subject s = make_subject(o, name);
    const auto scene = prepare(s.scene, threads);
    const PreparedScene<float>& prepared = *scene;
    const std::uint64_t most = *std::max_element(o.spp.begin(), o.spp.end());
    if (s.reference.view().absent()) { // our own: 16 times the samples, and other ones
        std::fprintf(stderr, "%s: renders a reference with %llu samples a pixel\n", s.name.c_str(),
                     (unsigned long long)(16 * most));
        ThreadExecutor all;
        s.reference = trace(s, prepared, "path", 16 * most, 1000, FilmPlanes::radiance, all).radiance;
    }
    const Pinned pinned(o.python.empty() ? std::nullopt : std::optional<int>(last_processor()));
    s.mask = emitter_mask(trace(s, prepared, "path", 64, 2000, FilmPlanes::features, threads).emission.view());
    const Plane<float, 3>& reference = s.reference;

    std::vector<Method> methods;
    for (const std::string& m : o.methods) methods.push_back(to_method(m));
    const TemporaryFolder folder;
    std::map<std::string, std::unique_ptr<Peer>> peers;
    if (!o.python.empty()) {
        export_scene(folder.path, s.scene, s.camera, s.width, s.height, s.file, s.own_triangles);
        for (const PeerKind& kind : peer_kinds) {
            if ((kind.diffuse_only || s.file.empty()) && !is_diffuse(s.scene)) { // textures go by the file alone
                std::fprintf(stderr, "%s: %s left out, the scene is not all diffuse\n", s.name.c_str(), kind.name);
                continue;
            }
            try {
                peers[kind.name] = std::make_unique<Peer>(o.python, std::string(LAMBENT_PEERS_DIR "/") + kind.script,
                                                          folder.path, kind.setting);
            } catch (const Error& e) {
                std::fprintf(stderr, "%s: %s left out: %s\n", s.name.c_str(), kind.name, e.what());
                continue;
            }
            methods.push_back({kind.name, "", ""});
        }
    }

    // Other renderers mean other things by materials that are not diffuse: each is held to its own converged image then.
    std::map<std::string, std::vector<float>> own_references;
    const auto peer_image = [&](const std::string& method, std::uint64_t spp, std::uint32_t seed) {
        Peer::Answer answer = peers.at(method)->render(spp, seed);
        require(answer.rgb.size() == std::size_t(s.width) * std::size_t(s.height) * 3,
                [&] { return method + ": its image has another size"; });
        return answer;
    };
    if (!is_diffuse(s.scene))
        for (const auto& peer : peers) own_references[peer.first] = peer_image(peer.first, 16 * most, 1000).rgb;

    struct Result {
        std::vector<double> seconds;
        double rel_mse = 0, mse = 0;
        std::array<double, 2> means{};
    };
    bool agrees = true;
    std::map<std::string, std::vector<Point>> curves;
    const auto best_peer = [&](const auto& value) { // the largest, 0 without peers
        double best = 0;
        for (const auto& peer : peers) best = std::max(best, value(curves.at(peer.first)));
        return best;
    };
    const std::array<double, 2> truth = means(s, reference.view());
    const auto means_agree = [&](const Method& m, const std::array<double, 2>& own) {
        bool good = true;
        for (std::size_t half = 0; half < 2; ++half) {
            const double ratio = own[half] / truth[half];
            if (!m.denoiser.empty() || m.estimator == "light" || m.estimator == "bsdf" || std::abs(ratio - 1) < 0.03) continue;
            const bool other = own_references.count(m.name) == 1;
            std::fprintf(stderr, "%s: the mean of %s is %.5g of the reference's in the %s half%s\n", s.name.c_str(),
                         m.name.c_str(), ratio, half == 0 ? "left" : "right",
                         other ? " (its own materials: compared with its own converged image)" : "");
            good = good && other;
        }
        return good;
    };
    for (const std::uint64_t spp : o.spp) {
        std::map<std::string, Result> results;
        const auto take = [&](const std::string& method, const PixelView<const float, 3>& image, double seconds) {
            Result& r = results[method];
            r.seconds.push_back(seconds);
            const auto own = own_references.find(method);
            const auto converged = own == own_references.end() ? reference.view()
                                                               : rgb_view(own->second.data(), s.width, s.height);
            r.rel_mse += rel_mse(image, converged, s.mask.view()) / o.rounds;
            r.mse += mse(image, converged, s.mask.view()) / o.rounds;
            const std::array<double, 2> m = means(s, image);
            for (std::size_t half = 0; half < 2; ++half) r.means[half] += m[half] / o.rounds;
        };
        for (int round = 0; round < o.rounds; ++round) {
            const auto seed = std::uint32_t(round) + 1;
            for (const std::string& estimator : estimators)
                for (const bool denoised : {false, true}) { // which takes planes that cost some time
                    const auto ours = [&](const Method& m) {
                        return m.estimator == estimator && m.denoiser.empty() != denoised;
                    };
                    if (std::none_of(methods.begin(), methods.end(), ours)) continue;
                    const double start = cpu_seconds();
                    const PixelData<float> frame =
                        trace(s, prepared, estimator, spp, seed,
                              denoised ? FilmPlanes::statistics : FilmPlanes::features, threads);
                    const double render_s = cpu_seconds() - start;
                    for (const Method& m : methods) {
                        if (!ours(m)) continue;
                        if (!denoised) {
                            take(m.name, frame.radiance.view(), render_s);
                            continue;
                        }
                        const double filter_start = cpu_seconds();
                        const auto clean = denoise_frame(frame, denoise_options(m.denoiser), threads);
                        take(m.name, clean.radiance.view(), render_s + cpu_seconds() - filter_start);
                    }
                }
            for (const auto& peer : peers) {
                const Peer::Answer answer = peer_image(peer.first, spp, seed);
                take(peer.first, rgb_view(answer.rgb.data(), s.width, s.height), answer.seconds);
            }
        }
        for (const Method& m : methods) {
            const Result& r = results.at(m.name);
            curves[m.name].push_back({spp, median(r.seconds), r.rel_mse});
        }
        const double best = best_peer([](const auto& curve) { return curve.back().efficiency(); });
        for (const Method& m : methods) {
            const Result& r = results.at(m.name);
            const bool wrong = spp == most && !means_agree(m, r.means);
            agrees = agrees && !wrong;
            const Point& p = curves[m.name].back();
            Line line(o.json);
            line.add("scene", s.name).add("method", m.name).add("spp", double(spp)).add("seconds", p.seconds);
            line.add("rel_mse", p.rel_mse).add("rmse", std::sqrt(r.mse)).add("efficiency", p.efficiency());
            line.add("msamples_per_s", double(s.width) * s.height * double(spp) / p.seconds * 1e-6);
            if (best > 0) line.add("ratio_to_best_peer", p.efficiency() / best);
            line.add("wrong", wrong ? 1 : 0);
        }
    }
    print_equal_time(o, s, curves);
    const auto own_target = targets.find(s.name);
    const double target = o.target > 0 ? o.target : own_target == targets.end() ? 0 : own_target->second;
    if (target > 0) {
        const double best = best_peer([&](const auto& curve) { return 1 / seconds_to(target, curve); });
        for (const Method& m : methods) {
            const double seconds = seconds_to(target, curves[m.name]);
            Line line(o.json);
            line.add("scene", s.name).add("method", m.name).words().add("target", target).add("seconds", seconds);
            line.add("efficiency", 1 / (target * seconds));
            if (best > 0) line.add("ratio_to_best_peer", 1 / (seconds * best));
        }
    }
    for (const auto& [method, peer] : peers)
        print_start(o, s, method, peer->first_image_s(), peer->peak_mib());
    measure_start(o, s);
    return agrees;
}

/// The builtin scenes, and those with references where they were found when the project was configured.
std::vector<std::string> default_scenes(bool quick) {
    std::vector<std::string> scenes = {"builtin:cornell"};
    if (!quick) scenes.insert(scenes.end(), {"builtin:room", "builtin:door"});
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
        "bench_error_time [SCENE...] [options]   SCENE: builtin:cornell, builtin:door, builtin:room, .gltf, .glb, .obj");
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
    line.add("--size WxH", "in pixels (128x128)", [&](const std::string& v) {
        const std::vector<std::string> sides = split_exactly(v, 'x', 2);
        o.width = int(to_integer(sides[0], 1, 1 << 14));
        o.height = int(to_integer(sides[1], 1, 1 << 14));
    });
    line.add("--peers PYTHON", "an interpreter that has mitsuba, bpy and numpy: adds their rows; all on one thread (none)",
             [&](const std::string& v) { o.python = v; });
    line.add("--target E", "rel_mse to which times are compared (the scene's, if it has one)",
             [&](const std::string& v) { o.target = to_positive(v); });
    line.add("--env F", "environment map of the scene", [&](const std::string& v) { o.environment = v; });
    line.add("--lamp x,y,z,side,radiance", "a square that shines down (none)", [&](const std::string& v) { o.lamp = to_lamp(v); });
    line.add("--eye x,y,z", "of the camera (the scene's)", [&](const std::string& v) { o.eye = to_vector(v); });
    line.add("--look-at x,y,z", "what it looks at (the scene's)", [&](const std::string& v) { o.look_at = to_vector(v); });
    line.add("--vfov DEG", "its vertical angle of view (the scene's)",
             [&](const std::string& v) { o.vertical_fov = to_positive(v); });
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
    const bool with_peers = !o.python.empty();
    if (o.methods.empty()) o.methods = with_peers ? std::vector<std::string>{"path", "independent"} : own_methods;
    if (!with_peers) std::fprintf(stderr, "other renderers are left out: no --peers\n");

    if (!o.json)
        std::printf("%-26s %-26s %10s %10s %10s %10s %10s %10s%s\n", "scene", "method", "spp", "seconds", "rel_mse",
                    "rmse", "efficiency", "Msamples/s", with_peers ? " to best peer" : "");
    ThreadExecutor threads(with_peers ? 1 : 0);
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
