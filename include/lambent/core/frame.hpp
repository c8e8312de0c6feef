#pragma once
#include <lambent/core/vec.hpp>
#include <cmath>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Right-handed orthonormal basis around a unit normal, for going to and from shading space, where the
/// normal is (0, 0, 1). Continuous but for the plane normal.z = 0; exact to a few ulp at the poles too.
/// source  Duff, Burgess, Christensen, Hery, Kensler, Liani, Villemin, JCGT 6:1 (2017)
template <class T>
struct Frame {
    Vec3<T> tangent, bitangent, normal;

    explicit Frame(const Vec3<T>& n) : normal(n) {
        using std::copysign;
        const T sign = copysign(T(1), n.z);
        const T a = T(-1) / (sign + n.z);
        const T b = n.x * n.y * a;
        tangent = {T(1) + sign * n.x * n.x * a, sign * b, -sign * n.x};
        bitangent = {b, sign + n.y * n.y * a, -n.y};
    }

    Vec3<T> to_world(const Vec3<T>& v) const { return v.x * tangent + v.y * bitangent + v.z * normal; }
    Vec3<T> to_local(const Vec3<T>& v) const { return {dot(v, tangent), dot(v, bitangent), dot(v, normal)}; }
};

} // namespace LAMBENT_ABI
} // namespace lambent
