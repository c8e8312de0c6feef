#include "options.hpp"
#include "../support/command_line.hpp"
#include <lambent/render/render.hpp>

using namespace lambent;

namespace {

void set_size(Options& o, const std::string& text) {
    const std::vector<std::string> parts = split(text, 'x');
    if (parts.size() != 2) throw UsageError("must be WxH, as in 1280x720");
    o.width = int(to_integer(parts[0], 1, 1 << 16));
    o.height = int(to_integer(parts[1], 1, 1 << 16));
}

void set_range(Options& o, const std::string& text) {
    const std::vector<std::string> parts = split(text, ':');
    if (parts.size() != 2) throw UsageError("must be A:B, as in 0:64");
    const auto bound = [](const std::string& part) { return std::uint64_t(to_integer(part, 0, std::int64_t(max_samples))); };
    o.range = SampleRange{bound(parts[0]), bound(parts[1])};
    if (o.range->begin >= o.range->end) throw UsageError("is empty");
}

void set_crop(Options& o, const std::string& text) {
    const std::vector<std::string> parts = split_exactly(text, ',', 4);
    const auto bound = [&](std::size_t i) { return int(to_integer(parts[i], 0, 1 << 16)); };
    o.crop = {bound(0), bound(1), bound(2), bound(3)};
    if (o.crop.empty()) throw UsageError("is empty");
}

void set_pixel(Options& o, const std::string& text) {
    const std::vector<std::string> parts = split_exactly(text, ',', 2);
    o.pixel = {int(to_integer(parts[0], 0, 1 << 16)), int(to_integer(parts[1], 0, 1 << 16))};
}

void set_environment(Options& o, const std::string& text) {
    const std::string constant = "constant:";
    o.environment.clear();
    o.constant_environment.reset();
    if (text.rfind(constant, 0) != 0) {
        o.environment = text;
        return;
    }
    o.constant_environment = to_vector(text.substr(constant.size()));
    if (min_component(*o.constant_environment) < 0) throw UsageError("radiance must be >= 0");
}

void add_sphere_light(Options& o, const std::string& text) {
    const std::vector<double> n = to_numbers(text, 5);
    if (!(n[3] > 0) || !(n[4] >= 0)) throw UsageError("radius must be > 0 and radiance >= 0");
    o.sphere_lights.push_back({{n[0], n[1], n[2]}, n[3], n[4]});
}

void set_firefly_rule(Options& o, const std::string& text) {
    const std::string clamp = "clamp:";
    if (text.rfind(clamp, 0) == 0) o.firefly_clamp = to_positive(text.substr(clamp.size()));
    else set_firefly(o.image, text);
}

std::string to_file(const std::string& text, const std::string& extension) {
    if (!text.ends_with(extension) || text.size() == extension.size()) throw UsageError("must end in " + extension);
    return text;
}

void check_together(const Options& o) {
    if (!o.crop.empty() && !o.crop.inside(o.width, o.height))
        throw UsageError("--crop reaches out of the image of " + std::to_string(o.width) + " x " + std::to_string(o.height));
    if (o.pixel && (o.pixel->x >= o.width || o.pixel->y >= o.height))
        throw UsageError("--pixel lies outside of the image of " + std::to_string(o.width) + " x " + std::to_string(o.height));
    if (o.pixel && o.error_target > 0)
        throw UsageError("--pixel and --error-target exclude each other: how many samples a pixel gets takes its neighbours");
    if (o.range && o.error_target > 0)
        throw UsageError(
            "--sample-range and --error-target exclude each other: where a pixel stops takes all samples before");
    if (o.eye && o.target && *o.eye == *o.target) throw UsageError("--eye and --target coincide");
}

void add_examples(CommandLine& line) {
    const auto add = [&](const char* what, const char* arguments) { line.add_example(what, arguments); };
    add("a scene, denoised, with a picture to look at", "render scene.glb --spp 64 --size 1920x1080 --out a.exr --preview a.png");
    add("until the image is good to 5 %", "render scene.glb --error-target 0.05 --out a.exr");
    add("what can be done in ten minutes", "render scene.glb --spp 65536 --time-limit 600 --out a.exr");
    add("a long one, saved as it goes", "render scene.glb --spp 4096 --checkpoint --out a.exr");
    add("go on with it", "render scene.glb --spp 8192 --resume a.film --out a.exr");
    add("a part of the samples, here or elsewhere", "render scene.glb --spp 64 --sample-range 0:32 --out a.exr");
    add("the parts together", "merge all.film a.film b.film");
    add("a part of the image", "render scene.glb --size 1920x1080 --crop 800,400,1120,680 --out part.exr");
    add("why a pixel is as it is: the paths of its samples", "render scene.glb --size 1920x1080 --spp 4 --pixel 960,540");
    add("what a scene file has", "render scene.glb --validate");
    add("what was left out for a scene, and what that saved", "render scene.glb --explain");
}

} // namespace

