#pragma once
#include <lambent/bvh/primitive.hpp>
#include <lambent/core/bounds.hpp>
#include <lambent/core/error.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/ray.hpp>
#include <bit>
#include <cmath>
#include <cstddef>
#include <string>
#include <type_traits>
#include <utility>

namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {
/// The power of two at or below x, kept far enough from the ends that it has an inverse.
template <class T>
inline T power_of_two_below(T x) {
    using Bits = FloatBits<T>;
    constexpr T least = std::numeric_limits<T>::min() * 4;
    if (!(x > least)) return least;
    const T p = std::bit_cast<T>(std::bit_cast<typename Bits::Type>(x) & Bits::exponent);
    return p < 1 / least ? p : 1 / least;
}

/// The scalar product in the same roundings everywhere.
template <class T>
inline T fixed_dot(const Vec3<T>& a, const Vec3<T>& b) {
    return multiply_add(a.x, b.x, multiply_add(a.y, b.y, opaque(a.z * b.z)));
}
} // namespace detail

/// Nearest t in [ray.t_min, ray.t_max) at which the ray meets the sphere, from outside or inside; infinite if none.
/// Lengths are counted in powers of two of the distance and the direction in its own, so that no square overflows
/// or vanishes, and the roundings are the same wherever the call is inlined. The point at t lies on the sphere within
/// a few units in the last place of the greater of its radius and the distance between ray origin and centre.
/// range   any finite centre and direction, radius >= 0
/// source  the discriminant by the distance to the line: Hearn, Baker; Haines et al., Ray Tracing Gems (2019), 7
template <class T>
inline T intersect_sphere(const Ray<T>& ray, const Vec3<T>& center, T radius) {
    constexpr T none = std::numeric_limits<T>::infinity();
    const Vec3<T> offset = ray.origin - center;
    const T unit = detail::power_of_two_below(glm::max(max_component(glm::abs(offset)), radius));
    const T speed = detail::power_of_two_below(max_component(glm::abs(ray.direction)));
    const Vec3<T> f = offset * (1 / unit), d = ray.direction * (1 / speed); // exact, as is the next
    const T r = radius * (1 / unit);

    const T length2 = detail::fixed_dot(d, d);
    const T b = -detail::fixed_dot(f, d), s = detail::opaque(b / length2);
    const Vec3<T> nearest{multiply_add(d.x, s, f.x), multiply_add(d.y, s, f.y), multiply_add(d.z, s, f.z)};
    const T discriminant = multiply_add(r, r, -detail::fixed_dot(nearest, nearest)) * length2;
    if (!(discriminant >= 0)) return none;
    const T c = multiply_add(-r, r, detail::fixed_dot(f, f));
    const T q = b + std::copysign(std::sqrt(discriminant), b);
    if (q == 0) return none;
    const T t0 = detail::opaque(c / q) * unit / speed, t1 = detail::opaque(q / length2) * unit / speed;
    const T near = glm::min(t0, t1), far = glm::max(t0, t1);
    if (near >= ray.t_min && near < ray.t_max) return near;
    if (far >= ray.t_min && far < ray.t_max) return far;
    return none;
}

/// The spheres in the caller's own containers, which must outlive it; see spheres().
template <class Centers, class Radii, class CenterOf, class RadiusOf>
class SphereSet {
public:
    using Scalar = detail::ProjectedScalar<Centers, CenterOf>;

    SphereSet(const Centers& centers, const Radii& radii, CenterOf center_of, RadiusOf radius_of)
        : centers_(centers), radii_(radii), center_of_(std::move(center_of)), radius_of_(std::move(radius_of)) {
        require(centers_.size() == radii_.size(), [&] {
            return "spheres: " + std::to_string(centers_.size()) + " centres, but " + std::to_string(radii_.size()) +
                   " radii";
        });
    }

    std::size_t count() const { return centers_.size(); }
    Vec3<Scalar> center(std::size_t i) const { return center_of_(centers_[i]); }
    Scalar radius(std::size_t i) const { return Scalar(radius_of_(radii_[i])); }

    /// Empty where there is no sphere: a negative radius, a NaN, an infinity.
    Bounds3<Scalar> bounds(std::size_t i) const {
        const Vec3<Scalar> c = center(i);
        const Scalar r = radius(i);
        Bounds3<Scalar> box;
        if (!is_finite(c) || !is_finite(r) || r < 0) return box;
        constexpr Scalar most = std::numeric_limits<Scalar>::max();
        for (int k = 0; k < 3; ++k) {
            box.min[k] = glm::max(next_down(c[k] - r), -most);
            box.max[k] = glm::min(next_up(c[k] + r), most);
        }
        return box;
    }

    Hit<Scalar> intersect(std::size_t i, const Ray<Scalar>& ray) const {
        return {.t = intersect_sphere(ray, center(i), radius(i))};
    }

    /// Unit normal, outwards, at a point of sphere i.
    Vec3<Scalar> normal(std::size_t i, const Vec3<Scalar>& point) const {
        const Vec3<Scalar> d = point - center(i);
        const Scalar largest = max_component(glm::abs(d));
        return largest > 0 ? glm::normalize(d / largest) : Vec3<Scalar>(0, 0, 1);
    }

private:
    detail::ContainerView<Centers> centers_;
    detail::ContainerView<Radii> radii_;
    CenterOf center_of_;
    RadiusOf radius_of_;
};

/// Views the caller's spheres without copying them, for PrimitiveBvh. A hit's u and v are 0; for a point's normal ask
/// the set. Spheres of negative radius, or with a NaN or an infinity, are left out of the tree. From inside a sphere
/// is hit too; a filter that refuses its near side is asked about the far one.
/// centers    any random-access container (operator[], std::size), of any type; a span, or an lvalue that outlives
///            the result: temporaries do not compile
/// radii      the same, one for each centre; may be the same container
/// center_of  its element → Vec3 of float or double; left out where the elements are Vec3 themselves
/// radius_of  its element → float or double; left out where the elements are numbers
/// throws     lambent::Error when there are more of one than of the other
///     const auto set = spheres(balls, balls, position_of, radius_of);
///     const auto bvh = PrimitiveBvh<decltype(set)>::build(set);
template <class Centers, class Radii, class CenterOf = detail::AsIs, class RadiusOf = detail::AsIs>
    requires detail::NotTemporary<Centers&&> && detail::NotTemporary<Radii&&>
auto spheres(Centers&& centers, Radii&& radii, CenterOf center_of = {}, RadiusOf radius_of = {}) {
    return SphereSet<std::remove_cvref_t<Centers>, std::remove_cvref_t<Radii>, CenterOf, RadiusOf>(
        centers, radii, std::move(center_of), std::move(radius_of));
}

/// Containers that die at the end of the statement; give an lvalue or a span.
template <class Centers, class Radii, class... Projections>
    requires(!detail::NotTemporary<Centers &&> || !detail::NotTemporary<Radii &&>)
void spheres(Centers&&, Radii&&, Projections&&...) = delete;

} // namespace LAMBENT_ABI
} // namespace lambent
