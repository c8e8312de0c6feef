#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec.hpp>
#include <lambent/scene/scene.hpp>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>

/// Scenes made in code: for trying things out without a file.
namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {
template <class T>
std::uint32_t add_material(Scene<T>& scene, const std::string& name, const Vec3f& color, const Vec3f& emission = Vec3f(0)) {
    Material m;
    m.name = name;
    m.base_color = color;
    m.emission = emission;
    scene.materials.push_back(m);
    return std::uint32_t(scene.materials.size() - 1);
}

/// A quad of two triangles, corners counter-clockwise as seen from its front; texture coordinates run over
/// [0, 1]² from the fourth corner.
template <class T>
void add_quad(Scene<T>& scene, const std::array<Vec3d, 4>& corners, std::uint32_t material) {
    const auto first = std::uint32_t(scene.positions.size());
    static constexpr float uv[4][2] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
    for (std::size_t i = 0; i < 4; ++i) {
        scene.positions.push_back(Vec3<T>(corners[i]));
        scene.texcoords.push_back({uv[i][0], uv[i][1]});
    }
    scene.triangles.push_back({first, first + 1, first + 2});
    scene.triangles.push_back({first, first + 2, first + 3});
    scene.triangle_materials.insert(scene.triangle_materials.end(), 2, material);
}

/// The six faces of the box [low, high], turned by `angle` (radians) about the vertical through its centre;
/// the fronts look outwards, or inwards for a room. Faces in the order -x +x -y +y -z +z, a material each.
enum class BoxFront : std::uint8_t { outside, inside };
template <class T>
void add_box(Scene<T>& scene, const Vec3d& low, const Vec3d& high, double angle, BoxFront front,
             const std::array<std::uint32_t, 6>& materials) {
    const Vec3d center = (low + high) / 2.0;
    const double c = std::cos(angle), s = std::sin(angle);
    const auto corner = [&](int i) {
        const Vec3d p((i & 1) != 0 ? high.x : low.x, (i & 2) != 0 ? high.y : low.y, (i & 4) != 0 ? high.z : low.z);
        const Vec3d d = p - center;
        return center + Vec3d(c * d.x + s * d.z, d.y, -s * d.x + c * d.z);
    };
    static constexpr int faces[6][4] = {{0, 4, 6, 2}, {5, 1, 3, 7}, {0, 1, 5, 4}, {6, 7, 3, 2}, {1, 0, 2, 3}, {4, 5, 7, 6}};
    for (std::size_t f = 0; f < 6; ++f) {
        std::array<Vec3d, 4> q;
        for (std::size_t i = 0; i < 4; ++i) q[i] = corner(faces[f][front == BoxFront::outside ? i : 3 - i]);
        add_quad(scene, q, materials[f]);
    }
}
} // namespace detail

/// `builtin:cornell`: a Cornell box of one metre with two boxes in it, a chequered back wall and a square light
/// in a hole of the ceiling; open towards the camera.
template <class T = float>
Scene<T> cornell_scene() {
    Scene<T> scene;
    const auto white = detail::add_material(scene, "white", Vec3f(0.73f));
    const auto red = detail::add_material(scene, "red", {0.63f, 0.065f, 0.05f});
    const auto green = detail::add_material(scene, "green", {0.14f, 0.45f, 0.091f});
    const auto chequered = detail::add_material(scene, "chequered", Vec3f(1));
    const auto light = detail::add_material(scene, "light", Vec3f(0), {17, 12, 4.5f});

    Image tiles;
    tiles.name = "chequer";
    tiles.width = tiles.height = 256;
    tiles.rgba.resize(256 * 256 * 4, 255);
    for (std::size_t y = 0; y < 256; ++y)
        for (std::size_t x = 0; x < 256; ++x) {
            const bool dark = ((x / 32 + y / 32) & 1) != 0;
            const std::array<std::uint8_t, 3> rgb = dark ? std::array<std::uint8_t, 3>{70, 110, 170}
                                                         : std::array<std::uint8_t, 3>{225, 220, 205};
            for (std::size_t k = 0; k < 3; ++k) tiles.rgba[4 * (y * 256 + x) + k] = rgb[k];
        }
    scene.images.push_back(tiles);
    scene.materials[chequered].base_color_texture.image = 0;

    using Q = std::array<Vec3d, 4>;
    detail::add_quad(scene, Q{{{0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {1, 0, 0}}}, white);     // floor
    detail::add_quad(scene, Q{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}}, chequered); // back
    detail::add_quad(scene, Q{{{0, 0, 1}, {0, 0, 0}, {0, 1, 0}, {0, 1, 1}}}, red);       // left
    detail::add_quad(scene, Q{{{1, 0, 0}, {1, 0, 1}, {1, 1, 1}, {1, 1, 0}}}, green);     // right
    // The ceiling, around the hole that the light fills.
    const double a = 0.38, b = 0.62;
    detail::add_quad(scene, Q{{{0, 1, 0}, {1, 1, 0}, {1, 1, a}, {0, 1, a}}}, white);
    detail::add_quad(scene, Q{{{0, 1, b}, {1, 1, b}, {1, 1, 1}, {0, 1, 1}}}, white);
    detail::add_quad(scene, Q{{{0, 1, a}, {a, 1, a}, {a, 1, b}, {0, 1, b}}}, white);
    detail::add_quad(scene, Q{{{b, 1, a}, {1, 1, a}, {1, 1, b}, {b, 1, b}}}, white);
    detail::add_quad(scene, Q{{{a, 1, a}, {b, 1, a}, {b, 1, b}, {a, 1, b}}}, light);
    const auto all = [&](std::uint32_t m) { return std::array<std::uint32_t, 6>{m, m, m, m, m, m}; };
    detail::add_box(scene, {0.18, 0, 0.2}, {0.47, 0.6, 0.49}, 0.3, detail::BoxFront::outside, all(white));
    detail::add_box(scene, {0.52, 0, 0.52}, {0.82, 0.3, 0.82}, -0.29, detail::BoxFront::outside, all(white));
    scene.cameras.push_back({{0.5, 0.5, 2.4}, {0.5, 0.5, 0}, {0, 1, 0}, 39.3, "front"});
    return scene;
}

