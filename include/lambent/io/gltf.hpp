#pragma once
#include <lambent/core/bounds.hpp>
#include <lambent/core/error.hpp>
#include <lambent/core/executor.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/io/gltf_material.hpp>
#include <lambent/io/gltf_mesh.hpp>
#include <lambent/io/gltf_node.hpp>
#include <lambent/io/gltf_parse.hpp>
#include <lambent/io/gltf_validate.hpp>
#include <lambent/io/load_options.hpp>
#include <lambent/io/notes.hpp>
#include <lambent/io/partial_file.hpp>
#include <lambent/io/recentre.hpp>
#include <lambent/scene/attributes.hpp>
#include <lambent/scene/scene.hpp>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <tiny_gltf.h>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Unrolls the default scene of one glTF file.
template <class T>
class GltfLoader {
public:
    GltfLoader(const PartialFile& file, const std::string& path, const LoadOptions& options)
        : path_(path), options_(options), model_(parse_gltf(file, path_, options_)), notes_(path),
          meshes_(model_, path_, scene_, notes_) {}

    template <class E>
    Scene<T> load(E& executor) {
        GltfValidator(model_, path_, options_).check();
        const std::vector<Placed> nodes = placed_nodes();
        const Totals totals = check_totals(nodes);
        scene_.positions.reserve(totals.vertices);
        scene_.triangles.reserve(totals.triangles);
        scene_.triangle_materials.reserve(totals.triangles);
        scene_.origin = scene_origin(bounds_of(nodes));
        GltfMaterials<T> materials(model_, path_, options_, scene_, notes_);
        for (const Placed& placed : nodes) {
            const tinygltf::Node& node = model_.nodes[std::size_t(placed.node)];
            for_each_instance(placed, [&](Mat4d world) {
                world[3] -= Vec4d(scene_.origin, 0);
                meshes_.add(node.mesh, world, [&](const tinygltf::Primitive& p) {
                    return p.material >= 0 ? std::uint32_t(p.material) : materials.default_material();
                });
            });
            if (node.camera >= 0) add_camera(node, placed.matrix);
            add_light(node, placed);
        }
        meshes_.complete();
        materials.load_images(executor);
        add_tangents(scene_);
        store_notes();
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
            const std::string where = place_of(placed.node);
            require(!seen[index],
                    [&] { return where + ": the node is reached twice, by a cycle or by two parents"; });
            seen[index] = 1;
            const tinygltf::Node& node = model_.nodes[index];
            placed.matrix = placed.matrix * gltf_node_matrix(node, where);
            check_finite(placed.matrix, where);
            for (auto it = node.children.rbegin(); it != node.children.rend(); ++it)
                open.push_back({*it, placed.matrix});
            out.push_back(placed);
        }
        return out;
    }

    std::string place_of(int node) const { return path_ + ": /nodes/" + std::to_string(node); }

    static void check_finite(const Mat4d& matrix, const std::string& where) {
        for (int k = 0; k < 4; ++k)
            for (int r = 0; r < 4; ++r)
                require(is_finite(matrix[k][r]), [&] { return where + ": its world transform overflows"; });
    }

    std::vector<int> root_nodes() {
        const auto count = int(model_.scenes.size());
        require(options_.scene < count, [&] {
            return path_ + ": scene " + std::to_string(options_.scene) + " of " + std::to_string(count);
        });
        if (count > 0)
            return model_.scenes[std::size_t(options_.scene >= 0 ? options_.scene : std::max(model_.defaultScene, 0))]
                .nodes;
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

    struct Totals {
        std::size_t triangles = 0, vertices = 0, instances = 0;
    };

    /// What the nodes unroll to, before anything of that size is made.
    Totals check_totals(const std::vector<Placed>& nodes) const {
        Totals totals;
        for (const Placed& placed : nodes) {
            const tinygltf::Node& node = model_.nodes[std::size_t(placed.node)];
            if (node.mesh < 0) continue;
            const std::size_t copies = GltfInstancing(model_, node, place_of(placed.node)).count;
            totals.instances += copies;
            require(totals.instances <= options_.max_nodes, [&] {
                return path_ + ": more than " + std::to_string(options_.max_nodes) + " instances of meshes";
            });
            // Counts are below 2^32 and copies below 2^24: no overflow.
            totals.vertices += copies * meshes_.vertex_count(node.mesh);
            for (const tinygltf::Primitive& p : model_.meshes[std::size_t(node.mesh)].primitives)
                totals.triangles += copies * gltf_triangle_count(model_, p);
            require(totals.triangles <= options_.max_triangles && totals.vertices <= options_.max_vertices, [&] {
                return path_ + ": its instances unroll to more than " + std::to_string(options_.max_triangles) +
                       " triangles or " + std::to_string(options_.max_vertices) + " vertices";
            });
        }
        return totals;
    }

    /// Bounds of all vertices, by their meshes' boxes.
    Bounds3<double> bounds_of(const std::vector<Placed>& nodes) {
        Bounds3<double> all;
        for (const Placed& placed : nodes) {
            const tinygltf::Node& node = model_.nodes[std::size_t(placed.node)];
            if (node.mesh < 0) continue;
            if (node.skin >= 0)
                notes_.add("meshes with a skin keep their rest pose", "/nodes/" + std::to_string(placed.node));
            const Bounds3<double>& box = meshes_.bounds(node.mesh);
            if (box.empty()) continue;
            for_each_instance(placed, [&](const Mat4d& world) {
                for (int k = 0; k < 8; ++k) {
                    const Vec4d corner((k & 1) != 0 ? box.max.x : box.min.x, (k & 2) != 0 ? box.max.y : box.min.y,
                                       (k & 4) != 0 ? box.max.z : box.min.z, 1);
                    all.add(Vec3d(world * corner));
                }
            });
        }
        return all;
    }

    /// Calls f(world transform) for every copy of a node's mesh.
    template <class F>
    void for_each_instance(const Placed& placed, F&& f) const {
        const tinygltf::Node& node = model_.nodes[std::size_t(placed.node)];
        if (node.mesh < 0) return;
        const std::string where = place_of(placed.node);
        for (const Mat4d& local : GltfInstancing(model_, node, where).matrices(model_, path_)) {
            const Mat4d world = placed.matrix * local;
            check_finite(world, where);
            f(world);
        }
    }

    void add_camera(const tinygltf::Node& node, const Mat4d& matrix) {
        const tinygltf::Camera& in = model_.cameras[std::size_t(node.camera)];
        const double fov = in.perspective.yfov * 180 / pi<double>;
        const Vec3d ahead = -Vec3d(matrix[2]), up(matrix[1]);
        if (in.type != "perspective" || !(fov > 0 && fov < 180) || !(length(ahead) > 0 && length(up) > 0)) {
            notes_.add("cameras are not perspective or can't be used, and are left out",
                       "/cameras/" + std::to_string(node.camera));
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
            place_of(placed.node) + "/extensions/KHR_lights_punctual";
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
        notes_.add("animations are ignored", {}, model_.animations.size());
        for (const std::string& name : model_.extensionsUsed)
            if (!gltf_extension_known(name)) notes_.add("extensions are not supported and ignored: " + name);
        notes_.store(scene_.notes);
    }

    const std::string path_;
    const LoadOptions options_;
    const GltfModel model_;
    Scene<T> scene_;
    Notes notes_;
    GltfMeshes<T> meshes_;
};

} // namespace detail

