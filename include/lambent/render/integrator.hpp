#pragma once
#include <lambent/core/ray.hpp>
#include <lambent/film/film.hpp>
#include <lambent/material/lambert.hpp>
#include <lambent/material/standard.hpp>
#include <lambent/sampling/sampler.hpp>
#include <lambent/scene/render_scene.hpp>
#include <array>
#include <concepts>
#include <cstdint>
#include <type_traits>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Which numbers of a sample are used for what. A path's vertex n draws from its own four dimensions.
namespace dimensions {
inline constexpr std::uint32_t pixel = 0; ///< 2D
inline constexpr std::uint32_t lens = 1;  ///< 2D
inline constexpr std::uint32_t first_vertex = 2; ///< its first dimension
inline constexpr std::uint32_t per_vertex = 4;   ///< dimensions of each
inline constexpr std::uint32_t light = 0;     ///< 2D, from here on relative to the vertex: which one, and where on it
inline constexpr std::uint32_t direction = 1; ///< 2D
inline constexpr std::uint32_t lobe = 2;      ///< 1D
inline constexpr std::uint32_t roulette = 3;  ///< 1D
} // namespace dimensions

/// Counts of what was traced, and of what was not.
struct RayCounts {
    std::uint64_t closest = 0, shadow = 0;
    std::uint64_t saved = 0; ///< shadow rays: light samples that could not have shown, and so were not worth one
    RayCounts& operator+=(const RayCounts& other) {
        closest += other.closest;
        shadow += other.shadow;
        saved += other.saved;
        return *this;
    }
};

/// Estimates the light that arrives along a camera ray. `sample` is one estimate, a pure function of the
/// scene, the ray and the stream's numbers. To add an integrator, write one struct that fits. One with a static member
/// `miss_is_background` promises that what it makes of a miss is a function of what background() says.
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

/// What a vertex whose dimensions begin at `base` draws: at once where the stream is faster so, else when asked for.
/// Refers to the stream.
template <class Stream>
class VertexNumbers {
    static constexpr bool at_once = requires { requires Stream::four_at_once; };
    struct Nothing {};

public:
    using T = typename Stream::Scalar;
    static_assert(dimensions::first_vertex % 4 == 2 && dimensions::per_vertex % 4 == 0, "as streams have them at once");

    VertexNumbers(const Stream& stream, std::uint32_t base) : stream_(stream), base_(base) {
        if constexpr (at_once) numbers_ = stream.get_2d_of_four(base);
    }
    Vec2<T> light() const { return get_2d(dimensions::light); }
    Vec2<T> direction() const { return get_2d(dimensions::direction); }
    T lobe() const { return get_1d(dimensions::lobe); }
    T roulette() const { return get_1d(dimensions::roulette); }

private:
    Vec2<T> get_2d(std::uint32_t dimension) const {
        if constexpr (at_once) return numbers_[dimension];
        else return stream_.get_2d(base_ + dimension);
    }
    T get_1d(std::uint32_t dimension) const {
        if constexpr (at_once) return numbers_[dimension].x;
        else return stream_.get_1d(base_ + dimension);
    }
    const Stream& stream_;
    std::uint32_t base_;
    [[no_unique_address]] std::conditional_t<at_once, std::array<Vec2<T>, 4>, Nothing> numbers_;
};

/// Calls f(bsdf) with how light scatters at a surface, not at all where it doesn't: a scene may have BSDFs of its own.
template <class S, class T, class F>
void with_bsdf(const S& scene, const Surface<T>& surface, F&& f) {
    if constexpr (requires { scene.with_bsdf(surface, f); }) scene.with_bsdf(surface, f);
    else if (!surface.point.diffuse()) f(StandardBsdf<T>(surface.point));
    else if (!is_black(surface.albedo)) f(Lambert<T>{surface.albedo});
}

/// Whether a BSDF is made of delta lobes alone, which no light sample meets; whether light may go through it.
template <class B>
bool only_delta(const B& bsdf) {
    if constexpr (requires { bsdf.only_delta(); }) return bsdf.only_delta();
    else return false;
}
template <class B>
bool transmits(const B& bsdf) {
    if constexpr (requires { bsdf.transmits(); }) return bsdf.transmits();
    else return false;
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
/// The features of what is seen by way of mirrors and smooth glass alone: they take the place of the glass's own, but for
/// its distance and material, and light seen so counts as seen directly.
template <class T>
inline void record_reflected(PixelSample<T>& sample, const Surface<T>& surface, const Vec3<T>& throughput) {
    sample.albedo = min(surface.albedo * throughput, Vec3<T>(1));
    sample.normal = surface.shading_normal;
    sample.position = surface.position;
    sample.emission += surface.emission * throughput;
}
} // namespace detail

} // namespace LAMBENT_ABI
} // namespace lambent
