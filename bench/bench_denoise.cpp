// Denoisers beside Open Image Denoise on the same frames: error, energy and CPU time of one thread. The reference is
// two independent halves A and B, and the error the mean of (x - A)(x - B) / (ref² + 0.01): noise of the reference
// cancels out of it. It is kept in a folder; delete its files when a scene or what renders it changes.
#include "../examples/support/command_line.hpp"
#include "../examples/support/preview.hpp"
#include "denoise_scenes.hpp"
#include "lamp.hpp"
#include "output.hpp"
#include "peers/peer.hpp"
#include "process.hpp"
#include "renderer.hpp"
#include "scene_files.hpp"
#include "timing.hpp"
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise.hpp>
#include <lambent/film/metrics.hpp>
#include <lambent/io/film_file.hpp>
#include <lambent/render/render.hpp>
#include <lambent/scene/builtin.hpp>
#include <map>
#include <memory>
#include <optional>

namespace {

using namespace lambent;
namespace fs = std::filesystem;

/// What denoisers are given.
constexpr FilmPlanes input_planes = FilmPlanes::statistics;
/// Geometric means take no error below this: near it the product of two halves may be negative.
constexpr double least_error = 1e-6;

struct Options {
    std::vector<std::string> scenes, methods = {"raw", "oidn", "oidn_fast", "best", "balanced"};
    std::vector<std::uint64_t> spp = {1, 4, 16, 64};
    std::uint64_t reference_spp = 512;
    std::uint32_t seed = 1;
    fs::path cache = "build/denoise_cache", pictures;
    std::string python;
    int width = 256, height = 144;
    bool json = false, keep_inputs = false, mask_emitters = false;
};

/// A scene by name. Parameters are tuned on some of them and judged on the others.
struct Subject {
    const char* name;
    bool judges;
    Scene<float> (*build)();
    const char *file = "", *sky = "";
    std::optional<Camera> camera{};
};

Scene<float> furnished_room() {
    Scene<float> scene = scene_of_file((fs::path(LAMBENT_SHARED_DIR) / "scenes/hotel_room/hotel_room.glb").string());
    add_lamp(scene, {{10032, 1900, -6128}, 600, 40});
    return scene;
}

const std::vector<Subject>& subjects() {
    namespace own = denoise_scenes;
    static const std::vector<Subject> all = {
        {"cornell", false, nullptr, "reference/cornell.glb"},
        {"atrium", false, nullptr, "reference/atrium.glb", "reference/sky_sun.exr"},
        {"many_lights", false, nullptr, "reference/many_lights.glb"},
        {"materials", false, nullptr, "reference/materials.glb", "reference/sky_soft.exr"},
        {"shadows", false, own::shadows},
        {"gloss", false, own::gloss},
        {"tiny", false, own::tiny},
        {"sponza", true, nullptr, "scenes/sponza_crytek/sponza.glb", "reference/sky_sun.exr",
         Camera{{-11, 2.5, -0.5}, {0, 3.5, -0.3}, {0, 1, 0}, 70, ""}},
        {"helmet", true, nullptr, "scenes/damaged_helmet/DamagedHelmet.glb",
         "scenes/environments/venice_sunset_256.hdr", Camera{{0, 0, 3.2}, {0, 0, 0}, {0, 1, 0}, 45, ""}},
        {"glass", true, own::glass_balls},
        {"dof", true, own::dof},
        {"mirror", true, own::mirrors},
        {"door", true, [] { return door_scene<float>(); }},
        {"sibenik", true, nullptr, "scenes/sibenik/sibenik.obj", "reference/sky_sun.exr",
         Camera{{-16, -8, 0}, {0, -8, 0}, {0, 1, 0}, 60, ""}},
        {"hotel", true, furnished_room, "", "", Camera{{10032, 1000, -2500}, {10032, 900, -8000}, {0, 1, 0}, 60, ""}},
        {"alpha", true, nullptr, "scenes/alpha_blend_mode_test/AlphaBlendModeTest.glb", "reference/sky_soft.exr",
         Camera{{0.9, 2.2, 7.9}, {0.8, 2, 6.9}, {0, 1, 0}, 24, ""}},
        {"transmission", true, nullptr, "scenes/transmission_roughness_test/TransmissionRoughnessTest.glb",
         "scenes/environments/venice_sunset_256.hdr", Camera{{0.67, 0.94, 2.8}, {0, 0.1, 0.1}, {0, 1, 0}, 18, ""}},
        {"specular", true, nullptr, "scenes/specular_test/SpecularTest.glb",
         "scenes/environments/venice_sunset_256.hdr", Camera{{0.22, 0.57, 1.63}, {0.1, 0, 0}, {0, 1, 0}, 20, ""}}};
    return all;
}

const Subject& subject(const std::string& name) {
    std::string names;
    for (const Subject& s : subjects()) {
        if (s.name == name) return s;
        names += std::string(names.empty() ? "" : ", ") + s.name;
    }
    throw UsageError("there is no '" + name + "'; there are tune, judge, all, " + names);
}

std::vector<std::string> to_scenes(const std::string& list) {
    std::vector<std::string> names;
    for (const std::string& word : split(list, ',')) {
        const bool group = word == "all" || word == "tune" || word == "judge";
        if (!group) subject(word);
        for (const Subject& s : subjects())
            if (word == s.name || word == "all" || word == (s.judges ? "judge" : "tune")) names.push_back(s.name);
    }
    return names;
}

fs::path in_cache(const Options& o, const Subject& s, const std::string& rest) {
    const std::string size = std::to_string(o.width) + "x" + std::to_string(o.height);
    return o.cache / (std::string(s.name) + "_" + size + "_" + rest);
}

/// A scene that is loaded when the first image of it is asked for.
class Renderer {
public:
    Renderer(const Subject& s, const Options& o) : subject_(s), options_(o) {}

