#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/io/gltf_parse.hpp>
#include <lambent/io/load_options.hpp>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <tiny_gltf.h>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Whether we honour an extension, or lose nothing by passing it over, so that a file may require it.
inline bool gltf_extension_known(std::string_view name) {
    for (const std::string_view known :
         {"KHR_lights_punctual", "KHR_texture_transform", "KHR_mesh_quantization", "EXT_mesh_gpu_instancing",
          "KHR_materials_clearcoat", "KHR_materials_emissive_strength", "KHR_materials_ior", "KHR_materials_sheen",
          "KHR_materials_specular", "KHR_materials_transmission", "KHR_materials_unlit", "KHR_materials_variants",
          "KHR_materials_volume", "KHR_xmp", "KHR_xmp_json_ld"})
        if (name == known) return true;
    return false;
}

/// Checks a parsed glTF model: tinygltf takes nearly every number as it comes. Afterwards every index,
/// offset, stride and count can be used without another look, except vertex indices and sparse indices, which
/// are checked where they are read.
class GltfValidator {
public:
    GltfValidator(const GltfModel& model, const std::string& path, const LoadOptions& options)
        : model_(model), path_(path), options_(options) {}

    /// throws lambent::Error with the file, a JSON pointer and the numbers
    void check() const {
        check_extensions();
        if (model_.nodes.size() > options_.max_nodes)
            refuse("/nodes", std::to_string(model_.nodes.size()) + " nodes, over the limit of " +
                                 std::to_string(options_.max_nodes));
        for (std::size_t i = 0; i < model_.bufferViews.size(); ++i) check_buffer_view(i);
        for (std::size_t i = 0; i < model_.accessors.size(); ++i) check_accessor(i);
        for (std::size_t i = 0; i < model_.images.size(); ++i)
            optional_index(model_.images[i].bufferView, model_.bufferViews.size(),
                           at("images", i) + "/bufferView");
        for (std::size_t i = 0; i < model_.textures.size(); ++i) {
            optional_index(model_.textures[i].source, model_.images.size(), at("textures", i) + "/source");
            optional_index(model_.textures[i].sampler, model_.samplers.size(),
                           at("textures", i) + "/sampler");
        }
        for (std::size_t i = 0; i < model_.materials.size(); ++i) check_material(i);
        for (std::size_t i = 0; i < model_.meshes.size(); ++i)
            for (std::size_t k = 0; k < model_.meshes[i].primitives.size(); ++k)
                check_primitive(model_.meshes[i].primitives[k], at("meshes", i) + at("primitives", k));
        for (std::size_t i = 0; i < model_.nodes.size(); ++i) check_node(i);
        for (std::size_t i = 0; i < model_.scenes.size(); ++i)
            for (const int node : model_.scenes[i].nodes)
                index(node, model_.nodes.size(), at("scenes", i) + "/nodes");
        optional_index(model_.defaultScene, model_.scenes.size(), "/scene");
    }

    [[noreturn]] void refuse(const std::string& where, const std::string& why) const {
        fail(path_ + ": " + where + ": " + why);
    }

private:
    static std::string at(const char* array, std::size_t i) {
        return std::string("/") + array + "/" + std::to_string(i);
    }

    void index(int i, std::size_t size, const std::string& where) const {
        if (i < 0 || std::size_t(i) >= size)
            refuse(where, "index " + std::to_string(i) + " of " + std::to_string(size));
    }
    void optional_index(int i, std::size_t size, const std::string& where) const {
        if (i != -1) index(i, size, where);
    }

    void check_extensions() const {
        for (const std::string& name : model_.extensionsRequired)
            if (!gltf_extension_known(name))
                refuse("/extensionsRequired", "the extension " + name + " is required but not supported");
    }

