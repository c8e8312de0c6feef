#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec_lanes.hpp>
#include <lambent/core/vec_packs.hpp>
#include <lambent/light/light_bounds.hpp>
#include <lambent/light/light_sample.hpp>
#include <lambent/sampling/warp.hpp>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

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

/// The same for several points.
template <class T, int N>
[[gnu::always_inline]] inline Vec3Pack<T, N> triangle_error(const Vec3Pack<T, N>& p0, const Vec3Pack<T, N>& p1,
                                                            const Vec3Pack<T, N>& p2, Pack<T, N> extent) {
    const Pack<T, N> share(gamma_bound<T>(7)), least = Pack<T, N>(gamma_bound<T>(4)) * extent;
    const Vec3Pack<T, N> size = abs(p0) + abs(p1) + abs(p2);
    return {multiply_add(size.x, share, least), multiply_add(size.y, share, least), multiply_add(size.z, share, least)};
}
template <class T, int N>
[[gnu::always_inline]] inline Pack<T, N> triangle_extent(const Vec3Pack<T, N>& first_edge, const Vec3Pack<T, N>& second_edge) {
    const Vec3Pack<T, N> a = abs(first_edge), b = abs(second_edge);
    return max(max(max(a.x, b.x), max(a.y, b.y)), max(a.z, b.z));
}

/// Points of a TriangleLight as seen from several places: see LightSample.
template <class T, int N>
struct TrianglePoints {
    Vec3Pack<T, N> wi, target, target_error;
    Pack<T, N> pdf;
    Mask<T, N> front; ///< where the front side is seen
};

/// A triangle that emits, or a parallelogram of which it is the half at one of its corners, sampled uniformly over its
/// area. Radiance is the caller's to fill in: it may vary over a triangle, by the barycentrics that `sample` reports. Of
/// area 0 it is never found.
template <class T>
class TriangleLight {
public:
    enum class Outline : std::uint8_t { triangle, parallelogram }; ///< the latter's corner is the first vertex

    explicit TriangleLight(const std::array<Vec3<T>, 3>& vertices, Outline outline = Outline::triangle)
        : vertices_(vertices), outline_(outline),
          extent_(triangle_extent(to_lanes(vertices[1] - vertices[0]), to_lanes(vertices[2] - vertices[0]))) {
        const T share = outline == Outline::triangle ? T(0.5) : T(1); // of what the edges span
        const Vec3<T> spanned = robust_cross(vertices[1] - vertices[0], vertices[2] - vertices[0]);
        const T size2 = dot(spanned, spanned);
        if (size2 > T(1e-30) && size2 < T(1e30)) {
            const T size = std::sqrt(size2);
            normal_ = spanned / size;
            area_ = size * share;
            return;
        }
        const T largest = max_component(abs(spanned)); // whose square may be 0 or infinite
        if (!(largest > 0) || !is_finite(largest)) return;
        const Vec3<T> direction = spanned / largest;
        normal_ = normalize(direction);
        area_ = largest * (length(direction) * share);
    }

    /// The parallelogram that two triangles make which face the same way and share an edge, if its fourth corner is
    /// theirs to within rounding, and to a ten-thousandth of its height, so that areas are.
    static std::optional<TriangleLight> joined(const std::array<Vec3<T>, 3>& a, const std::array<Vec3<T>, 3>& b) {
        for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t j = 0; j < 3; ++j) {
                const Vec3<T>&corner = a[i], &second = a[(i + 1) % 3], &third = a[(i + 2) % 3];
                if (b[(j + 1) % 3] != third || b[(j + 2) % 3] != second) continue;
                const TriangleLight light({corner, second, third}, Outline::parallelogram);
                const Vec3<T> off = abs((second - corner) - (b[j] - third)), size = abs(corner) + abs(second) + abs(third);
                const T height = light.area_ / std::max(length(second - corner), length(third - corner));
                if (!(max_component(off) <= T(1e-4) * height)) return std::nullopt;
                for (int axis = 0; axis < 3; ++axis) // so that the error of a point bounds what the corner is off, too
                    if (!(off[axis] <= gamma_bound<T>(3) * size[axis])) return std::nullopt;
                return light;
            }
        return std::nullopt;
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
        if (outline_ == Outline::parallelogram) b.box.add(vertices_[1] + (vertices_[2] - vertices_[0]));
        if (!(area_ > 0)) return b;
        b.axis = normal_;
        b.cos_normals = 1;
        b.intensity = luminance * area_;
        b.sides = sides;
        return b;
    }

    /// A point of the light as seen from `from`; `barycentric` receives the weights of its second and third vertex,
    /// `front` whether the front side is seen.
    LightSample<T> sample(const Vec3<T>& from, const Vec2<T>& u, Vec2<T>& barycentric, bool& front) const {
        LightSample<T> s;
        barycentric = outline_ == Outline::triangle ? square_to_triangle(u) : u;
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

    /// sample() from several points at once; of what a LightSample has, that which is not the same for all.
    template <int N>
    TrianglePoints<T, N> sample(const Vec3Pack<T, N>& from, const Vec2Pack<T, N>& u) const {
        using P = Pack<T, N>;
        const Vec2Pack<T, N> b = outline_ == Outline::triangle ? square_to_triangle(u) : u;
        const Vec3Pack<T, N> p0 = spread<T, N>(vertices_[0]) * (P(1) - b.x - b.y);
        const Vec3Pack<T, N> p1 = spread<T, N>(vertices_[1]) * b.x, p2 = spread<T, N>(vertices_[2]) * b.y;
        TrianglePoints<T, N> s;
        s.target = p0 + p1 + p2;
        s.target_error = triangle_error(p0, p1, p2, P(extent_));
        const Vec3Pack<T, N> to_light = s.target - from;
        const P distance2 = dot_xzy(to_light, to_light);
        s.wi = to_light / sqrt(distance2);
        const P cosine = dot(spread<T, N>(normal_), s.wi), seen = abs(cosine) * P(area_);
        s.front = cosine < P(0);
        s.pdf = select((seen > P(0)) & (distance2 > P(0)), distance2 / seen, P(0));
        return s;
    }

private:
    std::array<Vec3<T>, 3> vertices_;
    Outline outline_;
    T extent_;
    Vec3<T> normal_{0};
    T area_ = 0;
};

} // namespace LAMBENT_ABI
} // namespace lambent
