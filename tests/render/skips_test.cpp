// What is left out for a scene that doesn't need it changes no bit.
#include "same_bits.hpp"
#include "support/random.hpp"
#include <doctest/doctest.h>
#include <lambent/core/parallel.hpp>
#include <lambent/render/ambient_occlusion.hpp>
#include <lambent/render/counting_scene.hpp>
#include <lambent/render/direct.hpp>
#include <lambent/render/first_hit.hpp>
#include <lambent/render/path.hpp>
#include <lambent/render/render.hpp>
#include <lambent/sampling/sobol.hpp>
#include <lambent/scene/builtin.hpp>
#include <lambent/scene/specialised_scene.hpp>

using namespace lambent;
using lambent_test::same_bits;

namespace {

/// An integrator that does not say what it makes of a miss.
template <class I>
struct Secretive {
    I integrator;
    template <class S, class Stream>
    PixelSample<typename S::Scalar> sample(const S& scene, const Ray<typename S::Scalar>& ray, const Stream& stream,
                                           RayCounts& counts) const {
        return integrator.sample(scene, ray, stream, counts);
    }
};

/// The Cornell box with much sky around, of one colour.
Scene<float> under_open_sky() {
    Scene<float> scene = cornell_scene<float>();
    scene.environment.scale = Vec3f(0.3f, 0.5f, 1.1f);
    Camera& camera = scene.cameras[0];
    camera.eye += 1.5 * (camera.eye - camera.target) + Vec3d(0.7, 0.4, 0);
    return scene;
}

struct Rendered {
    Film<float> film;
    RenderResult result;
};

template <class S, class I>
Rendered rendered(const S& scene, const Camera& camera, const I& integrator, RenderOptions options = {}) {
    if (options.width == 1280) options.width = 60, options.height = 44;
    Rendered r;
    ThreadExecutor threads(2);
    r.result = render(r.film, scene, camera, integrator, SobolSampler<float>(3), options, threads, [] { return true; });
    return r;
}

} // namespace

TEST_CASE("tiles that see one background take one sample a pixel, and have the bits of all") {
    const Scene<float> scene = under_open_sky();
    SerialExecutor serial;
    const PreparedScene<float> prepared(scene, serial);
    const auto check = [&](const auto& integrator, const RenderOptions& options) {
        const Rendered with = rendered(prepared, scene.cameras[0], integrator, options);
        const Rendered without =
            rendered(prepared, scene.cameras[0], Secretive<std::remove_cvref_t<decltype(integrator)>>{integrator}, options);
        CHECK(same_bits(with.film, without.film));
        CHECK(with.result.skipped > 60 * 44 * (options.end_sample - options.first_sample - 1) / 5);
        CHECK(with.result.skipped + with.result.rays.closest == without.result.rays.closest);
        CHECK(without.result.skipped == 0);
    };
    for (const FilmPlanes planes : {FilmPlanes::radiance, FilmPlanes::features, FilmPlanes::statistics})
        check(PathIntegrator<>{}, {.first_sample = 5, .end_sample = 18, .planes = planes});
    check(PathIntegrator<>{}, {.end_sample = 64, .filter = PixelFilter::blackman_harris, .firefly_clamp = 0.4});
    check(PathIntegrator<PathStrategy::light>{}, {.end_sample = 7, .tile = 5});
    check(DirectIntegrator{}, {.end_sample = 4});
    check(FirstHitIntegrator{}, {.end_sample = 4});
    check(AmbientOcclusionIntegrator{}, {.end_sample = 4});
}

TEST_CASE("no tile is skipped under a map, through a lens, or in a scene that cannot tell") {
    Scene<float> scene = under_open_sky();
    SerialExecutor serial;
    Camera with_lens = scene.cameras[0];
    with_lens.lens_radius = 0.01;
    {
        const PreparedScene<float> prepared(scene, serial);
        CHECK(rendered(prepared, with_lens, PathIntegrator<>{}).result.skipped == 0);
    }
    scene.environment.map = {Vec3f(1), Vec3f(2)};
    scene.environment.width = 2;
    scene.environment.height = 1;
    const PreparedScene<float> prepared(scene, serial);
    CHECK(rendered(prepared, scene.cameras[0], PathIntegrator<>{}).result.skipped == 0);
}

