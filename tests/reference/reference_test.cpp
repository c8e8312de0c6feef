#include <lambent/film/metrics.hpp>
#include <lambent/io/environment.hpp>
#include <lambent/io/exr.hpp>
#include <lambent/io/scene_file.hpp>
#include <lambent/render/path.hpp>
#include <lambent/render/render.hpp>
#include <lambent/sampling/independent.hpp>
#include <lambent/sampling/sobol.hpp>
#include <lambent/scene/missing.hpp>
#include <lambent/scene/specialised_scene.hpp>
#include <render/transport.hpp>
#include <support/skip.hpp>
#include <doctest/doctest.h>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

using namespace lambent_test;

/// Scenes from files against converged images of another renderer (4 400 samples a pixel and more).
namespace {

const std::string shared = LAMBENT_SHARED_DIR;

bool missing(const std::string& file) {
    if (std::filesystem::exists(shared + "/" + file)) return false;
    skip("reference scenes: no " + file);
    return true;
}

Scene<float> reference_scene(const std::string& name, const std::string& environment = "") {
    Scene<float> scene = load_scene(shared + "/reference/" + name + ".glb");
    if (!environment.empty()) scene.environment = read_environment(shared + "/reference/" + environment);
    return scene;
}

Plane<float, 3> reference_image(const std::string& name) {
    const ExrImage exr = read_exr(shared + "/reference/" + name + "_128.exr");
    Plane<float, 3> image(exr.width, exr.height);
    const ExrChannel* channels[] = {exr.find("R"), exr.find("G"), exr.find("B")};
    for (std::size_t i = 0; i < image.values().size(); ++i) image.values()[i] = channels[i % 3]->values[i / 3];
    return image;
}

struct Rendered {
    Plane<float, 3> radiance, emission;
};
template <class P>
Rendered render_plainly(const Scene<float>& scene, int width, int height, int spp, const P& sampler) {
    SerialExecutor serial;
    const PreparedScene<float> prepared(scene, serial);
    const CameraRays<float> rays(scene.cameras.at(0), width, height, scene.origin);
    Rendered out{{width, height}, {width, height}};
    RayCounts counts;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            Vec3d sum(0), seen(0);
            for (int i = 0; i < spp; ++i) {
                const auto stream = sampler.at(std::uint32_t(x), std::uint32_t(y), std::uint32_t(i));
                const Vec2f jitter = stream.get_2d(dimensions::pixel);
                const auto s = PathIntegrator<>{}.sample(prepared, rays.ray(float(x) + jitter.x, float(y) + jitter.y), stream, counts);
                sum += Vec3d(s.radiance);
                seen += Vec3d(s.emission);
            }
            out.radiance.view().store(x, y, Vec3f(sum / double(spp)));
            out.emission.view().store(x, y, Vec3f(seen / double(spp)));
        }
    return out;
}

Vec3d mean(const Plane<float, 3>& image, int x0 = 0, int y0 = 0, int size = 0) {
    const int x1 = size > 0 ? x0 + size : image.width(), y1 = size > 0 ? y0 + size : image.height();
    Vec3d sum(0);
    for (int y = y0; y < y1; ++y)
        for (int x = x0; x < x1; ++x) sum += Vec3d(image.load(x, y));
    return sum / double((x1 - x0) * (y1 - y0));
}

/// The image's mean within `tolerance` in every channel, and no block of 32 x 32 pixels far off.
void check_means(const std::string& name, const std::string& environment, int spp, double tolerance, double block_tolerance) {
    CAPTURE(name);
    const Plane<float, 3> reference = reference_image(name);
    const Plane<float, 3> ours =
        render_plainly(reference_scene(name, environment), reference.width(), reference.height(), spp, SobolSampler<float>(1)).radiance;
    const Vec3d a = mean(ours), b = mean(reference);
    INFO("ours " << a.x << ' ' << a.y << ' ' << a.z << ", reference " << b.x << ' ' << b.y << ' ' << b.z);
    for (int c = 0; c < 3; ++c) CHECK(std::abs(a[c] / b[c] - 1) < tolerance);
    for (int y = 0; y < reference.height(); y += 32)
        for (int x = 0; x < reference.width(); x += 32) {
            const Vec3d block = mean(ours, x, y, 32), truth = mean(reference, x, y, 32);
            CAPTURE(x);
            CAPTURE(y);
            CHECK(std::abs((block.x + block.y + block.z) / (truth.x + truth.y + truth.z) - 1) < block_tolerance);
        }
}

} // namespace

TEST_CASE("mean of reference/cornell within 0.5 % of the converged image") {
    if (missing("reference/cornell.glb")) return;
    check_means("cornell", "", 128, 0.005, 0.01); // a block of 32 samples has a standard deviation of 0.6 %
}

TEST_CASE("mean of reference/atrium under its sunny sky within 0.5 % of the converged image") {
    if (missing("reference/atrium.glb")) return;
    check_means("atrium", "sky_sun.exr", 32, 0.005, 0.04);
}

TEST_CASE("mean of reference/many_lights within 1 % of the converged image") { // 0.5 % would take 200 samples a pixel
    if (missing("reference/many_lights.glb")) return;
    check_means("many_lights", "", 64, 0.01, 0.1);
}

