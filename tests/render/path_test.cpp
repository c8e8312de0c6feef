#include <lambent/render/direct.hpp>
#include <lambent/render/render.hpp>
#include <lambent/sampling/independent.hpp>
#include <lambent/sampling/stratified.hpp>
#include <lambent/scene/missing.hpp>
#include <render/transport.hpp>
#include <doctest/doctest.h>
#include <algorithm>
#include <cstdint>

using namespace lambent_test;

namespace {

/// A scene that is watched: how often it is asked, and how deep the stack is then.
struct WatchedScene {
    using Scalar = float;
    const PreparedScene<float>& inner;
    mutable std::uint64_t closest = 0, shadow = 0;
    mutable std::uintptr_t highest = 0, lowest = ~std::uintptr_t(0);
    mutable std::uint64_t lights = 0, idle = 0; ///< light samples; shadow rays for one that could not bring light
    mutable bool worth_a_ray = false;

    const Scene<float>& scene() const { return inner.scene(); }
    Hit<float> intersect(const Ray<float>& ray) const {
        ++closest;
        const volatile char here = 0;
        highest = std::max(highest, reinterpret_cast<std::uintptr_t>(&here));
        lowest = std::min(lowest, reinterpret_cast<std::uintptr_t>(&here));
        return inner.intersect(ray);
    }
    bool occluded(const Ray<float>& ray) const {
        ++shadow;
        if (!worth_a_ray) ++idle;
        return inner.occluded(ray);
    }
    Surface<float> surface(const Ray<float>& ray, const Hit<float>& hit) const { return inner.surface(ray, hit); }
    Vec3f background(const Vec3f& d) const { return inner.background(d); }
    LightSample<float> sample_light(const Vec3f& p, const Vec3f& n, const Vec2f& u, Companion c) const {
        const LightSample<float> light = inner.sample_light(p, n, u, c);
        ++lights;
        worth_a_ray = light.pdf > 0 && !is_black(light.radiance) && dot(n, light.wi) > 0; // all here is opaque
        return light;
    }
    float hit_light_pdf(const Ray<float>& ray, const Hit<float>& hit, const Vec3f& n) const { return inner.hit_light_pdf(ray, hit, n); }
    float background_pdf(const Vec3f& d) const { return inner.background_pdf(d); }
    bool has_lights(Companion c) const { return inner.has_lights(c); }
};
static_assert(RenderScene<WatchedScene>);

constexpr auto independent = [](std::uint32_t seed) { return IndependentSampler<float>(seed); };

} // namespace

TEST_CASE("G1: the rays that an integrator counts are those that the scene was asked") {
    SerialExecutor serial;
    const Scene<float> scene = room_scene<float>(2);
    const PreparedScene<float> prepared(scene, serial);
    const WatchedScene watched{prepared};
    const Estimate e = image_mean(watched, scene.cameras[0], {16, 16}, PathIntegrator<>{}, 16);
    CHECK(watched.shadow > 1000);
    CHECK(e.rays == double(watched.closest + watched.shadow));
    const std::uint64_t shadow = watched.shadow;
    image_mean(watched, scene.cameras[0], {16, 16}, PathIntegrator<PathStrategy::bsdf>{}, 16);
    CHECK(watched.shadow == shadow); // what is off costs no ray
}

TEST_CASE(
    "no shadow ray where cosine, BSDF or light is 0; no light is asked for where there is none or nothing reflects") {
    SerialExecutor serial;
    const auto watch = [&](const Scene<float>& scene, auto&& check) {
        const PreparedScene<float> prepared(scene, serial);
        const WatchedScene watched{prepared};
        image_mean(watched, scene.cameras[0], {16, 16}, PathIntegrator<>{}, 16);
        check(watched);
    };
    const auto idle = [](const WatchedScene& w) {
        CHECK(w.lights > 1000);
        CHECK(w.shadow > 100);
        CHECK(w.shadow < w.lights); // some lights were behind the surface, or showed their back
        CHECK(w.idle == 0);
    };
    watch(room_scene<float>(3), idle);
    Scene<float> lamps = cornell_scene<float>();
    detail::add_material(lamps, "back", Vec3f(0), Vec3f(5)); // a lamp whose back is to the floor
    detail::add_box(lamps, {0.4, 0.9, 0.4}, {0.6, 0.95, 0.6}, 0, detail::BoxFront::inside,
                    {5, 5, 5, 5, 5, 5});
    watch(lamps, [](const WatchedScene& w) { CHECK(w.idle == 0); });
    const auto none = [](const WatchedScene& w) {
        CHECK(w.closest >= 256 * 16);
        CHECK(w.lights == 0);
        CHECK(w.shadow == 0);
    };
    Scene<float> dark = cornell_scene<float>();
    for (Material& m : dark.materials) m.emission = Vec3f(0);
    watch(dark, none);
    dark.environment.scale = Vec3f(1); // bounces find it
    watch(dark, none);
    Scene<float> black = cornell_scene<float>();
    for (Material& m : black.materials) m.base_color = Vec3f(0), m.base_color_texture = {};
    watch(black, none);
}

