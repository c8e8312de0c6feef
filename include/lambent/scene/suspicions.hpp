#pragma once
#include <lambent/core/bounds.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec.hpp>
#include <lambent/scene/scene.hpp>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// What in a scene is allowed but rarely meant, a sentence each: for people who look for why a picture is wrong.
template <class T>
std::vector<std::string> suspicions(const Scene<T>& scene) {
    std::vector<std::string> out;
    const auto say = [&](std::size_t count, const std::string& what) {
        if (count > 0) out.push_back(std::to_string(count) + " " + what);
    };
    std::vector<char> used_vertex(scene.positions.size(), 0), used_material(scene.materials.size(), 0);
    std::vector<char> uv_needed(scene.materials.size(), 0);
    for (std::size_t m = 0; m < scene.materials.size(); ++m)
        Material::for_each_texture(scene.materials[m], [&](const Texture& t) {
            if (t && (t.set == 0 ? scene.texcoords : scene.texcoords1).empty()) uv_needed[m] = 1;
        });
    std::size_t no_area = 0, against = 0, without_uv = 0;
    for (std::size_t i = 0; i < scene.triangles.size(); ++i) {
        const UVec3& t = scene.triangles[i];
        const std::uint32_t material = scene.triangle_materials[i];
        used_material[material] = 1;
        without_uv += uv_needed[material] != 0 ? 1u : 0u;
        const Vec3d a(scene.positions[t[0]]);
        const Vec3d n = cross(Vec3d(scene.positions[t[1]]) - a, Vec3d(scene.positions[t[2]]) - a);
        if (n == Vec3d(0)) ++no_area;
        bool opposed = !scene.normals.empty();
        for (int k = 0; k < 3; ++k) {
            used_vertex[t[k]] = 1;
            opposed = opposed && dot(Vec3d(scene.normals[t[k]]), n) < 0;
        }
        against += opposed ? 1u : 0u;
    }
    const auto unused = [](const std::vector<char>& used) {
        std::size_t count = 0;
        for (const char u : used) count += u == 0 ? 1u : 0u;
        return count;
    };
    say(no_area, "triangles have no area and are never hit");
    say(against, "triangles whose three vertex normals point to their back side: is their winding turned round?");
    say(without_uv, "triangles have a material with textures but no texture coordinates for them");
    say(unused(used_vertex), "vertices are used by no triangle");
    for (const Sphere<T>& s : scene.spheres) used_material[s.material] = 1;
    say(unused(used_material), "materials are used by no surface");
    std::size_t dark = 0;
    for (const Material& m : scene.materials)
        if (is_black(m.base_color) && !m.emissive() && m.transmission == 0) ++dark;
    say(dark, "materials are black and emit nothing");
    const Bounds3<double> box = scene.bounds();
    if (!box.empty()) {
        const double size = max_component(box.size());
        if (size > 1e5) out.push_back("the scene is " + std::to_string(size / 1000) + " km large: are its units metres?");
        if (size < 1e-3) out.push_back("the scene is " + std::to_string(size * 1000) + " mm large: are its units metres?");
    }
    if (max_component(abs(scene.origin)) > 0)
        out.push_back("the scene is farther from (0, 0, 0) than it is large: stored relative to (" +
                      std::to_string(scene.origin.x) + ", " + std::to_string(scene.origin.y) + ", " +
                      std::to_string(scene.origin.z) + ")");
    return out;
}

} // namespace LAMBENT_ABI
} // namespace lambent
