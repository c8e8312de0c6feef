#pragma once
#include <lambent/core/bounds.hpp>
#include <lambent/core/vec.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace lambent {
inline namespace LAMBENT_ABI {

/// All points on rays from an apex between four directions, which go around it in either sense: what a rectangle of an
/// image sees. The directions span less than a half space; none has to be of unit length.
template <class T>
class Pyramid {
public:
    Pyramid(const Vec3<T>& apex, const std::array<Vec3<T>, 4>& corners) : apex_(apex) {
        const Vec3<T> middle = corners[0] + corners[1] + corners[2] + corners[3];
        bool ahead = true;
        for (std::size_t i = 0; i < 4; ++i) {
            const Vec3<T> n = cross(corners[i], corners[(i + 1) % 4]);
            const T side = dot(n, middle);
            inward_[i] = side > 0 ? n : side < 0 ? -n : Vec3<T>(0); // 0 keeps nothing out
            ahead = ahead && dot(corners[i], middle) > 0;
        }
        inward_[4] = ahead ? middle : Vec3<T>(0);
    }

    /// Whether a box may have points in the pyramid: false only where a plane keeps it out by more than rays and
    /// triangles are wrong by.
    bool may_meet(const Bounds3<T>& box) const {
        constexpr T wrong = 256 * std::numeric_limits<T>::epsilon();
        for (const Vec3<T>& n : inward_) {
            T depth = 0, size = 0;
            for (int k = 0; k < 3; ++k) {
                const T low = box.min[k] - apex_[k], high = box.max[k] - apex_[k];
                depth += n[k] * (n[k] > 0 ? high : low);
                size += std::abs(n[k]) * std::max(std::abs(low), std::abs(high));
            }
            if (depth < -wrong * size) return false;
        }
        return true;
    }

private:
    Vec3<T> apex_;
    std::array<Vec3<T>, 5> inward_; ///< normals of the sides, and of a plane through the apex with all behind it
};

} // namespace LAMBENT_ABI
} // namespace lambent
