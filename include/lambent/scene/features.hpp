#pragma once
#include <lambent/scene/scene.hpp>
#include <algorithm>
#include <string>

namespace lambent {
inline namespace LAMBENT_ABI {

/// What a scene may have beside opaque triangles of Lambert's reflection, one colour each. As a template argument: what
/// code is made for.
struct SceneFeatures {
    bool textures = true;   ///< images; without them texture coordinates are idle
    bool colors = true;     ///< of vertices
    bool alpha = true;      ///< materials that are masked or blended
    bool specular = true;   ///< materials that reflect otherwise, or let light through
    bool spheres = true;
    bool front_only = true; ///< materials whose back sides cameras don't see

    friend constexpr bool operator==(const SceneFeatures&, const SceneFeatures&) = default;

    /// Calls f(member, name) for each.
    template <class F>
    static constexpr void for_each(F&& f) {
        f(&SceneFeatures::textures, "textures"), f(&SceneFeatures::colors, "vertex colours");
        f(&SceneFeatures::alpha, "alpha"), f(&SceneFeatures::specular, "specular materials");
        f(&SceneFeatures::spheres, "spheres"), f(&SceneFeatures::front_only, "materials without back sides");
    }

    /// Whether code made for these features can do with a scene that has `used`.
    constexpr bool hold(const SceneFeatures& used) const {
        bool all = true;
        for_each([&](auto feature, const char*) { all = all && (this->*feature || !(used.*feature)); });
        return all;
    }
};

/// All of them.
inline constexpr SceneFeatures every_feature{};
/// None: opaque triangles of Lambert's reflection, one colour each.
inline constexpr SceneFeatures no_feature{false, false, false, false, false, false};

/// None but back sides that cameras may not see, as glTF has them unless told otherwise: those cost nothing.
inline constexpr SceneFeatures plain_features{false, false, false, false, false, true};

/// Those of a scene's materials and arrays, used or not.
template <class T>
SceneFeatures features_of(const Scene<T>& scene) {
    const auto any = [&](auto&& is) { return std::any_of(scene.materials.begin(), scene.materials.end(), is); };
    const auto textured = [](const Material& m) {
        bool has = false;
        Material::for_each_texture(m, [&](const Texture& t) { has = has || bool(t); });
        return has;
    };
    return {.textures = any(textured),
            .colors = !scene.colors.empty(),
            .alpha = any([](const Material& m) { return m.alpha_mode != AlphaMode::opaque; }),
            .specular = any([](const Material& m) { return !m.diffuse(); }),
            .spheres = !scene.spheres.empty(),
            .front_only = any([](const Material& m) { return m.front_only; })};
}

} // namespace LAMBENT_ABI
} // namespace lambent
