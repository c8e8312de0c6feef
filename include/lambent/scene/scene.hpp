#pragma once
#include <lambent/core/bounds.hpp>
#include <lambent/core/error.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec.hpp>
#include <lambent/light/punctual_light.hpp>
#include <lambent/scene/camera.hpp>
#include <lambent/scene/material.hpp>
#include <lambent/scene/sphere.hpp>
#include <lambent/scene/texture.hpp>
#include <cstdint>
#include <string>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Light from infinitely far away: a constant, or a latitude-longitude map times `scale`. Direction d looks
/// up u = 0.5 + atan2(d.z, d.x) / 2π, v = acos(d.y) / π; row 0 is up.
struct Environment {
    Vec3f scale{0};          ///< radiance of the constant sky, or factor of the map; 0 = no environment
    int width = 0, height = 0;
    std::vector<Vec3f> map;  ///< linear radiance, width · height; empty for a constant sky
    double rotation = 0;     ///< degrees about +y

    bool black() const { return is_black(scale); }
};

/// Everything there is to render, as flat arrays that refer to each other by index. Fill it by hand, by
/// add_mesh() or by a loader; it knows no file. Geometry is stored relative to `origin`, which loaders set
/// so that scenes far from (0, 0, 0) keep their precision; camera, lights and everything that users see
/// stay in their own coordinates.
template <class T>
struct Scene {
    std::vector<Vec3<T>> positions;  ///< relative to origin
    std::vector<Vec3f> normals;      ///< one a position, unit; (0, 0, 0) = take the triangle's own; or empty
    std::vector<Vec4f> tangents;     ///< one a position: unit, w = ±1 the bitangent's sign; 0 = the triangle's; or empty
    std::vector<Vec2f> texcoords;    ///< one a position, or empty
    std::vector<Vec2f> texcoords1;   ///< a second set: one a position, or empty
    std::vector<Vec4f> colors;       ///< one a position, linear, multiplies base_color and alpha; or empty
    std::vector<UVec3> triangles;    ///< indices into positions, counter-clockwise from the front
    std::vector<std::uint32_t> triangle_materials; ///< one a triangle
    std::vector<Sphere<T>> spheres;  ///< relative to origin
    std::vector<Material> materials;
    std::vector<Image> images;
    std::vector<PunctualLight> punctual_lights;
    Environment environment;
    bool compensated = false;        ///< StandardPoint::compensated, of all materials
    std::vector<Camera> cameras;
    Vec3d origin{0};
    std::vector<std::string> notes;  ///< what a loader wants the user to know, a sentence each

    /// Bounds of triangles and spheres in the user's coordinates.
    Bounds3<double> bounds() const {
        Bounds3<double> box;
        for (const UVec3& t : triangles)
            for (int k = 0; k < 3; ++k) {
                const Vec3d p = Vec3d(positions[t[k]]) + origin;
                if (is_finite(p)) box.add(p);
            }
        for (const Sphere<T>& s : spheres) {
            box.add(Vec3d(s.center) + origin - Vec3d(double(s.radius)));
            box.add(Vec3d(s.center) + origin + Vec3d(double(s.radius)));
        }
        return box;
    }

    /// throws lambent::Error naming the first index or array that does not fit
    void validate() const {
        const auto fits = [&](std::size_t size, const char* what) {
            require(size == 0 || size == positions.size(), [&] {
                return std::string("Scene: ") + std::to_string(size) + " " + what + " for " +
                       std::to_string(positions.size()) + " positions";
            });
        };
        fits(normals.size(), "normals");
        fits(tangents.size(), "tangents");
        fits(texcoords.size(), "texcoords");
        fits(texcoords1.size(), "texcoords1");
        fits(colors.size(), "colors");
        require(triangle_materials.size() == triangles.size(), [&] {
            return "Scene: " + std::to_string(triangle_materials.size()) + " triangle materials for " +
                   std::to_string(triangles.size()) + " triangles";
        });
        const auto inside = [&](std::size_t index, std::size_t size, const char* what) {
            require(index < size, [&] {
                return std::string("Scene: ") + what + " " + std::to_string(index) + " of " + std::to_string(size);
            });
        };
        for (const UVec3& t : triangles)
            for (int k = 0; k < 3; ++k) inside(t[k], positions.size(), "vertex index");
        for (const std::uint32_t m : triangle_materials) inside(m, materials.size(), "material index");
        for (const Sphere<T>& s : spheres) inside(s.material, materials.size(), "material index");
        for (const Material& m : materials)
            Material::for_each_texture(m, [&](const Texture& t) {
                if (t) inside(std::size_t(t.image), images.size(), "image index");
            });
        for (const Image& i : images)
            require(i.width >= 0 && i.height >= 0 &&
                        i.rgba.size() == std::size_t(i.width) * std::size_t(i.height) * 4,
                    [&] { return "Scene: image '" + i.name + "' has the wrong number of bytes"; });
        require(environment.map.size() == std::size_t(environment.width) * std::size_t(environment.height),
                "Scene: the environment's size does not fit its pixels");
    }
};

using Scenef = Scene<float>; ///< in single precision

} // namespace LAMBENT_ABI
} // namespace lambent
