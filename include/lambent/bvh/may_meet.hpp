#pragma once
#include <lambent/bvh/bvh.hpp>
#include <lambent/bvh/visit.hpp>
#include <lambent/core/bounds.hpp>
#include <lambent/core/pyramid.hpp>
#include <cstdint>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Whether a ray within the pyramid may meet a primitive of the tree; where this says no, none does.
/// cost  a walk to the first box of a leaf that the pyramid meets; does not allocate, but in a tree with spatial splits
template <class T, class Leaves>
bool may_meet(const BasicBvh<T, Leaves>& bvh, const Pyramid<T>& pyramid) {
    struct Search {
        const Pyramid<T>& pyramid;
        bool found = false;
        bool enter(const Bounds3<T>& box) const { return pyramid.may_meet(box); }
        bool visit(std::uint32_t) {
            found = true;
            return false;
        }
    } search{pyramid};
    traverse(bvh, search);
    return search.found;
}

} // namespace LAMBENT_ABI
} // namespace lambent
