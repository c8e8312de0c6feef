#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/light/environment_light.hpp>
#include <lambent/light/light_sample.hpp>
#include <lambent/light/sphere_light.hpp>
#include <lambent/light/triangle_light.hpp>
#include <lambent/sampling/distribution.hpp>
#include <lambent/scene/attributes.hpp>
#include <lambent/scene/scene.hpp>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// All lights of a scene, and how one is chosen. Refers to the scene, which must stay as it is.
/// Primitives are the triangles, then the spheres.
template <class T>
class SceneLights {
public:
    explicit SceneLights(const Scene<T>& scene) : scene_(scene) {
        environment_ = EnvironmentLight<T>(scene.environment.map, scene.environment.width, scene.environment.height,
                                           scene.environment.scale, scene.environment.rotation);
        collect();
    }
    SceneLights(Scene<T>&&) = delete;

    std::size_t count() const { return lights_.size(); }

    /// Whether sample() may find any.
    bool any(Companion /*companion*/) const { return !lights_.empty(); }

    Vec3<T> background(const Vec3<T>& direction) const {
        return environment_.black() ? Vec3<T>(0) : environment_.radiance(direction);
    }

    /// Light at point `from`, from one light picked by power and one direction to it; the pdf includes the pick.
    LightSample<T> sample(const Vec3<T>& from, const Vec3<T>& /*normal*/, const Vec2<T>& u, Companion /*companion*/) const {
        const auto chosen = table_.sample(u.x);
        LightSample<T> s;
        if (!(chosen.pdf > 0)) return s;
        // The light takes up one interval of u.x; where in it u.x fell is as evenly spread as u.x itself.
        const T rest = std::min(chosen.x * T(table_.size()) - T(chosen.index), one_minus_epsilon<T>);
        s = sample_one(lights_[chosen.index], from, {std::max(rest, T(0)), u.y});
        s.pdf *= T(table_.probability(chosen.index));
        return s;
    }

    /// Density per solid angle with which sample() at `from` draws unit direction wi to a primitive met there at
    /// this distance; 0 where it is no light.
    T pdf(const Vec3<T>& from, const Vec3<T>& /*normal*/, std::uint32_t primitive, T distance, const Vec3<T>& wi) const {
        if (light_of_primitive_.empty()) return 0;
        const std::uint32_t light = light_of_primitive_[primitive];
        if (light == no_light) return 0;
        const T pick = T(table_.probability(light));
        if (primitive < scene_.triangles.size()) return pick * triangle(primitive).pdf(distance * distance, wi);
        return pick * sphere(primitive - std::uint32_t(scene_.triangles.size())).pdf(from);
    }

    /// The same for a direction that leaves the scene.
    T background_pdf(const Vec3<T>& direction) const {
        return environment_index_ == no_light ? T(0)
                                              : T(table_.probability(environment_index_)) * environment_.pdf(direction);
    }

private:
    enum class Kind : std::uint8_t { triangle, sphere, punctual, environment };
    struct LightRef {
        Kind kind;
        std::uint32_t index;
    };
    static constexpr std::uint32_t no_light = 0xffffffffu;

    TriangleLight<T> triangle(std::uint32_t index) const {
        const UVec3 t = scene_.triangles[index];
        return {{scene_.positions[t[0]], scene_.positions[t[1]], scene_.positions[t[2]]}};
    }
    SphereLight<T> sphere(std::uint32_t index) const {
        const Sphere<T>& s = scene_.spheres[index];
        return {s.center, s.radius};
    }
    Vec3<T> emission_of_sphere(std::uint32_t index) const {
        return Vec3<T>(emission_at(scene_, scene_.materials[scene_.spheres[index].material], Attributes()));
    }

    LightSample<T> sample_one(const LightRef& light, const Vec3<T>& from, const Vec2<T>& u) const {
        LightSample<T> s;
        switch (light.kind) {
        case Kind::environment: s = environment_.sample(u); break;
        case Kind::punctual: s = scene_.punctual_lights[light.index].sample(from, scene_.origin); break;
        case Kind::sphere:
            s = sphere(light.index).sample(from, u);
            s.radiance = emission_of_sphere(light.index);
            break;
        case Kind::triangle: {
            Vec2<T> barycentric(0);
            bool front = false;
            s = triangle(light.index).sample(from, u, barycentric, front);
            const Material& material = scene_.materials[scene_.triangle_materials[light.index]];
            if (!front && !material.double_sided) s.pdf = 0;
            if (!(s.pdf > 0)) break;
            const Attributes a = attributes_at(scene_, light.index, barycentric.x, barycentric.y);
            s.radiance = Vec3<T>(emission_at(scene_, material, a) * coverage_at(scene_, material, a));
            break;
        }
        }
        return s;
    }

    void collect() {
        std::vector<double> powers;
        const auto add = [&](Kind kind, std::size_t index, double power) {
            if (!(power > 0) || !is_finite(power)) return no_light;
            lights_.push_back({kind, std::uint32_t(index)});
            powers.push_back(power);
            return std::uint32_t(lights_.size() - 1);
        };
        std::vector<std::uint32_t> of_primitive(scene_.triangles.size() + scene_.spheres.size(), no_light);
        for (std::size_t i = 0; i < scene_.triangles.size(); ++i) {
            const Material& m = scene_.materials[scene_.triangle_materials[i]];
            if (m.emissive()) of_primitive[i] = add(Kind::triangle, i, triangle_power(std::uint32_t(i), m));
        }
        for (std::size_t i = 0; i < scene_.spheres.size(); ++i) {
            const double radius = double(scene_.spheres[i].radius), area = 4 * pi<double> * radius * radius;
            of_primitive[scene_.triangles.size() + i] =
                add(Kind::sphere, i, pi<double> * area * luminance(Vec3d(emission_of_sphere(std::uint32_t(i)))));
        }
        if (!lights_.empty()) light_of_primitive_ = std::move(of_primitive);
        const Bounds3<double> bounds = scene_.bounds();
        const double radius = bounds.empty() ? 1.0 : std::max(1e-30, length(bounds.size()) / 2);
        for (std::size_t i = 0; i < scene_.punctual_lights.size(); ++i)
            add(Kind::punctual, i, scene_.punctual_lights[i].power(radius));
        if (!environment_.black())
            environment_index_ = add(Kind::environment, 0, 4 * pi<double> * pi<double> * radius * radius *
                                                               double(environment_.mean_luminance()));
        table_ = Distribution1D(std::span<const double>(powers));
    }

    /// π · area · mean emission; a texture is looked at in a few places, and never counts for nothing.
    double triangle_power(std::uint32_t index, const Material& m) const {
        const double area = length(Vec3d(triangle(index).area_vector())) / 2;
        double mean = luminance(Vec3d(m.emission));
        if (m.emission_texture) {
            constexpr int side = 4;
            double sum = 0;
            for (int i = 0; i < side * side; ++i) {
                const Vec2<T> b = square_to_triangle(Vec2<T>((T(i % side) + T(0.5)) / side, (T(i / side) + T(0.5)) / side));
                sum += luminance(Vec3d(emission_at(scene_, m, attributes_at(scene_, index, b.x, b.y))));
            }
            mean = std::max(sum / (side * side), mean * 0.01);
        }
        return pi<double> * area * (m.double_sided ? 2 : 1) * mean;
    }

    const Scene<T>& scene_;
    EnvironmentLight<T> environment_;
    std::vector<LightRef> lights_;
    std::vector<std::uint32_t> light_of_primitive_;
    std::uint32_t environment_index_ = no_light;
    Distribution1D table_;
};

} // namespace LAMBENT_ABI
} // namespace lambent