    FilmState<float> render(std::uint64_t spp, std::uint32_t seed, FilmPlanes planes) {
        if (!prepared_) load();
        const int width = options_.width, height = options_.height;
        const RenderOptions options{.width = width, .height = height, .end_sample = spp, .planes = planes};
        FilmState<float> state{{}, width, height, {0, 0, width, height}, camera_, scene_.origin, {}, {}};
        trace_paths(state.film, *prepared_, camera_, seed, options, threads_);
        return state;
    }

    /// What is denoised.
    PixelData<float> input(std::uint64_t spp) {
        const fs::path file = in_cache(options_, subject_, std::to_string(spp) + "_seed_" +
                                       std::to_string(options_.seed) + "_planes_" +
                                       std::to_string(unsigned(input_planes)) + ".film");
        const auto frame = [](const FilmState<float>& state) { return state.film.resolve(state.origin); };
        if (options_.keep_inputs && fs::exists(file)) return frame(read_film<float>(file.string()));
        const FilmState<float> state = render(spp, options_.seed, input_planes);
        if (options_.keep_inputs) write_film(file.string(), state);
        return frame(state);
    }

private:
    void load() {
        const fs::path folder = LAMBENT_SHARED_DIR;
        scene_ = subject_.build != nullptr ? subject_.build() : scene_of_file((folder / subject_.file).string());
        if (*subject_.sky != '\0') scene_.environment = sky_of_file((folder / subject_.sky).string());
        camera_ = subject_.camera ? *subject_.camera : scene_.cameras.at(0);
        prepared_ = prepare(scene_, threads_);
    }

    const Subject& subject_;
    const Options& options_;
    Scene<float> scene_;
    Camera camera_;
    ThreadExecutor threads_;
    std::unique_ptr<PreparedScene<float>> prepared_;
};

void write_floats(const fs::path& file, const std::vector<float>& values) {
    std::ofstream out(file, std::ios::binary);
    out.write(reinterpret_cast<const char*>(values.data()), std::streamsize(values.size() * sizeof(float)));
    require(out.good(), [&] { return file.string() + ": cannot be written"; });
}

/// Two halves and what is derived from them.
struct Reference {
    std::array<Plane<float, 3>, 2> halves;
    Plane<float, 3> mean;
    double scale = 1; ///< makes the median luminance 0.25

    Reference(const Subject& s, const Options& o, Renderer& renderer) : mean(o.width, o.height) {
        for (std::size_t half = 0; half < 2; ++half) halves[half] = get(s, o, renderer, half);
        std::vector<double> light;
        for (std::size_t i = 0; i < mean.values().size(); ++i)
            mean.values()[i] = (halves[0].values()[i] + halves[1].values()[i]) / 2;
        for (int y = 0; y < o.height; ++y)
            for (int x = 0; x < o.width; ++x) light.push_back(luminance(Vec3d(mean.load(x, y))));
        const auto middle = light.begin() + std::ptrdiff_t(light.size() / 2);
        std::nth_element(light.begin(), middle, light.end());
        double typical = *middle, count = 0;
        if (!(typical > 0)) { // most of it is black
            for (const double l : light) typical += l, count += l > 0 ? 1 : 0;
            typical /= count;
        }
        scale = 0.25 / typical;
    }

