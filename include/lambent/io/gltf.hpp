#pragma once
#include <lambent/core/bounds.hpp>
#include <lambent/core/error.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/io/gltf_material.hpp>
#include <lambent/io/gltf_mesh.hpp>
#include <lambent/io/gltf_parse.hpp>
#include <lambent/io/gltf_validate.hpp>
#include <lambent/io/load_options.hpp>
#include <lambent/io/recentre.hpp>
#include <lambent/scene/scene.hpp>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <tiny_gltf.h>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// A node's own transform, in double.
/// throws lambent::Error when its quaternion has no direction
inline Mat4d gltf_node_matrix(const tinygltf::Node& node, const std::string& where) {
    Mat4d m(1.0);
    if (node.matrix.size() == 16) {
        for (int k = 0; k < 16; ++k) m[k / 4][k % 4] = node.matrix[std::size_t(k)];
        return m;
    }
    if (node.rotation.size() == 4) {
        double x = node.rotation[0], y = node.rotation[1], z = node.rotation[2], w = node.rotation[3];
        const double norm = std::sqrt(x * x + y * y + z * z + w * w);
        require(norm > 0, [&] { return where + "/rotation: a quaternion of length 0"; });
        x /= norm, y /= norm, z /= norm, w /= norm;
        m[0] = {1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w), 0};
        m[1] = {2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w), 0};
        m[2] = {2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y), 0};
    }
    if (node.scale.size() == 3)
        for (int k = 0; k < 3; ++k) m[k] *= node.scale[std::size_t(k)];
    if (node.translation.size() == 3)
        m[3] = {node.translation[0], node.translation[1], node.translation[2], 1};
    return m;
}

/// Unrolls the default scene of one glTF file.
template <class T>
class GltfLoader {
public:
    GltfLoader(const std::string& path, const LoadOptions& options)
        : path_(path), options_(options), model_(parse_gltf(path_)) {}

    Scene<T> load() {
        GltfValidator(model_, path_, options_).check();
        const std::vector<Placed> nodes = placed_nodes();
        check_totals(nodes);
        GltfMaterials<T> materials(model_, path_, options_, scene_);
        meshes_.resize(model_.meshes.size());
        for (const Placed& placed : nodes) {
            const tinygltf::Node& node = model_.nodes[std::size_t(placed.node)];
            if (node.mesh >= 0) add_mesh(node.mesh, placed.matrix, materials);
            if (node.camera >= 0) add_camera(node, placed.matrix);
            add_light(node, placed);
        }
        store_notes();
        Bounds3<double> bounds;
        for (const UVec3& t : scene_.triangles)
            for (int k = 0; k < 3; ++k) bounds.add(positions_[t[k]]);
        store_positions(scene_, positions_, bounds);
        scene_.validate();
        return std::move(scene_);
    }

private:
    struct Placed {
        int node;
        Mat4d matrix;
    };

    /// The scene's nodes with their world transforms, parents first.
    /// throws lambent::Error where a node is reached twice: by a cycle, or by two parents
    std::vector<Placed> placed_nodes() {
        std::vector<Placed> out;
        std::vector<char> seen(model_.nodes.size(), 0);
        std::vector<Placed> open;
        const std::vector<int> roots = root_nodes();
        for (auto it = roots.rbegin(); it != roots.rend(); ++it) open.push_back({*it, Mat4d(1.0)});
        while (!open.empty()) {
            Placed placed = open.back();
            open.pop_back();
            const auto index = std::size_t(placed.node);
            const std::string where = path_ + ": /nodes/" + std::to_string(placed.node);
            require(!seen[index],
                    [&] { return where + ": the node is reached twice, by a cycle or by two parents"; });
            seen[index] = 1;
            const tinygltf::Node& node = model_.nodes[index];
            placed.matrix = placed.matrix * gltf_node_matrix(node, where);
            for (int k = 0; k < 4; ++k)
                for (int r = 0; r < 4; ++r)
                    require(is_finite(placed.matrix[k][r]),
                            [&] { return where + ": its world transform overflows"; });
            for (auto it = node.children.rbegin(); it != node.children.rend(); ++it)
                open.push_back({*it, placed.matrix});
            out.push_back(placed);
        }
        return out;
    }

