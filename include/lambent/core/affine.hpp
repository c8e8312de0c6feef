#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/matrix.hpp>
#include <lambent/core/numerics.hpp>

namespace lambent {
inline namespace LAMBENT_ABI {

/// An affine map, x → column[0]·x.x + column[1]·x.y + column[2]·x.z + translation. The default one is the identity.
template <class T>
struct Affine {
    Vec3<T> column[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    Vec3<T> translation{0};

    /// throws  lambent::Error if the last row is not (0, 0, 0, 1)
    template <class S>
    static Affine from(const Mat4<S>& m) {
        require(m[0][3] == 0 && m[1][3] == 0 && m[2][3] == 0 && m[3][3] == 1,
                "Affine: the matrix's last row is not (0, 0, 0, 1)");
        Affine a;
        for (int k = 0; k < 3; ++k) a.column[k] = Vec3<T>(T(m[k][0]), T(m[k][1]), T(m[k][2]));
        a.translation = Vec3<T>(T(m[3][0]), T(m[3][1]), T(m[3][2]));
        return a;
    }

    Vec3<T> point(const Vec3<T>& p) const { return vector(p) + translation; }
    Vec3<T> vector(const Vec3<T>& v) const { return column[0] * v.x + column[1] * v.y + column[2] * v.z; }

    /// Unit normal, in the image, of a surface with normal n of any length: by the transposed inverse. It stays on the
    /// same side of the surface, also where the map mirrors space; a triangle's corners change their sense of rotation
    /// there. Needs a map that has an inverse.
    Vec3<T> normal(const Vec3<T>& n) const {
        Vec3<T> c[3], m;
        T size[3];
        for (int k = 0; k < 3; ++k) { // columns of size 1, so that no product overflows or vanishes
            size[k] = max_component(glm::abs(column[k]));
            c[k] = column[k] / size[k];
        }
        const T least = glm::min(size[0], glm::min(size[1], size[2]));
        for (int k = 0; k < 3; ++k) m[k] = n[k] * (least / size[k]);
        const Vec3<T> across = robust_cross(c[1], c[2]);
        const Vec3<T> r = across * m.x + robust_cross(c[2], c[0]) * m.y + robust_cross(c[0], c[1]) * m.z;
        return glm::normalize(r / max_component(glm::abs(r))) * (glm::dot(c[0], across) < 0 ? T(-1) : T(1));
    }
};

} // namespace LAMBENT_ABI
} // namespace lambent