    /// Over the pixels that `mask` does not leave out.
    double rel_mse(const std::vector<float>& x, const std::vector<std::uint8_t>& mask) const {
        CompensatedSum<double> sum;
        double count = 0;
        for (std::size_t i = 0; i < x.size(); ++i) {
            if (!mask.empty() && mask[i / 3] != 0) continue;
            count += 1;
            const double a = halves[0].values()[i], b = halves[1].values()[i], ref = scale * (a + b) / 2;
            sum.add(scale * scale * (double(x[i]) - a) * (double(x[i]) - b) / (ref * ref + 0.01));
        }
        return sum.value() / std::max(count, 1.0);
    }

    struct Intervals {
        double coverage = 0;   ///< share of values whose 95 % interval holds the truth
        double half_width = 0; ///< mean, in units of the true root-mean-square error
    };
    /// The reference's own noise widens the intervals: without it they would be blamed for that.
    Intervals intervals(const std::vector<float>& x, const std::vector<float>& error) const {
        double covered = 0, width = 0, squares = 0;
        for (std::size_t i = 0; i < x.size(); ++i) {
            const double a = halves[0].values()[i], b = halves[1].values()[i], half = 1.96 * double(error[i]);
            const double noise = 1.96 * (a - b) / 2;
            covered += std::abs(double(x[i]) - (a + b) / 2) <= std::sqrt(half * half + noise * noise);
            width += half;
            squares += (double(x[i]) - a) * (double(x[i]) - b);
        }
        const double n = double(x.size());
        return {covered / n, width / n / std::sqrt(std::max(1e-12, squares / n))};
    }

    double energy(const std::vector<float>& x) const {
        CompensatedSum<double> sum, truth;
        for (const float v : x) sum.add(double(v));
        for (const float v : mean.values()) truth.add(double(v));
        return sum.value() / truth.value();
    }

private:
    static Plane<float, 3> get(const Subject& s, const Options& o, Renderer& renderer, std::size_t half) {
        const fs::path file = in_cache(o, s, std::to_string(o.reference_spp) + (half == 0 ? "_a.f32" : "_b.f32"));
        Plane<float, 3> image(o.width, o.height);
        const auto bytes = image.values().size() * sizeof(float);
        std::error_code none;
        if (fs::file_size(file, none) == bytes) {
            std::ifstream in(file, std::ios::binary);
            in.read(reinterpret_cast<char*>(image.values().data()), std::streamsize(bytes));
            require(in.good(), [&] { return file.string() + ": cannot be read"; });
            return image;
        }
        const auto start = std::chrono::steady_clock::now();
        const auto seed = std::uint32_t(1001 + half);
        image = renderer.render(o.reference_spp, seed, FilmPlanes::radiance).film.resolve().radiance;
        const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - start;
        std::fprintf(stderr, "%s: half of the reference, %.1f s\n", s.name, passed.count());
        write_floats(file.string() + ".part", image.values());
        fs::rename(file.string() + ".part", file); // whole or not at all
        return image;
    }
};

/// Open Image Denoise in a process of its own.
class Oidn {
public:
    explicit Oidn(const Options& o) : python_(o.python) {
        std::ofstream(folder_.path / "size.txt") << o.width << " " << o.height << "\n";
    }

