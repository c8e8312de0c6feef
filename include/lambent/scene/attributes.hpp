#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec.hpp>
#include <lambent/material/standard.hpp>
#include <lambent/scene/scene.hpp>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

/// What a scene's arrays say about a point of a triangle: interpolated, and looked up in images.
namespace lambent {
inline namespace LAMBENT_ABI {

/// What textures are looked up with at a point, and the colour that multiplies the base colour.
struct Attributes {
    Vec2f texcoord[2] = {Vec2f(0), Vec2f(0)};
    Vec4f color{1};
};

/// `values` at barycentric coordinates (u, v) of triangle t.
template <class V, class T>
V interpolate(const std::vector<V>& values, const UVec3& t, T u, T v) {
    const float b = float(u), c = float(v);
    return values[t[0]] * (1 - b - c) + values[t[1]] * b + values[t[2]] * c;
}

/// What the vertices of a triangle hold, at barycentric coordinates (u, v).
template <class T>
Attributes attributes_at(const Scene<T>& scene, std::uint32_t triangle, T u, T v) {
    Attributes a;
    const UVec3& t = scene.triangles[triangle];
    if (!scene.texcoords.empty()) a.texcoord[0] = interpolate(scene.texcoords, t, u, v);
    if (!scene.texcoords1.empty()) a.texcoord[1] = interpolate(scene.texcoords1, t, u, v);
    if (!scene.colors.empty()) a.color = interpolate(scene.colors, t, u, v);
    return a;
}

/// Linear RGBA of a texture that has an image.
template <class T>
Vec4f look_up(const Scene<T>& scene, const Texture& texture, const Attributes& a) {
    return texture.sample(scene.images[std::size_t(texture.image)], a.texcoord[texture.set]);
}

/// Linear reflectance in [0, 1], with texture, if the scene has any, and vertex colour.
template <bool textures = true, class T>
Vec3f base_color_at(const Scene<T>& scene, const Material& m, const Attributes& a) {
    Vec3f color = m.base_color * Vec3f(a.color);
    if constexpr (textures)
        if (m.base_color_texture) color *= Vec3f(look_up(scene, m.base_color_texture, a));
    return clamp(color, 0.0f, 1.0f);
}

/// Radiance of a material's lit side.
template <bool textures = true, class T>
Vec3f emission_at(const Scene<T>& scene, const Material& m, const Attributes& a) {
    if constexpr (textures)
        if (m.emission_texture) return m.emission * Vec3f(look_up(scene, m.emission_texture, a));
    return m.emission;
}

/// What a material is at a point, seen from its front or not.
template <class T>
StandardPoint<T> standard_point(const Scene<T>& scene, const Material& m, const Attributes& a, bool front) {
    StandardPoint<T> p;
    p.base_color = Vec3<T>(base_color_at(scene, m, a));
    if (m.diffuse()) return p;
    p.metallic = T(m.metallic);
    p.roughness = T(m.roughness);
    if (m.metallic_roughness_texture) {
        const Vec4f t = look_up(scene, m.metallic_roughness_texture, a);
        p.roughness *= T(t.y);
        p.metallic *= T(t.z);
    }
    p.ior = T(m.ior);
    p.specular = T(m.specular);
    if (m.specular_texture) p.specular *= T(look_up(scene, m.specular_texture, a).w);
    p.specular_color = Vec3<T>(m.specular_color);
    if (m.specular_color_texture) p.specular_color *= Vec3<T>(Vec3f(look_up(scene, m.specular_color_texture, a)));
    p.transmission = T(m.transmission);
    if (m.transmission_texture) p.transmission *= T(look_up(scene, m.transmission_texture, a).x);
    p.thin = !(m.thickness > 0);
    p.front = front;
    p.compensated = scene.compensated;
    p.clearcoat = T(m.clearcoat);
    if (m.clearcoat_texture) p.clearcoat *= T(look_up(scene, m.clearcoat_texture, a).x);
    p.clearcoat_roughness = T(m.clearcoat_roughness);
    if (m.clearcoat_roughness_texture) p.clearcoat_roughness *= T(look_up(scene, m.clearcoat_roughness_texture, a).y);
    p.sheen_color = Vec3<T>(m.sheen_color);
    if (m.sheen_color_texture) p.sheen_color *= Vec3<T>(Vec3f(look_up(scene, m.sheen_color_texture, a)));
    p.sheen_roughness = T(m.sheen_roughness);
    if (m.sheen_roughness_texture) p.sheen_roughness *= T(look_up(scene, m.sheen_roughness_texture, a).w);
    return p;
}

/// Extinction per metre of the volume that a surface of the material bounds; 0 for sheets and clear glass.
inline Vec3f extinction_of(const Material& m) {
    if (!(m.transmission > 0) || !(m.thickness > 0) || !is_finite(m.attenuation_distance)) return Vec3f(0);
    return -log(max(m.attenuation_color, Vec3f(1e-6f))) / m.attenuation_distance;
}

/// The chance, in [0, 1], that there is a surface: 0 or 1 but for AlphaMode::blend.
template <class T>
float coverage_at(const Scene<T>& scene, const Material& m, const Attributes& a) {
    if (m.alpha_mode == AlphaMode::opaque) return 1;
    float alpha = m.alpha * a.color.w;
    if (m.base_color_texture) alpha *= look_up(scene, m.base_color_texture, a).w;
    if (m.alpha_texture) alpha *= look_up(scene, m.alpha_texture, a).x;
    if (m.alpha_mode == AlphaMode::mask) return alpha >= m.alpha_cutoff ? 1.0f : 0.0f;
    return alpha > 0 ? std::fmin(alpha, 1.0f) : 0.0f;
}

/// Unit tangent of a triangle, at right angles to unit normal n, along growing u of a texture's own coordinates; w is
/// the sign of the bitangent, which runs up the image. 0 where the coordinates do not tell.
template <class T>
Vec4f triangle_tangent(const Scene<T>& scene, std::uint32_t triangle, const Texture& texture, const Vec3f& n) {
    const UVec3& t = scene.triangles[triangle];
    const std::vector<Vec2f>& texcoords = texture.set == 0 ? scene.texcoords : scene.texcoords1;
    if (texcoords.empty()) return Vec4f(0);
    const Vec2f uv0 = texture.transformed(texcoords[t[0]]);
    const Vec2f a = texture.transformed(texcoords[t[1]]) - uv0, b = texture.transformed(texcoords[t[2]]) - uv0;
    const Vec3f e(scene.positions[t[1]] - scene.positions[t[0]]), f(scene.positions[t[2]] - scene.positions[t[0]]);
    const float turn = a.x * b.y - a.y * b.x;
    Vec3f along = e * b.y - f * a.y;
    if (turn < 0) along = -along;
    along -= n * dot(n, along);
    const float size = length(along);
    if (turn == 0 || !(size > 0) || !is_finite(size)) return Vec4f(0);
    const bool facing = dot(cross(e, f), n) >= 0;
    return Vec4f(along / size, (turn < 0) == facing ? 1.0f : -1.0f);
}

/// Unit normal `n` of a point, from interpolated normals on the triangle's front side, bent by the material's normal
/// map. Tangents are the scene's, or the triangle's where it has none.
template <class T>
Vec3f mapped_normal(const Scene<T>& scene, std::uint32_t triangle, T u, T v, const Material& m, const Attributes& a,
                    const Vec3f& n) {
    Vec4f tangent(0);
    if (!scene.tangents.empty()) {
        const UVec3& t = scene.triangles[triangle];
        // Corners of different handedness, or without a tangent, leave it to the triangle.
        const float w = scene.tangents[t[0]].w;
        if (w != 0 && scene.tangents[t[1]].w == w && scene.tangents[t[2]].w == w) {
            Vec3f along(interpolate(scene.tangents, t, u, v));
            along -= n * dot(n, along);
            const float size = length(along);
            if (size > 1e-6f) tangent = Vec4f(along / size, w);
        }
    }
    if (tangent.w == 0) tangent = triangle_tangent(scene, triangle, m.normal_texture, n);
    if (tangent.w == 0) return n;
    Vec3f local = 2.0f * Vec3f(look_up(scene, m.normal_texture, a)) - 1.0f;
    local.x *= m.normal_scale;
    local.y *= m.normal_scale;
    const Vec3f along(tangent), up = cross(n, along) * tangent.w;
    const Vec3f bent = along * local.x + up * local.y + n * local.z;
    const float size = length(bent);
    return size > 0 ? bent / size : n;
}

/// Gives vertices of normal-mapped triangles that have a normal but no tangent one of their own: the mean of those of
/// the triangles that share them, weighted by their angles, as MikkTSpace does it where vertices are already split at
/// the seams. Vertices between triangles of both handednesses get none.
/// source  M. Mikkelsen, Simulation of Wrinkled Surfaces Revisited (2008)
template <class T>
void add_tangents(Scene<T>& scene) {
    const auto mapped = [](const Material& m) { return bool(m.normal_texture); };
    if (scene.normals.empty() || std::none_of(scene.materials.begin(), scene.materials.end(), mapped)) return;
    std::vector<Vec4f> sums;
    std::vector<char> mixed;
    for (std::size_t i = 0; i < scene.triangles.size(); ++i) {
        const Material& m = scene.materials[scene.triangle_materials[i]];
        if (!m.normal_texture) continue;
        if (sums.empty()) {
            sums.assign(scene.positions.size(), Vec4f(0));
            mixed.assign(scene.positions.size(), 0);
        }
        const UVec3& t = scene.triangles[i];
        for (int k = 0; k < 3; ++k) {
            const std::uint32_t vertex = t[k];
            const Vec3f n = scene.normals[vertex];
            if (n == Vec3f(0)) continue;
            const Vec4f tangent = triangle_tangent(scene, std::uint32_t(i), m.normal_texture, n);
            if (tangent.w == 0) continue;
            const Vec3f corner(scene.positions[vertex]);
            const Vec3f p = Vec3f(scene.positions[t[(k + 1) % 3]]) - corner;
            const Vec3f q = Vec3f(scene.positions[t[(k + 2) % 3]]) - corner;
            const float angle = std::atan2(length(cross(p, q)), dot(p, q));
            Vec4f& sum = sums[vertex];
            if (sum.w * tangent.w < 0) mixed[vertex] = 1;
            sum += Vec4f(Vec3f(tangent) * angle, tangent.w);
        }
    }
    if (sums.empty()) return;
    scene.tangents.resize(scene.positions.size(), Vec4f(0));
    for (std::size_t i = 0; i < sums.size(); ++i) {
        Vec4f& tangent = scene.tangents[i];
        const float size = length(Vec3f(sums[i]));
        if (tangent.w == 0 && mixed[i] == 0 && size > 0)
            tangent = Vec4f(Vec3f(sums[i]) / size, sums[i].w > 0 ? 1.0f : -1.0f);
    }
}

} // namespace LAMBENT_ABI
} // namespace lambent
