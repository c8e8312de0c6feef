#pragma once
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <lambent/core/error.hpp>
#include <lambent/scene/camera.hpp>
#include <lambent/scene/scene.hpp>
#include <string>
#include <vector>

/// Whether every surface is Lambert's, without textures: what any renderer understands in the same way.
template <class T>
bool is_diffuse(const lambent::Scene<T>& scene) {
    for (const lambent::Material& m : scene.materials) {
        bool textured = false;
        lambent::Material::for_each_texture(m, [&](const lambent::Texture& t) { textured = textured || bool(t); });
        if (textured || m.metallic > 0 || m.specular > 0 || m.transmission > 0 || m.clearcoat > 0 || m.unlit ||
            m.alpha_mode != lambent::AlphaMode::opaque)
            return false;
    }
    return scene.spheres.empty() && scene.punctual_lights.empty() && scene.colors.empty();
}

/// Writes what peers are given of a scene into `folder`: scene.json and arrays of numbers as they lie in memory.
/// `file` is the glTF file that the first `own_triangles` are from; empty where they are from none.
/// throws lambent::Error where a file cannot be written
template <class T>
void export_scene(const std::filesystem::path& folder, const lambent::Scene<T>& scene, const lambent::Camera& camera,
                  int width, int height, const std::string& file, std::size_t own_triangles) {
    using namespace lambent;
    const auto write = [&](const char* name, const void* data, std::size_t bytes) {
        std::ofstream out(folder / name, std::ios::binary);
        out.write(static_cast<const char*>(data), std::streamsize(bytes));
        require(out.good(), [&] { return (folder / name).string() + ": cannot be written"; });
    };
    const auto write_array = [&](const char* name, const auto& array) {
        write(name, array.data(), array.size() * sizeof array[0]);
    };
    const auto list = [](const auto& v) {
        char text[96];
        std::snprintf(text, sizeof text, "[%.9g, %.9g, %.9g]", double(v.x), double(v.y), double(v.z));
        return std::string(text);
    };
    std::vector<Vec3f> positions;
    for (const Vec3<T>& p : scene.positions) positions.push_back(Vec3f(Vec3d(p) + scene.origin));
    write_array("positions.f32", positions);
    write_array("triangles.u32", scene.triangles);
    write_array("triangle_materials.u32", scene.triangle_materials);

    std::string json = "{\"width\": " + std::to_string(width) + ", \"height\": " + std::to_string(height) +
                       ", \"file\": \"" + file + "\", \"own_triangles\": " + std::to_string(own_triangles) +
                       ", \"diffuse\": " + (is_diffuse(scene) ? "true" : "false") +
                       ",\n \"camera\": {\"eye\": " + list(camera.eye) + ", \"target\": " + list(camera.target) +
                       ", \"up\": " + list(camera.up) + ", \"vertical_fov\": " + std::to_string(camera.vertical_fov) +
                       "},\n \"materials\": [";
    for (std::size_t i = 0; i < scene.materials.size(); ++i) {
        const Material& m = scene.materials[i];
        json += (i > 0 ? ",\n  " : "\n  ") + std::string("{\"name\": \"m") + std::to_string(i) +
                "\", \"color\": " + list(m.base_color) + ", \"emission\": " + list(m.emission) +
                ", \"double_sided\": " + (m.double_sided ? "true" : "false") + "}";
    }
    json += "],\n \"sky\": ";
    const Environment& sky = scene.environment;
    if (sky.black()) {
        json += "null}\n";
    } else {
        std::vector<Vec3f> map = sky.map;
        for (Vec3f& texel : map) texel *= sky.scale;
        if (map.empty()) map.assign(2, sky.scale);
        write_array("sky.f32", map);
        json += "{\"width\": " + std::to_string(sky.map.empty() ? 2 : sky.width) +
                ", \"height\": " + std::to_string(sky.map.empty() ? 1 : sky.height) +
                ", \"rotation\": " + std::to_string(sky.rotation) + "}}\n";
    }
    write("scene.json", json.data(), json.size());
}
