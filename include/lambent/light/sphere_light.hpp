#pragma once
#include <lambent/core/frame.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/light/light_bounds.hpp>
#include <lambent/light/light_sample.hpp>
#include <lambent/sampling/warp.hpp>
#include <algorithm>
#include <cmath>

namespace lambent {
inline namespace LAMBENT_ABI {

/// A sphere that emits outwards, sampled uniformly over the cone that it fills as seen from a point outside.
/// From inside, and from the sphere's own surface, whichever side rounding puts that on, there is nothing to
/// sample: its light is then met by chance alone.
template <class T>
struct SphereLight {
    Vec3<T> center;
    T radius;

    /// Density per solid angle of every direction that meets the sphere; 0 from inside and from its surface.
    T pdf(const Vec3<T>& from) const {
        const Vec3<T> d = center - from;
        const T distance2 = dot(d, d);
        const T touching = radius + gamma_bound<T>(32) * (max_component(abs(center)) + radius);
        return distance2 > touching * touching ? uniform_cone_pdf(radius * radius / distance2) : T(0);
    }

    /// For a luminance of radiance above 0.
    LightBounds<T> bounds(T luminance) const {
        LightBounds<T> b;
        b.box.add(center - Vec3<T>(radius));
        b.box.add(center + Vec3<T>(radius));
        b.intensity = luminance * pi<T> * radius * radius;
        return b;
    }

    LightSample<T> sample(const Vec3<T>& from, const Vec2<T>& u) const {
        LightSample<T> s;
        s.pdf = pdf(from);
        if (!(s.pdf > 0)) return s;
        const Vec3<T> d = center - from;
        const T distance2 = dot(d, d), distance = std::sqrt(distance2);
        const T sin2_max = radius * radius / distance2;
        const Vec3<T> local = square_to_uniform_cone(u, sin2_max);
        s.wi = Frame<T>(d / distance).to_world(local);
        // The shadow ray ends where it meets a sphere that is wider by what a hit far away may be off, else it
        // could meet the light itself; grazing hits have no error bound along the ray.
        const T wider = radius + gamma_bound<T>(16) * (distance + max_component(abs(center)) + radius);
        const T sin2 = local.x * local.x + local.y * local.y;
        const T half_chord = safe_sqrt(wider * wider - distance2 * sin2);
        s.target = from + s.wi * std::max(distance * local.z - half_chord, (distance - radius) / 2);
        return s;
    }
};

} // namespace LAMBENT_ABI
} // namespace lambent
