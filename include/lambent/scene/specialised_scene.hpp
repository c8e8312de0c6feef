#pragma once
#include <lambent/core/error.hpp>
#include <lambent/material/lambert.hpp>
#include <lambent/material/standard.hpp>
#include <lambent/scene/features.hpp>
#include <lambent/scene/prepared_scene.hpp>
#include <span>
#include <string>

namespace lambent {
inline namespace LAMBENT_ABI {

/// A prepared scene as seen by code that is made for some features alone: what it lacks is not asked for, nor compiled.
/// Pixels come out with the same bits where the compiler may not fuse products with sums as it likes (gcc and clang:
/// -ffp-contract=off), and else to rounding: differences of up to 3e-5 were seen. Where `plain_features` are enough, paths
/// take half the time (see detail::PackedPaths). Refers to the scene.
///     const SpecialisedScene<float, plain_features> plain(prepared);
///     render(plain, camera, PathIntegrator<>{}, sampler, options, executor);
template <class T, SceneFeatures features>
class SpecialisedScene {
public:
    using Scalar = T;

    /// throws lambent::Error where the scene has more than `features`
    explicit SpecialisedScene(const PreparedScene<T>& scene) : scene_(scene) {
        const SceneFeatures used = features_of(scene.scene());
        SceneFeatures::for_each([&](auto feature, const char* name) {
            require(features.*feature || !(used.*feature),
                    [&] { return std::string("SpecialisedScene: made for scenes without ") + name + ", and this one has some"; });
        });
    }
    SpecialisedScene(PreparedScene<T>&&) = delete;

    const Scene<T>& scene() const { return scene_.scene(); }
    const SceneLights<T>& lights() const { return scene_.lights(); }
    bool has_lights(Companion companion) const { return scene_.has_lights(companion); }
    bool has_panes() const
        requires(features.specular)
    {
        return scene_.has_panes();
    }
    Hit<T> intersect(const Ray<T>& ray) const { return scene_.template intersect<features>(ray); }
    Hit<T> intersect_camera(const Ray<T>& ray) const { return scene_.template intersect_camera<features>(ray); }
    bool occluded(const Ray<T>& ray) const { return scene_.template occluded<features>(ray); }
    void intersect(std::span<const Ray<T>> rays, std::span<Hit<T>> hits) const { scene_.template intersect<features>(rays, hits); }
    void intersect_camera(std::span<const Ray<T>> rays, std::span<Hit<T>> hits) const {
        scene_.template intersect_camera<features>(rays, hits);
    }
    void occluded(std::span<const Ray<T>> rays, std::span<bool> occluded) const {
        scene_.template occluded<features>(rays, occluded);
    }
    bool occluded_but_for_panes(const Ray<T>& ray, bool& panes) const {
        return scene_.template occluded_but_for_panes<features>(ray, panes);
    }
    void occluded_but_for_panes(std::span<const Ray<T>> rays, std::span<bool> occluded, std::span<bool> panes) const {
        scene_.template occluded_but_for_panes<features>(rays, occluded, panes);
    }
    bool sees_only_background(const Pyramid<T>& view) const { return scene_.sees_only_background(view); }
    Surface<T> surface(const Ray<T>& ray, const Hit<T>& hit) const { return scene_.template surface<features>(ray, hit); }
    template <class F>
    void with_bsdf(const Surface<T>& surface, F&& f) const {
        if constexpr (features.specular)
            if (!surface.point.diffuse()) return f(StandardBsdf<T>(surface.point));
        if (!is_black(surface.albedo)) f(Lambert<T>{surface.albedo});
    }
    Vec3<T> background(const Vec3<T>& direction) const { return scene_.background(direction); }
    LightSample<T> sample_light(const Vec3<T>& from, const Vec3<T>& normal, const Vec2<T>& u, Companion companion) const {
        return scene_.template sample_light<features>(from, normal, u, companion);
    }
    T hit_light_pdf(const Ray<T>& ray, const Hit<T>& hit, const Vec3<T>& normal) const {
        return scene_.hit_light_pdf(ray, hit, normal);
    }
    T background_pdf(const Vec3<T>& direction) const { return scene_.background_pdf(direction); }

private:
    const PreparedScene<T>& scene_;
};

namespace detail {
template <SceneFeatures... choices>
struct FirstFit { // of no choices
    template <class T, class F>
    static decltype(auto) call(const SceneFeatures&, const PreparedScene<T>& scene, F& f) {
        return f(scene);
    }
};
template <SceneFeatures first, SceneFeatures... others>
struct FirstFit<first, others...> {
    template <class T, class F>
    static decltype(auto) call(const SceneFeatures& used, const PreparedScene<T>& scene, F& f) {
        if (first.hold(used)) return f(SpecialisedScene<T, first>(scene));
        return FirstFit<others...>::call(used, scene, f);
    }
};
} // namespace detail

/// Calls f(scene) with the first of some specialisations that can do with a scene, else with the scene itself. Each takes
/// the time to compile f once more.
///     with_specialised<plain_features, SceneFeatures{.alpha = false, .specular = false}>(prepared, f)
template <SceneFeatures... choices, class T, class F>
decltype(auto) with_specialised(const PreparedScene<T>& scene, F&& f) {
    return detail::FirstFit<choices...>::call(features_of(scene.scene()), scene, f);
}

} // namespace LAMBENT_ABI
} // namespace lambent