    std::vector<int> root_nodes() {
        if (!model_.scenes.empty()) return model_.scenes[std::size_t(std::max(model_.defaultScene, 0))].nodes;
        std::vector<char> child(model_.nodes.size(), 0);
        for (const tinygltf::Node& node : model_.nodes)
            for (const int c : node.children) child[std::size_t(c)] = 1;
        std::vector<int> roots;
        for (std::size_t i = 0; i < child.size(); ++i)
            if (!child[i]) roots.push_back(int(i));
        if (!roots.empty())
            scene_.notes.push_back(path_ + ": the file names no scene; all its nodes are taken");
        return roots;
    }

    void check_totals(const std::vector<Placed>& nodes) const {
        std::size_t triangles = 0, vertices = 0;
        for (const Placed& placed : nodes) {
            const int mesh = model_.nodes[std::size_t(placed.node)].mesh;
            if (mesh < 0) continue;
            for (const tinygltf::Primitive& p : model_.meshes[std::size_t(mesh)].primitives) {
                if (!gltf_has_triangles(p)) continue;
                triangles += gltf_triangle_count(model_, p);
                vertices += model_.accessors[std::size_t(p.attributes.at("POSITION"))].count;
                require(triangles <= options_.max_triangles && vertices <= options_.max_vertices, [&] {
                    return path_ + ": its instances unroll to more than " +
                           std::to_string(options_.max_triangles) + " triangles or " +
                           std::to_string(options_.max_vertices) + " vertices";
                });
            }
        }
    }

    void add_mesh(int mesh, const Mat4d& matrix, GltfMaterials<T>& materials) {
        auto& decoded = meshes_[std::size_t(mesh)];
        if (!decoded) {
            decoded.emplace();
            const auto& primitives = model_.meshes[std::size_t(mesh)].primitives;
            for (std::size_t k = 0; k < primitives.size(); ++k) {
                if (!primitives[k].targets.empty()) ++morphed_;
                if (!gltf_has_triangles(primitives[k])) {
                    ++counts_.points_and_lines;
                    continue;
                }
                const std::string where =
                    "/meshes/" + std::to_string(mesh) + "/primitives/" + std::to_string(k);
                decoded->push_back(decode_gltf_primitive(model_, primitives[k],
                                                         materials.texcoords(primitives[k].material), path_,
                                                         where, counts_));
            }
        }
        for (const GltfPrimitive& p : *decoded)
            add_primitive(p, matrix,
                          p.material >= 0 ? std::uint32_t(p.material) : materials.default_material());
    }

    void add_primitive(const GltfPrimitive& p, const Mat4d& matrix, std::uint32_t material) {
        const std::size_t first = positions_.size();
        const Vec3d x(matrix[0]), y(matrix[1]), z(matrix[2]), shift(matrix[3]);
        const bool mirrored = dot(cross(x, y), z) < 0;
        for (const Vec3f& v : p.positions)
            positions_.push_back(x * double(v.x) + y * double(v.y) + z * double(v.z) + shift);
        if (!p.normals.empty()) {
            // The cofactor matrix is the inverse transpose times the determinant, and exists where that is 0.
            const double sign = mirrored ? -1 : 1;
            const Vec3d nx = cross(y, z) * sign, ny = cross(z, x) * sign, nz = cross(x, y) * sign;
            scene_.normals.resize(first, Vec3f(0));
            for (const Vec3f& v : p.normals) {
                const Vec3d n = nx * double(v.x) + ny * double(v.y) + nz * double(v.z);
                const double size = length(n);
                scene_.normals.push_back(size > 0 && is_finite(size) ? Vec3f(n / size) : Vec3f(0));
            }
        }
        append(scene_.texcoords, p.texcoords, first, Vec2f(0));
        append(scene_.colors, p.colors, first, Vec4f(1));
        const auto offset = std::uint32_t(first);
        for (UVec3 t : p.triangles) {
            if (mirrored) std::swap(t.y, t.z); // the front stays the front
            scene_.triangles.push_back(t + offset);
            scene_.triangle_materials.push_back(material);
        }
    }

    /// Appends an attribute to an array that starts with the first primitive to have it.
    template <class V>
    static void append(std::vector<V>& all, const std::vector<V>& values, std::size_t first,
                       const V& missing) {
        if (values.empty()) return;
        all.resize(first, missing);
        all.insert(all.end(), values.begin(), values.end());
    }