    Peer::Answer denoise(const PixelData<float>& frame, const std::string& quality) {
        write_floats(folder_.path / "color.f32", frame.radiance.values());
        write_floats(folder_.path / "albedo.f32", frame.albedo.values());
        write_floats(folder_.path / "normal.f32", frame.normal.values());
        std::unique_ptr<Peer>& peer = peers_[quality];
        if (!peer)
            peer = std::make_unique<Peer>(python_, LAMBENT_PEERS_DIR "/oidn_denoise.py", folder_.path, quality);
        return peer->render(0, 0);
    }

private:
    std::string python_;
    TemporaryFolder folder_;
    std::map<std::string, std::unique_ptr<Peer>> peers_;
};

/// An image of one method, the CPU time that it took, and what the method says of its error.
struct Answer {
    std::vector<float> rgb, error;
    double seconds = 0;
};

Answer run(const std::string& method, const PixelData<float>& frame, std::optional<Oidn>& oidn) {
    if (method == "raw") return {frame.radiance.values(), {}, 0};
    if (method == "oidn" || method == "oidn_fast") {
        Peer::Answer answer = oidn->denoise(frame, method == "oidn" ? "high" : "fast");
        return {std::move(answer.rgb), {}, answer.seconds};
    }
    ThreadExecutor one(1);
    const double start = cpu_seconds();
    Denoised<float> clean = denoise_frame(frame, denoise_options(method), one);
    return {std::move(clean.radiance.values()), std::move(clean.error.values()), cpu_seconds() - start};
}

struct Result {
    double rel_mse = 0, ratio = 0; ///< ratio to oidn: 0 where that was not run
};
/// By samples, method and scene.
using Results = std::map<std::uint64_t, std::map<std::string, std::map<std::string, Result>>>;

void measure(const Options& o, const Subject& s, std::optional<Oidn>& oidn, Results& results) {
    Renderer renderer(s, o);
    const Reference reference(s, o, renderer);
    const auto picture = [&](const std::string& name, const float* rgb) {
        if (o.pictures.empty()) return;
        fs::create_directories(o.pictures);
        write_preview((o.pictures / (s.name + ("_" + name) + ".png")).string(), {rgb_view(rgb, o.width, o.height)},
                      std::log2(reference.scale));
    };
    picture("reference", reference.mean.values().data());
    Plane<std::uint8_t, 1> mask;
    if (o.mask_emitters) mask = emitter_mask(renderer.input(64).emission.view());
    for (const std::uint64_t spp : o.spp) {
        const PixelData<float> frame = renderer.input(spp);
        double peer = 0;
        for (const std::string& method : o.methods) { // oidn stands before what is compared with it
            const Answer answer = run(method, frame, oidn);
            require(answer.rgb.size() == frame.radiance.values().size(), "the peer's image has another size");
            picture(std::to_string(spp) + "_" + method, answer.rgb.data());
            const double error = reference.rel_mse(answer.rgb, mask.values());
            if (method == "oidn") peer = std::max(error, least_error);
            const double ratio = peer > 0 ? std::max(error, least_error) / peer : 0;
            results[spp][method][s.name] = {error, ratio};
            Line line(o.json);
            line.add("scene", s.name).add("method", method).add("spp", double(spp)).add("rel_mse", error);
            if (peer > 0) line.add("ratio_to_oidn", ratio);
            line.add("energy", reference.energy(answer.rgb)).add("seconds", answer.seconds);
            if (answer.error.empty()) continue;
            const Reference::Intervals intervals = reference.intervals(answer.rgb, answer.error);
            line.add("coverage", intervals.coverage).add("half_width", intervals.half_width);
        }
    }
}

/// Geometric means over the scenes that `counts` takes; nothing where there are none.
template <class Counts>
void print_means(const Options& o, const Results& results, const std::string& group, Counts&& counts) {
    for (const std::uint64_t spp : o.spp)
        for (const std::string& method : o.methods) {
            double log_error = 0, log_ratio = 0, n = 0;
            std::pair<std::string, double> worst{"", -1};
            for (const auto& [scene, r] : results.at(spp).at(method)) {
                if (!counts(subject(scene))) continue;
                log_error += std::log(std::max(r.rel_mse, least_error));
                log_ratio += r.ratio > 0 ? std::log(r.ratio) : 0;
                n += 1;
                const double badness = r.ratio > 0 ? r.ratio : r.rel_mse;
                if (badness > worst.second) worst = {scene, badness};
            }
            if (n == 0) return;
            Line line(o.json);
            line.add("scene", "mean of " + group).add("method", method).add("worst_scene", worst.first);
            line.add("spp", double(spp)).add("rel_mse", std::exp(log_error / n));
            if (log_ratio != 0 || method == "oidn") line.add("ratio_to_oidn", std::exp(log_ratio / n));
            line.add("worst", worst.second);
        }
}

} // namespace