    void check_buffer_view(std::size_t i) const {
        const tinygltf::BufferView& view = model_.bufferViews[i];
        index(view.buffer, model_.buffers.size(), at("bufferViews", i) + "/buffer");
        const std::size_t size = model_.buffer_size(std::size_t(view.buffer));
        if (view.byteOffset > size || view.byteLength > size - view.byteOffset)
            refuse(at("bufferViews", i), "bytes " + std::to_string(view.byteOffset) + " + " +
                                             std::to_string(view.byteLength) + " of a buffer of " +
                                             std::to_string(size));
        if (view.byteStride > 252)
            refuse(at("bufferViews", i), "byteStride " + std::to_string(view.byteStride));
    }

    /// `count` elements of `size` bytes, `stride` apart, fit in the view behind `offset`.
    void check_fit(int view, std::size_t offset, std::size_t count, std::size_t stride, std::size_t size,
                   const std::string& where) const {
        index(view, model_.bufferViews.size(), where + "/bufferView");
        const std::size_t length = model_.bufferViews[std::size_t(view)].byteLength;
        if (count == 0) return;
        if (size > length || offset > length - size || count - 1 > (length - size - offset) / stride)
            refuse(where, std::to_string(count) + " elements of " + std::to_string(size) + " bytes, " +
                              std::to_string(stride) + " apart, at offset " + std::to_string(offset) +
                              " do not fit in a view of " + std::to_string(length) + " bytes");
    }

    void check_accessor(std::size_t i) const {
        const tinygltf::Accessor& a = model_.accessors[i];
        const std::string where = at("accessors", i);
        const int component = tinygltf::GetComponentSizeInBytes(std::uint32_t(a.componentType));
        const int components = tinygltf::GetNumComponentsInType(std::uint32_t(a.type));
        if (component <= 0 || a.componentType == TINYGLTF_COMPONENT_TYPE_DOUBLE)
            refuse(where, "componentType " + std::to_string(a.componentType));
        if (components <= 0) refuse(where, "unknown type");
        const std::size_t size = std::size_t(component) * std::size_t(components);
        if (a.bufferView != -1) {
            index(a.bufferView, model_.bufferViews.size(), where + "/bufferView");
            const std::size_t stride = model_.bufferViews[std::size_t(a.bufferView)].byteStride;
            if (stride != 0 && stride < size)
                refuse(where, "byteStride " + std::to_string(stride) + " for elements of " +
                                  std::to_string(size) + " bytes");
            check_fit(a.bufferView, a.byteOffset, a.count, stride == 0 ? size : stride, size, where);
        } else if (a.count > options_.max_vertices) {
            refuse(where, std::to_string(a.count) + " elements without data");
        }
        if (!a.sparse.isSparse) return;
        const auto& sparse = a.sparse;
        if (sparse.count < 0 || std::size_t(sparse.count) > a.count || sparse.indices.byteOffset < 0 ||
            sparse.values.byteOffset < 0)
            refuse(where + "/sparse",
                   "count " + std::to_string(sparse.count) + " of " + std::to_string(a.count));
        const std::size_t index_size = index_bytes(sparse.indices.componentType, where + "/sparse/indices");
        check_fit(sparse.indices.bufferView, std::size_t(sparse.indices.byteOffset),
                  std::size_t(sparse.count), index_size, index_size, where + "/sparse/indices");
        check_fit(sparse.values.bufferView, std::size_t(sparse.values.byteOffset), std::size_t(sparse.count),
                  size, size, where + "/sparse/values");
    }

    std::size_t index_bytes(int type, const std::string& where) const {
        if (type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE) return 1;
        if (type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT) return 2;
        if (type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT) return 4;
        refuse(where, "indices of componentType " + std::to_string(type));
    }

