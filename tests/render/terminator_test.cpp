#include <lambent/render/render.hpp>
#include <lambent/scene/smooth_lift.hpp>
#include <render/transport.hpp>
#include <doctest/doctest.h>
#include <support/random.hpp>

using namespace lambent_test;

/// Coarse meshes with smooth normals: light ends where it would on the smooth surface, not where facets turn away.
namespace {

PunctualLight sun_towards(const Vec3d& direction) {
    PunctualLight sun;
    sun.kind = PunctualLight::Kind::directional;
    sun.intensity = Vec3f(3);
    sun.direction = normalize(direction);
    return sun;
}

/// An icosphere with the normals of the sphere through its vertices.
Scene<float> smooth_sphere(int level) {
    Scene<float> scene;
    add_icosphere(scene, {0, 0, 0}, 1, level, false, add_material(scene, Vec3f(0.8f)));
    for (const Vec3f& p : scene.positions) scene.normals.push_back(normalize(p));
    return scene;
}

PixelData<float> image(const Scene<float>& scene, const Camera& camera) {
    SerialExecutor serial;
    const PreparedScene<float> prepared(scene, serial);
    RenderOptions options;
    options.width = options.height = 64;
    options.end_sample = 16;
    return render(prepared, camera, PathIntegrator<>{{2}}, SobolSampler<float>(1), options, serial);
}

} // namespace

TEST_CASE("a coarse sphere with smooth normals is lit as the sphere is") {
    const PunctualLight sun = sun_towards({-1, -0.3, -0.1});
    const Camera camera{{0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 35, ""};
    Scene<float> sphere;
    sphere.spheres.push_back({{0, 0, 0}, 1, add_material(sphere, Vec3f(0.8f))});
    sphere.punctual_lights = {sun};
    const PixelData<float> expected = image(sphere, camera);
    struct Case {
        int level;
        double rms, worst; ///< facets' hard ends give .027, .0049, .0025 and more than .2, .08, .04
    };
    for (const Case& c : {Case{1, 0.013, 0.08}, Case{2, 0.0035, 0.025}, Case{3, 0.001, 0.008}}) {
        Scene<float> mesh = smooth_sphere(c.level);
        mesh.punctual_lights = {sun};
        const PixelData<float> found = image(mesh, camera);
        double sum = 0, worst = 0, n = 0;
        for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 64; ++x) {
                if (std::hypot(x - 31.5, y - 31.5) > 20) continue; // within the silhouette, which is at 25 pixels
                const double e = found.radiance.load(x, y).x - expected.radiance.load(x, y).x;
                sum += e * e, worst = std::max(worst, std::abs(e)), n += 1;
            }
        CAPTURE(c.level);
        CHECK(std::sqrt(sum / n) < c.rms);
        CHECK(worst < c.worst);
    }
}

TEST_CASE("what smooth normals lift through a wall gets no light from behind it") {
    // A dark room in the sun. In it a coarse ball that all but touches a wall, so that lifted points lie outside.
    Scene<float> scene = smooth_sphere(0);
    for (auto& p : scene.positions) p.x += 1.04f;
    const std::uint32_t wall = add_material(scene, Vec3f(0.5f));
    const double s = 2;
    const Vec3d c[8] = {{-s, -s, -s}, {s, -s, -s}, {-s, s, -s}, {s, s, -s}, {-s, -s, s}, {s, -s, s}, {-s, s, s}, {s, s, s}};
    for (const auto& q : {std::array{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}}) {
        lambent::detail::add_quad(scene, {c[q[0]], c[q[1]], c[q[2]], c[q[3]]}, wall);
        scene.normals.resize(scene.positions.size(), Vec3f(normalize(cross(c[q[1]] - c[q[0]], c[q[2]] - c[q[0]]))));
    }
    scene.texcoords.clear();
    for (const Vec3d& from : {Vec3d(1.95, 1.9, 0.3), Vec3d(1.9, -1.5, 1.2), Vec3d(1.95, 0.3, -1.9)})
        for (const Vec3d& sun : {Vec3d(-0.05, -1, 0.2), Vec3d(-0.1, 0.3, 1), Vec3d(-0.02, -1, -1)}) {
            scene.punctual_lights = {sun_towards(sun)};
            const Camera camera{from, {1.8, 0, 0}, {1, 0, 0}, 90, ""};
            const PixelData<float> found = image(scene, camera);
            double brightest = 0;
            for (int y = 0; y < 64; ++y)
                for (int x = 0; x < 64; ++x) brightest = std::max(brightest, double(found.radiance.load(x, y).x));
            CHECK(brightest == 0);
        }
}

TEST_CASE("lifted points: light samples and bounces find the same far light") {
    Scene<float> scene = smooth_sphere(1);
    const auto material = add_material(scene, Vec3f(0), Vec3f(2));
    scene.spheres.push_back({{60, 15, -20}, 20, material});
    SerialExecutor serial;
    const PreparedScene<float> prepared(scene, serial);
    const Camera camera{{0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 20, ""};
    const Estimate light = image_mean(prepared, camera, {16, 16}, PathIntegrator<PathStrategy::light>{{1}}, 64);
    const Estimate bsdf = image_mean(prepared, camera, {16, 16}, PathIntegrator<PathStrategy::bsdf>{{1}}, 4096);
    const Estimate both = image_mean(prepared, camera, {16, 16}, PathIntegrator<>{{1}}, 64);
    INFO("light " << light.grey << ", bsdf " << bsdf.grey << ", both " << both.grey);
    CHECK(bsdf.relative_error() < 0.01);
    CHECK(std::abs(light.z(bsdf)) < max_z);
    CHECK(std::abs(both.z(light)) < max_z);
}

TEST_CASE("smooth_lift: nothing where flat or hollow, onto the sphere where it bulges") {
    Random random(3);
    for (int i = 0; i < 2000; ++i) {
        const double size = std::pow(2.0, random.uniform(-8, -1));
        const Vec3d middle = normalize(random.in_box<double>(-1, 1));
        std::array<Vec3d, 3> v;
        for (Vec3d& p : v) p = normalize(middle + size * random.in_box<double>(-1, 1));
        Vec3d face = cross(v[1] - v[0], v[2] - v[0]);
        if (length(face) < 1e-3 * size * size) continue;
        face = normalize(face) * (dot(face, middle) > 0 ? 1.0 : -1.0);
        double b[3] = {random.uniform(), random.uniform(), random.uniform()};
        const double sum = b[0] + b[1] + b[2];
        const Vec3d weights = Vec3d(b[0], b[1], b[2]) / sum;
        const Vec3d point = v[0] * weights.x + v[1] * weights.y + v[2] * weights.z;
        CAPTURE(i);
        CHECK(length(smooth_lift<double>(point, v, {face, face, face}, weights, face)) < 1e-15);
        CHECK(smooth_lift<double>(point, v, {-v[0], -v[1], -v[2]}, weights, -face) == Vec3d(0));
        // The planes lie above the sphere by half of the distance's square, as the chord lies below: twice is at hand.
        const Vec3d lifted = point + smooth_lift<double>(point, v, {v[0] * 3.0, v[1], v[2] * 0.2}, weights, face);
        CHECK(length(lifted) >= 1 - 2 * size * size * size * size);
        CHECK(length(lifted) - 1 <= 1.01 * (1 - length(point)) + 2 * size * size * size * size);
    }
}
