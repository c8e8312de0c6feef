// contributing: begin
#pragma once
#include <lambent/render/integrator.hpp>

namespace lambent {
inline namespace LAMBENT_ABI {

/// The scene lit from where the camera is: albedo by the cosine to the viewer. Quick to look at a model with.
struct HeadlightIntegrator {
    template <RenderScene S, SampleStream Stream>
    PixelSample<typename S::Scalar> sample(const S& scene, const Ray<typename S::Scalar>& ray, const Stream& /*stream*/,
                                           RayCounts& counts) const {
        PixelSample<typename S::Scalar> result;
        ++counts.closest;
        const Hit<typename S::Scalar> hit = detail::camera_hit(scene, ray);
        if (!hit) return result;
        const Surface<typename S::Scalar> surface = scene.surface(ray, hit);
        detail::record_surface(result, surface);
        result.emission = Vec3<typename S::Scalar>(0);
        result.radiance = surface.albedo * dot(surface.shading_normal, surface.wo);
        return result;
    }
};

} // namespace LAMBENT_ABI
} // namespace lambent
// contributing: end
