#pragma once
#include <lambent/core/bounds.hpp>
#include <lambent/core/error.hpp>
#include <lambent/core/matrix.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec.hpp>
#include <lambent/io/gltf_accessor.hpp>
#include <lambent/io/gltf_parse.hpp>
#include <lambent/io/notes.hpp>
#include <lambent/scene/scene.hpp>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <tiny_gltf.h>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

inline bool gltf_has_triangles(const tinygltf::Primitive& p) {
    return (p.mode == -1 || p.mode >= TINYGLTF_MODE_TRIANGLES) && p.attributes.contains("POSITION");
}

/// Vertices that a primitive strings together: its indices, or its positions.
inline std::size_t gltf_corner_count(const GltfModel& model, const tinygltf::Primitive& p) {
    const int accessor = p.indices >= 0 ? p.indices : p.attributes.at("POSITION");
    return model.accessors[std::size_t(accessor)].count;
}

inline std::size_t gltf_triangle_count(const GltfModel& model, const tinygltf::Primitive& p) {
    if (!gltf_has_triangles(p)) return 0;
    const std::size_t corners = gltf_corner_count(model, p);
    if (p.mode <= TINYGLTF_MODE_TRIANGLES) return corners / 3;
    return corners < 3 ? 0 : corners - 2;
}

/// Triangle i of a list, strip or fan; strips and fans as glTF 2.0 §3.7.2.1 winds them.
template <class Corner>
UVec3 gltf_triangle(int mode, std::size_t i, Corner&& corner) {
    if (mode == TINYGLTF_MODE_TRIANGLE_STRIP) return {corner(i), corner(i + 1 + i % 2), corner(i + 2 - i % 2)};
    if (mode == TINYGLTF_MODE_TRIANGLE_FAN) return {corner(i + 1), corner(i + 2), corner(0)};
    return {corner(3 * i), corner(3 * i + 1), corner(3 * i + 2)};
}

/// Writes the meshes of a validated model into a scene, straight from the file's bytes.
template <class T>
class GltfMeshes {
public:
    GltfMeshes(const GltfModel& model, const std::string& path, Scene<T>& scene, Notes& notes)
        : model_(model), read_(model, path), path_(path), scene_(scene), notes_(notes), bounds_(model.meshes.size()) {}

    /// Vertices that one copy of a mesh makes.
    std::size_t vertex_count(int mesh) const {
        std::size_t count = 0;
        VertexRanges ranges;
        for (const tinygltf::Primitive& p : primitives(mesh))
            if (gltf_has_triangles(p) && ranges.emplace(p.attributes, 0).second)
                count += model_.accessors[std::size_t(p.attributes.at("POSITION"))].count;
        return count;
    }

    /// Bounds of a mesh's vertices in its own space.
    /// throws lambent::Error on positions that are not finite
    const Bounds3<double>& bounds(int mesh) {
        auto& known = bounds_[std::size_t(mesh)];
        if (known) return *known;
        known.emplace();
        const auto& all = primitives(mesh);
        for (std::size_t k = 0; k < all.size(); ++k) {
            const std::string where = place(mesh, k);
            if (!all[k].targets.empty()) notes_.add("primitives have morph targets and keep their rest shape", where);
            if (!gltf_has_triangles(all[k])) {
                notes_.add("primitives of points or lines were skipped", where);
                continue;
            }
            const int accessor = all[k].attributes.at("POSITION");
            Vec3f low(std::numeric_limits<float>::max()), high(-low);
            std::uint32_t largest = 0;
            read_.template for_each<Vec3f>(accessor, [&](std::size_t, const Vec3f& v) {
                low = min(low, v);
                high = max(high, v);
                largest = std::max(largest, largest_magnitude(v));
            });
            if (largest >= infinite)
                read_.template for_each<Vec3f>(accessor, [&](std::size_t i, const Vec3f& v) {
                    if (!is_finite(v)) refuse(where, "/attributes/POSITION: element " + std::to_string(i) + " is not finite");
                });
            if (model_.accessors[std::size_t(accessor)].count == 0) continue;
            known->add(Vec3d(low));
            known->add(Vec3d(high));
        }
        return *known;
    }

