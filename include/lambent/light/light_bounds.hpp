#pragma once
#include <lambent/core/bounds.hpp>
#include <lambent/core/numerics.hpp>
#include <algorithm>
#include <cmath>
#include <cstdint>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Where a light, or a group of them, may be and shine: what is needed to bound its contribution without looking at
/// it. Emission falls off as the cosine from the nearest of its normals, and is 0 beyond `cos_emission`.
/// source  Conty Estevez, Kulla, "Importance sampling of many lights with adaptive tree splitting", HPG 2018
template <class T>
struct LightBounds {
    /// Where it shines.
    enum class Sides : std::uint8_t { front, both }; ///< both: shines the same along minus each normal
    Bounds3<T> box;
    Vec3<T> axis{0, 0, 1};  ///< unit; of the cone of normals
    T cos_normals = -1;     ///< of the cone's half angle; -1 where normals point anywhere
    T cos_emission = 0;     ///< of the angle from its nearest normal beyond which a light is dark
    T intensity = 0;        ///< radiant intensity (luminance) along the normal, summed over the group
    Sides sides = Sides::front;
};

/// The bounds of two groups together.
template <class T>
LightBounds<T> unite(const LightBounds<T>& a, const LightBounds<T>& b) {
    if (!(a.intensity > 0)) return b;
    if (!(b.intensity > 0)) return a;
    using Sides = typename LightBounds<T>::Sides;
    LightBounds<T> r;
    r.box = a.box;
    r.box.add(b.box);
    r.intensity = a.intensity + b.intensity;
    r.cos_emission = std::min(a.cos_emission, b.cos_emission);
    r.sides = a.sides == Sides::both || b.sides == Sides::both ? Sides::both : Sides::front;
    // Of a light that shines both ways either normal will do.
    const Vec3<T> other = b.sides == Sides::both && dot(a.axis, b.axis) < 0 ? -b.axis : b.axis;
    const auto angle = [](T cosine) { return std::acos(std::clamp(cosine, T(-1), T(1))); };
    const T apart = std::atan2(length(cross(a.axis, other)), dot(a.axis, other)); // acos is coarse at 0
    const T angle_a = angle(a.cos_normals), angle_b = angle(b.cos_normals);
    if (apart + angle_b <= angle_a) {
        r.axis = a.axis, r.cos_normals = a.cos_normals;
    } else if (apart + angle_a <= angle_b) {
        r.axis = other, r.cos_normals = b.cos_normals;
    } else if (const T half = (apart + angle_a + angle_b) / 2; half < pi<T>) {
        // From a's axis turned towards the other one, until both cones are inside.
        const Vec3<T> side = cross(cross(a.axis, other), a.axis);
        const T size = length(side), turn = half - angle_a;
        r.axis = size > 0 ? normalize(a.axis * std::cos(turn) + side * (std::sin(turn) / size)) : a.axis;
        r.cos_normals = size > 0 ? std::cos(half) - 4 * std::numeric_limits<T>::epsilon() : T(-1);
    }
    return r;
}

} // namespace LAMBENT_ABI
} // namespace lambent
