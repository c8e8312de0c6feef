#pragma once
#include <lambent/core/ray.hpp>
#include <lambent/film/film.hpp>
#include <lambent/sampling/sampler.hpp>
#include <lambent/scene/prepared_scene.hpp>
#include <concepts>
#include <cstdint>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Which numbers of a sample are used for what. A path's vertex n draws from its own four dimensions.
namespace dimensions {
inline constexpr std::uint32_t pixel = 0; ///< 2D
inline constexpr std::uint32_t lens = 1;  ///< 2D
inline constexpr std::uint32_t first_vertex = 2;
inline constexpr std::uint32_t per_vertex = 4;
inline constexpr std::uint32_t light = 0;     ///< 2D, from here on relative to the vertex: which one, and where on it
inline constexpr std::uint32_t direction = 1; ///< 2D
inline constexpr std::uint32_t roulette = 3;  ///< 1D
} // namespace dimensions

/// Counts of what was traced.
struct RayCounts {
    std::uint64_t closest = 0, shadow = 0;
    RayCounts& operator+=(const RayCounts& other) {
        closest += other.closest;
        shadow += other.shadow;
        return *this;
    }
};

/// Estimates the light that arrives along a camera ray. `sample` is one estimate, a pure function of the
/// scene, the ray and the stream's numbers. To add an integrator, write one struct that fits.
template <class I, class S, class Stream>
concept Integrator = RenderScene<S> && SampleStream<Stream> &&
    requires(const I& integrator, const S& scene, const Ray<typename S::Scalar>& ray, const Stream& stream,
             RayCounts& counts) {
        { integrator.sample(scene, ray, stream, counts) } -> std::same_as<PixelSample<typename S::Scalar>>;
    };

namespace detail {
/// What a camera ray meets: a scene may hide surfaces from the camera alone by an intersect_camera() of its own.
template <class S, class T>
inline Hit<T> camera_hit(const S& scene, const Ray<T>& ray) {
    if constexpr (requires { scene.intersect_camera(ray); }) return scene.intersect_camera(ray);
    else return scene.intersect(ray);
}

/// The features of a first hit.
template <class T>
inline void record_surface(PixelSample<T>& sample, const Surface<T>& surface) {
    sample.hit = true;
    sample.albedo = surface.albedo;
    sample.normal = surface.shading_normal;
    sample.position = surface.position;
    sample.depth = surface.distance;
    sample.material = surface.material;
    sample.emission = surface.emission;
}
} // namespace detail

} // namespace LAMBENT_ABI
} // namespace lambent
