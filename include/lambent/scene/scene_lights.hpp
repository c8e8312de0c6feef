#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/light/environment_light.hpp>
#include <lambent/light/light_sample.hpp>
#include <lambent/light/light_tree.hpp>
#include <lambent/light/sphere_light.hpp>
#include <lambent/light/triangle_light.hpp>
#include <lambent/sampling/distribution.hpp>
#include <lambent/scene/attributes.hpp>
#include <lambent/scene/features.hpp>
#include <lambent/scene/scene.hpp>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// All lights of a scene, and how one of them is chosen: the environment, then those without a place, then
/// the others, picked by a tree that knows where they are, or by power from a table where they are too few for it. One
/// number picks, and what is left of it places the sample, so that well-spread numbers are well spread over all lights.
/// Two triangles that make a parallelogram are one light, if they shine evenly and follow each other. Refers to the
/// scene, which must stay as it is. Primitives are the triangles, then the spheres.
template <class T>
class SceneLights {
public:
    /// From this number of lights with a place on they are picked by the tree.
    static constexpr std::size_t default_tree_from = 2;

    explicit SceneLights(const Scene<T>& scene, std::size_t tree_from = default_tree_from)
        : scene_(scene), environment_(scene.environment.map, scene.environment.width, scene.environment.height,
                                      scene.environment.scale, scene.environment.rotation) {
        collect(tree_from);
    }
    SceneLights(Scene<T>&&, std::size_t = 0) = delete;

    std::size_t count() const { return lights_.size() + distant_lights_.size() + std::size_t(!environment_.black()); }

    /// Whether sample() may find any.
    bool any(Companion companion) const { return any_[std::size_t(companion)]; }

    Vec3<T> background(const Vec3<T>& direction) const {
        return environment_.black() ? Vec3<T>(0) : environment_.radiance(direction);
    }

    /// Light at point `from` on a surface of unit `normal`, wanted from its side only (normal 0: from anywhere): one
    /// light, and one direction to it. The pdf includes the pick.
    template <SceneFeatures features = every_feature>
    LightSample<T> sample(const Vec3<T>& from, const Vec3<T>& normal, Vec2<T> u, Companion companion) const {
        T probability = 1;
        const Shares& shares = shares_[std::size_t(companion)];
        LightSample<T> s;
        if (takes(u.x, shares.environment, probability)) {
            s = environment_.sample(u, companion, normal);
        } else if (takes(u.x, shares.distant, probability)) {
            const std::uint32_t index = pick(distant_, u.x, probability);
            if (!(probability > 0)) return s;
            s = scene_.punctual_lights[distant_lights_[index]].sample(from, scene_.origin);
        } else if (!tree_.empty()) {
            const auto chosen = tree_.sample(from, normal, u.x);
            if (!(chosen.probability > 0)) return s;
            probability *= chosen.probability;
            s = sample_one<features>(lights_[chosen.index], from, {chosen.u, u.y});
        } else {
            const std::uint32_t index = lights_.size() > 1 ? pick(table_, u.x, probability) : 0;
            if (!(probability > 0) || lights_.empty()) return s;
            s = sample_one<features>(lights_[index], from, u);
        }
        s.pdf *= probability;
        return s;
    }

    /// Density per solid angle with which sample(from, normal, u, Companion::bsdf) draws unit direction wi to a
    /// primitive met there at this distance; 0 where it is no light.
    T pdf(const Vec3<T>& from, const Vec3<T>& normal, std::uint32_t primitive, T distance, const Vec3<T>& wi) const {
        if (light_of_primitive_.empty()) return 0;
        const std::uint32_t light = light_of_primitive_[primitive];
        if (light == no_light) return 0;
        const Shares& shares = shares_[std::size_t(Companion::bsdf)];
        const T pick = (1 - shares.environment) * (1 - shares.distant) *
                       (tree_.empty() ? T(table_.probability(light)) : tree_.pmf(from, normal, light));
        if (primitive < scene_.triangles.size())
            return pick * triangles_[lights_[light].index].shape.pdf(distance * distance, wi);
        return pick * sphere(primitive - std::uint32_t(scene_.triangles.size())).pdf(from);
    }

    /// The same for a direction that leaves the scene.
    T background_pdf(const Vec3<T>& direction) const {
        const T share = shares_[std::size_t(Companion::bsdf)].environment;
        return share > 0 ? share * environment_.pdf(direction, Companion::bsdf) : T(0);
    }