TEST_CASE("a specialised scene has the bits of the general one; one that lacks a feature of the scene is refused") {
    SerialExecutor serial;
    Scene<float> plain = cornell_scene<float>();
    for (Material& m : plain.materials) m.base_color_texture = {};
    plain.images.clear();
    Scene<float> smooth = plain;
    smooth.spheres.clear();
    const auto check = [&]<SceneFeatures features>(const Scene<float>& scene) {
        const PreparedScene<float> prepared(scene, serial);
        const RenderOptions options{.end_sample = 8, .planes = FilmPlanes::statistics};
        const Rendered general = rendered(prepared, scene.cameras[0], PathIntegrator<>{}, options);
        const SpecialisedScene<float, features> special(prepared);
        CHECK(same_bits(general.film, rendered(special, scene.cameras[0], PathIntegrator<>{}, options).film));
        bool chosen = false;
        with_specialised<no_feature, features>(prepared, [&](const auto& s) {
            chosen = std::is_same_v<std::remove_cvref_t<decltype(s)>, SpecialisedScene<float, features>>;
        });
        CHECK(chosen);
    };
    REQUIRE(features_of(plain) == no_feature);
    check.operator()<no_feature>(plain);

    constexpr SceneFeatures rounded{false, false, false, true, true, false};
    const Scene<float> room = room_scene<float>(2);
    REQUIRE(rounded.hold(features_of(room)));
    check.operator()<rounded>(room);
    const PreparedScene<float> prepared_room(room, serial);
    CHECK_THROWS_WITH_AS((SpecialisedScene<float, no_feature>(prepared_room)),
                         "SpecialisedScene: made for scenes without spheres, and this one has some", Error);
    bool general = false;
    with_specialised<no_feature>(prepared_room, [&](const auto& s) {
        general = std::is_same_v<std::remove_cvref_t<decltype(s)>, PreparedScene<float>>;
    });
    CHECK(general);
}

TEST_CASE("features of a scene: each by what brings it, and none more") {
    Scene<float> plain = cornell_scene<float>();
    for (Material& m : plain.materials) m.base_color_texture = {};
    const auto with = [&](auto&& change) {
        Scene<float> scene = plain;
        change(scene);
        return features_of(scene);
    };
    const auto only = [](bool SceneFeatures::*feature) {
        SceneFeatures f = no_feature;
        f.*feature = true;
        return f;
    };
    CHECK(features_of(plain) == no_feature);
    CHECK(with([](auto& s) { s.materials[0].normal_texture.image = 0; }) == only(&SceneFeatures::textures));
    CHECK(with([](auto& s) { s.colors.resize(s.positions.size()); }) == only(&SceneFeatures::colors));
    CHECK(with([](auto& s) { s.materials[0].alpha_mode = AlphaMode::blend; }) == only(&SceneFeatures::alpha));
    CHECK(with([](auto& s) { s.materials[0].specular = 1; }) == only(&SceneFeatures::specular));
    CHECK(with([](auto& s) { s.materials[0].transmission = 1; }) == only(&SceneFeatures::specular));
    CHECK(with([](auto& s) { s.spheres.push_back({}); }) == only(&SceneFeatures::spheres));
    CHECK(with([](auto& s) { s.materials[0].front_only = true; }) == only(&SceneFeatures::front_only));
    CHECK(every_feature.hold(every_feature));
    CHECK_FALSE(no_feature.hold(every_feature));
}

TEST_CASE("a counting scene: the same bits; its counts are those of the integrator, and shadow rays are saved") {
    SerialExecutor serial;
    for (const Scene<float>& scene : {cornell_scene<float>(), room_scene<float>(2)}) {
        const PreparedScene<float> prepared(scene, serial);
        const CountingScene<float> counting(prepared);
        const Rendered plain = rendered(prepared, scene.cameras[0], PathIntegrator<>{}, {.end_sample = 4});
        const Rendered counted = rendered(counting, scene.cameras[0], PathIntegrator<>{}, {.end_sample = 4});
        CHECK(same_bits(plain.film, counted.film));
        const SceneCounts n = counting.counts();
        CHECK(n.closest == counted.result.rays.closest);
        CHECK(n.shadow == counted.result.rays.shadow);
        CHECK(n.light_samples > n.shadow);
        CHECK(counted.result.rays.saved == n.light_samples - n.shadow);
        CHECK(n.surfaces <= n.closest);
        CHECK(n.nodes > n.closest);
        CHECK((n.lookups > 0) == features_of(scene).textures);
    }
}
