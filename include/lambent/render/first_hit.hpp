#pragma once
#include <lambent/render/integrator.hpp>

namespace lambent {
inline namespace LAMBENT_ABI {

/// The albedo of what is seen, lit from the viewer: radiance = emission + albedo · cosine. Noise-free previews.
struct FirstHitIntegrator {
    static constexpr bool miss_is_background = true;

    template <RenderScene S, SampleStream Stream>
    PixelSample<typename S::Scalar> sample(const S& scene, const Ray<typename S::Scalar>& ray, const Stream&,
                                           RayCounts& counts) const {
        using T = typename S::Scalar;
        PixelSample<T> result;
        ++counts.closest;
        if (const Hit<T> hit = detail::camera_hit(scene, ray)) {
            const Surface<T> surface = scene.surface(ray, hit);
            detail::record_surface(result, surface);
            result.radiance = surface.emission + surface.albedo * glm::max(T(0), dot(surface.shading_normal, surface.wo));
        } else {
            result.radiance = result.emission = scene.background(ray.direction);
        }
        return result;
    }
};

} // namespace LAMBENT_ABI
} // namespace lambent
