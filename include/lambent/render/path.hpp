#pragma once
#include <lambent/core/frame.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/material/lambert.hpp>
#include <lambent/render/integrator.hpp>
#include <lambent/render/panes.hpp>
#include <lambent/render/path_listener.hpp>
#include <lambent/sampling/mis.hpp>
#include <algorithm>
#include <cstdint>
#include <limits>

namespace lambent {
inline namespace LAMBENT_ABI {

/// How light is looked for at a vertex: by a ray to a light that was picked, by the bounce that hits one, or
/// by both, weighted. `light` never sees light on surfaces that no light sample reaches, `bsdf` no punctual light.
enum class PathStrategy : std::uint8_t { both, light, bsdf };
/// How two ways of finding one light are weighted against each other: Veach 1997, 9.2.
enum class MisHeuristic : std::uint8_t { power, balance };

/// How long paths may be.
struct PathOptions {
    std::uint32_t max_depth = unlimited;  ///< scattering events of a path; 0 = emission only
    std::uint32_t roulette_depth = 2;     ///< scattering events before roulette may end a path; `unlimited` = never
    float roulette_strength = 1.0f / 3;   ///< of a path (the largest channel of what it carries on): roulette may end
                                          ///< weaker ones, and gives this to those that survive
    static constexpr std::uint32_t unlimited = std::numeric_limits<std::uint32_t>::max();
};

/// One path under way. Between two calls of advance() it waits for the answer to `ray` and, where
/// `shadow_radiance` is not black, to `shadow_ray`.
template <class T, class Listener = NoListener>
struct PathState {
    Ray<T> ray;
    Vec3<T> throughput{1};
    PixelSample<T> result;
    std::uint32_t depth = 0; ///< scattering events so far
    T bsdf_pdf = 0;          ///< of the ray's direction; 0 where only it could find a light: of the camera, or a delta lobe's
    T eta_scale = 1;         ///< what refraction has done to the scale of the throughput
    bool specular = true;    ///< delta lobes only so far
    bool first = false;      ///< the ray left the first surface that is not specular
    bool shadow_first = false; ///< so did the shadow ray
    Vec3<T> normal{0};       ///< of the surface that the ray left, as lights were asked for there
    Vec3<T> extinction{0};   ///< per unit of length, of the volume that the ray is in
    Ray<T> shadow_ray;
    Vec3<T> shadow_radiance{0};
    std::uint32_t shadow_panes = 0; ///< that the shadow ray may pass: what max_depth leaves
    std::uint32_t probes = 0;   ///< short shadow rays so far that advance() asked itself: see Surface::lift
    bool aimed = false; ///< a light sample was drawn; black `shadow_radiance` says then that it was not worth a ray
    bool alive = true;
    [[no_unique_address]] Listener listener{};

    /// To be called where nothing is in the way of the shadow ray.
    void add_shadow_radiance() {
        result.radiance += shadow_radiance;
        (shadow_first ? result.direct : result.indirect) += shadow_radiance;
    }
};

/// Unidirectional path tracing with next-event estimation, multiple importance sampling and roulette on the
/// throughput. A state machine: `start`, then `advance` with each hit; `sample` drives one path to its end, in
/// constant stack at any depth. Strategy and heuristic are types, so that what is off costs nothing.
/// source  Veach, PhD thesis (1997), chapters 9 and 10
template <PathStrategy strategy = PathStrategy::both, MisHeuristic heuristic = MisHeuristic::power>
struct PathIntegrator {
    PathOptions options{};
    static constexpr bool miss_is_background = true;

    template <class T, class L = NoListener>
    static PathState<T, L> start(const Ray<T>& ray, const L& listener = {}) {
        PathState<T, L> path;
        path.ray = ray;
        path.listener = listener;
        return path;
    }

    /// Takes the path from its ray's hit to its next ray. A shadow ray that it asks for has to be answered
    /// before the next call: add_shadow_radiance() unless it is occluded.
    template <RenderScene S, SampleStream Stream, class L>
    void advance(const S& scene, PathState<typename S::Scalar, L>& path, const Hit<typename S::Scalar>& hit,
                 const Stream& stream) const {
        using T = typename S::Scalar;
        path.shadow_radiance = Vec3<T>(0);
        path.aimed = false;
        if (!hit) {
            path.listener.miss(path);
            add_emission(path, scene.background(path.ray.direction),
                         [&] { return scene.background_pdf(path.ray.direction); });
            if (path.depth == 0) path.result.emission = path.result.radiance;
            path.alive = false;
            return;
        }
        const Surface<T> surface = scene.surface(path.ray, hit);
        path.listener.hit(path, hit, surface);
        if (!is_black(path.extinction)) path.throughput *= exp(-path.extinction * (surface.distance - path.ray.t_min));
        if (path.depth == 0) detail::record_surface(path.result, surface);
        else if (path.specular) detail::record_reflected(path.result, surface, path.throughput);
        add_emission(path, surface.emission, [&] { return scene.hit_light_pdf(path.ray, hit, path.normal); });
        path.alive = false;
        if (path.depth >= options.max_depth) return;
        detail::with_bsdf(scene, surface, [&](const auto& bsdf) { meet(scene, path, surface, bsdf, stream); });
    }

    template <RenderScene S, SampleStream Stream, class L = NoListener>
    PixelSample<typename S::Scalar> sample(const S& scene, const Ray<typename S::Scalar>& ray, const Stream& stream,
                                           RayCounts& counts, const L& listener = {}) const {
        auto path = start(ray, listener);
        while (path.alive) {
            ++counts.closest;
            advance(scene, path, path.depth == 0 ? detail::camera_hit(scene, path.ray) : scene.intersect(path.ray), stream);
            if (is_black(path.shadow_radiance)) {
                counts.saved += path.aimed ? 1u : 0u;
                continue;
            }
            ++counts.shadow;
            detail::trace_shadow_ray(scene, path, counts);
        }
        counts.shadow += path.probes;
        return path.result;
    }

private:
    static constexpr Companion companion = strategy == PathStrategy::both ? Companion::bsdf : Companion::none;

    template <class T>
    static T mis_weight(T pdf, T other) {
        return heuristic == MisHeuristic::power ? power_heuristic(pdf, other) : balance_heuristic(pdf, other);
    }

    /// Light that the path met by chance.
    template <class T, class L, class Pdf>
    static void add_emission(PathState<T, L>& path, const Vec3<T>& emission, Pdf light_pdf) {
        if (is_black(emission)) return;
        Vec3<T> radiance = path.throughput * emission;
        T competing = 0, weight = 1;
        if (path.bsdf_pdf > 0) {
            if constexpr (strategy == PathStrategy::light) return;
            if constexpr (strategy == PathStrategy::both) {
                competing = light_pdf();
                weight = mis_weight(path.bsdf_pdf, competing);
                radiance *= weight;
            }
        }
        path.listener.emission(path, emission, competing, weight, radiance);
        path.result.radiance += radiance;
        if (path.depth > 0) (path.first || path.specular ? path.result.direct : path.result.indirect) += radiance;
    }

    /// Next-event estimation and the next direction at a surface.
    template <class S, class T, class L, class B, class Stream>
    void meet(const S& scene, PathState<T, L>& path, const Surface<T>& surface, const B& bsdf, const Stream& stream) const {
        const detail::VertexNumbers numbers(stream, dimensions::first_vertex + dimensions::per_vertex * path.depth);
        const Frame<T> frame(surface.shading_normal);
        const Vec3<T> wo = frame.to_local(surface.wo);
        if constexpr (strategy != PathStrategy::bsdf) {
            if (scene.has_lights(companion) && !detail::only_delta(bsdf))
                aim_at_light(scene, path, surface, frame, bsdf, wo, numbers.light());
        }
        scatter(scene, path, surface, frame, bsdf, wo, numbers);
    }

    /// How a direction leaves the true surface to the side on which the shading normal has it. Where a facet is in the
    /// way it does from above the facet, if nothing is between. Else, what interpolated and mapped normals would send
    /// through an opaque surface, or reflect from a transmissive one's inside, is lost.
    template <class S, class T, class L>
    static Exit way_out(const S& scene, PathState<T, L>& path, const Surface<T>& surface, const Vec3<T>& wi, T local_z) {
        if (dot(wi, surface.geometric_normal) * local_z > 0) return Exit::position;
        if (!(local_z > 0) || !(dot(surface.lift, surface.lift) > 0)) return Exit::none;
        ++path.probes;
        const Vec3<T> origin = spawn_ray(surface, surface.lift).origin;
        const bool walled = scene.occluded({.origin = origin, .direction = surface.position + surface.lift - origin, .t_max = 1});
        return walled ? Exit::none : Exit::lift;
    }

    template <class S, class T, class L, class B>
    void aim_at_light(const S& scene, PathState<T, L>& path, const Surface<T>& surface, const Frame<T>& frame,
                      const B& bsdf, const Vec3<T>& wo, const Vec2<T>& u) const {
        const LightSample<T> light = scene.sample_light(surface.position, lit_normal(surface, bsdf), u, companion);
        path.aimed = true;
        path.listener.light(path, light);
        if (!(light.pdf > 0)) return;
        const Vec3<T> wi = frame.to_local(light.wi);
        const BsdfValue<T> scattered = evaluate(bsdf, wo, wi);
        const Vec3<T> value = scattered.f * glm::abs(wi.z) * light.radiance * path.throughput;
        if (is_black(value)) return;
        const Exit out = way_out(scene, path, surface, light.wi, wi.z);
        if (out == Exit::none) return;
        T weight = 1;
        if constexpr (strategy == PathStrategy::both)
            if (!light.delta) weight = mis_weight(light.pdf, scattered.pdf);
        path.shadow_radiance = value * (weight / light.pdf);
        path.shadow_first = path.specular;
        path.shadow_panes = options.max_depth - path.depth - 1;
        path.listener.aim(path, scattered, weight);
        path.shadow_ray = light.infinite
                              ? spawn_ray(surface, light.wi, out)
                              : spawn_ray_to(surface, light.target, light.target_error, light.target_normal, out);
    }

    /// The normal by which lights are chosen: none where they may shine through.
    template <class T, class B>
    static Vec3<T> lit_normal(const Surface<T>& surface, const B& bsdf) {
        return detail::transmits(bsdf) ? Vec3<T>(0) : surface.shading_normal;
    }

    template <class S, class T, class L, class B, class Numbers>
    void scatter(const S& scene, PathState<T, L>& path, const Surface<T>& surface, const Frame<T>& frame, const B& bsdf,
                 const Vec3<T>& wo, const Numbers& numbers) const {
        const BsdfSample<T> bounce = bsdf.sample(wo, numbers.lobe(), numbers.direction());
        const Vec3<T> wi = normalize(frame.to_world(bounce.wi));
        path.listener.bounce(path, bounce, wi);
        if (!(bounce.pdf > 0)) return;
        const Exit out = way_out(scene, path, surface, wi, bounce.wi.z);
        if (out == Exit::none) return;
        path.throughput *= bounce.weight;
        path.eta_scale *= bounce.eta_scale;
        ++path.depth;
        if (!is_finite(path.throughput)) { // by components: a maximum may pass over a NaN
            path.result.radiance += path.throughput; // so the film counts the sample, and takes nothing of it
            return;
        }
        const T strength = max_component(path.throughput) * path.eta_scale;
        if (!(strength > 0)) return;
        if (path.depth >= options.roulette_depth) {
            const T survival = std::clamp(strength / T(options.roulette_strength), T(0.05), T(0.99)); // white mazes end too
            const bool survived = numbers.roulette() < survival;
            path.listener.roulette(path, survival, survived);
            if (!survived) return;
            path.throughput /= survival;
        }
        path.alive = true;
        if (detail::has_panes(scene) && bounce.delta && bounce.wi.z < 0 &&
            !is_black(detail::straight_through(surface, bsdf, wo))) {
            path.ray.t_min = next_up(surface.distance);
            return;
        }
        if (bounce.wi.z < 0) path.extinction = surface.front ? surface.extinction : Vec3<T>(0);
        path.bsdf_pdf = bounce.delta ? T(0) : bounce.pdf;
        path.first = path.specular && !bounce.delta;
        path.specular = path.specular && bounce.delta;
        path.normal = lit_normal(surface, bsdf);
        path.ray = spawn_ray(surface, wi, out);
    }
};

} // namespace LAMBENT_ABI
} // namespace lambent
