// The path tracer in a scene that isn't ours: a hollow sphere that glows and reflects half of what it gets, with a ball of
// glass in it. A renderer answers a few questions about its own data, and integrators, samplers and film are its own.
#include <cmath>
#include <cstdio>
#include <lambent/core/parallel.hpp>
#include <lambent/render/path.hpp>
#include <lambent/bvh/sphere.hpp>
#include <lambent/render/render.hpp>
#include <lambent/sampling/sobol.hpp>

using namespace lambent;

// scene: begin
/// What an integrator asks of a scene: see lambent::RenderScene. Here in double, as everything may be.
struct GlowingSphere {
    using Scalar = double;
    using V = Vec3<double>;
    static constexpr double inside = 10, ball = 1;

    static double meet(const Ray<double>& ray, double radius) {
        return intersect_sphere(ray, V(0), radius);
    }
    Hit<double> intersect(const Ray<double>& ray) const {
        const double wall = meet(ray, inside), glass = meet(ray, ball), t = std::fmin(wall, glass);
        return t < ray.t_max ? Hit<double>{.t = t, .primitive = glass < wall ? 1u : 0u} : Hit<double>();
    }
    bool occluded(const Ray<double>& ray) const { return intersect(ray).t < ray.t_max; }

    Surface<double> surface(const Ray<double>& ray, const Hit<double>& hit) const {
        Surface<double> s;
        s.position = ray.origin + hit.t * ray.direction;
        s.position_error = V(1e-14 * inside);
        s.wo = -ray.direction;
        s.front = dot(s.position, s.wo) > 0;
        s.geometric_normal = s.shading_normal = normalize(s.position) * (s.front ? 1.0 : -1.0);
        s.distance = hit.t;
        if (hit.primitive == 1) {
            s.albedo = V(1);
            s.point.specular = s.point.transmission = 1;
            s.point.roughness = 0;
            s.point.thin = false;
            s.point.front = s.front;
        } else {
            s.albedo = s.point.base_color = V(0.5);
            s.emission = V(1);
        }
        return s;
    }
    V background(const V&) const { return V(0); }

    // No light is aimed at: the walls shine from everywhere, and paths find them.
    bool has_lights(Companion) const { return false; }
    LightSample<double> sample_light(const V&, const V&, const Vec2d&, Companion) const { return {}; }
    double hit_light_pdf(const Ray<double>&, const Hit<double>&, const V&) const { return 0; }
    double background_pdf(const V&) const { return 0; }
};
// scene: end

int main() {
    ThreadExecutor threads;
    Camera camera;
    camera.eye = {0, 0, 5};
    camera.target = {0, 0, 0};
    // render: begin
    const RenderOptions options{.width = 32, .height = 32, .end_sample = 64};
    const auto frame = render(GlowingSphere{}, camera, PathIntegrator<>{}, SobolSampler<double>(1), options, threads);
    // render: end
    double sum = 0;
    for (int y = 0; y < 32; ++y)
        for (int x = 0; x < 32; ++x) sum += frame.radiance.view().load(x, y).x;
    std::printf("radiance %.2f: emission 1 over 1 - albedo 0.5, through glass or not\n", sum / (32 * 32));
}