    /// Appends a copy of a mesh; `matrix` leads to the scene's space, which is relative to its origin. Primitives that
    /// have the same attributes share their vertices. `material_of(primitive)` gives a material's index.
    /// throws lambent::Error on a vertex index out of range
    template <class MaterialOf>
    void add(int mesh, const Mat4d& matrix, MaterialOf&& material_of) {
        const auto& all = primitives(mesh);
        VertexRanges ranges;
        for (std::size_t k = 0; k < all.size(); ++k) {
            if (!gltf_has_triangles(all[k])) continue;
            const auto [range, added] = ranges.emplace(all[k].attributes, scene_.positions.size());
            if (added) add_vertices(all[k], matrix, place(mesh, k));
            add_triangles(all[k], range->second, mirrored(matrix), material_of(all[k]), place(mesh, k));
        }
    }

    /// Attributes end with the last primitive to have them; fills them up to the number of positions.
    void complete() {
        const auto fill = [&](auto& values, const auto& missing) {
            if (!values.empty()) values.resize(scene_.positions.size(), missing);
        };
        fill(scene_.normals, Vec3f(0));
        fill(scene_.tangents, Vec4f(0));
        fill(scene_.texcoords, Vec2f(0));
        fill(scene_.texcoords1, Vec2f(0));
        fill(scene_.colors, Vec4f(1));
    }

private:
    using VertexRanges = std::map<std::map<std::string, int>, std::size_t>;

    /// Bits of the component of largest magnitude, in the order of the numbers; those that are not finite come last.
    static constexpr std::uint32_t infinite = 0x7f800000u;
    template <class V>
    static std::uint32_t largest_magnitude(const V& v) {
        std::uint32_t largest = 0;
        for (int c = 0; c < V::length(); ++c) largest = std::max(largest, std::bit_cast<std::uint32_t>(v[c]) & 0x7fffffffu);
        return largest;
    }

    const std::vector<tinygltf::Primitive>& primitives(int mesh) const {
        return model_.meshes[std::size_t(mesh)].primitives;
    }
    static std::string place(int mesh, std::size_t primitive) {
        return "/meshes/" + std::to_string(mesh) + "/primitives/" + std::to_string(primitive);
    }
    [[noreturn]] void refuse(const std::string& where, const std::string& what) const {
        fail(path_ + ": " + where + what);
    }
    static bool mirrored(const Mat4d& m) { return dot(cross(Vec3d(m[0]), Vec3d(m[1])), Vec3d(m[2])) < 0; }

    void add_vertices(const tinygltf::Primitive& p, const Mat4d& matrix, const std::string& where) {
        const std::size_t first = scene_.positions.size();
        const Vec3d x(matrix[0]), y(matrix[1]), z(matrix[2]), shift(matrix[3]);
        const std::size_t count = model_.accessors[std::size_t(p.attributes.at("POSITION"))].count;
        scene_.positions.resize(first + count);
        read_.template for_each<Vec3f>(p.attributes.at("POSITION"), [&](std::size_t i, const Vec3f& v) {
            scene_.positions[first + i] = Vec3<T>(x * double(v.x) + y * double(v.y) + z * double(v.z) + shift);
        });
        // The cofactor matrix is the inverse transpose times the determinant, and exists where that is 0.
        const Directions normal(cross(y, z), cross(z, x), cross(x, y), mirrored(matrix) ? -1 : 1), tangent(x, y, z, 1);
        attribute<Vec3f>(p, "NORMAL", scene_.normals, first, Vec3f(0), where, [&](const Vec3f& v) { return normal(v); });
        attribute<Vec4f>(p, "TANGENT", scene_.tangents, first, Vec4f(0), where, [&](const Vec4f& v) {
            const Vec3f t = tangent(Vec3f(v));
            return t == Vec3f(0) ? Vec4f(0) : Vec4f(t, (v.w < 0) == mirrored(matrix) ? 1.0f : -1.0f);
        });
        const auto same = [](const auto& v) { return v; };
        attribute<Vec2f>(p, "TEXCOORD_0", scene_.texcoords, first, Vec2f(0), where, same);
        attribute<Vec2f>(p, "TEXCOORD_1", scene_.texcoords1, first, Vec2f(0), where, same);
        attribute<Vec4f>(p, "COLOR_0", scene_.colors, first, Vec4f(1), where, same);
    }