    /// Calls f(light, radiance, double_sided) if all light samples are of one triangle that shines evenly, and says whether.
    template <class F>
    bool with_only_triangle(Companion companion, F&& f) const {
        const Shares& shares = shares_[std::size_t(companion)];
        if (lights_.size() != 1 || lights_[0].kind != Kind::triangle || shares.environment > 0 || shares.distant > 0) return false;
        const Triangle& t = triangles_[0];
        if (t.varies) return false;
        f(t.shape, t.radiance, t.double_sided);
        return true;
    }

private:
    enum class Kind : std::uint8_t { triangle, sphere, punctual };
    struct LightRef {
        Kind kind;
        std::uint32_t index; ///< among triangles_, the scene's spheres, or its punctual lights
    };
    struct Triangle {
        TriangleLight<T> shape;
        Vec3<T> radiance; ///< unless it varies
        std::uint32_t primitive;
        bool double_sided, varies;
    };
    struct Shares {
        T environment = 0; ///< of all samples
        T distant = 0;     ///< of the others
    };
    static constexpr std::uint32_t no_light = 0xffffffffu;

    /// Whether u falls to something of this share; u is stretched to [0, 1) again and the probability follows.
    static bool takes(T& u, T share, T& probability) {
        if (!(share > 0)) return false;
        const bool taken = u < share;
        const T width = taken ? share : 1 - share;
        u = std::min((taken ? u : u - share) / width, one_minus_epsilon<T>);
        probability *= width;
        return taken;
    }

    /// The same for an item of a table.
    static std::uint32_t pick(const Distribution1D& table, T& u, T& probability) {
        const auto chosen = table.sample(u);
        probability *= chosen.pdf > 0 ? T(table.probability(chosen.index)) : T(0);
        u = std::clamp(chosen.x * T(table.size()) - T(chosen.index), T(0), one_minus_epsilon<T>);
        return chosen.index;
    }

    std::array<Vec3<T>, 3> corners(std::size_t triangle) const {
        const UVec3 t = scene_.triangles[triangle];
        return {scene_.positions[t[0]], scene_.positions[t[1]], scene_.positions[t[2]]};
    }
    SphereLight<T> sphere(std::uint32_t index) const {
        const Sphere<T>& s = scene_.spheres[index];
        return {s.center, s.radius};
    }
    Vec3<T> emission_of_sphere(std::uint32_t index) const {
        return Vec3<T>(emission_at(scene_, scene_.materials[scene_.spheres[index].material], Attributes()));
    }

    template <SceneFeatures features>
    LightSample<T> sample_one(const LightRef& light, const Vec3<T>& from, const Vec2<T>& u) const {
        LightSample<T> s;
        switch (light.kind) {
        case Kind::punctual: s = scene_.punctual_lights[light.index].sample(from, scene_.origin); break;
        case Kind::sphere:
            if constexpr (features.spheres) {
                s = sphere(light.index).sample(from, u);
                s.radiance = emission_of_sphere(light.index);
            }
            break;
        case Kind::triangle: {
            Vec2<T> barycentric(0);
            bool front = false;
            const Triangle& t = triangles_[light.index];
            s = t.shape.sample(from, u, barycentric, front);
            if (!front && !t.double_sided) s.pdf = 0;
            s.radiance = t.radiance;
            if constexpr (features.textures || features.alpha)
                if (t.varies && s.pdf > 0) {
                    const Material& material = scene_.materials[scene_.triangle_materials[t.primitive]];
                    const Attributes a = attributes_at(scene_, t.primitive, barycentric.x, barycentric.y);
                    s.radiance = Vec3<T>(emission_at(scene_, material, a) * coverage_at(scene_, material, a));
                }
            break;
        }
        }
        return s;
    }

