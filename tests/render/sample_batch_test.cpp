// Rays that are traced together give the pixels that rays traced one by one give.
#include "one_by_one.hpp"
#include "support/random.hpp"
#include <doctest/doctest.h>
#include <lambent/core/parallel.hpp>
#include <lambent/render/counting_scene.hpp>
#include <lambent/render/direct.hpp>
#include <lambent/render/path.hpp>
#include <lambent/render/render.hpp>
#include <lambent/sampling/sobol.hpp>
#include <lambent/scene/builtin.hpp>
#include <lambent/scene/specialised_scene.hpp>
#include <type_traits>
#include <vector>

using namespace lambent;
using lambent_test::Random;
using lambent_test::OneByOne;
using lambent_test::pass_of;
using lambent_test::same;

namespace {

/// The Cornell box under a sky, with shreds in it: each at least twice in the same place, some more often than a leaf has
/// room for, of several materials: also such as let some rays pass, by chance or all.
Scene<float> shreds(std::size_t count) {
    Scene<float> scene = cornell_scene<float>();
    scene.environment.scale = Vec3f(0.2f, 0.3f, 0.5f);
    const auto first = std::uint32_t(scene.materials.size());
    scene.materials.resize(first + 7);
    Material* const m = &scene.materials[first];
    m[0].base_color = Vec3f(0.7f, 0.1f, 0.1f);
    m[1].base_color = Vec3f(0.1f, 0.7f, 0.1f);
    m[2].alpha_mode = AlphaMode::blend;
    m[2].alpha = 0.4f;
    m[3].alpha_mode = AlphaMode::mask;
    m[3].alpha = 0.3f;
    m[4].front_only = true;
    m[5].specular = 1;
    m[5].metallic = 1;
    m[5].roughness = 0;
    m[6].specular = 1;
    m[6].transmission = 1;
    m[6].roughness = 0;
    Random random(4);
    const Bounds3<double> box = scene.bounds();
    for (std::size_t i = 0; i < count; ++i) {
        Vec3<float> at;
        for (int k = 0; k < 3; ++k) at[k] = float(random.uniform(box.min[k], box.max[k]) - scene.origin[k]);
        const auto vertex = std::uint32_t(scene.positions.size());
        const double size = 0.02 * (box.max.x - box.min.x);
        for (int corner = 0; corner < 3; ++corner) scene.positions.push_back(at + random.in_box<float>(-size, size));
        for (int copy = 0; copy < (i % 8 == 0 ? 20 : 2); ++copy) {
            scene.triangles.push_back({vertex, vertex + 1, vertex + 2});
            scene.triangle_materials.push_back(first + std::uint32_t(random.index(7)));
        }
    }
    scene.normals.resize(scene.normals.empty() ? 0 : scene.positions.size(), Vec3f(0));
    scene.texcoords.resize(scene.texcoords.empty() ? 0 : scene.positions.size(), Vec2f(0));
    const Vec3d middle = (box.min + box.max) / 2.0 - scene.origin;
    scene.spheres.push_back({.center = Vec3f(middle), .radius = float(box.max.x - box.min.x) / 8, .material = first + 1});
    return scene;
}

} // namespace

TEST_CASE("paths side by side: the bits and the rays of paths one after the other, whatever the scene has in it") {
    ThreadExecutor threads(2);
    for (const std::size_t count : {150u, 16000u}) { // the second one's tree is large enough for rays to be interleaved
        const Scene<float> scene = shreds(count);
        const PreparedScene<float> prepared(scene, threads);
        RenderOptions options{.width = 37, .height = 29, .first_sample = 3, .end_sample = 8, .planes = FilmPlanes::statistics};
        const auto check = [&](const auto& integrator) {
            const auto pass = [&](const auto& seen, const auto& by) {
                return pass_of(seen, scene.cameras[0], by, SobolSampler<float>(5), options);
            };
            const auto together = pass(prepared, integrator);
            CHECK(together.rays.shadow > 1000);
            CHECK(same(together, pass(prepared, OneByOne{integrator})));
            CHECK(same(together, pass(CountingScene<float>(prepared), integrator)));
        };
        check(PathIntegrator<>{});
        check(PathIntegrator<PathStrategy::light>{{.max_depth = 3, .roulette_depth = 1}});
        check(DirectIntegrator{});
        options.window = {5, 7, 30, 20};
        options.tile = 11;
        options.end_sample = 90; // a pixel's samples end in the middle of a batch
        options.filter = PixelFilter::blackman_harris;
        options.firefly_clamp = 0.5;
        std::vector<std::uint8_t> active(std::size_t(25 * 13));
        for (std::size_t i = 0; i < active.size(); ++i) active[i] = i % 3 != 0;
        options.active = ActivePixels(active.data(), 25, 13);
        check(PathIntegrator<>{});
    }
}