TEST_CASE("S2: ten thousand bounces in a white box, in constant stack, and none gets out") {
    static_assert(sizeof(PathState<float>) <= 256, "a path's state fits into four cache lines");
    static_assert(std::is_trivially_copyable_v<PathState<float>>);
    SerialExecutor serial;
    Scene<float> scene;
    add_room(scene, 1, add_material(scene, Vec3f(1), Vec3f(1e-4f)));
    const PreparedScene<float> prepared(scene, serial);
    const WatchedScene watched{prepared};
    const Camera camera{{0.4, 0.6, 0.3}, {0.5, 0.5, 1}, {0, 1, 0}, 90, ""};
    constexpr std::uint32_t depth = 10000;
    const Estimate e = image_mean(watched, camera, {4, 4}, PathIntegrator<PathStrategy::bsdf>{{depth, PathOptions::unlimited}}, 4);
    CHECK(watched.closest == 64 * (depth + 1));
    CHECK(e.grey == doctest::Approx((depth + 1) * 1e-4).epsilon(1e-3));
    CHECK(watched.highest - watched.lowest < 1024);
}

TEST_CASE("S4: roulette by the throughput: the expected path length, 1 / (1 - albedo) where any path may end") {
    SerialExecutor serial;
    for (const double albedo : {0.5, 0.8})
        for (const float strength : {1.0f, 0.4f}) {
            Scene<float> scene;
            scene.spheres.push_back({{0, 0, 0}, 1, add_material(scene, Vec3f(float(albedo)))});
            const PreparedScene<float> prepared(scene, serial);
            const Camera camera{{0.3, 0.2, 0.1}, {0, 0, -1}, {0, 1, 0}, 90, ""};
            constexpr int paths = 16 * 16 * 256;
            const PathIntegrator<PathStrategy::bsdf> integrator{{PathOptions::unlimited, 1, strength}};
            const Estimate e = image_mean(prepared, camera, {16, 16}, integrator, 1, 256, independent);
            // Sums over n of P(length >= n) and of (2n - 1) P(length >= n).
            double expected = 0, square = 0, carried = 1, alive = 1;
            for (int n = 1; n < 1000; ++n) {
                expected += alive;
                square += (2 * n - 1) * alive;
                carried *= albedo;
                const double survival = std::min(carried / double(strength), 0.99);
                alive *= survival;
                carried /= survival;
            }
            const double length = e.rays / paths;
            MESSAGE("albedo " << albedo << ", strength " << strength << ": " << length << " rays a path of " << expected);
            CHECK(std::abs(length - expected) < max_z * std::sqrt(square - expected * expected) / std::sqrt(paths));
            if (strength == 1.0f) CHECK(expected == doctest::Approx(1 / (1 - albedo)));
        }
}

