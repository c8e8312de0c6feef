#pragma once
#include <lambent/core/ray.hpp>
#include <lambent/light/light_sample.hpp>
#include <lambent/scene/surface.hpp>
#include <concepts>

namespace lambent {
inline namespace LAMBENT_ABI {

/// What integrators ask of a scene; another renderer's scene can be integrated by answering it. Light is asked for at a
/// point with a normal, or with (0, 0, 0) where it may shine through the surface; what draws a direction and what tells
/// its density get the same. A scene may also have
///     with_bsdf(surface, f)     calls f(bsdf) with a Bsdf of its own; else Surface::point, or the albedo, says how it scatters
///     intersect_camera(ray)     what cameras meet, where that differs
///     intersect(rays, hits), intersect_camera(rays, hits), occluded(rays, occluded)  the same for spans of rays, which
///                               render() asks where it can
///     sees_only_background(pyramid)  whether no ray within it meets anything, and all see one background: render() then
///                               takes one sample for all
///     has_panes(), occluded_but_for_panes(ray, panes)  whether light goes straight through some of its surfaces, as
///                               their BSDFs' straight_through(wo) tells; whether anything else is in the way, and, in
///                               `panes`, whether such a surface is; and the latter for spans of rays
///     scene().origin            what its coordinates are relative to, in double
template <class S>
concept RenderScene = requires(const S& scene, const Ray<typename S::Scalar>& ray, const Hit<typename S::Scalar>& hit,
                               const Vec3<typename S::Scalar>& v, const Vec2<typename S::Scalar>& u,
                               Companion companion) {
    { scene.intersect(ray) } -> std::same_as<Hit<typename S::Scalar>>;
    { scene.occluded(ray) } -> std::same_as<bool>;
    { scene.surface(ray, hit) } -> std::same_as<Surface<typename S::Scalar>>;
    { scene.background(v) } -> std::same_as<Vec3<typename S::Scalar>>;
    { scene.sample_light(v, v, u, companion) } -> std::same_as<LightSample<typename S::Scalar>>;
    { scene.hit_light_pdf(ray, hit, v) } -> std::same_as<typename S::Scalar>;
    { scene.background_pdf(v) } -> std::same_as<typename S::Scalar>;
    { scene.has_lights(companion) } -> std::same_as<bool>;
};

} // namespace LAMBENT_ABI
} // namespace lambent
