#pragma once
#include <lambent/bvh/batch.hpp>
#include <lambent/bvh/bvh.hpp>
#include <lambent/bvh/may_meet.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/pyramid.hpp>
#include <lambent/core/ray.hpp>
#include <lambent/core/vec_lanes.hpp>
#include <lambent/light/light_sample.hpp>
#include <lambent/light/triangle_light.hpp>
#include <lambent/sampling/hash.hpp>
#include <lambent/scene/attributes.hpp>
#include <lambent/scene/features.hpp>
#include <lambent/scene/render_scene.hpp>
#include <lambent/scene/scene.hpp>
#include <lambent/scene/scene_lights.hpp>
#include <lambent/scene/smooth_lift.hpp>
#include <lambent/scene/surface.hpp>
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {
/// The filters for_ray(i) of a batch: see RayFilter.
template <class F>
struct OfRay {
    F for_ray;
    explicit OfRay(F f) : for_ray(f) {}
};
} // namespace detail

/// A scene made ready for rays: its tree and its lights. Refers to the scene, which must stay as it is. Primitives are
/// the triangles, then the spheres. What answers rays is made for every feature of a scene, or for those alone that the
/// caller names and vouches for: specialised_scene.hpp does both.
template <class T>
class PreparedScene {
public:
    using Scalar = T;

    /// throws lambent::Error when the scene's arrays do not fit together
    template <class E>
    PreparedScene(const Scene<T>& scene, E& executor) : scene_(validated(scene)), lights_(scene) {
        const auto mesh = triangles(scene.positions, scene.triangles);
        bvh_ = BasicBvh<T>::build(mesh, BuildOptions{}, executor);
        const auto see_through = [](const Material& m) { return m.alpha_mode != AlphaMode::opaque; };
        if (std::any_of(scene.materials.begin(), scene.materials.end(), see_through)) {
            see_through_.reserve(scene.triangles.size());
            for (const std::uint32_t m : scene.triangle_materials) see_through_.push_back(see_through(scene.materials[m]));
        }
        front_only_ = std::any_of(scene.materials.begin(), scene.materials.end(),
                                  [](const Material& m) { return m.front_only; });
        for (const Material& m : scene.materials) panes_.push_back(m.may_be_pane());
        has_panes_ = std::find(panes_.begin(), panes_.end(), true) != panes_.end();
    }
    PreparedScene(Scene<T>&&, auto&) = delete;

    const Scene<T>& scene() const { return scene_; }
    const BasicBvh<T>& bvh() const { return bvh_; }
    std::size_t light_count() const { return lights_.count(); }
    bool has_lights(Companion companion) const { return lights_.any(companion); }
    bool has_panes() const { return has_panes_; }

    template <SceneFeatures features = every_feature>
    Hit<T> intersect(const Ray<T>& ray) const {
        if constexpr (features.alpha)
            if (masked()) return nearer_sphere<features>(ray, bvh_.intersect(ray, alpha_test(ray)));
        return nearer_sphere<features>(ray, bvh_.intersect(ray));
    }

    /// intersect() for a ray from the camera, which does not see the back sides of Material::front_only.
    template <SceneFeatures features = every_feature>
    Hit<T> intersect_camera(const Ray<T>& ray) const {
        if constexpr (features.front_only)
            if (front_only_) return nearer_sphere<features>(ray, bvh_.intersect(ray, front_test(ray)));
        return intersect<features>(ray);
    }

    template <SceneFeatures features = every_feature>
    bool occluded(const Ray<T>& ray) const {
        if constexpr (features.spheres)
            if (behind_sphere(ray)) return true;
        if constexpr (features.alpha)
            if (masked()) return bvh_.occluded(ray, alpha_test(ray));
        return bvh_.occluded(ray);
    }

    /// Whether anything but panes is in the way; `panes` becomes true if they are, as far as it matters.
    template <SceneFeatures features = every_feature>
    bool occluded_but_for_panes(const Ray<T>& ray, bool& panes) const {
        if constexpr (features.spheres)
            if (behind_sphere(ray, &panes)) return true;
        return bvh_.occluded(ray, opaque_test(ray, panes));
    }

