#pragma once
#include <lambent/core/ray.hpp>
#include <lambent/film/pixel_sample.hpp>
#include <lambent/render/integrator.hpp>
#include <lambent/render/panes.hpp>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <type_traits>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// An integrator whose samples are paths that can be taken step by step, and so side by side: see PathIntegrator.
template <class I, class S, class Stream>
concept PathMachine =
    requires(const I& integrator, const S& scene, decltype(I::start(Ray<typename S::Scalar>()))& path,
             const Hit<typename S::Scalar>& hit, const Stream& stream) { integrator.advance(scene, path, hit, stream); };

namespace detail {

/// What rays of a batch meet, and whether something is in their way: at once, from scenes that can, else one by one.
template <class S, class T>
void intersect_each(const S& scene, std::span<const Ray<T>> rays, std::span<Hit<T>> hits) {
    if constexpr (requires { scene.intersect(rays, hits); }) scene.intersect(rays, hits);
    else std::transform(rays.begin(), rays.end(), hits.begin(), [&](const Ray<T>& ray) { return scene.intersect(ray); });
}
template <class S, class T>
void camera_hit_each(const S& scene, std::span<const Ray<T>> rays, std::span<Hit<T>> hits) {
    if constexpr (requires { scene.intersect_camera(rays, hits); }) scene.intersect_camera(rays, hits);
    else std::transform(rays.begin(), rays.end(), hits.begin(), [&](const Ray<T>& ray) { return camera_hit(scene, ray); });
}
/// `panes` tells where they are in the way, as RenderScene has it, or stays false.
template <class S, class T>
void occluded_each(const S& scene, std::span<const Ray<T>> rays, std::span<bool> occluded, std::span<bool> panes) {
    if constexpr (requires { scene.has_panes(); })
        if (scene.has_panes()) {
            std::fill(panes.begin(), panes.end(), false);
            if constexpr (requires { scene.occluded_but_for_panes(rays, occluded, panes); })
                scene.occluded_but_for_panes(rays, occluded, panes);
            else
                for (std::size_t i = 0; i < rays.size(); ++i) occluded[i] = scene.occluded_but_for_panes(rays[i], panes[i]);
            return;
        }
    if constexpr (requires { scene.occluded(rays, occluded); }) scene.occluded(rays, occluded);
    else std::transform(rays.begin(), rays.end(), occluded.begin(), [&](const Ray<T>& ray) { return scene.occluded(ray); });
}

/// Camera rays whose samples are taken together: the same, to the bit, as one by one. Paths go side by side, all of them
/// one step and then the next, so that each step's rays make a batch.
/// cost  some 300 bytes a ray in float
template <class S, class I, class Stream>
class SampleBatch {
public:
    using T = typename S::Scalar;
    static constexpr std::size_t capacity = 512; ///< enough for batches to pay, and little enough to stay near the processor

    /// Refers to both. `expected`: rays in all; there is room for no more than that, nor than `capacity`.
    SampleBatch(const S& scene, const I& integrator, std::uint64_t expected) : scene_(scene), integrator_(integrator) {
        const auto most = std::size_t(std::min<std::uint64_t>(expected, capacity));
        streams_.reserve(most);
        rays_.resize(most);
        if constexpr (machine) {
            paths_.reserve(most);
            hits_.resize(most);
            alive_.resize(most);
            aimed_.resize(most);
            occluded_.reset(new bool[most]);
            panes_.reset(new bool[most]());
        }
    }

    /// Whether there is no more room.
    bool full() const { return streams_.size() == rays_.size(); }

    /// Call only where there is room.
    void add(const Ray<T>& ray, const Stream& stream) {
        rays_[streams_.size()] = ray;
        streams_.push_back(stream);
    }

    /// Calls take(sample) for each ray, in the order in which they were added, and forgets the rays.
    template <class Take>
    void run(RayCounts& counts, const Take& take) {
        if constexpr (machine) {
            for (std::size_t i = 0; i < streams_.size(); ++i) {
                paths_.push_back(I::start(rays_[i]));
                alive_[i] = std::uint32_t(i);
            }
            bool from_camera = true;
            for (std::size_t n = paths_.size(); n > 0; from_camera = false) n = step(n, from_camera, counts);
            for (const Path& path : paths_) {
                counts.shadow += path.probes;
                take(path.result);
            }
            paths_.clear();
        } else {
            for (std::size_t i = 0; i < streams_.size(); ++i) take(integrator_.sample(scene_, rays_[i], streams_[i], counts));
        }
        streams_.clear();
    }

private:
    static constexpr bool machine = PathMachine<I, S, Stream>;
    struct None {};
    static auto path_of(const Ray<T>& ray) {
        if constexpr (machine) return I::start(ray);
        else return None{};
    }
    using Path = decltype(path_of(Ray<T>()));

    /// Takes the first n of `alive_` one step on; returns how many of them go on, which are then the first.
    std::size_t step(std::size_t n, bool from_camera, RayCounts& counts) {
        for (std::size_t i = 0; i < n; ++i) rays_[i] = paths_[alive_[i]].ray;
        const std::span<const Ray<T>> rays(rays_.data(), n);
        if (from_camera) camera_hit_each<S, T>(scene_, rays, hits_);
        else intersect_each<S, T>(scene_, rays, hits_);
        counts.closest += n;

        std::size_t going_on = 0, aimed = 0;
        for (std::size_t i = 0; i < n; ++i) {
            const std::uint32_t index = alive_[i];
            Path& path = paths_[index];
            integrator_.advance(scene_, path, hits_[i], streams_[index]);
            const bool black = is_black(path.shadow_radiance);
            counts.saved += path.aimed && black ? 1u : 0u;
            aimed_[aimed] = alive_[going_on] = index;
            aimed += black ? 0 : 1;
            going_on += path.alive ? 1 : 0;
        }

        for (std::size_t i = 0; i < aimed; ++i) rays_[i] = paths_[aimed_[i]].shadow_ray;
        const std::span<bool> occluded(occluded_.get(), aimed);
        const std::span<bool> panes(panes_.get(), aimed);
        occluded_each<S, T>(scene_, std::span<const Ray<T>>(rays_.data(), aimed), occluded, panes);
        counts.shadow += aimed;
        for (std::size_t i = 0; i < aimed; ++i) answer_shadow_ray(scene_, paths_[aimed_[i]], occluded[i], panes[i], counts);
        return going_on;
    }

    const S& scene_;
    const I& integrator_;
    std::vector<Stream> streams_;
    std::vector<Ray<T>> rays_;
    std::vector<Hit<T>> hits_;
    std::vector<Path> paths_;
    std::vector<std::uint32_t> alive_, aimed_; ///< indices of paths
    std::unique_ptr<bool[]> occluded_, panes_;
};

} // namespace detail

} // namespace LAMBENT_ABI
} // namespace lambent