TEST_CASE("plain reference scenes: packed paths make the image of paths one by one, but for rounding") {
    for (const auto& [name, environment] : {std::pair{"cornell", ""}, {"atrium", "sky_sun.exr"}, {"many_lights", ""}}) {
        if (missing(std::string("reference/") + name + ".glb")) return;
        CAPTURE(name);
        const Scene<float> scene = reference_scene(name, environment);
        SerialExecutor serial;
        const PreparedScene<float> prepared(scene, serial);
        const SpecialisedScene<float, plain_features> plain(prepared);
        const RenderOptions options{.width = 96, .height = 96, .end_sample = 8};
        const auto of = [&](const auto& seen) {
            return render(seen, scene.cameras.at(0), PathIntegrator<>{}, SobolSampler<float>(3), options, serial).radiance;
        };
        const Plane<float, 3> packed = of(plain), alone = of(prepared);
        int different = 0;
        for (int y = 0; y < 96; ++y)
            for (int x = 0; x < 96; ++x) {
                const Vec3f a = packed.load(x, y), b = alone.load(x, y);
                different += max_component(abs(a - b)) > 1e-4f * (max_component(b) + 0.01f);
            }
        CHECK(different < 20); // of 9216: where rounding sends a path another way
        const Vec3d a = mean(packed), b = mean(alone);
        CHECK(length(a - b) < 1e-3 * length(b));
    }
}

TEST_CASE("G5: reference/furnace_convex: albedo 0.5 under a white sky, sphere and background") {
    if (missing("reference/furnace_convex.glb")) return;
    Scene<float> scene = reference_scene("furnace_convex");
    scene.environment.scale = Vec3f(1);
    const Plane<float, 3> image = render_plainly(scene, 64, 64, 64, SobolSampler<float>(1)).radiance;
    double inside = 0;
    int pixels = 0;
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x) {
            const double value = image.load(x, y).y;
            if (x == 0 || y == 0) CHECK(value > 0.4);
            if ((x - 32) * (x - 32) + (y - 32) * (y - 32) < 100) {
                inside += value;
                ++pixels;
            }
        }
    CHECK(inside / pixels == doctest::Approx(0.5).epsilon(0.004));
}

TEST_CASE("Owen-Sobol against independent samples on reference/cornell, 64 a pixel: squared error at most 0.7 of theirs") {
    if (missing("reference/cornell.glb")) return;
    const Scene<float> scene = reference_scene("cornell");
    const Plane<float, 3> reference = reference_image("cornell");
    const Rendered sobol = render_plainly(scene, 128, 128, 64, SobolSampler<float>(2));
    const Rendered plain = render_plainly(scene, 128, 128, 64, IndependentSampler<float>(2));
    const Plane<std::uint8_t, 1> mask = emitter_mask(std::as_const(plain.emission).view());
    const auto view = [](const Plane<float, 3>& p) { return p.view(); };
    const double ratio = mse(view(sobol.radiance), view(reference), std::as_const(mask).view()) /
                         mse(view(plain.radiance), view(reference), std::as_const(mask).view());
    MESSAGE("ratio of squared errors " << ratio);
    CHECK(ratio <= 0.7);
}

TEST_CASE("E4: Sibenik by the seed's camera and light: finite at 1 and 100 samples, windows not black under a sky") {
    if (missing("scenes/sibenik/sibenik.obj")) return;
    Scene<float> scene = load_scene(shared + "/scenes/sibenik/sibenik.obj");
    Material light;
    light.base_color = Vec3f(0);
    light.emission = Vec3f(20);
    scene.materials.push_back(light);
    scene.spheres.push_back({Vec3f(Vec3d(-5, 10, 0) - scene.origin), 8, std::uint32_t(scene.materials.size() - 1)});
    scene.cameras = {Camera{{-18, -15, -0.1}, {-17, -14.75, -0.1}, {0, 1, 0}, 53.13, "seed"}};
    for (const bool sky : {false, true}) {
        CAPTURE(sky);
        if (sky) scene.environment = soft_sky();
        SerialExecutor serial;
        const PreparedScene<float> prepared(scene, serial);
        int escaped = 0;
        const CameraRays<float> rays(scene.cameras[0], 48, 48, scene.origin);
        for (int y = 0; y < 48; ++y)
            for (int x = 0; x < 48; ++x) escaped += !prepared.intersect(rays.ray(float(x) + 0.5f, float(y) + 0.5f));
        for (const int spp : {1, 100}) {
            CAPTURE(spp);
            const Plane<float, 3> image = render_plainly(scene, 48, 48, spp, SobolSampler<float>(3)).radiance;
            int broken = 0, black_windows = 0;
            for (int y = 0; y < 48; ++y)
                for (int x = 0; x < 48; ++x) {
                    const Vec3f value = image.load(x, y);
                    broken += !is_finite(value) || min_component(value) < 0;
                    const bool window = !prepared.intersect(rays.ray(float(x) + 0.5f, float(y) + 0.5f));
                    black_windows += window && spp == 100 && is_black(value);
                }
            INFO("rays that leave by windows: " << escaped);
            CHECK(broken == 0);
            if (sky) CHECK(black_windows == 0);
            if (sky && spp == 100) CHECK(mean(image).y > 0);
        }
        if (sky) MESSAGE(escaped << " of 2304 pixels see the sky");
    }
}