TEST_CASE("S6: multiple importance sampling: no more fireflies than light sampling, variance at most 1.1 of the better") {
    SerialExecutor serial;
    for (const bool room : {true, false}) {
        CAPTURE(room);
        const Scene<float> scene = room ? room_scene<float>() : cornell_scene<float>();
        const PreparedScene<float> prepared(scene, serial);
        constexpr int spp = 20, seeds = 12;
        const auto noise = [&](const auto& integrator) {
            return image_mean(prepared, scene.cameras[0], {24, 24}, integrator, spp, seeds, independent).grey_error;
        };
        const double both = noise(Reflected{PathIntegrator<>{}});
        const double light = noise(Reflected{PathIntegrator<PathStrategy::light>{}});
        const double bsdf = noise(Reflected{PathIntegrator<PathStrategy::bsdf>{}});
        MESSAGE("variances, light " << light * light << ", bsdf " << bsdf * bsdf << ", both " << both * both);
        CHECK(both * both <= 1.1 * std::min(light * light, bsdf * bsdf));

        // Pixels that the seed's rule would call fireflies.
        const CameraRays<float> rays(scene.cameras[0], 64, 64, scene.origin);
        const auto fireflies = [&](const auto& integrator) {
            int n = 0;
            RayCounts counts;
            for (std::uint32_t p = 0; p < 64 * 64; ++p) {
                Vec3f sum(0);
                for (std::uint32_t i = 0; i < spp; ++i) {
                    const auto stream = IndependentSampler<float>(7).at(p % 64, p / 64, i);
                    const Vec2f jitter = stream.get_2d(dimensions::pixel);
                    sum += integrator.sample(prepared, rays.ray(float(p % 64) + jitter.x, float(p / 64) + jitter.y), stream, counts).radiance;
                }
                sum /= float(spp);
                n += dot(sum, sum) > 3 * 25 * 25;
            }
            return n;
        };
        CHECK(fireflies(Reflected{PathIntegrator<>{}}) <= fireflies(Reflected{PathIntegrator<PathStrategy::light>{}}));
    }
}

TEST_CASE("K3: beside the light, without any suppression, the energy is that of chance alone") {
    SerialExecutor serial;
    const Scene<float> scene = room_scene<float>();
    const PreparedScene<float> prepared(scene, serial);
    const Camera beside{{2.5, 4.2, 4}, {2.5, 5, 4.5}, {0, 1, 0}, 60, ""}; // the ceiling and the light's rim
    const Estimate reference = image_mean(prepared, beside, {16, 16}, Reflected{PathIntegrator<PathStrategy::bsdf>{{8}}}, 4096);
    const Estimate both = image_mean(prepared, beside, {16, 16}, Reflected{PathIntegrator<>{{8}}}, 256);
    const Estimate light = image_mean(prepared, beside, {16, 16}, Reflected{PathIntegrator<PathStrategy::light>{{8}}}, 512);
    INFO(reference.grey << " +- " << reference.grey_error << ", both " << both.grey << " +- " << both.grey_error << ", light "
                        << light.grey << " +- " << light.grey_error);
    CHECK(std::abs(both.z(reference)) < max_z);
    CHECK(std::abs(light.z(reference)) < max_z);
    CHECK(std::abs(both.grey / reference.grey - 1) < 0.02);
    CHECK(std::hypot(both.grey_error, reference.grey_error) < 0.01 * reference.grey);
}

