#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec.hpp>
#include <lambent/io/gltf_accessor.hpp>
#include <lambent/io/notes.hpp>
#include <cstddef>
#include <cstdint>
#include <string>
#include <tiny_gltf.h>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// A primitive's arrays, decoded, in the mesh's own space. Attributes that it lacks are empty.
struct GltfPrimitive {
    std::vector<Vec3f> positions, normals;
    std::vector<Vec4f> tangents;
    std::vector<Vec2f> texcoords, texcoords1;
    std::vector<Vec4f> colors;
    std::vector<UVec3> triangles;
    int material = -1;
};

inline bool gltf_has_triangles(const tinygltf::Primitive& p) {
    return (p.mode == -1 || p.mode >= TINYGLTF_MODE_TRIANGLES) && p.attributes.contains("POSITION");
}

/// Vertices that a primitive strings together: its indices, or its positions.
inline std::size_t gltf_corner_count(const tinygltf::Model& model, const tinygltf::Primitive& p) {
    const int accessor = p.indices >= 0 ? p.indices : p.attributes.at("POSITION");
    return model.accessors[std::size_t(accessor)].count;
}

inline std::size_t gltf_triangle_count(const tinygltf::Model& model, const tinygltf::Primitive& p) {
    if (!gltf_has_triangles(p)) return 0;
    const std::size_t corners = gltf_corner_count(model, p);
    if (p.mode <= TINYGLTF_MODE_TRIANGLES) return corners / 3;
    return corners < 3 ? 0 : corners - 2;
}

/// The triangles of a list, strip or fan; strips and fans as glTF 2.0 §3.7.2.1 winds them.
template <class Corner>
std::vector<UVec3> gltf_triangles(int mode, std::size_t count, Corner&& corner) {
    std::vector<UVec3> out(count);
    for (std::size_t i = 0; i < count; ++i) {
        if (mode == TINYGLTF_MODE_TRIANGLE_STRIP)
            out[i] = {corner(i), corner(i + 1 + i % 2), corner(i + 2 - i % 2)};
        else if (mode == TINYGLTF_MODE_TRIANGLE_FAN)
            out[i] = {corner(i + 1), corner(i + 2), corner(0)};
        else
            out[i] = {corner(3 * i), corner(3 * i + 1), corner(3 * i + 2)};
    }
    return out;
}

/// Decodes one primitive of a validated model.
/// throws lambent::Error on a vertex index out of range and on positions that are not finite
inline GltfPrimitive decode_gltf_primitive(const tinygltf::Model& model, const tinygltf::Primitive& p,
                                           const std::string& path, const std::string& where, Notes& notes) {
    const GltfAccessors read(model, path);
    GltfPrimitive out;
    out.material = p.material;
    out.positions = read.vectors<Vec3f>(p.attributes.at("POSITION"));
    for (std::size_t i = 0; i < out.positions.size(); ++i)
        require(is_finite(out.positions[i]), [&] {
            return path + ": " + where + "/attributes/POSITION: element " + std::to_string(i) +
                   " is not finite";
        });
    const auto attribute = [&](const std::string& name, auto& values, const auto& repair) {
        const auto it = p.attributes.find(name);
        if (it == p.attributes.end()) return;
        values = read.vectors<std::decay_t<decltype(values[0])>>(it->second);
        for (auto& v : values)
            for (int c = 0; c < v.length(); ++c)
                if (!is_finite(v[c])) {
                    v = repair;
                    notes.add("normals, tangents, texture coordinates or colours are not finite and were replaced", where);
                    break;
                }
    };
    attribute("NORMAL", out.normals, Vec3f(0));
    attribute("TANGENT", out.tangents, Vec4f(0));
    attribute("TEXCOORD_0", out.texcoords, Vec2f(0));
    attribute("TEXCOORD_1", out.texcoords1, Vec2f(0));
    attribute("COLOR_0", out.colors, Vec4f(1));

    const std::size_t corners = gltf_corner_count(model, p), count = gltf_triangle_count(model, p);
    if (p.mode <= TINYGLTF_MODE_TRIANGLES) notes.add("vertices at the end of triangle lists make no triangle", where, corners % 3);
    if (p.indices < 0) {
        out.triangles = gltf_triangles(p.mode, count, [](std::size_t i) { return std::uint32_t(i); });
        return out;
    }
    const std::vector<std::uint32_t> indices = read.indices(p.indices);
    for (std::size_t i = 0; i < indices.size(); ++i)
        require(indices[i] < out.positions.size(), [&] {
            return path + ": " + where + "/indices: element " + std::to_string(i) + " is vertex " +
                   std::to_string(indices[i]) + " of " + std::to_string(out.positions.size());
        });
    out.triangles = gltf_triangles(p.mode, count, [&](std::size_t i) { return indices[i]; });
    return out;
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