    /// Turns directions by the columns of a matrix, whatever its scale, and makes them unit; 0 stays 0.
    struct Directions {
        Vec3f x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};

        Directions(const Vec3d& a, const Vec3d& b, const Vec3d& c, double sign) {
            const double size = std::max({max_component(abs(a)), max_component(abs(b)), max_component(abs(c))});
            if (!(size > 0) || !is_finite(size)) return;
            x = Vec3f(a * (sign / size));
            y = Vec3f(b * (sign / size));
            z = Vec3f(c * (sign / size));
        }
        Vec3f operator()(const Vec3f& v) const {
            const Vec3f turned = x * v.x + y * v.y + z * v.z;
            const float square = dot(turned, turned);
            if (std::abs(square - 1) < 1e-6f) return turned;
            const float size = std::sqrt(square);
            return size > 0 && is_finite(size) ? turned / size : Vec3f(0);
        }
    };

    /// Appends an attribute to an array that starts with the first primitive to have it.
    template <class V, class F>
    void attribute(const tinygltf::Primitive& p, const char* name, std::vector<V>& all, std::size_t first, const V& missing,
                   const std::string& where, F&& changed) {
        const auto it = p.attributes.find(name);
        if (it == p.attributes.end()) return;
        all.resize(first, missing);
        all.reserve(scene_.positions.capacity());
        std::size_t bad = 0;
        read_.template for_each<V>(it->second, [&](std::size_t, const V& v) {
            const bool finite = largest_magnitude(v) < infinite;
            bad += finite ? 0u : 1u;
            all.push_back(finite ? V(changed(v)) : missing);
        });
        notes_.add("normals, tangents, texture coordinates or colours are not finite and were replaced", where, bad);
    }

    void add_triangles(const tinygltf::Primitive& p, std::size_t first, bool turned, std::uint32_t material,
                       const std::string& where) {
        const std::size_t corners = gltf_corner_count(model_, p), count = gltf_triangle_count(model_, p);
        if (p.mode <= TINYGLTF_MODE_TRIANGLES)
            notes_.add("vertices at the end of triangle lists make no triangle", where, corners % 3);
        const std::size_t vertices = model_.accessors[std::size_t(p.attributes.at("POSITION"))].count;
        const auto offset = std::uint32_t(first);
        std::uint32_t largest = 0;
        const auto append = [&](auto&& corner) {
            for (std::size_t i = 0; i < count; ++i) {
                UVec3 t = gltf_triangle(p.mode, i, corner);
                largest = std::max(largest, std::max(t.x, std::max(t.y, t.z)));
                if (turned) std::swap(t.y, t.z); // the front stays the front
                scene_.triangles.push_back(t + offset);
            }
        };
        if (p.indices < 0) {
            append([](std::size_t i) { return std::uint32_t(i); });
        } else {
            read_.with_indices(p.indices, [&](auto&& at) {
                append(at);
                if (count > 0 && largest >= vertices) refuse_index(at, corners, vertices, where);
            });
        }
        scene_.triangle_materials.resize(scene_.triangles.size(), material);
    }

    template <class At>
    [[noreturn]] void refuse_index(const At& at, std::size_t corners, std::size_t vertices, const std::string& where) const {
        std::size_t i = 0;
        while (i + 1 < corners && at(i) < vertices) ++i;
        refuse(where, "/indices: element " + std::to_string(i) + " is vertex " + std::to_string(at(i)) + " of " +
                          std::to_string(vertices));
    }

    const GltfModel& model_;
    GltfAccessors read_;
    const std::string& path_;
    Scene<T>& scene_;
    Notes& notes_;
    std::vector<std::optional<Bounds3<double>>> bounds_;
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