std::optional<Options> parse_options(int argc, char** argv, const std::string& program) {
    Options o;
    o.command.assign(argv, argv + argc);
    CommandLine line(program + " SCENE [options]     SCENE: .gltf .glb .obj builtin:cornell builtin:door builtin:room[:LIGHTS]");
    bool help = false;
    line.add("--out F.exr", "the image, with its planes (out.exr)", [&](auto& v) { o.out = to_file(v, ".exr"); });
    line.add("--preview F.png", "an sRGB preview (none)", [&](auto& v) { o.preview = to_file(v, ".png"); });
    line.add("--size WxH", "in pixels (1280x720)", [&](auto& v) { set_size(o, v); });
    std::optional<std::uint64_t> spp;
    line.add("--spp N", "samples a pixel (16), with --error-target at most (65536)",
             [&](auto& v) { spp = std::uint64_t(to_integer(v, 1, 1ll << 32)); });
    line.add("--seed S", "another seed, other noise (0)",
             [&](auto& v) { o.seed = std::uint32_t(to_integer(v, 0, 0xffffffffll)); });
    line.add("--threads N", "0 = all of the machine's (0); the image does not depend on it",
             [&](auto& v) { o.threads = unsigned(to_integer(v, 0, 4096)); });
    line.add("--integrator NAME", "path|direct|ao|first-hit (path)", [&](auto& v) {
        o.integrator = IntegratorKind(to_choice(v, {"path", "direct", "ao", "first-hit"}));
    });
    line.add("--sampler NAME", "sobol|stratified|independent (sobol)",
             [&](auto& v) { o.sampler = SamplerKind(to_choice(v, {"sobol", "stratified", "independent"})); });
    line.add("--strategy NAME", "how light is found: both|light|bsdf (both)",
             [&](auto& v) { o.strategy = PathStrategy(to_choice(v, {"both", "light", "bsdf"})); });
    line.add("--mis NAME", "power|balance (power)",
             [&](auto& v) { o.mis = MisHeuristic(to_choice(v, {"power", "balance"})); });
    line.add("--max-depth N", "scattering events, 0 = emission only (unlimited)",
             [&](auto& v) { o.path.max_depth = std::uint32_t(to_integer(v, 0, 0x7fffffff)); });
    line.add("--roulette-depth N|off", "scattering events before roulette (2)", [&](auto& v) {
        o.path.roulette_depth = v == "off" ? PathOptions::unlimited : std::uint32_t(to_integer(v, 0, 0x7fffffff));
    });
    line.add("--env F.hdr|F.exr|constant:r,g,b", "light from far away (the scene's)", [&](auto& v) { set_environment(o, v); });
    line.add("--env-rotate DEG", "about the vertical (0)", [&](auto& v) { o.environment_rotation = to_number(v); });
    line.add("--compensation", "facets pass light on to each other, which glTF's formula loses (off)",
             [&](auto&) { o.compensated = true; });
    line.add("--env-scale X", "factor on it (1)", [&](auto& v) { o.environment_scale = to_positive(v); });
    line.add("--sphere-light x,y,z,r,radiance", "one more light; repeatable (none)", [&](auto& v) { add_sphere_light(o, v); });
    line.add("--scene N", "which of a glTF file's scenes (its default)",
             [&](auto& v) { o.load.scene = int(to_integer(v, 0, 1 << 20)); });
    line.add("--scene-root FOLDER", "the scene may name files in and below it (the scene's own)",
             [&](auto& v) { o.load.root = v; });
    line.add("--max-triangles N", "refuse scenes with more (268435456)",
             [&](auto& v) { o.load.max_triangles = std::size_t(to_integer(v, 1, 1ll << 31)); });
    line.add("--max-nodes N", "refuse scenes with more nodes or instances (16777216)",
             [&](auto& v) { o.load.max_nodes = std::size_t(to_integer(v, 1, 1ll << 31)); });
    line.add("--max-pixels N", "leave larger textures out (268435456)",
             [&](auto& v) { o.load.max_pixels = std::size_t(to_integer(v, 1, 1ll << 31)); });
    line.add("--camera N", "which of the scene's cameras (0)", [&](auto& v) {
        o.camera = int(to_integer(v, 0, 1 << 20));
        o.camera_chosen = true;
    });
    line.add("--eye x,y,z", "instead of the camera's (its own)", [&](auto& v) { o.eye = to_vector(v); });
    line.add("--target x,y,z", "instead of the camera's (its own)", [&](auto& v) { o.target = to_vector(v); });
    line.add("--up x,y,z", "instead of the camera's (its own)", [&](auto& v) { o.up = to_vector(v); });
    line.add("--vfov DEG", "vertical angle of view, in (0, 180) (the camera's)", [&](auto& v) {
        o.vertical_fov = to_positive(v);
        if (!(*o.vertical_fov < 180)) throw UsageError("must be below 180");
    });
    line.add("--lens-radius M", "of a thin lens, in metres; blurs what is not in focus (0)",
             [&](auto& v) { o.lens_radius = to_positive(v); });
    line.add("--focus M", "distance of the sharp plane (the target's)", [&](auto& v) { o.focus_distance = to_positive(v); });
    line.add("--pixel-filter NAME", "box|tent|blackman-harris (box)",
             [&](auto& v) { o.filter = PixelFilter(to_choice(v, {"box", "tent", "blackman-harris"})); });
    line.add("--crop x0,y0,x1,y1", "only these pixels, the same as in the whole image (all)",
             [&](auto& v) { set_crop(o, v); });
    line.add("--pixel x,y", "print the paths of this pixel's samples, render nothing else (none)",
             [&](auto& v) { set_pixel(o, v); });
    add_image_options(line, o.image);
    line.add("--firefly off|clamp:X|seed[:S]",
             "off; clamp samples whose reflected radiance exceeds X; the seed's rule at S (by the method)",
             [&](auto& v) { set_firefly_rule(o, v); });
    line.add("--exposure EV", "of the preview, in stops (0)", [&](auto& v) { o.exposure = to_number(v); });
    line.add("--time-limit S", "stop after S seconds of rendering with what there is (none)",
             [&](auto& v) { o.time_limit = to_positive(v); });
    line.add("--sample-range A:B", "only the samples A to B-1; writes F.film for merge (0:spp)", [&](auto& v) { set_range(o, v); });
    line.add("--resume F.film", "go on from a saved state up to --spp; writes F.film (none)",
             [&](auto& v) { o.resume = to_file(v, ".film"); });
    line.add("--checkpoint", "write F.film beside F.exr, every few seconds (off)", [&](auto&) { o.checkpoint = true; });
    line.add("--stats F.json", "counts and times (none)", [&](auto& v) { o.stats = v; });
    line.add("--error-target E", "sample where it is noisy until the estimated error is E, as in 0.05 (none)",
             [&](auto& v) { o.error_target = to_positive(v); });
    line.add("--explain", "print what the scene has, what was left out for it, and what that saved (off)",
             [&](auto&) { o.explain = true; });
    line.add("--validate", "print what the scene has and everything suspicious, render nothing", [&](auto&) { o.validate = true; });
    line.add("--quiet", "say nothing but errors (off)", [&](auto&) { o.quiet = true; });
    line.add("--help", "this text", [&](auto&) { help = true; });
    const std::vector<std::string> rest = line.parse(argc, argv);
    if (help) {
        add_examples(line);
        line.print_help();
        return std::nullopt;
    }
    if (rest.size() != 1) throw UsageError(rest.empty() ? "no scene" : "more than one scene: " + rest[0] + " and " + rest[1]);
    o.scene = rest[0];
    o.film = with_extension(o.out, ".film");
    o.spp = spp.value_or(o.error_target > 0 ? 65536 : 16);
    check_together(o);
    return o;
}
