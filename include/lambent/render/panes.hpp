#pragma once
#include <lambent/core/frame.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/render/integrator.hpp>
#include <cstdint>

/// Panes: surfaces that light goes straight through, like windows. They don't hide lights from light samples, and a path
/// that goes on through one is still the ray that its last vertex drew: both ways of finding a light find it behind them.
namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Whether a scene has any, as far as it tells.
template <class S>
bool has_panes(const S& scene) {
    if constexpr (requires { scene.has_panes(); }) return scene.has_panes();
    else return false;
}

/// The share of light that goes straight through `surface` towards wo, local to it.
template <class T, class B>
Vec3<T> straight_through(const Surface<T>& surface, const B& bsdf, const Vec3<T>& wo) {
    if constexpr (requires { bsdf.straight_through(wo); })
        if (is_black(surface.extinction)) return bsdf.straight_through(wo);
    return Vec3<T>(0);
}

/// What arrives of the light along a ray that nothing but panes is in the way of: no more than `most` let it pass.
template <class S, class T>
Vec3<T> through_panes(const S& scene, Ray<T> ray, std::uint32_t most, RayCounts& counts) {
    const T size = length(ray.direction);
    Vec3<T> share(1);
    for (;; --most) {
        ++counts.closest;
        Hit<T> hit = scene.intersect(ray);
        if (!hit) return share;
        if (most == 0) return Vec3<T>(0);
        ray.t_min = next_up(hit.t); // the same ray, so that a surface that is there by chance is as it was
        hit.t *= size;
        const Surface<T> surface = scene.surface({.origin = ray.origin, .direction = ray.direction / size}, hit);
        Vec3<T> passed(0);
        with_bsdf(scene, surface, [&](const auto& bsdf) {
            passed = straight_through(surface, bsdf, Frame<T>(surface.shading_normal).to_local(surface.wo));
        });
        share *= passed;
        if (is_black(share)) return share;
    }
}

/// Gives a path the answer to its shadow ray.
template <class S, class Path>
void answer_shadow_ray(const S& scene, Path& path, bool occluded, bool panes, RayCounts& counts) {
    if constexpr (requires { scene.has_panes(); })
        if (panes && !occluded) {
            path.shadow_radiance *= through_panes(scene, path.shadow_ray, path.shadow_panes, counts);
            occluded = is_black(path.shadow_radiance);
        }
    path.listener.shadow(path, occluded);
    if (!occluded) path.add_shadow_radiance();
}

/// Asks the scene, and gives it.
template <class S, class Path>
void trace_shadow_ray(const S& scene, Path& path, RayCounts& counts) {
    bool panes = false;
    if constexpr (requires { scene.has_panes(); })
        if (scene.has_panes()) {
            const bool occluded = scene.occluded_but_for_panes(path.shadow_ray, panes);
            return answer_shadow_ray(scene, path, occluded, panes, counts);
        }
    answer_shadow_ray(scene, path, scene.occluded(path.shadow_ray), panes, counts);
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
