#pragma once
#include "support/meshes.hpp"
#include <cstddef>
#include <cstdint>
#include <lambent/bvh/bvh.hpp>
#include <span>
#include <vector>

namespace lambent_test {

/// Leaves of a tree in which every triangle lies twice, as spatial splits make it of some.
template <class T>
struct DoubledTriangles : lambent::detail::StoredTriangles<T> {
    using Base = lambent::detail::StoredTriangles<T>;
    using typename Base::Block;
    using Base::Base;

    template <class Set>
    static Block make_block(const Set& twice, std::span<const std::uint32_t> primitives) {
        Block block = Base::make_block(twice, primitives);
        for (std::uint32_t& p : block.primitive)
            if (p != lambent::no_primitive) p %= std::uint32_t(twice.count() / 2);
        return block;
    }
};

template <class T>
lambent::BasicBvh<T, DoubledTriangles<T>> doubled_bvh(const Mesh<T>& mesh) {
    std::vector<lambent::UVec3> twice = mesh.faces;
    twice.insert(twice.end(), mesh.faces.begin(), mesh.faces.end());
    auto bvh = lambent::BasicBvh<T, DoubledTriangles<T>>::build(lambent::triangles(mesh.vertices, twice));
    // The builder doesn't know; what says so in a tree with spatial splits is set by hand.
    const_cast<std::size_t&>(bvh.tree().duplicates) = mesh.faces.size();
    return bvh;
}

} // namespace lambent_test
