// The seed document's experiments, with the error against a long reference and, if asked for, pictures:
//   defaults    1 spp, the scale-free defaults against the original's sigmas
//   E1          the room at 1, 5, 10 and 20 spp, raw and filtered at 65 x 65 (E2: the error falls with every step)
//   E4          Sibenik at 1 and 100 spp, sigma 50, firefly threshold 25
//   E5          the room at 10 spp through a plain bilateral filter, d 65, colour 25, space 1
//   separation  whole windows against rows and columns
//   K1          steps along rows against those along columns: stripes
//   K2          the illumination's sigma times 1/4 to 4
//   K4          pixels far above the reference at 10 and 100 spp
#include "../examples/support/command_line.hpp"
#include "../examples/support/preview.hpp"
#include "renderer.hpp"
#include "scene_files.hpp"
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise.hpp>
#include <lambent/film/metrics.hpp>
#include <lambent/render/render.hpp>
#include <lambent/scene/builtin.hpp>
#include <lambent/scene/missing.hpp>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <tuple>

namespace {

using namespace lambent;
using Image = Plane<float, 3>;

struct Options {
    std::string pictures;
    int reference = 256;
    bool json = false, quick = false;
};

/// A scene, its frames and their reference.
class Subject {
public:
    Subject(std::string title, Scene<float> scene, const Camera& camera, int width, int height,
            int reference_spp)
        : name(std::move(title)), scene_(std::move(scene)), prepared_(prepare(scene_, threads)), camera_(camera),
          width_(width), height_(height) {
        const PixelData<float> frame = trace(reference_spp, 1000);
        reference = frame.radiance;
        mask = emitter_mask(frame.emission.view());
    }

    PixelData<float> trace(int spp, std::uint32_t seed = 1) {
        return trace_paths(*prepared_, camera_, seed,
                           RenderOptions{.width = width_, .height = height_, .end_sample = std::uint64_t(spp)}, threads);
    }
    double rel_mse(const Image& image) const {
        return lambent::rel_mse(image.view(), reference.view(), mask.view());
    }
    /// Of the image as one sees it: clipped at 1 and as sRGB.
    double psnr(const Image& image) const {
        const auto seen = [](const Image& from) {
            Image to = from;
            for (float& x : to.values()) x = linear_to_srgb(std::clamp(x, 0.0f, 1.0f));
            return to;
        };
        return -10 * std::log10(mse(seen(image).view(), seen(reference).view()));
    }

    const std::string name;
    ThreadExecutor threads;
    Image reference;
    Plane<std::uint8_t, 1> mask;

private:
    Scene<float> scene_;
    std::unique_ptr<PreparedScene<float>> prepared_;
    Camera camera_;
    int width_, height_;
};

/// The original's light for OBJ scenes.
void add_original_light(Scene<float>& scene) {
    Material m;
    m.base_color = Vec3f(0);
    m.emission = Vec3f(20);
    scene.materials.push_back(m);
    scene.spheres.push_back(
        {Vec3f(Vec3d(-5, 10, 0) - scene.origin), 8, std::uint32_t(scene.materials.size() - 1)});
}

class Experiments {
public:
    explicit Experiments(const Options& options) : o_(options) {
        const int side = o_.quick ? 64 : 192;
        add("cornell", cornell_scene<float>(), {}, side, side);
        add("room", room_scene<float>(), {}, side, side);
        const std::filesystem::path shared = LAMBENT_SHARED_DIR "/scenes";
        const Camera atrium{
            .eye = {-11, 2.5, -0.5}, .target = {0, 3.5, -0.3}, .vertical_fov = 70, .name = {}};
        const Camera nave{
            .eye = {-18, -15, -0.1}, .target = {-17, -14.75, -0.1}, .vertical_fov = 53.13, .name = {}};
        for (const auto& [name, file, camera] : {std::tuple{"sponza", "sponza_crytek/sponza.glb", atrium},
                                                 std::tuple{"sibenik", "sibenik/sibenik.obj", nave}})
            if (!o_.quick && std::filesystem::exists(shared / file)) {
                Scene<float> scene = scene_of_file((shared / file).string());
                if (std::string(name) == "sibenik")
                    add_original_light(scene);
                else
                    scene.environment = soft_sky();
                add(name, std::move(scene), camera, 256, 144);
            }
    }