    /// The same for many rays at once: the same answers, sooner where rays have something in common, or the tree is large.
    template <SceneFeatures features = every_feature>
    void intersect(std::span<const Ray<T>> rays, std::span<Hit<T>> hits) const {
        if (bvh_.tree().bytes() <= detail::large_tree) { // rays that go all ways are faster alone
            for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = intersect<features>(rays[i]);
            return;
        }
        with_alpha_test<features>(rays, [&](const auto&... filter) { bvh_.intersect(rays, hits, filter...); });
        nearer_spheres<features>(rays, hits);
    }
    template <SceneFeatures features = every_feature>
    void intersect_camera(std::span<const Ray<T>> rays, std::span<Hit<T>> hits) const {
        const auto trace = [&](const auto&... filter) { bvh_.intersect(rays, hits, filter...); };
        if constexpr (features.front_only) {
            if (front_only_) trace(detail::OfRay([this, rays](std::size_t i) { return front_test(rays[i]); }));
            else with_alpha_test<features>(rays, trace);
        } else {
            with_alpha_test<features>(rays, trace);
        }
        nearer_spheres<features>(rays, hits);
    }
    template <SceneFeatures features = every_feature>
    void occluded(std::span<const Ray<T>> rays, std::span<bool> occluded) const {
        with_alpha_test<features>(rays, [&](const auto&... filter) { bvh_.occluded(rays, occluded, filter...); });
        if constexpr (features.spheres)
            for (std::size_t i = 0; i < rays.size(); ++i) occluded[i] = occluded[i] || behind_sphere(rays[i]);
    }
    template <SceneFeatures features = every_feature>
    void occluded_but_for_panes(std::span<const Ray<T>> rays, std::span<bool> occluded, std::span<bool> panes) const {
        bvh_.occluded(rays, occluded,
                      detail::OfRay([this, rays, panes](std::size_t i) { return opaque_test(rays[i], panes[i]); }));
        if constexpr (features.spheres)
            for (std::size_t i = 0; i < rays.size(); ++i) occluded[i] = occluded[i] || behind_sphere(rays[i], &panes[i]);
    }

    /// Whether `ray` finds a surface at a point of a triangle, as a HitFilter. Where that is a matter of chance, the ray's
    /// own bits and the triangle's number decide, so that the answer depends on nothing but the ray.
    auto alpha_test(const Ray<T>& ray) const {
        return [this, &ray](std::uint32_t triangle, T u, T v, T /*t*/) {
            if (!masked() || !see_through_[triangle]) return true;
            const Material& m = material_of(triangle);
            const float coverage = coverage_at(scene_, m, attributes_at(scene_, triangle, u, v));
            if (!(coverage > 0) || !(coverage < 1)) return coverage > 0;
            using Bits = typename detail::FloatBits<T>::Type;
            std::uint64_t key = triangle;
            for (int axis = 0; axis < 3; ++axis) {
                key = derive_key(key, std::uint64_t(std::bit_cast<Bits>(ray.origin[axis])));
                key = derive_key(key, std::uint64_t(std::bit_cast<Bits>(ray.direction[axis])));
            }
            return to_unit<float>(key) < coverage;
        };
    }

    /// Whether no ray within the pyramid meets anything, and all see one background.
    /// cost  a walk of the tree to the first box that the pyramid meets
    bool sees_only_background(const Pyramid<T>& view) const {
        return scene_.environment.map.empty() && scene_.spheres.empty() && !may_meet(bvh_, view);
    }

