#pragma once
#include <lambent/bvh/sphere.hpp>
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
    T intersect(const Ray<T>& ray, T t_max) const {
        return intersect_sphere(Ray<T>{ray.origin, ray.direction, ray.t_min, t_max}, center, radius);
    }
};

} // namespace LAMBENT_ABI
} // namespace lambent
