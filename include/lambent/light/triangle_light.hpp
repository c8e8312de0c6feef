#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/light/light_bounds.hpp>
#include <lambent/light/light_sample.hpp>
#include <lambent/sampling/warp.hpp>
#include <array>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Bound, an axis each, on the error of a point p0 + p1 + p2 of a triangle (its vertices times their weights),
/// and on that of the distance at which a ray that starts there would meet the triangle again: the latter
/// grows with the triangle's extent, also where the point itself is exact.
template <class T>
inline Vec3<T> triangle_error(const Vec3<T>& p0, const Vec3<T>& p1, const Vec3<T>& p2,
                              const std::array<Vec3<T>, 3>& vertices) {
    const Vec3<T> extent = max(abs(vertices[1] - vertices[0]), abs(vertices[2] - vertices[0]));
    return gamma_bound<T>(7) * (abs(p0) + abs(p1) + abs(p2)) + Vec3<T>(gamma_bound<T>(4) * max_component(extent));
}

/// A triangle that emits, sampled uniformly over its area. Radiance is the caller's to fill in: it may vary
/// over the triangle, by the barycentrics that `sample` reports.
template <class T>
struct TriangleLight {
    std::array<Vec3<T>, 3> vertices;

    /// Cross product of the edges: twice the area along the normal.
    Vec3<T> area_vector() const { return robust_cross(vertices[1] - vertices[0], vertices[2] - vertices[0]); }

    /// Density per solid angle at a point from which the triangle is met at this squared distance in unit
    /// direction wi; 0 from the edge on.
    T pdf(T distance2, const Vec3<T>& wi) const {
        const T projected_area = glm::abs(dot(area_vector(), wi)) / 2;
        return projected_area > 0 ? distance2 / projected_area : T(0);
    }

    /// For a mean luminance of radiance above 0.
    LightBounds<T> bounds(T luminance, typename LightBounds<T>::Sides sides) const {
        LightBounds<T> b;
        for (const Vec3<T>& v : vertices) b.box.add(v);
        const Vec3<T> doubled_area = area_vector();
        const T size = length(doubled_area);
        if (!(size > 0)) return b;
        b.axis = doubled_area / size;
        b.cos_normals = 1;
        b.intensity = luminance * size / 2;
        b.sides = sides;
        return b;
    }

    /// A point of the triangle as seen from `from`; `barycentric` receives the weights of its second and third
    /// vertex, `front` whether the front side is seen.
    LightSample<T> sample(const Vec3<T>& from, const Vec2<T>& u, Vec2<T>& barycentric, bool& front) const {
        LightSample<T> s;
        barycentric = square_to_triangle(u);
        const Vec3<T> p0 = vertices[0] * (1 - barycentric.x - barycentric.y);
        const Vec3<T> p1 = vertices[1] * barycentric.x, p2 = vertices[2] * barycentric.y;
        s.target = p0 + p1 + p2;
        s.target_error = triangle_error(p0, p1, p2, vertices);
        const Vec3<T> to_light = s.target - from;
        const T distance2 = dot(to_light, to_light);
        const Vec3<T> doubled_area = area_vector();
        const T length2 = dot(doubled_area, doubled_area);
        if (!(distance2 > 0) || !(length2 > 0)) return s;
        s.wi = to_light / std::sqrt(distance2);
        s.target_normal = doubled_area / std::sqrt(length2);
        front = dot(s.target_normal, s.wi) < 0;
        s.pdf = pdf(distance2, s.wi);
        return s;
    }
};

} // namespace LAMBENT_ABI
} // namespace lambent
