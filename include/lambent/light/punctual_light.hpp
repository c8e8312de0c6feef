#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/light/light_bounds.hpp>
#include <lambent/light/light_sample.hpp>
#include <algorithm>
#include <cstdint>

namespace lambent {
inline namespace LAMBENT_ABI {

/// A light without surface, as in glTF's KHR_lights_punctual: falls off with the squared distance (directional:
/// not at all), a spot also smoothly between its cones.
struct PunctualLight {
    /// As in KHR_lights_punctual.
    enum class Kind : std::uint8_t { point, spot, directional };
    Kind kind = Kind::point;
    Vec3d position{0};         ///< scene coordinates before recentring
    Vec3d direction{0, 0, -1}; ///< unit, the way the light travels
    Vec3f intensity{1};        ///< W/sr (candela's place) for point and spot, irradiance for directional
    float inner_cone_cos = 1;  ///< spot: full intensity inside
    float outer_cone_cos = 0;  ///< spot: none outside

    /// What reaches `from`, given relative to `origin`.
    template <class T>
    LightSample<T> sample(const Vec3<T>& from, const Vec3d& origin) const {
        LightSample<T> s;
        s.delta = true;
        if (kind == Kind::directional) {
            s.infinite = true;
            s.wi = -Vec3<T>(direction);
            s.radiance = Vec3<T>(intensity);
            s.pdf = 1;
            return s;
        }
        s.target = Vec3<T>(position - origin);
        const Vec3<T> to_light = s.target - from;
        const T distance2 = dot(to_light, to_light);
        if (!(distance2 > 0)) return s;
        s.wi = to_light / std::sqrt(distance2);
        s.radiance = Vec3<T>(intensity) / distance2;
        if (kind == Kind::spot) {
            const T cosine = -dot(s.wi, Vec3<T>(direction));
            const T width = std::max(T(0.001), T(inner_cone_cos) - T(outer_cone_cos));
            const T fade = std::clamp((cosine - T(outer_cone_cos)) / width, T(0), T(1));
            s.radiance *= fade * fade;
        }
        s.pdf = is_black(s.radiance) ? T(0) : T(1);
        return s;
    }

    /// Of a point or a spot, given relative to `origin`.
    template <class T>
    LightBounds<T> bounds(const Vec3d& origin) const {
        LightBounds<T> b;
        b.box.add(Vec3<T>(position - origin));
        b.intensity = T(luminance(Vec3d(intensity)));
        if (kind != Kind::spot) return b;
        b.axis = Vec3<T>(direction);
        b.cos_normals = T(outer_cone_cos); // all of the cone is lit by at most `intensity`, nothing outside is
        b.cos_emission = T(0.999);
        return b;
    }

    /// For choosing among lights: radiant power, of a directional light through a disk of this radius.
    double power(double scene_radius) const {
        const double i = luminance(Vec3d(intensity));
        switch (kind) {
        case Kind::directional: return i * pi<double> * scene_radius * scene_radius;
        case Kind::spot: return i * 2 * pi<double> * (1 - (double(inner_cone_cos) + double(outer_cone_cos)) / 2);
        case Kind::point: return i * 4 * pi<double>;
        }
        return 0;
    }
};

} // namespace LAMBENT_ABI
} // namespace lambent
