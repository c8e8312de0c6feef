#pragma once
#include <lambent/core/vec.hpp>
#include <limits>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Axis-aligned box; the default one is empty (min > max) and grows by whatever is added.
template <class T>
struct Bounds3 {
    Vec3<T> min{std::numeric_limits<T>::infinity()};
    Vec3<T> max{-std::numeric_limits<T>::infinity()};

    void add(const Vec3<T>& p) {
        min = glm::min(min, p);
        max = glm::max(max, p);
    }
    void add(const Bounds3& b) {
        min = glm::min(min, b.min);
        max = glm::max(max, b.max);
    }

    bool empty() const { return !(min.x <= max.x && min.y <= max.y && min.z <= max.z); }
    Vec3<T> size() const { return max - min; }
    Vec3<T> center() const { return min + (max - min) / T(2); }

    /// Half the surface: what a surface-area heuristic needs; 0 when empty.
    T half_area() const {
        if (empty()) return 0;
        const Vec3<T> d = size();
        return d.x * d.y + d.y * d.z + d.z * d.x;
    }
};

} // namespace LAMBENT_ABI
} // namespace lambent