int main(int argc, char** argv) try {
    Options o;
    bool help = false, quick = false;
    CommandLine line("bench_denoise [options]");
    line.add("--scenes LIST", "names, or tune, judge, all (all)",
             [&](const std::string& v) { o.scenes = to_scenes(v); });
    line.add("--methods LIST", "raw, oidn, oidn_fast, and " + std::string(denoise_methods) +
             " (raw,oidn,oidn_fast,best,balanced)", [&](const std::string& v) {
        o.methods = split(v, ',');
        for (const std::string& m : o.methods)
            if (m != "raw" && m != "oidn" && m != "oidn_fast") try {
                    denoise_options(m);
                } catch (const Error& e) {
                    throw UsageError(e.what());
                }
    });
    line.add("--spp LIST", "samples a pixel (1,4,16,64)", [&](const std::string& v) {
        o.spp.clear();
        for (const std::string& n : split(v, ',')) o.spp.push_back(std::uint64_t(to_integer(n, 1, 1 << 20)));
    });
    line.add("--seed N", "of what is denoised (1)", [&](const std::string& v) {
        o.seed = std::uint32_t(to_integer(v, 0, 1000));
    });
    line.add("--size WxH", "in pixels (256x144)", [&](const std::string& v) {
        const std::vector<std::string> sides = split_exactly(v, 'x', 2);
        o.width = int(to_integer(sides[0], 1, 1 << 14));
        o.height = int(to_integer(sides[1], 1, 1 << 14));
    });
    line.add("--reference-spp N", "samples of each half of the reference (512)", [&](const std::string& v) {
        o.reference_spp = std::uint64_t(to_integer(v, 1, 1 << 20));
    });
    line.add("--cache DIR", "keeps references (build/denoise_cache)", [&](const std::string& v) { o.cache = v; });
    line.add("--keep-inputs", "keeps what is denoised there too; delete it when a scene or the renderer changes",
             [&](const std::string&) { o.keep_inputs = true; });
    line.add("--peers PYTHON", "an interpreter that has pyoidn and numpy: adds Open Image Denoise (none)",
             [&](const std::string& v) { o.python = v; });
    line.add("--pictures DIR", "PNGs of references and results (none)", [&](const std::string& v) { o.pictures = v; });
    line.add("--mask-emitters", "errors leave out pixels that see an emitter or the sky, at least in part",
             [&](const std::string&) { o.mask_emitters = true; });
    line.add("--quick", "three scenes, 4 and 16 samples, references of 128", [&](const std::string&) { quick = true; });
    line.add("--json", "one object a line", [&](const std::string&) { o.json = true; });
    line.add("--help", "this list", [&](const std::string&) { help = true; });
    if (!line.parse(argc, argv).empty()) throw UsageError("scenes are named by --scenes");
    if (help) return line.print_help(), 0;

    if (o.scenes.empty()) o.scenes = to_scenes(quick ? "cornell,gloss,mirror" : "all");
    if (quick) o.spp = {4, 16}, o.reference_spp = std::min<std::uint64_t>(o.reference_spp, 128);
    std::optional<Oidn> oidn;
    std::string lacks = o.python.empty() ? "no --peers" : "";
    try {
        if (lacks.empty()) run_process({o.python, "-c", "import numpy, pyoidn"});
    } catch (const Error& e) {
        lacks = e.what();
    }
    if (!lacks.empty()) {
        std::fprintf(stderr, "Open Image Denoise is left out: %s\n", lacks.c_str());
        std::erase_if(o.methods, [](const std::string& m) { return m.rfind("oidn", 0) == 0; });
    } else {
        oidn.emplace(o);
        std::stable_partition(o.methods.begin(), o.methods.end(), [](const std::string& m) { return m == "oidn"; });
    }

    if (!o.json)
        std::printf("%-26s %-26s %10s %10s %s%10s %10s %10s %10s\n", "scene", "method", "spp", "rel_mse",
                    oidn ? "   to oidn " : "", "energy", "seconds", "covered", "half width");
    fs::create_directories(o.cache);
    Results results;
    for (const std::string& scene : o.scenes) measure(o, subject(scene), oidn, results);
    if (!o.json)
        std::printf("\n%-26s %-26s %-26s %10s %10s%s %10s\n", "geometric mean", "method", "worst scene", "spp",
                    "rel_mse", oidn ? "    to oidn" : "", "worst");
    const auto judges = [](const Subject& s) { return s.judges; };
    std::ptrdiff_t judging = 0;
    for (const std::string& scene : o.scenes) judging += judges(subject(scene)) ? 1 : 0;
    if (judging > 0 && judging < std::ptrdiff_t(o.scenes.size())) {
        print_means(o, results, "tuning scenes", std::not_fn(judges));
        print_means(o, results, "judging scenes", judges);
    }
    print_means(o, results, "all scenes", [](const Subject&) { return true; });
} catch (const UsageError& e) {
    std::fprintf(stderr, "bench_denoise: %s\n", e.what());
    return 2;
} catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
}
