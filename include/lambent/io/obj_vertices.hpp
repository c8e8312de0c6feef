#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numbers>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// The distinct corners of an OBJ file's faces, in the order of their first use: what becomes a scene's vertices.
/// cost  a corner is found among those of the same v: the first `chained` in a list, further ones in a tree, so that a
///       file that puts a million texture coordinates at one v is read in time
class ObjVertices {
public:
    static constexpr std::uint32_t none = 0xffffffffu;
    static constexpr int chained = 16;

    /// A corner's normal comes from the faces of its smoothing group instead of a vn: this bit, and the group's number.
    static constexpr std::uint32_t smooth = 0x80000000u;
    static constexpr std::uint32_t most_groups = 0x7ffffffeu; ///< so that no group looks like `none`

    struct Corner {
        std::uint32_t v = none, vt = none;
        std::uint32_t normal = none; ///< a vn, or `smooth | group`, or none: flat

        bool smoothed() const { return normal != none && (normal & smooth) != 0; }
        friend auto operator<=>(const Corner&, const Corner&) = default;
    };

    /// Expects so many positions, and vertices.
    void reserve(std::size_t count) {
        first_.reserve(count);
        corners_.reserve(count);
    }

    /// To be called once for every v, before its first use.
    void add_position() { first_.push_back(none); }

    std::size_t size() const { return corners_.size(); }
    bool has_texcoords() const { return has_texcoords_; }
    const Corner& operator[](std::size_t i) const { return corners_[i].corner; }

    /// Index of the vertex of this corner, made on its first use.
    std::uint32_t index_of(const Corner& corner) {
        has_texcoords_ |= corner.vt != none;
        int length = 0;
        for (std::uint32_t i = first_[corner.v]; i != none; i = corners_[i].next, ++length)
            if (corners_[i].corner == corner) return i;
        const std::uint32_t added = std::uint32_t(corners_.size());
        if (length < chained) {
            corners_.push_back({corner, first_[corner.v]});
            first_[corner.v] = added;
            return added;
        }
        const auto [known, is_new] = crowd_.emplace(key(corner), added);
        if (is_new) corners_.push_back({corner, none});
        return known->second;
    }

    /// Which vertex stands for all those of the same v and smoothing group, whatever their texture coordinates.
    std::uint32_t representative(std::uint32_t vertex) const {
        if (!has_texcoords_) return vertex;
        const Corner& corner = corners_[vertex].corner;
        std::uint32_t found = none;
        for (std::uint32_t i = first_[corner.v]; i != none; i = corners_[i].next)
            if (corners_[i].corner.normal == corner.normal) found = i;
        if (found != none) return found;
        return crowd_.lower_bound({corner.v, corner.normal, 0})->second;
    }

private:
    using Key = std::array<std::uint32_t, 3>;
    static Key key(const Corner& c) { return {c.v, c.normal, c.vt}; }

    struct Entry {
        Corner corner;
        std::uint32_t next; ///< the vertex of the same v made before it, or none
    };
    std::vector<Entry> corners_;
    std::vector<std::uint32_t> first_; ///< one a v: the last of its chain made, or none
    std::map<Key, std::uint32_t> crowd_;
    bool has_texcoords_ = false;
};

/// Adds to normals[representative] of each smoothed corner the unit normals of its triangles, weighted by their angles
/// there, and gives all corners of a group at a v the normalised sum; (0, 0, 0) where it vanishes. An angle's share of
/// a polygon's corner adds up over the triangles that the polygon is cut into.
/// normals  one a vertex, (0, 0, 0) for the smoothed ones
/// source   Thürmer, Wüthrich, Computing vertex normals from polygonal facets, J. Graphics Tools 3, 1998
inline void smooth_normals(const ObjVertices& vertices, const std::vector<Vec3d>& positions,
                           const std::vector<UVec3>& triangles, std::vector<Vec3f>& normals) {
    for (const UVec3& t : triangles) {
        if (!vertices[t.x].smoothed() && !vertices[t.y].smoothed() && !vertices[t.z].smoothed()) continue;
        Vec3d p[3];
        for (int k = 0; k < 3; ++k) p[k] = positions[vertices[t[k]].v];
        const Vec3d across = cross(p[1] - p[0], p[2] - p[0]);
        const double area = length(across);
        if (!(area > 0) || !is_finite(area)) continue;
        const Vec3f normal(across / area);
        const auto angle_at = [&](int k) {
            const double along = dot(p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
            const double size = area + std::abs(along); // scaled by it, floats hold both
            return is_finite(size) ? std::atan2(float(area / size), float(along / size)) : 0.0f;
        };
        const float first = angle_at(0), second = angle_at(1);
        const float angles[] = {first, second, std::max(std::numbers::pi_v<float> - first - second, 0.0f)};
        for (int k = 0; k < 3; ++k)
            if (vertices[t[k]].smoothed()) normals[vertices.representative(t[k])] += normal * angles[k];
    }
    for (std::uint32_t i = 0; i < vertices.size(); ++i)
        if (vertices[i].smoothed() && vertices.representative(i) == i) {
            const float size = length(normals[i]);
            // Opposite faces cancel but for rounding.
            normals[i] = size > 1e-5f ? normals[i] / size : Vec3f(0);
        }
    for (std::uint32_t i = 0; i < vertices.size(); ++i)
        if (vertices[i].smoothed()) normals[i] = normals[vertices.representative(i)];
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
