#pragma once
#include "../examples/support/command_line.hpp"
#include <lambent/scene/scene.hpp>
#include <string>
#include <vector>

/// A square lamp that shines down, for scenes whose files have no light.
struct Lamp {
    lambent::Vec3d center{0};
    double side = 0, radiance = 0;
};

/// "x,y,z,side,radiance"; throws UsageError.
inline Lamp to_lamp(const std::string& text) {
    const std::vector<double> n = to_numbers(text, 5);
    if (!(n[3] > 0) || !(n[4] > 0)) throw UsageError("side and radiance must be > 0");
    return {{n[0], n[1], n[2]}, n[3], n[4]};
}

/// Adds its two triangles as the scene's last ones.
template <class T>
void add_lamp(lambent::Scene<T>& scene, const Lamp& lamp) {
    using namespace lambent;
    Material m;
    m.name = "lamp";
    m.base_color = Vec3f(0);
    m.specular = 0;
    m.emission = Vec3f(float(lamp.radiance));
    scene.materials.push_back(m);
    const auto first = std::uint32_t(scene.positions.size());
    const double h = lamp.side / 2;
    for (const Vec3d& corner : {Vec3d(-h, 0, -h), Vec3d(h, 0, -h), Vec3d(h, 0, h), Vec3d(-h, 0, h)})
        scene.positions.push_back(Vec3<T>(lamp.center + corner - scene.origin));
    const auto fill = [&](auto& values) {
        if (!values.empty()) values.resize(scene.positions.size());
    };
    fill(scene.normals), fill(scene.tangents), fill(scene.texcoords), fill(scene.texcoords1);
    if (!scene.colors.empty()) scene.colors.resize(scene.positions.size(), Vec4f(1));
    scene.triangles.push_back({first, first + 1, first + 2});
    scene.triangles.push_back({first, first + 2, first + 3});
    scene.triangle_materials.insert(scene.triangle_materials.end(), 2, std::uint32_t(scene.materials.size() - 1));
}