/// Loads a scene of the bytes of a .gltf or .glb file; `path` names it in messages and finds the files that it names.
template <class T = float, class E>
Scene<T> load_gltf_bytes(std::string_view bytes, const std::string& path, const LoadOptions& options, E& executor) {
    const detail::PartialFile file(bytes);
    return detail::GltfLoader<T>(file, path, options).load(executor);
}

/// Loads a scene of a .gltf or .glb file: every mesh instance (EXT_mesh_gpu_instancing's too) unrolled to world space, in
/// double, then recentred; strips and fans as triangles; cameras, KHR_lights_punctual; materials with their textures and
/// the extensions that Material has fields for. Images are read and decoded at the end, in parallel, where a triangle's
/// material needs them; of a .glb nothing else is read either. A missing or unreadable image is
/// a note, and the factor is used alone. Notes also count whatever was left out: points, lines, skins, morph targets,
/// animations, unknown extensions.
/// throws lambent::Error, with the file and a JSON pointer, on a file that is damaged or contradicts itself, on required
///         extensions that are not supported, on files outside of the scene's folder, and beyond the options' limits
/// needs   lambent::gltf; lambent::image for textures
template <class T = float, class E>
Scene<T> load_gltf(const std::string& path, const LoadOptions& options, E& executor) {
    const detail::PartialFile file(path);
    return detail::GltfLoader<T>(file, path, options).load(executor);
}
/// The same, images decoded on the calling thread.
template <class T = float>
Scene<T> load_gltf(const std::string& path, const LoadOptions& options = {}) {
    SerialExecutor serial;
    return load_gltf<T>(path, options, serial);
}

} // namespace LAMBENT_ABI
} // namespace lambent
