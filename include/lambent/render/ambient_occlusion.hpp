#pragma once
#include <lambent/core/frame.hpp>
#include <lambent/render/integrator.hpp>
#include <lambent/sampling/warp.hpp>
#include <limits>

namespace lambent {
inline namespace LAMBENT_ABI {

/// The cosine-weighted share of the hemisphere that is free up to a distance; a miss is black.
struct AmbientOcclusionIntegrator {
    double distance = std::numeric_limits<double>::infinity(); ///< metres
    static constexpr bool miss_is_background = true;

    template <RenderScene S, SampleStream Stream>
    PixelSample<typename S::Scalar> sample(const S& scene, const Ray<typename S::Scalar>& ray, const Stream& stream,
                                           RayCounts& counts) const {
        using T = typename S::Scalar;
        PixelSample<T> result;
        ++counts.closest;
        const Hit<T> hit = detail::camera_hit(scene, ray);
        if (!hit) return result;
        const Surface<T> surface = scene.surface(ray, hit);
        detail::record_surface(result, surface);
        result.emission = Vec3<T>(0);
        result.albedo = Vec3<T>(1);
        const Vec2<T> u = stream.get_2d(dimensions::first_vertex + dimensions::direction);
        const Vec3<T> wi = Frame<T>(surface.shading_normal).to_world(square_to_cosine_hemisphere(u));
        if (!(dot(wi, surface.geometric_normal) > 0)) return result;
        Ray<T> probe = spawn_ray(surface, normalize(wi));
        probe.t_max = T(distance);
        ++counts.shadow;
        if (!scene.occluded(probe)) result.radiance = result.direct = Vec3<T>(1);
        return result;
    }
};

} // namespace LAMBENT_ABI
} // namespace lambent