    void collect(std::size_t tree_from) {
        std::vector<LightBounds<T>> bounds;
        std::vector<double> powers, distant_powers;
        double power = 0, distant_power = 0;
        const auto add = [&](Kind kind, std::size_t index, const LightBounds<T>& b, double p) {
            if (!(b.intensity > 0) || !is_finite(b.intensity) || !is_finite(p)) return no_light;
            lights_.push_back({kind, std::uint32_t(index)});
            bounds.push_back(b);
            powers.push_back(p);
            power += p;
            return std::uint32_t(lights_.size() - 1);
        };
        std::vector<std::uint32_t> of_primitive(scene_.triangles.size() + scene_.spheres.size(), no_light);
        for (std::size_t i = 0, together = 1; i < scene_.triangles.size(); i += together) {
            together = 1;
            const Material& m = scene_.materials[scene_.triangle_materials[i]];
            if (!m.emissive()) continue;
            using Sides = typename LightBounds<T>::Sides;
            const bool varies = m.emission_texture || m.alpha_mode != AlphaMode::opaque;
            TriangleLight<T> shape(corners(i));
            const std::span<const std::uint32_t> materials = scene_.triangle_materials;
            if (!varies && i + 1 < materials.size() && materials[i] == materials[i + 1])
                if (const auto both = TriangleLight<T>::joined(corners(i), corners(i + 1))) {
                    shape = *both;
                    together = 2;
                }
            const auto b = shape.bounds(T(mean_luminance(std::uint32_t(i), m)), m.double_sided ? Sides::both : Sides::front);
            const std::uint32_t light =
                add(Kind::triangle, triangles_.size(), b, pi<double> * double(b.intensity) * (m.double_sided ? 2 : 1));
            std::fill_n(of_primitive.begin() + std::ptrdiff_t(i), together, light);
            if (light == no_light) continue;
            triangles_.push_back({shape, Vec3<T>(m.emission), std::uint32_t(i), m.double_sided, varies});
        }
        for (std::size_t i = 0; i < scene_.spheres.size(); ++i) {
            const auto b = sphere(std::uint32_t(i)).bounds(luminance(emission_of_sphere(std::uint32_t(i))));
            of_primitive[scene_.triangles.size() + i] = add(Kind::sphere, i, b, 4 * pi<double> * double(b.intensity));
        }
        if (!lights_.empty()) light_of_primitive_ = std::move(of_primitive);
        const Bounds3<double> box = scene_.bounds();
        const double radius = box.empty() ? 1.0 : std::max(1e-30, length(box.size()) / 2);
        for (std::size_t i = 0; i < scene_.punctual_lights.size(); ++i) {
            const PunctualLight& light = scene_.punctual_lights[i];
            const double p = light.power(radius);
            if (light.kind != PunctualLight::Kind::directional) {
                add(Kind::punctual, i, light.template bounds<T>(scene_.origin), p);
            } else if (p > 0 && is_finite(p)) {
                distant_lights_.push_back(std::uint32_t(i));
                distant_powers.push_back(p);
                distant_power += p;
            }
        }
        distant_ = Distribution1D(std::span<const double>(distant_powers));
        if (lights_.size() >= tree_from) tree_ = LightTree<T>(bounds);
        else table_ = Distribution1D(std::span<const double>(powers));

        for (const Companion companion : {Companion::none, Companion::bsdf}) {
            const double sky = 4 * pi<double> * pi<double> * radius * radius * double(environment_.mean_luminance(companion));
            shares_[std::size_t(companion)] = {share(sky, distant_power + power), share(distant_power, power)};
            any_[std::size_t(companion)] = sky + distant_power + power > 0;
        }
    }

    /// Of two kinds of light by power, but none is left out: the power of what shines from far away does not tell how
    /// much of it gets in.
    static T share(double a, double b) {
        if (!(a > 0) || !(b > 0)) return T(a > 0 ? 1 : 0);
        return T(std::clamp(a / (a + b), 0.25, 0.75));
    }

    /// Of a triangle's lit side; a texture is looked at in a few places, and never counts for nothing.
    double mean_luminance(std::uint32_t index, const Material& m) const {
        const double whole = luminance(Vec3d(m.emission));
        if (!m.emission_texture) return whole;
        constexpr int side = 4;
        double sum = 0;
        for (int i = 0; i < side * side; ++i) {
            const Vec2<T> b = square_to_triangle(Vec2<T>((T(i % side) + T(0.5)) / side, (T(i / side) + T(0.5)) / side));
            sum += luminance(Vec3d(emission_at(scene_, m, attributes_at(scene_, index, b.x, b.y))));
        }
        return std::max(sum / (side * side), whole * 0.01);
    }

    const Scene<T>& scene_;
    EnvironmentLight<T> environment_;
    std::vector<LightRef> lights_;                  ///< with a place
    std::vector<Triangle> triangles_;               ///< those among lights_
    std::vector<std::uint32_t> distant_lights_;     ///< punctual ones that are directional
    std::vector<std::uint32_t> light_of_primitive_; ///< empty without lights among them
    Shares shares_[2];                              ///< by Companion
    bool any_[2] = {false, false};
    Distribution1D distant_, table_;
    LightTree<T> tree_; ///< or the table
};

} // namespace LAMBENT_ABI
} // namespace lambent