    /// The point where `ray`, of unit direction, met the scene.
    template <SceneFeatures features = every_feature>
    Surface<T> surface(const Ray<T>& ray, const Hit<T>& hit) const {
        Surface<T> s;
        s.wo = -ray.direction;
        s.distance = hit.t;
        Attributes attributes;
        if (is_sphere<features>(hit.primitive)) {
            const Sphere<T>& sphere = sphere_of(hit.primitive);
            s.material = sphere.material;
            s.geometric_normal = s.shading_normal = normalize(ray.origin + hit.t * ray.direction - sphere.center);
            s.position = sphere.center + sphere.radius * s.geometric_normal;
            s.position_error = gamma_bound<T>(8) * (abs(sphere.center) + Vec3<T>(sphere.radius));
        } else {
            const UVec3 t = scene_.triangles[hit.primitive];
            s.material = scene_.triangle_materials[hit.primitive];
            const T w = 1 - hit.u - hit.v;
            const std::array<Lanes3<T>, 3> corner = corners(t);
            const Lanes3<T> p0 = corner[0] * Lanes3<T>(w), p1 = corner[1] * Lanes3<T>(hit.u), p2 = corner[2] * Lanes3<T>(hit.v);
            s.position = to_vec(p0 + p1 + p2);
            const Lanes3<T> first_edge = corner[1] - corner[0], second_edge = corner[2] - corner[0];
            s.position_error = to_vec(triangle_error(p0, p1, p2, triangle_extent(first_edge, second_edge)));
            s.geometric_normal = unit_normal(first_edge, second_edge);
            s.shading_normal = s.geometric_normal;
            if (!scene_.normals.empty()) {
                const Vec3<T> n = interpolate(scene_.normals, t, hit.u, hit.v);
                const T length2 = dot(n, n);
                if (length2 > T(1e-12)) s.shading_normal = n / std::sqrt(length2);
                s.lift = lift_of(t, s, {w, hit.u, hit.v});
            }
            if constexpr (features.textures || features.colors)
                attributes = attributes_at(scene_, hit.primitive, hit.u, hit.v);
        }
        const Material& material = scene_.materials[s.material];
        const bool front = dot(s.geometric_normal, s.wo) >= 0;
        if (dot(s.shading_normal, s.geometric_normal) < 0) s.shading_normal = -s.shading_normal;
        if constexpr (features.textures)
            if (material.normal_texture && !is_sphere<features>(hit.primitive)) {
                const Vec3<T> bent(mapped_normal(scene_, hit.primitive, hit.u, hit.v, material, attributes,
                                                 Vec3f(s.shading_normal)));
                // A map may bend a normal below the triangle itself, where nothing could be lit.
                if (dot(bent, s.geometric_normal) > 0) s.shading_normal = normalize(bent);
            }
        if (!front) {
            s.geometric_normal = -s.geometric_normal;
            s.shading_normal = -s.shading_normal;
        }
        if (s.shading_normal != s.geometric_normal) keep_reflection_above(s);
        s.front = front;
        if constexpr (features.specular) {
            s.extinction = Vec3<T>(extinction_of(material));
            s.point = standard_point(scene_, material, attributes, front);
            s.albedo = s.point.albedo(glm::max(T(0), dot(s.shading_normal, s.wo)));
        } else {
            s.point.base_color = s.albedo = Vec3<T>(base_color_at<features.textures>(scene_, material, attributes));
        }
        if (material.unlit) {
            s.emission = s.point.base_color;
            s.albedo = Vec3<T>(0);
            s.point = {};
            return s;
        }
        if (material.emissive() && (front || material.double_sided))
            s.emission = Vec3<T>(emission_at<features.textures>(scene_, material, attributes));
        return s;
    }

    Vec3<T> background(const Vec3<T>& direction) const { return lights_.background(direction); }

    /// Light at point `from` of a surface with unit `normal`, as SceneLights::sample().
    template <SceneFeatures features = every_feature>
    LightSample<T> sample_light(const Vec3<T>& from, const Vec3<T>& normal, const Vec2<T>& u, Companion companion) const {
        return lights_.template sample<features>(from, normal, u, companion);
    }

    const SceneLights<T>& lights() const { return lights_; }

    /// Density per solid angle with which sample_light() beside BSDF samples, at the ray's origin on a surface of
    /// this normal, draws the ray's direction to the light that it hit; 0 where that is none. The direction is of unit
    /// length.
    T hit_light_pdf(const Ray<T>& ray, const Hit<T>& hit, const Vec3<T>& normal) const {
        return lights_.pdf(ray.origin, normal, hit.primitive, hit.t, ray.direction);
    }

    T background_pdf(const Vec3<T>& direction) const { return lights_.background_pdf(direction); }

private:
    static const Scene<T>& validated(const Scene<T>& scene) {
        scene.validate();
        return scene;
    }
    bool masked() const { return !see_through_.empty(); }
    /// Calls f with alpha_test() of each ray, or with nothing where all surfaces are opaque.
    template <SceneFeatures features, class F>
    void with_alpha_test(std::span<const Ray<T>> rays, const F& f) const {
        if constexpr (features.alpha)
            if (masked()) return f(detail::OfRay([this, rays](std::size_t i) { return alpha_test(rays[i]); }));
        f();
    }

    template <SceneFeatures features>
    bool is_sphere(std::uint32_t primitive) const {
        return features.spheres && primitive >= scene_.triangles.size();
    }
    const Sphere<T>& sphere_of(std::uint32_t primitive) const {
        return scene_.spheres[primitive - scene_.triangles.size()];
    }
    /// The nearer of a triangle's hit and the spheres'.
    template <SceneFeatures features>
    Hit<T> nearer_sphere(const Ray<T>& ray, Hit<T> hit) const {
        if constexpr (!features.spheres) return hit;
        for (std::size_t i = 0; i < scene_.spheres.size(); ++i) {
            const T t = scene_.spheres[i].intersect(ray, glm::min(hit.t, ray.t_max));
            if (t < hit.t) hit = {.t = t, .primitive = std::uint32_t(scene_.triangles.size() + i)};
        }
        return hit;
    }

