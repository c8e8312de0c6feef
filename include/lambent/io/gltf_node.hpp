#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/matrix.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec.hpp>
#include <lambent/io/gltf_accessor.hpp>
#include <lambent/io/gltf_material.hpp>
#include <lambent/io/gltf_parse.hpp>
#include <lambent/io/load_options.hpp>
#include <cmath>
#include <cstddef>
#include <string>
#include <tiny_gltf.h>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Translation · rotation · scale, in double; the quaternion is (x, y, z, w) and of any length above 0.
inline Mat4d gltf_matrix(const Vec3d& translation, const Vec4d& rotation, const Vec3d& scale) {
    const Vec4d q = rotation / std::sqrt(dot(rotation, rotation));
    const double x = q.x, y = q.y, z = q.z, w = q.w;
    Mat4d m(1.0);
    m[0] = {1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w), 0};
    m[1] = {2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w), 0};
    m[2] = {2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y), 0};
    for (int k = 0; k < 3; ++k) m[k] *= scale[k];
    m[3] = Vec4d(translation, 1);
    return m;
}

/// A node's own transform.
/// throws lambent::Error when its quaternion has no direction
inline Mat4d gltf_node_matrix(const tinygltf::Node& node, const std::string& where) {
    if (node.matrix.size() == 16) {
        Mat4d m(1.0);
        for (int k = 0; k < 16; ++k) m[k / 4][k % 4] = node.matrix[std::size_t(k)];
        return m;
    }
    Vec3d translation(0), scale(1);
    Vec4d rotation(0, 0, 0, 1);
    for (int k = 0; k < 4; ++k)
        if (node.rotation.size() == 4) rotation[k] = node.rotation[std::size_t(k)];
    for (int k = 0; k < 3; ++k) {
        if (node.scale.size() == 3) scale[k] = node.scale[std::size_t(k)];
        if (node.translation.size() == 3) translation[k] = node.translation[std::size_t(k)];
    }
    require(dot(rotation, rotation) > 0, [&] { return where + "/rotation: a quaternion of length 0"; });
    return gltf_matrix(translation, rotation, scale);
}

/// The accessors of a node's EXT_mesh_gpu_instancing, -1 for those that it lacks.
struct GltfInstancing {
    int translation = -1, rotation = -1, scale = -1;
    std::size_t count = 1; ///< copies of the mesh; 1 without the extension

    /// throws lambent::Error where they do not fit together
    GltfInstancing(const GltfModel& model, const tinygltf::Node& node, const std::string& where) {
        const tinygltf::Value& extension = gltf_extension(node.extensions, "EXT_mesh_gpu_instancing");
        if (!extension.IsObject() || !extension.Has("attributes")) return;
        const tinygltf::Value& attributes = extension.Get("attributes");
        bool first = true;
        const auto find = [&](const char* name, int type, int& out) {
            if (!attributes.IsObject() || !attributes.Has(name)) return;
            const double index = gltf_number(attributes, name, -1);
            const std::string at = where + "/extensions/EXT_mesh_gpu_instancing/attributes/" + name;
            require(index >= 0 && index < double(model.accessors.size()),
                    [&] { return at + ": index " + std::to_string(index) + " of " + std::to_string(model.accessors.size()); });
            out = int(index);
            const tinygltf::Accessor& a = model.accessors[std::size_t(out)];
            require(a.type == type && (first || a.count == count),
                    [&] { return at + ": elements or their number (" + std::to_string(a.count) + ") do not fit"; });
            count = a.count;
            first = false;
        };
        find("TRANSLATION", TINYGLTF_TYPE_VEC3, translation);
        find("ROTATION", TINYGLTF_TYPE_VEC4, rotation);
        find("SCALE", TINYGLTF_TYPE_VEC3, scale);
    }

    /// Transforms of the copies below the node's own.
    std::vector<Mat4d> matrices(const GltfModel& model, const std::string& path) const {
        const GltfAccessors read(model, path);
        const auto vectors = [&](int accessor, auto missing) {
            using V = decltype(missing);
            return accessor < 0 ? std::vector<V>(count, missing) : read.template vectors<V>(accessor);
        };
        const std::vector<Vec3f> t = vectors(translation, Vec3f(0)), s = vectors(scale, Vec3f(1));
        const std::vector<Vec4f> r = vectors(rotation, Vec4f(0, 0, 0, 1));
        std::vector<Mat4d> out;
        for (std::size_t i = 0; i < count; ++i) {
            const bool turned = dot(r[i], r[i]) > 0 && is_finite(dot(r[i], r[i]));
            out.push_back(gltf_matrix(Vec3d(t[i]), turned ? Vec4d(r[i]) : Vec4d(0, 0, 0, 1), Vec3d(s[i])));
        }
        return out;
    }
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