TEST_CASE("S7: over a smooth edge the error of strata and of Sobol falls faster than 1/sqrt(n), independent samples' as that") {
    Scene<float> scene;
    lambent::detail::add_quad(scene, {Vec3d{-9, -9, 0}, Vec3d{1, -9, 0}, Vec3d{-1, 9, 0}, Vec3d{-9, 9, 0}},
                              add_material(scene, Vec3f(0), Vec3f(1)));
    SerialExecutor serial;
    const PreparedScene<float> prepared(scene, serial);
    const Camera camera{{0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 10, ""};
    const auto rate = [&](auto sampler_of) {
        std::vector<double> x, y;
        for (const int n : {4, 16, 64, 256}) {
            const Estimate e = image_mean(prepared, camera, {8, 8}, PathIntegrator<>{{0}}, n, 16, sampler_of(n));
            x.push_back(std::log(n));
            y.push_back(std::log(e.grey_error));
        }
        return slope(x, y);
    };
    const double sobol = rate([](int) { return [](std::uint32_t seed) { return SobolSampler<float>(seed); }; });
    const double strata = rate([](int n) { return [n](std::uint32_t seed) { return StratifiedSampler<float>(seed, std::uint32_t(n)); }; });
    const double plain = rate([](int) { return independent; });
    MESSAGE("slopes of log error: sobol " << sobol << ", stratified " << strata << ", independent " << plain);
    CHECK(sobol < -0.65);
    CHECK(strata < -0.65);
    CHECK(plain == doctest::Approx(-0.5).epsilon(0.1));
}

TEST_CASE("smooth normals on coarse facets: all strategies agree, and no light is made up") {
    Scene<float> scene;
    add_icosphere(scene, Vec3d(0), 1, 1, false, add_material(scene, Vec3f(1)));
    for (const Vec3f& p : scene.positions) scene.normals.push_back(normalize(p));
    scene.environment = soft_sky();
    SerialExecutor serial;
    const PreparedScene<float> prepared(scene, serial);
    const Camera camera{{0.3, 0.4, 4}, {0, 0, 0}, {0, 1, 0}, 32, ""};
    const Estimate both = image_mean(prepared, camera, {16, 16}, PathIntegrator<>{}, 512);
    const Estimate light = image_mean(prepared, camera, {16, 16}, PathIntegrator<PathStrategy::light>{}, 1024);
    const Estimate bsdf = image_mean(prepared, camera, {16, 16}, PathIntegrator<PathStrategy::bsdf>{}, 512);
    INFO(both.grey << " +- " << both.grey_error << ", " << light.grey << " +- " << light.grey_error << ", " << bsdf.grey);
    CHECK(std::abs(both.z(bsdf)) < max_z);
    CHECK(std::abs(light.z(bsdf)) < max_z);
    CHECK(std::abs(light.z(both)) < max_z);
    CHECK(both.grey_error < 0.002 * both.grey);
    scene.environment = {};
    scene.environment.scale = Vec3f(1);
    const PreparedScene<float> furnace(scene, serial);
    const Camera close_up{{0.3, 0.4, 2}, {0, 0, 0}, {0, 1, 0}, 20, ""};
    CHECK(image_mean(furnace, close_up, {16, 16}, PathIntegrator<>{}, 256).grey < 1.002);
}

TEST_CASE("scenes a thousandth and a thousand times as large look the same") {
    SerialExecutor serial;
    Estimate at_one;
    for (const float scale : {1.0f, 1e-3f, 1e3f}) {
        Scene<float> scene = cornell_scene<float>();
        for (Vec3f& p : scene.positions) p *= scale;
        Camera camera = scene.cameras[0];
        camera.eye *= double(scale);
        camera.target *= double(scale);
        const PreparedScene<float> prepared(scene, serial);
        const Estimate e = image_mean(prepared, camera, {24, 24}, PathIntegrator<>{}, 64);
        if (scale == 1.0f) at_one = e;
        CAPTURE(scale);
        CHECK(std::abs(e.z(at_one)) < max_z);
        CHECK(std::abs(e.grey / at_one.grey - 1) < 0.003); // the same numbers are drawn
    }
}

TEST_CASE("direct, indirect and seen light: their sum is the radiance, direct light that of one scattering") {
    SerialExecutor serial;
    for (const bool cornell : {true, false}) {
        const Scene<float> scene = cornell ? cornell_scene<float>() : room_scene<float>(2);
        const PreparedScene<float> prepared(scene, serial);
        RenderOptions options{.width = 24, .height = 16, .end_sample = 8, .planes = FilmPlanes::statistics};
        const auto frame = render(prepared, scene.cameras[0], PathIntegrator<>{}, SobolSampler<float>(3), options, serial);
        const auto once = render(prepared, scene.cameras[0], DirectIntegrator{}, SobolSampler<float>(3), options, serial);
        double indirect = 0;
        for (int y = 0; y < 16; ++y)
            for (int x = 0; x < 24; ++x)
                for (int c = 0; c < 3; ++c) {
                    const float direct = frame.direct.load(x, y)[c], emission = frame.emission.load(x, y)[c];
                    CHECK(direct + frame.indirect.load(x, y)[c] + emission ==
                          doctest::Approx(frame.radiance.load(x, y)[c]).epsilon(1e-4));
                    CHECK(direct == doctest::Approx(once.radiance.load(x, y)[c] - emission).epsilon(1e-3));
                    indirect += double(frame.indirect.load(x, y)[c]);
                }
        CHECK(indirect > 1);
    }
}
