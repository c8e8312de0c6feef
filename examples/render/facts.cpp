#include "facts.hpp"
#include <algorithm>
#include <lambent/scene/features.hpp>

using namespace lambent;

namespace {

template <class Is>
bool any_material(const Scene<float>& scene, Is&& is) {
    return std::any_of(scene.materials.begin(), scene.materials.end(), is);
}
bool any_normal_map(const Scene<float>& scene) {
    return any_material(scene, [](const Material& m) { return bool(m.normal_texture); });
}
bool any_emissive(const Scene<float>& scene) {
    return any_material(scene, [](const Material& m) { return m.emissive(); });
}

} // namespace

std::vector<std::string> facts_of(const Scene<float>& scene) {
    std::vector<std::string> facts;
    const auto add = [&](bool there, const char* name) {
        if (there) facts.emplace_back(name);
    };
    add(!scene.triangles.empty(), "triangles");
    add(!scene.spheres.empty(), "spheres");
    add(!scene.normals.empty(), "vertex_normals");
    add(!scene.colors.empty(), "vertex_colors");
    add(!scene.images.empty(), "textures");
    add(any_normal_map(scene), "normal_maps");
    const SceneFeatures has = features_of(scene);
    add(has.alpha, "alpha");
    add(has.specular, "specular");
    add(has.specular && scene.compensated, "compensation");
    add(any_material(scene, [](const Material& m) { return m.transmission > 0; }), "transmission");
    add(any_material(scene, [](const Material& m) { return m.may_be_pane(); }), "panes");
    add(any_emissive(scene), "emissive_surfaces");
    add(any_material(scene, [](const Material& m) { return bool(m.emission_texture); }), "emissive_textures");
    add(!scene.punctual_lights.empty(), "punctual_lights");
    add(!scene.environment.black(), "environment");
    add(!scene.environment.map.empty(), "environment_map");
    return facts;
}

bool is_specialised(const Options& o, const Scene<float>& scene) {
    return o.integrator == IntegratorKind::path && o.strategy == PathStrategy::both && o.mis == MisHeuristic::power &&
           plain_features.hold(features_of(scene));
}

std::vector<std::string> skipped_by(const Options& o, const Scene<float>& scene) {
    std::vector<std::string> skipped;
    const auto add = [&](bool left_out, const char* name) {
        if (left_out) skipped.emplace_back(name);
    };
    add(scene.images.empty(), "textures");
    add(!any_normal_map(scene), "normal_maps");
    const SceneFeatures has = features_of(scene);
    add(!has.alpha, "alpha");
    if (o.integrator != IntegratorKind::path) return skipped;
    add(is_specialised(o, scene), "general_code");
    add(!has.specular, "standard_bsdf");
    // Where a bounce may find it too, an environment of one colour is not aimed at.
    const bool aims = any_emissive(scene) || !scene.punctual_lights.empty() || !scene.environment.map.empty() ||
                      (o.strategy == PathStrategy::light && !scene.environment.black());
    add(o.strategy == PathStrategy::bsdf || !aims, "light_sampling");
    add(o.strategy != PathStrategy::both || !aims, "mis");
    return skipped;
}