    void add_camera(const tinygltf::Node& node, const Mat4d& matrix) {
        const tinygltf::Camera& in = model_.cameras[std::size_t(node.camera)];
        const double fov = in.perspective.yfov * 180 / pi<double>;
        const Vec3d ahead = -Vec3d(matrix[2]), up(matrix[1]);
        if (in.type != "perspective" || !(fov > 0 && fov < 180) || !(length(ahead) > 0 && length(up) > 0)) {
            scene_.notes.push_back(path_ + ": /cameras/" + std::to_string(node.camera) +
                                   " is no perspective camera that can be used and is left out");
            return;
        }
        Camera camera;
        camera.eye = Vec3d(matrix[3]);
        camera.target = camera.eye + normalize(ahead);
        camera.up = normalize(up);
        camera.vertical_fov = fov;
        camera.name = in.name.empty() ? node.name : in.name;
        scene_.cameras.push_back(std::move(camera));
    }

    void add_light(const tinygltf::Node& node, const Placed& placed) {
        const tinygltf::Value& extension = gltf_extension(node.extensions, "KHR_lights_punctual");
        if (!extension.IsObject()) return;
        const double index = gltf_number(extension, "light", -1);
        const std::string where =
            path_ + ": /nodes/" + std::to_string(placed.node) + "/extensions/KHR_lights_punctual";
        require(index >= 0 && index < double(model_.lights.size()), [&] {
            return where + ": light " + std::to_string(index) + " of " + std::to_string(model_.lights.size());
        });
        const tinygltf::Light& in = model_.lights[std::size_t(index)];
        PunctualLight light;
        if (in.type == "directional")
            light.kind = PunctualLight::Kind::directional;
        else if (in.type == "spot")
            light.kind = PunctualLight::Kind::spot;
        else
            require(in.type == "point", [&] { return where + ": unknown type of light '" + in.type + "'"; });
        light.position = Vec3d(placed.matrix[3]);
        const Vec3d ahead = -Vec3d(placed.matrix[2]);
        if (length(ahead) > 0) light.direction = normalize(ahead);
        for (int c = 0; c < 3; ++c) {
            const double color = in.color.size() == 3 ? in.color[std::size_t(c)] : 1.0;
            light.intensity[c] = float(std::max(0.0, color * in.intensity));
            require(is_finite(light.intensity[c]), [&] { return where + ": the intensity is not finite"; });
        }
        light.inner_cone_cos = float(std::cos(in.spot.innerConeAngle));
        light.outer_cone_cos = float(std::cos(in.spot.outerConeAngle));
        scene_.punctual_lights.push_back(light);
    }

    void store_notes() {
        const std::size_t vertices = positions_.size();
        if (!scene_.normals.empty()) scene_.normals.resize(vertices, Vec3f(0));
        if (!scene_.texcoords.empty()) scene_.texcoords.resize(vertices, Vec2f(0));
        if (!scene_.colors.empty()) scene_.colors.resize(vertices, Vec4f(1));
        const auto note = [&](std::size_t count, const char* what) {
            if (count > 0) scene_.notes.push_back(path_ + ": " + std::to_string(count) + " " + what);
        };
        note(counts_.points_and_lines, "primitives of points or lines were skipped");
        note(counts_.leftover_vertices, "vertices at the end of triangle lists make no triangle");
        note(counts_.repaired, "normals, texture coordinates or colours are not finite and were replaced");
        note(morphed_, "primitives have morph targets and keep their rest shape");
        note(model_.skins.size(), "skins are ignored: their meshes keep their rest pose");
        note(model_.animations.size(), "animations are ignored");
        for (const std::string& name : model_.extensionsUsed)
            if (!gltf_extension_known(name))
                scene_.notes.push_back(path_ + ": the extension " + name + " is not supported and ignored");
    }

    const std::string path_;
    const LoadOptions options_;
    const tinygltf::Model model_;
    Scene<T> scene_;
    std::vector<Vec3d> positions_;
    std::vector<std::optional<std::vector<GltfPrimitive>>> meshes_;
    GltfMeshCounts counts_;
    std::size_t morphed_ = 0;
};

} // namespace detail

/// Loads the default scene of a .gltf or .glb file: every mesh instance unrolled to world space (in double,
/// then recentred), strips and fans to triangles, cameras, KHR_lights_punctual, base colour and emission with
/// their textures, alpha masks, vertex colours. Materials beyond Lambert show their base colour. A missing or
/// unreadable image is a note, and the factor is used alone. Notes also count whatever was left out.
/// throws lambent::Error, with the file and a JSON pointer, on a file that is damaged or contradicts itself,
///         on required extensions that are not supported, and beyond the options' limits
/// needs   lambent::gltf; lambent::image for textures
template <class T = float>
Scene<T> load_gltf(const std::string& path, const LoadOptions& options = {}) {
    return detail::GltfLoader<T>(path, options).load();
}

} // namespace LAMBENT_ABI
} // namespace lambent
