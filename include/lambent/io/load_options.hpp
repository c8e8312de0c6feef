#pragma once
#include <lambent/core/config.hpp>
#include <cstddef>

namespace lambent {
inline namespace LAMBENT_ABI {

/// What a scene file may ask for at most: a small file can claim, or unroll to, far more than it holds.
struct LoadOptions {
    std::size_t max_triangles = std::size_t(1) << 28; ///< after unrolling instances
    std::size_t max_vertices = std::size_t(1) << 29;  ///< after unrolling instances
    std::size_t max_pixels = std::size_t(1) << 28;    ///< of one image
};

} // namespace LAMBENT_ABI
} // namespace lambent