    void check_material(std::size_t i) const {
        const tinygltf::Material& m = model_.materials[i];
        const std::string where = at("materials", i);
        const auto& pbr = m.pbrMetallicRoughness;
        for (const int t : {pbr.baseColorTexture.index, pbr.metallicRoughnessTexture.index, m.normalTexture.index,
                            m.occlusionTexture.index, m.emissiveTexture.index})
            optional_index(t, model_.textures.size(), where);
        for (const double v : {pbr.metallicFactor, pbr.roughnessFactor, m.normalTexture.scale, m.alphaCutoff})
            if (!is_finite(float(v))) refuse(where, "a number that is not finite");
        if (m.alphaMode != "OPAQUE" && m.alphaMode != "MASK" && m.alphaMode != "BLEND")
            refuse(where + "/alphaMode", "'" + m.alphaMode + "' is none of OPAQUE, MASK and BLEND");
        const std::vector<double>&base = m.pbrMetallicRoughness.baseColorFactor, &emissive = m.emissiveFactor;
        if (!base.empty()) check_numbers(base, 4, where + "/pbrMetallicRoughness/baseColorFactor");
        if (!emissive.empty()) check_numbers(emissive, 3, where + "/emissiveFactor");
    }

    void check_numbers(const std::vector<double>& values, std::size_t count, const std::string& where) const {
        if (values.size() != count)
            refuse(where, std::to_string(values.size()) + " numbers instead of " + std::to_string(count));
        for (const double v : values)
            if (!is_finite(v)) refuse(where, "a number that is not finite");
    }

    void check_primitive(const tinygltf::Primitive& p, const std::string& where) const {
        if (p.mode < -1 || p.mode > TINYGLTF_MODE_TRIANGLE_FAN)
            refuse(where, "mode " + std::to_string(p.mode));
        optional_index(p.material, model_.materials.size(), where + "/material");
        std::size_t count = 0;
        if (const auto position = p.attributes.find("POSITION"); position != p.attributes.end()) {
            index(position->second, model_.accessors.size(), where + "/attributes/POSITION");
            count = model_.accessors[std::size_t(position->second)].count;
        }
        for (const auto& [name, accessor] : p.attributes) {
            const std::string attribute = where + "/attributes/" + name;
            index(accessor, model_.accessors.size(), attribute);
            const tinygltf::Accessor& a = model_.accessors[std::size_t(accessor)];
            if (name == "POSITION" || name == "NORMAL") check_type(a, {TINYGLTF_TYPE_VEC3}, attribute);
            if (name == "TANGENT") check_type(a, {TINYGLTF_TYPE_VEC4}, attribute);
            if (name.starts_with("TEXCOORD_")) check_type(a, {TINYGLTF_TYPE_VEC2}, attribute);
            if (name.starts_with("COLOR_"))
                check_type(a, {TINYGLTF_TYPE_VEC3, TINYGLTF_TYPE_VEC4}, attribute);
            if (a.count != count)
                refuse(attribute,
                       std::to_string(a.count) + " elements for " + std::to_string(count) + " positions");
        }
        if (p.indices == -1) return;
        index(p.indices, model_.accessors.size(), where + "/indices");
        const tinygltf::Accessor& indices = model_.accessors[std::size_t(p.indices)];
        check_type(indices, {TINYGLTF_TYPE_SCALAR}, where + "/indices");
        index_bytes(indices.componentType, where + "/indices");
    }

    void check_type(const tinygltf::Accessor& a, std::initializer_list<int> allowed,
                    const std::string& where) const {
        if (std::find(allowed.begin(), allowed.end(), a.type) == allowed.end())
            refuse(where, "elements of " +
                              std::to_string(tinygltf::GetNumComponentsInType(std::uint32_t(a.type))) +
                              " components");
    }

    void check_node(std::size_t i) const {
        const tinygltf::Node& node = model_.nodes[i];
        const std::string where = at("nodes", i);
        optional_index(node.mesh, model_.meshes.size(), where + "/mesh");
        optional_index(node.camera, model_.cameras.size(), where + "/camera");
        for (const int child : node.children) index(child, model_.nodes.size(), where + "/children");
        if (!node.translation.empty()) check_numbers(node.translation, 3, where + "/translation");
        if (!node.rotation.empty()) check_numbers(node.rotation, 4, where + "/rotation");
        if (!node.scale.empty()) check_numbers(node.scale, 3, where + "/scale");
        if (!node.matrix.empty()) check_numbers(node.matrix, 16, where + "/matrix");
    }

    const GltfModel& model_;
    const std::string& path_;
    const LoadOptions& options_;
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
