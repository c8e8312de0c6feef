#include "options.hpp"
#include "../support/command_line.hpp"

using namespace lambent;

namespace {

Vec3d to_vector(const std::string& text) {
    const std::vector<double> n = to_numbers(text, 3);
    return {n[0], n[1], n[2]};
}

void set_size(Options& o, const std::string& text) {
    const std::size_t x = text.find('x');
    if (x == std::string::npos) throw UsageError("must be WxH, as in 1280x720");
    o.width = int(to_integer(text.substr(0, x), 1, 1 << 16));
    o.height = int(to_integer(text.substr(x + 1), 1, 1 << 16));
}

void set_range(Options& o, const std::string& text) {
    const std::size_t colon = text.find(':');
    if (colon == std::string::npos) throw UsageError("must be A:B, as in 0:64");
    o.range_begin = std::uint64_t(to_integer(text.substr(0, colon), 0, 1ll << 32));
    o.range_end = std::uint64_t(to_integer(text.substr(colon + 1), 0, 1ll << 32));
    if (*o.range_begin >= *o.range_end) throw UsageError("is empty");
}

void set_crop(Options& o, const std::string& text) {
    const std::vector<double> n = to_numbers(text, 4);
    o.crop = {int(n[0]), int(n[1]), int(n[2]), int(n[3])};
    if (o.crop.empty()) throw UsageError("is empty");
}

} // namespace

Options parse_options(int argc, char** argv) {
    Options o;
    CommandLine line("render SCENE [options]     SCENE: .gltf .glb .obj builtin:cornell builtin:room[:LIGHTS]");
    bool help = false;
    line.add("--out F.exr", "the image, with its planes (out.exr)", [&](auto& v) { o.out = v; });
    line.add("--preview F.png", "an sRGB preview (none)", [&](auto& v) { o.preview = v; });
    line.add("--size WxH", "in pixels (1280x720)", [&](auto& v) { set_size(o, v); });
    line.add("--spp N", "samples a pixel (16)", [&](auto& v) { o.spp = std::uint64_t(to_integer(v, 1, 1ll << 32)); });
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
    line.add("--roulette-depth N|off", "scattering events before roulette (4)", [&](auto& v) {
        o.path.roulette_depth = v == "off" ? PathOptions::unlimited : std::uint32_t(to_integer(v, 0, 0x7fffffff));
    });
    line.add("--env F.hdr|F.exr|constant:r,g,b", "light from far away (none)", [&](auto& v) { o.environment = v; });
    line.add("--env-rotate DEG", "about the vertical (0)", [&](auto& v) { o.environment_rotation = to_number(v); });
    line.add("--env-scale X", "factor on it (1)", [&](auto& v) { o.environment_scale = to_positive(v); });
    line.add("--sphere-light x,y,z,r,radiance", "one more light; repeatable", [&](auto& v) {
        const std::vector<double> n = to_numbers(v, 5);
        if (!(n[3] > 0) || !(n[4] >= 0)) throw UsageError("radius must be > 0 and radiance >= 0");
        o.sphere_lights.push_back({{n[0], n[1], n[2]}, n[3], n[4]});
    });
    line.add("--camera N", "which of the scene's cameras (0)", [&](auto& v) {
        o.camera = int(to_integer(v, 0, 1 << 20));
        o.camera_chosen = true;
    });
    line.add("--eye x,y,z", "instead of the camera's", [&](auto& v) { o.eye = to_vector(v); });
    line.add("--target x,y,z", "instead of the camera's", [&](auto& v) { o.target = to_vector(v); });
    line.add("--up x,y,z", "instead of the camera's", [&](auto& v) { o.up = to_vector(v); });
    line.add("--vfov DEG", "vertical angle of view, in (0, 180)", [&](auto& v) {
        o.vertical_fov = to_positive(v);
        if (!(*o.vertical_fov < 180)) throw UsageError("must be below 180");
    });
    line.add("--crop x0,y0,x1,y1", "only these pixels, the same bits as in the whole image",
             [&](auto& v) { set_crop(o, v); });
    line.add("--aov all|none|LIST", "planes beside the image, as albedo,N,Z (all)", [&](auto& v) { o.aov = v; });
    line.add("--float", "float32 throughout the EXR", [&](auto&) { o.full_float = true; });
    line.add("--firefly X|off", "scale down samples whose reflected radiance exceeds X (off)", [&](auto& v) {
        o.firefly_clamp = v == "off" ? std::numeric_limits<double>::infinity() : to_positive(v);
    });
    line.add("--exposure EV", "of the preview, in stops (0)", [&](auto& v) { o.exposure = to_number(v); });
    line.add("--time-limit S", "stop after S seconds of rendering with what there is",
             [&](auto& v) { o.time_limit = to_positive(v); });
    line.add("--sample-range A:B", "only the samples A to B-1; writes F.film for merge", [&](auto& v) { set_range(o, v); });
    line.add("--resume F.film", "go on from a saved state up to --spp", [&](auto& v) { o.resume = v; });
    line.add("--checkpoint", "write F.film beside F.exr", [&](auto&) { o.checkpoint = true; });
    line.add("--stats F.json", "counts and times", [&](auto& v) { o.stats = v; });
    line.add("--error-target E", "not yet", [](auto&) { throw UsageError("not yet"); });
    line.add("--explain", "not yet", [](auto&) { throw UsageError("not yet"); });
    line.add("--quiet", "say nothing but errors", [&](auto&) { o.quiet = true; });
    line.add("--help", "this text", [&](auto&) { help = true; });
    const std::vector<std::string> rest = line.parse(argc, argv);
    if (help) {
        line.print_help();
        std::exit(0);
    }
    if (rest.size() != 1) throw UsageError(rest.empty() ? "no scene" : "more than one scene: " + rest[0] + " and " + rest[1]);
    o.scene = rest[0];
    return o;
}