    bool run() {
        for (auto& s : subjects_) defaults(*s.second);
        const auto room = subjects_.find("room"), sibenik = subjects_.find("sibenik");
        samples(*room->second);
        bilateral(*room->second);
        separation(*room->second);
        outliers(*room->second);
        if (sibenik != subjects_.end()) church(*sibenik->second);
        for (auto& s : subjects_) sweep(*s.second);
        return good_;
    }

private:
    void add(const std::string& name, Scene<float> scene, std::optional<Camera> camera, int width,
             int height) {
        const Camera chosen = camera ? *camera : scene.cameras.at(0);
        subjects_[name] = std::make_unique<Subject>(name, std::move(scene), chosen, width, height,
                                                    o_.quick ? 64 : o_.reference);
        picture(*subjects_[name], "reference", o_.reference, subjects_[name]->reference);
    }

    Image clean(Subject& s, const PixelData<float>& frame, const DenoiseOptions& options) {
        return denoise_frame(frame, options, s.threads).radiance;
    }
    void picture(const Subject& s, const std::string& what, int spp, const Image& image) const {
        if (o_.pictures.empty()) return;
        const std::string file = s.name + "_" + what + "_" + std::to_string(spp) + ".png";
        write_preview((std::filesystem::path(o_.pictures) / file).string(), {image.view()}, 0);
    }
    /// Prints a row; gives the relative error.
    double row(const char* experiment, const Subject& s, const std::string& what, int spp,
               const Image& image) {
        const double error = s.rel_mse(image), psnr = s.psnr(image);
        std::printf(o_.json ? "{\"bench\": \"experiments\", \"experiment\": \"%s\", \"scene\": \"%s\", "
                              "\"method\": \"%s\", "
                              "\"spp\": %d, \"rel_mse\": %.6g, \"psnr\": %.6g}\n"
                            : "%-11s %-8s %-22s %4d spp   relMSE %9.4g   PSNR %6.2f dB\n",
                    experiment, s.name.c_str(), what.c_str(), spp, error, psnr);
        std::fflush(stdout);
        expect(is_finite(error), experiment, "the image is not finite");
        picture(s, what, spp, image);
        return error;
    }
    void expect(bool holds, const char* experiment, const char* otherwise) {
        if (!holds) std::fprintf(stderr, "%s: %s\n", experiment, otherwise);
        good_ = good_ && holds;
    }

    void defaults(Subject& s) {
        const PixelData<float> frame = s.trace(1);
        const double raw = row("defaults", s, "raw", 1, frame.radiance);
        const double seed = row("defaults", s, "seed", 1, clean(s, frame, denoise_options("seed")));
        const double ours = row("defaults", s, "balanced", 1, clean(s, frame, {}));
        row("defaults", s, "best", 1, clean(s, frame, denoise_options("best")));
        if (!o_.json)
            std::printf("            %-8s seed / balanced %.3g, raw / balanced %.3g\n", s.name.c_str(),
                        seed / ours, raw / ours);
        expect(ours < raw, "defaults", "the filter makes the image worse");
    }

    void samples(Subject& s) {
        DenoiseOptions wide;
        wide.kernel = 65;
        double before = std::numeric_limits<double>::infinity();
        for (const int spp : {1, 5, 10, 20}) {
            const PixelData<float> frame = s.trace(spp);
            const double raw = row("E1", s, "raw", spp, frame.radiance);
            const double seed = row("E1", s, "seed", spp, clean(s, frame, denoise_options("seed")));
            const double ours = row("E1", s, "balanced at 65 x 65", spp, clean(s, frame, wide));
            expect(ours < raw && ours < seed, "E1", "no better than raw and the original's sigmas");
            expect(ours < before, "E2", "more samples do not lower the error");
            before = ours;
        }
    }

