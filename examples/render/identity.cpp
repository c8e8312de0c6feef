#include "identity.hpp"
#include "facts.hpp"
#include <lambent/scene/fingerprint.hpp>
#include <cmath>
#include <cstdio>

using namespace lambent;

namespace {

std::string text_of(double number) {
    char text[32];
    std::snprintf(text, sizeof text, "%.17g", number);
    return text;
}

std::string text_of(const Vec3d& v) { return text_of(v.x) + "," + text_of(v.y) + "," + text_of(v.z); }

std::string text_of(const Camera& camera) {
    return "eye " + text_of(camera.eye) + " target " + text_of(camera.target) + " up " + text_of(camera.up) + " vfov " +
           text_of(camera.vertical_fov) +
           (camera.lens_radius > 0 ? " lens " + text_of(camera.lens_radius) + " focus " + text_of(camera.focus_distance) : "");
}

std::string integrator_of(const Options& o) {
    switch (o.integrator) {
    case IntegratorKind::direct: return "direct";
    case IntegratorKind::ao: return "ao";
    case IntegratorKind::first_hit: return "first-hit";
    case IntegratorKind::path: break;
    }
    const char* const strategies[] = {"both", "light", "bsdf"};
    const auto depth = [](std::uint32_t n) { return n == PathOptions::unlimited ? "unlimited" : std::to_string(n); };
    std::string text = "path, strategy " + std::string(strategies[int(o.strategy)]);
    if (o.strategy == PathStrategy::both) text += o.mis == MisHeuristic::power ? ", mis power" : ", mis balance";
    return text + ", max depth " + depth(o.path.max_depth) + ", roulette depth " + depth(o.path.roulette_depth);
}

std::string sampler_of(const Options& o) {
    switch (o.sampler) {
    case SamplerKind::sobol: return "sobol";
    case SamplerKind::independent: return "independent";
    case SamplerKind::stratified: break;
    }
    return "stratified for " + std::to_string(o.spp) + " spp";
}

} // namespace

std::map<std::string, std::string> identity_of(const Options& o, const Scene<float>& scene, const Camera& camera) {
    char hash[20];
    std::snprintf(hash, sizeof hash, "%016llx", static_cast<unsigned long long>(fingerprint(scene)));
    const auto list = [](const std::vector<std::string>& words) {
        std::string text;
        for (const std::string& word : words) text.append(text.empty() ? "" : " ").append(word);
        return text;
    };
    return {{"scene", std::string("content ") + hash},
            {"scene facts", list(facts_of(scene))},
            {"skipped", list(skipped_by(o, scene))},
            {"error target", o.error_target > 0 ? text_of(o.error_target) : "none"},
            {"camera", text_of(camera)},
            {"integrator", integrator_of(o)},
            {"sampler", sampler_of(o)},
            {"pixel filter", std::vector<std::string>{"box", "tent", "blackman-harris"}[std::size_t(o.filter)]},
            {"seed", std::to_string(o.seed)},
            {"firefly clamp", std::isinf(o.firefly_clamp) ? "off" : text_of(o.firefly_clamp)}};
}
