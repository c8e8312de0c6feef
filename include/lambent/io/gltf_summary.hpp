#pragma once
#include <lambent/io/file.hpp>
#include <lambent/io/gltf_parse.hpp>
#include <lambent/io/gltf_validate.hpp>
#include <lambent/io/load_options.hpp>
#include <algorithm>
#include <cstddef>
#include <string>
#include <tiny_gltf.h>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// What a glTF file has, whether or not a renderer makes use of it.
struct GltfSummary {
    std::size_t scenes = 0, nodes = 0, meshes = 0, primitives = 0, materials = 0, textures = 0, images = 0, accessors = 0,
                cameras = 0, lights = 0, skins = 0, animations = 0, buffer_bytes = 0;
    std::size_t mesh_nodes = 0; ///< nodes of the default scene that have a mesh
    std::size_t depth = 0;      ///< of the default scene's hierarchy; a root alone is 1
    std::vector<std::string> extensions_used, extensions_required;
};

/// Counts what a .gltf or .glb file has, after the checks that load_gltf() makes of its structure.
/// throws lambent::Error as load_gltf() does
inline GltfSummary summarize_gltf(const std::string& path, const LoadOptions& options = {}) {
    const detail::PartialFile file(path);
    const detail::GltfModel model = detail::parse_gltf(file, path, options);
    detail::GltfValidator(model, path, options).check();
    GltfSummary s;
    s.scenes = model.scenes.size();
    s.nodes = model.nodes.size();
    s.meshes = model.meshes.size();
    for (const tinygltf::Mesh& mesh : model.meshes) s.primitives += mesh.primitives.size();
    s.materials = model.materials.size();
    s.textures = model.textures.size();
    s.images = model.images.size();
    s.accessors = model.accessors.size();
    s.cameras = model.cameras.size();
    s.lights = model.lights.size();
    s.skins = model.skins.size();
    s.animations = model.animations.size();
    for (std::size_t i = 0; i < model.buffers.size(); ++i) s.buffer_bytes += model.buffer_size(i);
    s.extensions_used = model.extensionsUsed;
    s.extensions_required = model.extensionsRequired;
    if (model.scenes.empty()) return s;
    std::vector<std::pair<int, std::size_t>> open;
    for (const int root : model.scenes[std::size_t(std::max(model.defaultScene, 0))].nodes) open.push_back({root, 1});
    std::size_t visits = 0;
    while (!open.empty() && visits++ <= s.nodes) { // cycles are load_gltf()'s to refuse
        const auto [node, depth] = open.back();
        open.pop_back();
        const tinygltf::Node& n = model.nodes[std::size_t(node)];
        s.mesh_nodes += n.mesh >= 0 ? 1u : 0u;
        s.depth = std::max(s.depth, depth);
        for (const int child : n.children) open.push_back({child, depth + 1});
    }
    return s;
}

} // namespace LAMBENT_ABI
} // namespace lambent
