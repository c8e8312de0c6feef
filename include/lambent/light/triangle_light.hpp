#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec_lanes.hpp>
#include <lambent/light/light_bounds.hpp>
#include <lambent/light/light_sample.hpp>
#include <lambent/sampling/warp.hpp>
#include <array>
#include <cmath>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Bound, an axis each, on the error of a point p0 + p1 + p2 of a triangle (its vertices times their weights),
/// and on that of the distance at which a ray that starts there would meet the triangle again: the latter
/// grows with the triangle's extent (along its two edges at the first vertex), also where the point itself is exact.
template <class T>
inline Lanes3<T> triangle_error(Lanes3<T> p0, Lanes3<T> p1, Lanes3<T> p2, T extent) {
    return multiply_add(abs(p0) + abs(p1) + abs(p2), Lanes3<T>(gamma_bound<T>(7)), Lanes3<T>(gamma_bound<T>(4) * extent));
}
template <class T>
inline T triangle_extent(Lanes3<T> first_edge, Lanes3<T> second_edge) {
    return largest(max(abs(first_edge), abs(second_edge)));
}

/// A triangle that emits, sampled uniformly over its area. Radiance is the caller's to fill in: it may vary
/// over the triangle, by the barycentrics that `sample` reports. Of area 0 it is never found.
template <class T>
class TriangleLight {
public:
    explicit TriangleLight(const std::array<Vec3<T>, 3>& vertices)
        : vertices_(vertices),
          extent_(triangle_extent(to_lanes(vertices[1] - vertices[0]), to_lanes(vertices[2] - vertices[0]))) {
        const Vec3<T> doubled_area = robust_cross(vertices[1] - vertices[0], vertices[2] - vertices[0]);
        const T size2 = dot(doubled_area, doubled_area);
        if (size2 > T(1e-30) && size2 < T(1e30)) {
            const T size = std::sqrt(size2);
            normal_ = doubled_area / size;
            area_ = size / 2;
            return;
        }
        const T largest = max_component(abs(doubled_area)); // whose square may be 0 or infinite
        if (!(largest > 0) || !is_finite(largest)) return;
        const Vec3<T> direction = doubled_area / largest;
        normal_ = normalize(direction);
        area_ = largest * (length(direction) / 2);
    }

    const std::array<Vec3<T>, 3>& vertices() const { return vertices_; }
    T area() const { return area_; }
    const Vec3<T>& normal() const { return normal_; } ///< unit, of the front

    /// Density per solid angle at a point from which the triangle is met at this squared distance in unit
    /// direction wi; 0 from the edge on.
    T pdf(T distance2, const Vec3<T>& wi) const {
        const T projected_area = glm::abs(dot(normal_, wi)) * area_;
        return projected_area > 0 ? distance2 / projected_area : T(0);
    }

    /// For a mean luminance of radiance above 0.
    LightBounds<T> bounds(T luminance, typename LightBounds<T>::Sides sides) const {
        LightBounds<T> b;
        for (const Vec3<T>& v : vertices_) b.box.add(v);
        if (!(area_ > 0)) return b;
        b.axis = normal_;
        b.cos_normals = 1;
        b.intensity = luminance * area_;
        b.sides = sides;
        return b;
    }

    /// A point of the triangle as seen from `from`; `barycentric` receives the weights of its second and third
    /// vertex, `front` whether the front side is seen.
    LightSample<T> sample(const Vec3<T>& from, const Vec2<T>& u, Vec2<T>& barycentric, bool& front) const {
        LightSample<T> s;
        barycentric = square_to_triangle(u);
        const Lanes3<T> p0 = to_lanes(vertices_[0]) * Lanes3<T>(1 - barycentric.x - barycentric.y);
        const Lanes3<T> p1 = to_lanes(vertices_[1]) * Lanes3<T>(barycentric.x);
        const Lanes3<T> p2 = to_lanes(vertices_[2]) * Lanes3<T>(barycentric.y);
        const Lanes3<T> target = p0 + p1 + p2, to_light = target - to_lanes(from);
        s.target = to_vec(target);
        s.target_error = to_vec(triangle_error(p0, p1, p2, extent_));
        const T distance2 = dot(to_light, to_light);
        if (!(distance2 > 0)) return s;
        s.wi = to_vec(to_light / Lanes3<T>(std::sqrt(distance2)));
        s.target_normal = normal_;
        front = dot(normal_, s.wi) < 0;
        s.pdf = pdf(distance2, s.wi);
        return s;
    }

private:
    std::array<Vec3<T>, 3> vertices_;
    T extent_;
    Vec3<T> normal_{0};
    T area_ = 0;
};

} // namespace LAMBENT_ABI
} // namespace lambent
