// Paths of plain scenes in the lanes of registers give the pixels of paths one by one. Compiled where compilers may not
// fuse products as they like, so to the bit.
#include "one_by_one.hpp"
#include "support/random.hpp"
#include "transport.hpp"
#include <doctest/doctest.h>
#include <lambent/core/parallel.hpp>
#include <lambent/render/packed_paths.hpp>
#include <lambent/render/path.hpp>
#include <lambent/render/render.hpp>
#include <lambent/sampling/independent.hpp>
#include <lambent/sampling/sobol.hpp>
#include <lambent/sampling/stratified.hpp>
#include <lambent/scene/builtin.hpp>
#include <lambent/scene/specialised_scene.hpp>
#include <limits>
#include <vector>

using namespace lambent;
using lambent_test::OneByOne;
using lambent_test::pass_of;
using lambent_test::Random;
using lambent_test::same;

namespace {

using Plain = SpecialisedScene<float, plain_features>;

template <class I, class P>
void check_same(const Plain& scene, const Camera& camera, const I& integrator, const P& sampler, const RenderOptions& options) {
    const auto packed = pass_of(scene, camera, integrator, sampler, options);
    CHECK(packed.rays.closest > 10000);
    CHECK(same(packed, pass_of(scene, camera, OneByOne{integrator}, sampler, options)));
}

Scene<float> bare_cornell() {
    Scene<float> scene = cornell_scene<float>();
    for (Material& m : scene.materials) m.base_color_texture = {};
    scene.images.clear();
    return scene;
}

/// The Cornell box with balls in it, of few facets and smooth normals; one all but touches a wall.
Scene<float> smooth_balls() {
    Scene<float> scene = bare_cornell();
    scene.texcoords.clear();
    scene.normals.assign(scene.positions.size(), Vec3f(0)); // of no length: these triangles keep their own
    const Bounds3<double> box = scene.bounds();
    const std::uint32_t clay = lambent_test::add_material(scene, Vec3f(0.9f, 0.5f, 0.3f));
    for (const Vec3d& place : {Vec3d(0.3, 0.7, 0.5), Vec3d(0.7, 0.6, 0.4), Vec3d(0.5, 0.12001, 0.9)}) {
        const Vec3d center = box.min + box.size() * place - scene.origin;
        lambent_test::add_icosphere(scene, center, 0.12 * box.size().x, 1, false, clay);
        for (std::size_t i = scene.normals.size(); i < scene.positions.size(); ++i)
            scene.normals.push_back(normalize(scene.positions[i] - Vec3f(center)));
    }
    return scene;
}

/// Of edges whose product's square float cannot hold.
Scene<float> tiny_cornell() {
    constexpr double scale = 0x1p-40;
    Scene<float> scene = bare_cornell();
    for (Vec3f& p : scene.positions) p *= float(scale);
    scene.origin *= scale;
    scene.cameras[0].eye *= scale;
    scene.cameras[0].target *= scale;
    return scene;
}

/// Shreds with arbitrary normals under everything that shines.
Scene<float> shreds(bool normals) {
    Scene<float> scene = bare_cornell();
    const auto first = std::uint32_t(scene.materials.size());
    scene.materials.resize(first + 9);
    Material* const m = &scene.materials[first];
    m[0].emission = Vec3f(3, 2, 1);
    m[1].emission = Vec3f(0.5f, 1, 2);
    m[1].double_sided = true;
    m[2].unlit = true;
    m[3].base_color = Vec3f(0);
    m[4].front_only = true;
    m[5].base_color = Vec3f(0.99f);
    m[6].base_color.x = m[7].base_color.z = std::numeric_limits<float>::quiet_NaN();
    m[8].emission.y = std::numeric_limits<float>::infinity();
    Random random(11);
    const Bounds3<double> box = scene.bounds();
    for (int i = 0; i < 400; ++i) {
        const auto vertex = std::uint32_t(scene.positions.size());
        const Vec3d at(random.uniform(box.min.x, box.max.x), random.uniform(box.min.y, box.max.y),
                       random.uniform(box.min.z, box.max.z));
        const double reach = box.size().x * 0.08;
        for (int corner = 0; corner < 3; ++corner)
            scene.positions.push_back(Vec3f(at - scene.origin + random.in_box<double>(-reach, reach)));
        scene.triangles.push_back({vertex, vertex + 1, vertex + 2});
        scene.triangle_materials.push_back(first + std::uint32_t(random.index(9)));
    }
    scene.texcoords.clear();
    scene.normals.clear();
    if (normals)
        for (std::size_t i = 0; i < scene.positions.size(); ++i) scene.normals.push_back(random.in_box<float>(-1, 1));
    const Vec3d middle = (box.min + box.max) / 2.0;
    using Kind = PunctualLight::Kind;
    scene.punctual_lights.push_back({.kind = Kind::point, .position = middle, .intensity = Vec3f(0.1f)});
    scene.punctual_lights.push_back({.kind = Kind::spot, .position = middle, .direction = {0, -1, 0}, .intensity = Vec3f(1)});
    scene.punctual_lights.push_back({.kind = Kind::directional, .direction = normalize(Vec3d(0.1, -1, -1))});
    scene.environment.scale = Vec3f(0.2f, 0.3f, 0.5f);
    return scene;
}

} // namespace

TEST_CASE("packed paths: the bits and the rays of paths one by one, whatever a plain scene has in it") {
    ThreadExecutor threads(2);
    std::vector<Scene<float>> scenes = {bare_cornell(), tiny_cornell(), smooth_balls(), shreds(false), shreds(true)};
    Scene<float> sky = shreds(true); // with a map: light samples by the environment
    sky.environment.width = 4;
    sky.environment.height = 2;
    sky.environment.map = {Vec3f(1), Vec3f(9), Vec3f(0), Vec3f(2), Vec3f(1), Vec3f(0.5f), Vec3f(0), Vec3f(1)};
    scenes.push_back(sky);
    for (std::size_t i = 0; i < scenes.size(); ++i) {
        CAPTURE(i);
        const PreparedScene<float> prepared(scenes[i], threads);
        const Plain scene(prepared);
        const Camera& camera = scenes[i].cameras[0];
        RenderOptions options{.width = 37, .height = 29, .first_sample = 3, .end_sample = 13, .planes = FilmPlanes::statistics};
        check_same(scene, camera, PathIntegrator<>{}, SobolSampler<float>(5), options);
        check_same(scene, camera, PathIntegrator<>{}, StratifiedSampler<float>(5, 16), options);
        check_same(scene, camera, PathIntegrator<>{}, IndependentSampler<float>(5), options);
        check_same(scene, camera, PathIntegrator<PathStrategy::light>{{.max_depth = 3, .roulette_depth = 1}},
                   SobolSampler<float>(5), options);
        check_same(scene, camera, PathIntegrator<PathStrategy::bsdf>{{.max_depth = 40, .roulette_depth = PathOptions::unlimited}},
                   SobolSampler<float>(5), options); // past the dimensions that have an order of their own
        check_same(scene, camera, PathIntegrator<PathStrategy::both, MisHeuristic::balance>{{.max_depth = 2}},
                   SobolSampler<float>(5), options);
        options.window = {5, 7, 30, 20};
        options.tile = 11;
        options.end_sample = 90; // a pixel's samples end in the middle of a batch
        options.filter = PixelFilter::blackman_harris;
        check_same(scene, camera, PathIntegrator<>{}, SobolSampler<float>(5), options);
    }
}
