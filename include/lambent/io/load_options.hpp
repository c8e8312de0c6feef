#pragma once
#include <lambent/core/config.hpp>
#include <cstddef>
#include <cstdint>
#include <string>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Which of the images that a scene file names are decoded: those that some triangle's material looks up, all that
/// materials look up, or none, so that surfaces show their factors.
enum class ImageLoading : std::uint8_t { used, all, none };

/// What a scene file may ask for at most: a small file can claim, or unroll to, far more than it holds.
struct LoadOptions {
    std::size_t max_triangles = std::size_t(1) << 28; ///< after unrolling instances
    std::size_t max_vertices = std::size_t(1) << 29;  ///< after unrolling instances
    std::size_t max_nodes = std::size_t(1) << 24;     ///< and instances
    std::size_t max_pixels = std::size_t(1) << 28;    ///< of one image
    std::size_t max_bytes = std::size_t(1) << 34;     ///< of all files together that a scene names
    std::string root{}; ///< the folder out of which no name in the file may lead; empty = the file's own
    int scene = -1;   ///< which of a glTF file's scenes; -1 = the file's default
    ImageLoading images = ImageLoading::used;
};

} // namespace LAMBENT_ABI
} // namespace lambent
