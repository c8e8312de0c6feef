#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/core/ray.hpp>
#include <lambent/core/vec.hpp>
#include <cstdint>

namespace lambent {
inline namespace LAMBENT_ABI {

/// An analytic sphere; emits outwards.
template <class T>
struct Sphere {
    Vec3<T> center{0};
    T radius = 1;
    std::uint32_t material = 0;

    /// Nearest t in [ray.t_min, t_max) at which the ray meets the sphere, from outside or inside; infinite if none.
    /// source  the discriminant by the distance to the line: Hearn, Baker; Haines et al., Ray Tracing Gems (2019), 7
    T intersect(const Ray<T>& ray, T t_max) const {
        constexpr T none = std::numeric_limits<T>::infinity();
        const T length2 = dot(ray.direction, ray.direction);
        const Vec3<T> f = ray.origin - center;
        const T b = -dot(f, ray.direction);
        const Vec3<T> nearest = f + ray.direction * (b / length2);
        const T discriminant = (radius * radius - dot(nearest, nearest)) * length2;
        if (!(discriminant >= 0)) return none;
        const T c = dot(f, f) - radius * radius;
        const T q = b + std::copysign(std::sqrt(discriminant), b);
        if (q == 0) return none;
        const T t0 = c / q, t1 = q / length2;
        const T near = glm::min(t0, t1), far = glm::max(t0, t1);
        if (near >= ray.t_min && near < t_max) return near;
        if (far >= ray.t_min && far < t_max) return far;
        return none;
    }
};

} // namespace LAMBENT_ABI
} // namespace lambent
