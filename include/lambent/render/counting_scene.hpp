#pragma once
#include <lambent/render/integrator.hpp>
#include <lambent/scene/prepared_scene.hpp>
#include <atomic>
#include <cstdint>

namespace lambent {
inline namespace LAMBENT_ABI {

/// What a scene was asked. RayCounts has the shadow rays that were saved; bilateral_counts() what a filter does.
struct SceneCounts {
    std::uint64_t closest = 0, shadow = 0; ///< rays
    std::uint64_t nodes = 0;               ///< of the tree, opened by both kinds, as if cameras saw all back sides
    std::uint64_t light_samples = 0;       ///< drawn; `shadow` of them were worth a ray
    std::uint64_t surfaces = 0;            ///< points of surfaces that were made out
    std::uint64_t lookups = 0;             ///< texture slots in use of their materials: each is looked up at most once
};

/// A prepared scene that counts what integrators ask of it; the same pixels, to the bit. Every ray goes through the tree
/// twice, and threads share the counters, so it is for looking at, not for speed. Refers to the scene.
///     const CountingScene<float> counting(prepared);
///     render(counting, camera, PathIntegrator<>{}, sampler, options, executor);
///     counting.counts().nodes
template <class T>
class CountingScene {
public:
    using Scalar = T;
    explicit CountingScene(const PreparedScene<T>& scene) : scene_(scene) {}
    CountingScene(PreparedScene<T>&&) = delete;

    SceneCounts counts() const { return {closest_, shadow_, nodes_, light_samples_, surfaces_, lookups_}; }

    const Scene<T>& scene() const { return scene_.scene(); }
    bool has_panes() const { return scene_.has_panes(); }
    bool has_lights(Companion companion) const { return scene_.has_lights(companion); }
    bool sees_only_background(const Pyramid<T>& view) const { return scene_.sees_only_background(view); }
    Vec3<T> background(const Vec3<T>& direction) const { return scene_.background(direction); }
    T background_pdf(const Vec3<T>& direction) const { return scene_.background_pdf(direction); }
    T hit_light_pdf(const Ray<T>& ray, const Hit<T>& hit, const Vec3<T>& normal) const {
        return scene_.hit_light_pdf(ray, hit, normal);
    }

    Hit<T> intersect(const Ray<T>& ray) const {
        closest(ray);
        return scene_.intersect(ray);
    }
    Hit<T> intersect_camera(const Ray<T>& ray) const {
        closest(ray);
        return scene_.intersect_camera(ray);
    }
    bool occluded(const Ray<T>& ray) const {
        std::uint64_t nodes = 0;
        scene_.bvh().occluded(ray, counted(ray, nodes));
        add(nodes_, nodes), add(shadow_, 1);
        return scene_.occluded(ray);
    }
    bool occluded_but_for_panes(const Ray<T>& ray, bool& panes) const {
        std::uint64_t nodes = 0;
        scene_.bvh().occluded(ray, counted(ray, nodes));
        add(nodes_, nodes), add(shadow_, 1);
        return scene_.occluded_but_for_panes(ray, panes);
    }
    Surface<T> surface(const Ray<T>& ray, const Hit<T>& hit) const {
        const Surface<T> surface = scene_.surface(ray, hit);
        const Material& m = scene().materials[surface.material];
        std::uint64_t lookups = 0;
        Material::for_each_texture(m, [&](const Texture& t) { lookups += bool(t); });
        if (m.diffuse()) lookups = std::uint64_t(bool(m.base_color_texture)) + bool(m.normal_texture) + bool(m.emission_texture);
        else lookups -= bool(m.alpha_texture);
        add(surfaces_, 1), add(lookups_, lookups);
        return surface;
    }
    LightSample<T> sample_light(const Vec3<T>& from, const Vec3<T>& normal, const Vec2<T>& u, Companion companion) const {
        add(light_samples_, 1);
        return scene_.sample_light(from, normal, u, companion);
    }

private:
    using Counter = std::atomic<std::uint64_t>;

    /// The filter of the scene's own rays, which counts nodes.
    auto counted(const Ray<T>& ray, std::uint64_t& nodes) const {
        struct Counted {
            decltype(scene_.alpha_test(ray)) covers;
            std::uint64_t& nodes;
            bool operator()(std::uint32_t triangle, T u, T v, T t) const { return covers(triangle, u, v, t); }
            void node() const { ++nodes; }
        };
        return Counted{scene_.alpha_test(ray), nodes};
    }
    void closest(const Ray<T>& ray) const {
        std::uint64_t nodes = 0;
        scene_.bvh().intersect(ray, counted(ray, nodes));
        add(nodes_, nodes), add(closest_, 1);
    }
    static void add(Counter& counter, std::uint64_t n) { counter.fetch_add(n, std::memory_order_relaxed); }

    const PreparedScene<T>& scene_;
    mutable Counter closest_{0}, shadow_{0}, nodes_{0}, light_samples_{0}, surfaces_{0}, lookups_{0};
};

} // namespace LAMBENT_ABI
} // namespace lambent