/// `builtin:room`: the room of the seed document, three spheres under sphere lights that stick half out of the
/// ceiling. The original has one light; more share its power in a row along the room.
template <class T = float>
Scene<T> room_scene(int lights = 1) {
    Scene<T> scene;
    const auto grey = detail::add_material(scene, "grey", Vec3f(0.5f));
    const auto red = detail::add_material(scene, "red", {1, 0, 0});
    const auto yellow = detail::add_material(scene, "yellow", {1, 1, 0});
    const auto blue = detail::add_material(scene, "blue", {0, 0, 1});
    const auto green = detail::add_material(scene, "green", {0, 1, 0});
    const auto light = detail::add_material(scene, "light", Vec3f(0), Vec3f(200.0f / float(lights)));
    detail::add_box(scene, {0, 0, 0}, {5, 5, 10}, 0, detail::BoxFront::inside, {red, yellow, grey, grey, grey, grey});
    scene.spheres = {{{2, T(0.7), T(2.5)}, T(0.5), red}, {{3, T(0.7), T(3.5)}, T(0.5), blue},
                     {{4, T(0.7), T(4.5)}, T(0.5), green}};
    for (int i = 0; i < lights; ++i)
        scene.spheres.push_back({{T(2.5), 5, T(10 * (i + 0.5) / lights)}, T(0.5), light});
    scene.cameras.push_back({{2.5, 1, 0.3}, {2.5, 1, 1.3}, {0, 1, 0}, 53.13010235415598, "seed"});
    return scene;
}

/// `builtin:door`: a room lit from the next one alone, through a slit of 0.25 m. The light is on the far side of
/// the wall between them, so that no point in front of the camera sees it.
template <class T = float>
Scene<T> door_scene() {
    Scene<T> scene;
    const auto white = detail::add_material(scene, "white", Vec3f(0.75f));
    const auto warm = detail::add_material(scene, "warm", {0.7f, 0.35f, 0.2f});
    const auto blue = detail::add_material(scene, "blue", {0.25f, 0.4f, 0.65f});
    const auto light = detail::add_material(scene, "light", Vec3f(0), {120, 105, 80});
    const auto add = [&](const Vec3d& low, const Vec3d& high, std::uint32_t material, double angle = 0) {
        detail::add_box(scene, low, high, angle, detail::BoxFront::outside,
                        {material, material, material, material, material, material});
    };
    detail::add_box(scene, {0, 0, 0}, {7, 2.5, 4}, 0, detail::BoxFront::inside, {warm, blue, white, white, white, white});
    // The wall, around the light and with the slit. It reaches into the room's sides, so that no crack is left.
    const double x0 = 4, x1 = 4.125, low = -0.125, high = 2.625;
    add({x0, low, low}, {x1, high, 0.75}, white);
    add({x0, low, 1.5}, {x1, high, 2.5}, white);
    add({x0, low, 2.75}, {x1, high, 4.125}, white);
    add({x0, low, 0.75}, {x1, 1, 1.5}, white);
    add({x0, 1.75, 0.75}, {x1, high, 1.5}, white);
    detail::add_box(scene, {x0, 1, 0.75}, {x1, 1.75, 1.5}, 0, detail::BoxFront::outside,
                    {white, light, white, white, white, white});
    add({2, 0, 0.7}, {2.7, 0.75, 1.4}, blue, 0.4);
    add({1.2, 0, 2.4}, {1.6, 1.4, 2.8}, white, -0.3);
    scene.cameras.push_back({{0.3, 1.5, 3.7}, {4, 0.9, 1.2}, {0, 1, 0}, 60, "by the wall"});
    return scene;
}

} // namespace LAMBENT_ABI
} // namespace lambent
