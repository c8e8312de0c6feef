#pragma once
#include <lambent/core/bounds.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/ray.hpp>
#include <lambent/core/simd.hpp>
#include <cstdint>
#include <limits>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Children of a node of the tree: as many as one register of T holds, up to 8, at least 4.
template <class T>
inline constexpr int tree_width = native_width<T> >= 8 ? 8 : 4;

/// A reference to a node, to a leaf of one to eight blocks of triangles, or to nothing.
struct ChildRef {
    std::uint32_t bits = empty_bits;

    static constexpr std::uint32_t empty_bits = 0xffffffffu;
    static constexpr std::uint32_t max_blocks = 8;
    static constexpr std::uint32_t max_index = (1u << 28) - 2;

    static ChildRef node(std::uint32_t index) { return {index << 4}; }
    static ChildRef leaf(std::uint32_t first_block, std::uint32_t blocks) {
        return {first_block << 4 | (blocks - 1) << 1 | 1u};
    }
    bool is_leaf() const { return (bits & 1u) != 0; }
    bool is_empty() const { return bits == empty_bits; }
    std::uint32_t index() const { return bits >> 4; } ///< of the node, or of the leaf's first block
    std::uint32_t blocks() const { return (bits >> 1 & 7u) + 1; }
};

/// The boxes of up to tree_width children, an axis and side at a time. An empty child's box is inside out and
/// meets no ray.
template <class T>
struct alignas(64) WideNode {
    static constexpr int width = tree_width<T>;
    T low[3][width], high[3][width];
    ChildRef child[width];

    WideNode() {
        for (int axis = 0; axis < 3; ++axis)
            for (int i = 0; i < width; ++i) {
                low[axis][i] = std::numeric_limits<T>::infinity();
                high[axis][i] = -std::numeric_limits<T>::infinity();
            }
    }
    void set(int i, const Bounds3<T>& box, ChildRef ref) {
        for (int axis = 0; axis < 3; ++axis) {
            low[axis][i] = box.min[axis];
            high[axis][i] = box.max[axis];
        }
        child[i] = ref;
    }
};

/// A ray made ready for box tests. The tests are conservative: a triangle that the triangle test hits lies in
/// boxes that the ray meets. For that, boxes grow by a few roundings of the largest coordinate in play, folded
/// into the origin, and the exit distance by those of the products. A direction of ±0 becomes a huge
/// finite slope, so that no 0 · ∞ arises, also with the origin in the plane of a box.
/// source  for the exit distance: Ize, "Robust BVH ray traversal", JCGT 2:2 (2013)
template <class T>
struct BoxRay {
    static constexpr int width = tree_width<T>;
    using Lanes = Pack<T, width>;
    Lanes near_origin[3], far_origin[3], inverse[3];
    bool negative[3];

    BoxRay(const Ray<T>& ray, T largest_coordinate) {
        constexpr T huge = std::numeric_limits<T>::max(), tiny = 1 / huge;
        const T reach = max_component(Vec3<T>(abs(ray.origin))) + largest_coordinate;
        const T pad = reach * (8 * std::numeric_limits<T>::epsilon());
        for (int axis = 0; axis < 3; ++axis) {
            const T d = ray.direction[axis];
            const T slope = (d < 0 ? -d : d) > tiny ? 1 / d : std::copysign(huge, d);
            negative[axis] = std::signbit(slope);
            near_origin[axis] = negative[axis] ? ray.origin[axis] - pad : ray.origin[axis] + pad;
            far_origin[axis] = negative[axis] ? ray.origin[axis] + pad : ray.origin[axis] - pad;
            inverse[axis] = slope;
        }
    }

    /// One bit a child whose box the ray meets in [t_min, t_max]; `entry` receives where.
    unsigned intersect(const WideNode<T>& node, Lanes t_min, Lanes t_max, Lanes& entry) const {
        constexpr T widen = 1 + 4 * std::numeric_limits<T>::epsilon();
        Lanes near = t_min, far = t_max;
        for (int axis = 0; axis < 3; ++axis) {
            const T* first = negative[axis] ? node.high[axis] : node.low[axis];
            const T* last = negative[axis] ? node.low[axis] : node.high[axis];
            near = max((Lanes::load(first) - near_origin[axis]) * inverse[axis], near);
            far = min((Lanes::load(last) - far_origin[axis]) * inverse[axis] * Lanes(widen), far);
        }
        entry = near;
        return bits(near <= far);
    }
};

} // namespace LAMBENT_ABI
} // namespace lambent