    void bilateral(Subject& s) {
        const PixelData<float> frame = s.trace(10);
        Image plain(frame.width, frame.height);
        cross_bilateral<float>(
            frame.radiance.view(), plain.view(),
            {.kernel = 65, .sigma_spatial = 1, .sigma_illumination = 25, .form = BilateralForm::reuse_2d},
            s.threads);
        const double other = row("E5", s, "plain bilateral", 10, plain);
        expect(row("E5", s, "balanced", 10, clean(s, frame, {})) < other, "E5",
               "no better than a plain bilateral filter");
    }

    void separation(Subject& s) {
        const PixelData<float> frame = s.trace(1);
        for (const char* form : {"reuse_2d", "separable_reuse"}) {
            const Image image = clean(s, frame, denoise_options(form));
            row("separation", s, form, 1, image);
            double along = 0, down = 0; // mean steps to the right and to the lower neighbour
            for (int y = 0; y + 1 < image.height(); ++y)
                for (int x = 0; x + 1 < image.width(); ++x) {
                    const Vec3f here = image.load(x, y), right = image.load(x + 1, y),
                                below = image.load(x, y + 1);
                    along += double(std::abs(right.y - here.y)) / (0.1 + here.y);
                    down += double(std::abs(below.y - here.y)) / (0.1 + here.y);
                }
            if (!o_.json)
                std::printf("K1          %-8s %-22s steps along rows / columns %.3f\n", s.name.c_str(), form,
                            along / down);
        }
    }

    void outliers(Subject& s) {
        int counts[2] = {0, 0};
        for (const int spp : {10, 100}) {
            const Image image = clean(s, s.trace(spp), {});
            row("K4", s, "balanced", spp, image);
            for (std::size_t i = 0; i < image.values().size(); ++i)
                counts[spp == 100] += image.values()[i] > 2 * s.reference.values()[i] + 0.1f ? 1 : 0;
        }
        if (!o_.json)
            std::printf("K4          %-8s values above twice the reference + 0.1: %d, then %d\n",
                        s.name.c_str(), counts[0], counts[1]);
        expect(counts[1] <= counts[0], "K4", "more samples, more outliers");
    }

    void church(Subject& s) {
        for (const int spp : {1, 100}) {
            const PixelData<float> frame = s.trace(spp);
            row("E4", s, "raw", spp, frame.radiance);
            row("E4", s, "seed", spp, clean(s, frame, denoise_options("seed")));
            row("E4", s, "balanced", spp, clean(s, frame, {}));
        }
    }

    void sweep(Subject& s) {
        const PixelData<float> frame = s.trace(4);
        for (const double factor : {0.25, 0.5, 1.0, 2.0, 4.0}) {
            DenoiseOptions options;
            options.sigma_illumination *= factor;
            char what[32];
            std::snprintf(what, sizeof what, "sigma x %g", factor);
            row("K2", s, what, 4, clean(s, frame, options));
        }
    }

    Options o_;
    std::map<std::string, std::unique_ptr<Subject>> subjects_;
    bool good_ = true;
};

} // namespace

int main(int argc, char** argv) {
    Options o;
    CommandLine line("bench_experiments [options]");
    bool help = false;
    line.add("--pictures FOLDER", "writes every image as PNG (none)", [&](auto& v) { o.pictures = v; });
    line.add("--reference N", "samples a pixel of the references (256)",
             [&](auto& v) { o.reference = int(to_integer(v, 1, 1 << 20)); });
    line.add("--quick", "small images of the builtin scenes", [&](auto&) { o.quick = true; });
    line.add("--json", "one object a line", [&](auto&) { o.json = true; });
    line.add("--help", "this text", [&](auto&) { help = true; });
    try {
        if (!line.parse(argc, argv).empty()) throw UsageError("takes options only");
        if (help) {
            line.print_help();
            return 0;
        }
        return Experiments(o).run() ? 0 : 1;
    } catch (const UsageError& e) {
        std::fprintf(stderr, "bench_experiments: %s\nbench_experiments --help lists the options\n", e.what());
        return 2;
    } catch (const std::exception& e) {
        std::fprintf(stderr, "bench_experiments: %s\n", e.what());
        return 1;
    }
}