    template <SceneFeatures features>
    void nearer_spheres(std::span<const Ray<T>> rays, std::span<Hit<T>> hits) const {
        if constexpr (features.spheres)
            if (!scene_.spheres.empty())
                for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = nearer_sphere<features>(rays[i], hits[i]);
    }
    /// With `panes`, those are noted there and let the ray pass.
    bool behind_sphere(const Ray<T>& ray, bool* panes = nullptr) const {
        for (const Sphere<T>& sphere : scene_.spheres) {
            if (!(sphere.intersect(ray, ray.t_max) < ray.t_max)) continue;
            if (panes == nullptr || !panes_[sphere.material]) return true;
            *panes = true;
        }
        return false;
    }

    /// alpha_test() that lets pass, and notes, what is a pane.
    auto opaque_test(const Ray<T>& ray, bool& panes) const {
        return [this, &panes, covers = alpha_test(ray)](std::uint32_t triangle, T u, T v, T t) {
            if (!covers(triangle, u, v, t)) return false;
            const bool pane = panes_[scene_.triangle_materials[triangle]];
            panes |= pane;
            return !pane;
        };
    }

    /// alpha_test() that also passes back sides which cameras don't see.
    auto front_test(const Ray<T>& ray) const {
        return [this, &ray, covers = alpha_test(ray)](std::uint32_t triangle, T u, T v, T t) {
            const bool seen = !material_of(triangle).front_only || dot(triangle_normal(triangle), ray.direction) < 0;
            return seen && covers(triangle, u, v, t);
        };
    }

    /// Bends a shading normal until the viewer's mirrored direction leaves the true surface: near silhouettes, and under
    /// steep normal maps, facets would be black that see nothing but the surface itself.
    /// source  Keller et al., The Iray Light Transport Simulation and Rendering System (2017), A.3
    static void keep_reflection_above(Surface<T>& s) {
        const T facing = dot(s.shading_normal, s.wo), above = dot(s.geometric_normal, s.wo);
        const Vec3<T> mirrored = 2 * facing * s.shading_normal - s.wo;
        const T height = dot(mirrored, s.geometric_normal), least = glm::min(T(0.01), above / 2);
        if (facing > 0 && height >= least) return;
        const Vec3<T> lifted = normalize(mirrored + (least - glm::min(height, least)) * s.geometric_normal);
        const Vec3<T> half = lifted + s.wo;
        const T size = length(half);
        s.shading_normal = size > T(1e-6) ? half / size : s.geometric_normal;
        if (!(dot(s.shading_normal, s.wo) > 0)) s.shading_normal = s.geometric_normal;
    }

    /// Surface::lift of a point of triangle `t`, from the viewer's side.
    Vec3<T> lift_of(const UVec3& t, const Surface<T>& s, const Vec3<T>& barycentric) const {
        const T side = dot(s.geometric_normal, s.wo) >= 0 ? T(1) : T(-1);
        const auto normal = [&](int i) { return Vec3<T>(scene_.normals[t[i]]) * side; };
        return smooth_lift<T>(s.position, {scene_.positions[t[0]], scene_.positions[t[1]], scene_.positions[t[2]]},
                              {normal(0), normal(1), normal(2)}, barycentric, s.geometric_normal * side);
    }

    std::array<Lanes3<T>, 3> corners(const UVec3& t) const {
        return {to_lanes(scene_.positions[t[0]]), to_lanes(scene_.positions[t[1]]), to_lanes(scene_.positions[t[2]])};
    }

    const Material& material_of(std::uint32_t triangle) const { return scene_.materials[scene_.triangle_materials[triangle]]; }

    Vec3<T> triangle_normal(std::uint32_t triangle) const {
        const std::array<Lanes3<T>, 3> corner = corners(scene_.triangles[triangle]);
        return unit_normal(corner[1] - corner[0], corner[2] - corner[0]);
    }

    /// Of the front. The tree holds no triangle without area, but the product of its edges may still vanish.
    static Vec3<T> unit_normal(Lanes3<T> first_edge, Lanes3<T> second_edge) {
        constexpr T tiny = T(1e-24), huge = T(1e24);
        Lanes3<T> n = robust_cross(first_edge, second_edge);
        T size2 = dot(n, n);
        if (!(size2 > tiny) || !(size2 < huge)) { // what is squared here could under- or overflow
            const Lanes3<T> scale(triangle_extent(first_edge, second_edge));
            n = robust_cross(first_edge / scale, second_edge / scale);
            size2 = dot(n, n);
        }
        return size2 > 0 ? to_vec(n / Lanes3<T>(std::sqrt(size2))) : Vec3<T>(0, 0, 1);
    }

    const Scene<T>& scene_;
    BasicBvh<T> bvh_;
    bool front_only_ = false, has_panes_ = false;
    std::vector<bool> panes_;       ///< of materials: those that may be panes
    std::vector<bool> see_through_; ///< triangles of materials that are masked or blended; empty without such
    SceneLights<T> lights_;
};

} // namespace LAMBENT_ABI
} // namespace lambent
