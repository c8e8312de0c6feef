#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <lambent/scene/builtin.hpp>
#include <string>

/// Scenes for denoisers, each of one kind of difficulty. Metres, y up; the camera is the scene's own.
namespace denoise_scenes {

using namespace lambent;
using Builder = Scene<float>;

/// A number in [0, 1) for a cell of a grid.
inline float chance(int x, int y) {
    std::uint32_t h = std::uint32_t(x) * 374761393u + std::uint32_t(y) * 668265263u + 12345u;
    h = (h ^ (h >> 13)) * 1274126177u;
    return float((h ^ (h >> 16)) >> 8) * 0x1p-24f;
}

/// chance() interpolated over cells × cells that repeat.
inline float cloud(float u, float v, int cells) {
    const float x = u * float(cells), y = v * float(cells);
    const int x0 = int(x), y0 = int(y), x1 = (x0 + 1) % cells, y1 = (y0 + 1) % cells;
    const float a = x - float(x0), b = y - float(y0);
    const float above = chance(x0, y0) * (1 - a) + chance(x1, y0) * a;
    return above * (1 - b) + (chance(x0, y1) * (1 - a) + chance(x1, y1) * a) * b;
}

/// An image of size × size, of color(u, v) in sRGB. Returns its index.
template <class Color>
std::int32_t paint(Builder& scene, int size, Color&& color) {
    Image image;
    image.width = image.height = size;
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
            const Vec3f c = color((float(x) + 0.5f) / float(size), (float(y) + 0.5f) / float(size));
            for (int k = 0; k < 3; ++k)
                image.rgba.push_back(std::uint8_t(std::lround(255 * std::clamp(c[k], 0.0f, 1.0f))));
            image.rgba.push_back(255);
        }
    scene.images.push_back(image);
    return std::int32_t(scene.images.size() - 1);
}

inline std::int32_t chequer(Builder& scene, const Vec3f& a, const Vec3f& b) {
    return paint(scene, 64, [&](float u, float v) { return (u < 0.5f) == (v < 0.5f) ? a : b; });
}

inline std::int32_t planks(Builder& scene) {
    return paint(scene, 256, [](float u, float v) {
        const int board = int(u * 6);
        const float across = u * 6 - float(board), along = v * 2 + chance(board, 7);
        if (across < 0.04f || along - std::floor(along) < 0.015f) return Vec3f(0.2f, 0.13f, 0.08f);
        const float grain = 0.75f + 0.15f * chance(board, int(along)) + 0.2f * cloud(u, v / 8, 64);
        return Vec3f(0.75f, 0.55f, 0.36f) * grain;
    });
}

inline std::int32_t bricks(Builder& scene, const Vec3f& color) {
    return paint(scene, 256, [&](float u, float v) {
        const int row = int(v * 8);
        const float x = u * 4 + (row % 2 == 0 ? 0.5f : 0.0f);
        const bool joint = v * 8 - float(row) < 0.1f || x - std::floor(x) < 0.05f;
        const float shade = 0.75f + 0.3f * chance(int(x) % 4, row) + 0.15f * cloud(u, v, 64);
        return joint ? Vec3f(0.7f, 0.68f, 0.64f) : color * shade;
    });
}

inline std::int32_t stripes(Builder& scene, const Vec3f& a, const Vec3f& b) {
    return paint(scene, 64, [&](float u, float) { return int(u * 4) % 2 == 0 ? a : b; });
}

inline std::uint32_t add(Builder& scene, const Material& m) {
    scene.materials.push_back(m);
    return std::uint32_t(scene.materials.size() - 1);
}

inline Material plain(const Vec3f& color) {
    Material m;
    m.base_color = color;
    return m;
}

/// Shows the image so many times along each side.
inline Material textured(std::int32_t image, float times) {
    Material m = plain(Vec3f(1));
    m.base_color_texture.image = image;
    m.base_color_texture.row_u = {times, 0};
    m.base_color_texture.row_v = {0, times};
    return m;
}

inline Material plastic(Material m, float roughness) {
    m.specular = 1;
    m.roughness = roughness;
    return m;
}

inline Material metal(const Vec3f& color, float roughness) {
    Material m = plain(color);
    m.metallic = m.specular = 1;
    m.roughness = roughness;
    return m;
}

inline Material lamp(const Vec3f& radiance) {
    Material m = plain(Vec3f(0));
    m.emission = radiance;
    return m;
}

inline Material glass(const Vec3f& color) {
    Material m = plastic(plain(color), 0);
    m.transmission = m.thickness = 1;
    return m;
}

inline void floor(Builder& scene, double x0, double z0, double x1, double z1, double y, std::uint32_t m) {
    detail::add_quad(scene, {{{x0, y, z0}, {x0, y, z1}, {x1, y, z1}, {x1, y, z0}}}, m);
}
/// Faces down.
inline void ceiling(Builder& scene, double x0, double z0, double x1, double z1, double y, std::uint32_t m) {
    detail::add_quad(scene, {{{x0, y, z0}, {x1, y, z0}, {x1, y, z1}, {x0, y, z1}}}, m);
}
/// Faces +z.
inline void wall(Builder& scene, double x0, double y0, double x1, double y1, double z, std::uint32_t m) {
    detail::add_quad(scene, {{{x0, y0, z}, {x1, y0, z}, {x1, y1, z}, {x0, y1, z}}}, m);
}
inline void box(Builder& scene, const Vec3d& low, const Vec3d& high, std::uint32_t m, double angle = 0) {
    detail::add_box(scene, low, high, angle, detail::BoxFront::outside, {m, m, m, m, m, m});
}
/// A room seen from within: its walls at -x, +x, the floor, the ceiling, the walls at -z and +z.
inline void room(Builder& scene, const Vec3d& size, const std::array<std::uint32_t, 6>& m) {
    detail::add_box(scene, {0, 0, 0}, size, 0, detail::BoxFront::inside, m);
}
inline void sphere(Builder& scene, const Vec3f& center, float radius, std::uint32_t m) {
    scene.spheres.push_back({center, radius, m});
}

/// Hard shadows of thin poles on a texture: edges that no feature plane knows of.
inline Builder shadows() {
    Builder s;
    floor(s, -10, -14, 10, 6, 0, add(s, textured(planks(s), 7)));
    const std::uint32_t pole = add(s, plain({0.5f, 0.12f, 0.08f})), white = add(s, plain(Vec3f(0.75f)));
    const std::uint32_t brick = add(s, textured(bricks(s, {0.7f, 0.4f, 0.3f}), 1));
    for (int i = 0; i < 12; ++i)
        for (int row = 0; row < 2; ++row) {
            const double x = -3.3 + 0.6 * i, z = -1.5 - 2.5 * row, r = 0.035;
            box(s, {x - r, 0, z - r}, {x + r, 1.4 + 0.4 * chance(i, row), z + r}, pole, 0.2 * i);
        }
    for (int row = 0; row < 2; ++row) // a fence's rails
        box(s, {-3.4, 1.15, -1.52 - 2.5 * row}, {3.4, 1.2, -1.48 - 2.5 * row}, pole);
    box(s, {-2.2, 0, 0.1}, {-1.5, 0.7, 0.8}, white, 0.5);
    box(s, {1.2, 0, -0.5}, {2, 1.1, 0.3}, brick, -0.3);
    box(s, {-0.4, 0, -3.2}, {0.5, 1.8, -2.4}, brick, 0.2);
    box(s, {-10, 0, -8.2}, {10, 3, -8}, add(s, textured(bricks(s, {0.6f, 0.6f, 0.55f}), 4)));
    sphere(s, {-12, 13, 6}, 0.25f, add(s, lamp({9500, 8600, 7000})));
    sphere(s, {14, 9, 2}, 0.2f, add(s, lamp({2500, 3000, 4500}))); // a choice between two lights is noise
    s.environment.scale = {0.3f, 0.36f, 0.45f};
    s.cameras.push_back({{0.6, 3.4, 3.6}, {0, 0.2, -1.6}, {0, 1, 0}, 42, ""});
    return s;
}

/// Rough to shiny metals and plastics, tiles of both, under a strip: highlights of every width.
inline Builder gloss() {
    Builder s;
    Material tiles = textured(paint(s, 128, [](float u, float v) {
        const int x = int(u * 8), y = int(v * 8);
        return Vec3f(0.45f) + 0.5f * Vec3f(chance(x, y), chance(x, y + 20), chance(x, y + 40));
    }), 1);
    tiles.metallic_roughness_texture.image = paint(s, 128, [](float u, float v) {
        const int x = int(u * 8), y = int(v * 8);
        return Vec3f(0, 0.1f + 0.5f * chance(x, y + 60), chance(x, y + 80) < 0.5f ? 1.0f : 0.0f);
    });
    tiles.metallic_roughness_texture.color_space = ColorSpace::linear;
    tiles.metallic = tiles.specular = tiles.roughness = 1;
    floor(s, -4, -3, 4, 4, 0, add(s, tiles));
    wall(s, -4, 0, 4, 3, -3, add(s, plastic(textured(bricks(s, {0.35f, 0.45f, 0.6f}), 3), 0.35f)));
    box(s, {-2.4, 0, -1.6}, {-1.5, 1.3, -0.7}, add(s, metal({1, 0.78f, 0.35f}, 0.15f)), 0.4);
    box(s, {-1, 0, -0.9}, {-0.2, 0.8, -0.1}, add(s, metal({0.95f, 0.64f, 0.54f}, 0.45f)), -0.5);
    const std::int32_t squares = chequer(s, {0.8f, 0.2f, 0.15f}, {0.9f, 0.85f, 0.7f});
    box(s, {0.5, 0, -1.8}, {1.4, 1.6, -0.9}, add(s, plastic(textured(squares, 3), 0.2f)), 0.3);
    box(s, {1.3, 0, -0.3}, {2, 0.6, 0.4}, add(s, plastic(plain({0.05f, 0.2f, 0.45f}), 0.1f)), -0.2);
    sphere(s, {-0.9f, 0.3f, 0.8f}, 0.3f, add(s, metal(Vec3f(0.9f), 0.3f)));
    sphere(s, {0.4f, 0.35f, 0.7f}, 0.35f, add(s, plastic(plain({0.1f, 0.4f, 0.15f}), 0.25f)));
    ceiling(s, -2.2, -1.9, 2.2, -1.75, 2.3, add(s, lamp({60, 56, 50})));
    s.environment.scale = {0.12f, 0.14f, 0.18f};
    s.cameras.push_back({{0.2, 1.7, 4.2}, {0, 0.35, -0.2}, {0, 1, 0}, 42, ""});
    return s;
}

/// A furnished room with tiny lights close to shiny things and to walls: fireflies. The lights themselves are hidden
/// from the camera, since a pixel that is 10 000 times as bright as the others would be all there is to a measurement.
inline Builder tiny() {
    Builder s;
    const std::uint32_t paper = add(s, textured(stripes(s, {0.75f, 0.7f, 0.6f}, {0.6f, 0.66f, 0.6f}), 5));
    const std::uint32_t white = add(s, plain(Vec3f(0.7f))), red = add(s, plain({0.55f, 0.12f, 0.1f}));
    const std::uint32_t parquet = add(s, plastic(textured(planks(s), 3), 0.3f));
    room(s, {5, 2.6, 5}, {paper, red, parquet, white, paper, add(s, plain(Vec3f(0.1f)))}); // no light behind the camera
    const std::uint32_t wood = add(s, textured(planks(s), 1)), steel = add(s, metal(Vec3f(0.8f), 0.2f));
    const auto cloth = add(s, textured(chequer(s, {0.2f, 0.3f, 0.55f}, {0.3f, 0.42f, 0.65f}), 4));
    box(s, {1.6, 0.68, 1.2}, {3.2, 0.74, 2.2}, wood);                                     // a table
    for (const double x : {1.65, 3.09})
        for (const double z : {1.25, 2.09}) box(s, {x, 0, z}, {x + 0.06, 0.68, z + 0.06}, wood);
    box(s, {0.1, 0, 0.3}, {0.5, 1.9, 1.9}, wood);                                         // a shelf
    box(s, {3.4, 0, 0.2}, {4.8, 0.45, 1}, cloth), box(s, {3.4, 0.45, 0.2}, {4.8, 0.9, 0.4}, cloth); // a sofa
    box(s, {2.0, 0.74, 1.5}, {2.3, 1.0, 1.8}, steel, 0.4);
    sphere(s, {2.8f, 0.89f, 1.7f}, 0.15f, add(s, metal({1, 0.75f, 0.4f}, 0.1f)));
    box(s, {1.1, 1.2, 0.02}, {2.3, 1.9, 0.05}, add(s, textured(bricks(s, {0.7f, 0.3f, 0.2f}), 1))); // a picture
    const std::uint32_t warm = add(s, lamp({2200, 1700, 1000})), cold = add(s, lamp({900, 1200, 1600}));
    sphere(s, {2.4f, 2.0f, 1.7f}, 0.02f, add(s, lamp({26000, 21000, 14000}))); // in a shade, open above and below
    const std::uint32_t dark = add(s, plain({0.15f, 0.14f, 0.12f}));
    for (const double side : {-0.3, 0.3}) {
        box(s, {2.4 + side - 0.005, 1.9, 1.4}, {2.4 + side + 0.005, 2.15, 2.0}, dark);
        box(s, {2.1, 1.9, 1.7 + side - 0.005}, {2.7, 2.15, 1.7 + side + 0.005}, dark);
    }
    sphere(s, {4.5f, 0.75f, 0.1f}, 0.015f, warm);  // behind the sofa
    sphere(s, {0.3f, 1.0f, 0.15f}, 0.015f, cold);  // behind the shelf
    s.cameras.push_back({{2.9, 1.55, 4.8}, {2.4, 0.95, 1.2}, {0, 1, 0}, 50, ""});
    return s;
}

/// Glass balls and a slab on a chequered floor: refraction, and caustics that only chance finds.
inline Builder glass_balls() {
    Builder s;
    floor(s, -5, -4, 5, 5, 0, add(s, textured(chequer(s, Vec3f(0.85f), {0.25f, 0.3f, 0.4f}), 10)));
    wall(s, -5, 0, 5, 4, -3, add(s, textured(bricks(s, {0.75f, 0.5f, 0.35f}), 3)));
    const std::uint32_t clear = add(s, glass(Vec3f(1)));
    sphere(s, {-0.95f, 0.55f, 0}, 0.55f, clear);
    sphere(s, {0.35f, 0.4f, 0.75f}, 0.4f, add(s, glass({0.75f, 0.95f, 0.8f})));
    sphere(s, {0.5f, 0.6f, -0.9f}, 0.6f, clear);
    box(s, {1.25, 0.001, -0.5}, {1.45, 1.3, 0.9}, add(s, glass({0.9f, 0.97f, 1})), 0.5);
    box(s, {-2.3, 0, -1.6}, {-1.6, 0.9, -0.9}, add(s, plain({0.6f, 0.15f, 0.12f})), 0.3);
    box(s, {1.9, 0, -1.4}, {2.5, 1.2, -0.8}, add(s, plain({0.15f, 0.4f, 0.2f})), -0.4);
    ceiling(s, -0.4, -0.3, 0.4, 0.5, 3.5, add(s, lamp({45, 42, 36})));
    s.environment.scale = {0.1f, 0.12f, 0.15f};
    s.cameras.push_back({{0.3, 1.6, 4.6}, {0.05, 0.5, -0.2}, {0, 1, 0}, 36, ""});
    return s;
}

/// A blue sky with a sun of three degrees.
inline Environment sunny(const Vec3d& to_sun) {
    Environment sky;
    sky.scale = Vec3f(1);
    sky.width = 256;
    sky.height = 128;
    const Vec3d sun = normalize(to_sun);
    for (int y = 0; y < sky.height; ++y)
        for (int x = 0; x < sky.width; ++x) {
            const double phi = ((x + 0.5) / sky.width - 0.5) * 2 * pi<double>;
            const double theta = (y + 0.5) / sky.height * pi<double>;
            const Vec3d d(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi));
            const float up = float(std::max(0.0, d.y));
            const Vec3f blue = mix(Vec3f(0.7f, 0.75f, 0.8f), Vec3f(0.15f, 0.3f, 0.65f), std::sqrt(up));
            const Vec3f color = d.y < 0 ? Vec3f(0.15f) : blue;
            sky.map.push_back(dot(d, sun) > std::cos(0.027) ? Vec3f(1500, 1350, 1100) : color);
        }
    return sky;
}

/// Rows of boxes before a wide lens: every plane of the frame is blurred and noisy.
inline Builder dof() {
    Builder s;
    floor(s, -30, -40, 30, 10, 0, add(s, textured(chequer(s, {0.6f, 0.58f, 0.5f}, {0.42f, 0.4f, 0.36f}), 40)));
    const std::array<std::uint32_t, 6> looks = {
        add(s, textured(chequer(s, {0.85f, 0.25f, 0.15f}, {0.95f, 0.9f, 0.8f}), 2)),
        add(s, textured(bricks(s, {0.75f, 0.45f, 0.3f}), 1)),
        add(s, textured(stripes(s, {0.15f, 0.35f, 0.7f}, {0.9f, 0.9f, 0.85f}), 1)),
        add(s, textured(planks(s), 1)),
        add(s, plain({0.15f, 0.5f, 0.2f})),
        add(s, plastic(plain({0.8f, 0.6f, 0.1f}), 0.2f))};
    for (int row = 0; row < 7; ++row)
        for (int i = -row - 2; i <= row + 2; ++i) {
            const double x = 0.95 * i + 0.4 * (row % 2), z = 2.6 - 1.4 * row, r = 0.22, h = 0.4 + 0.7 * chance(i, row);
            const std::uint32_t look = looks[std::size_t(6 * chance(i + 50, row))];
            box(s, {x - r, 0, z - r}, {x + r, h, z + r}, look, chance(row, i) * 1.5);
        }
    s.environment = sunny({-0.5, 0.75, 0.5});
    s.cameras.push_back({{0.2, 1.7, 5.2}, {0, 0.3, 0}, {0, 1, 0}, 38, "", 0.1, 4.6});
    return s;
}

/// A mirror for a wall and one for a ball: textures and light at second hand.
inline Builder mirrors() {
    Builder s;
    const std::uint32_t white = add(s, plain(Vec3f(0.75f))), mirror = add(s, metal(Vec3f(0.92f), 0));
    const std::uint32_t brick = add(s, textured(bricks(s, {0.7f, 0.35f, 0.25f}), 2));
    const std::uint32_t paper = add(s, textured(stripes(s, {0.35f, 0.5f, 0.6f}, {0.75f, 0.75f, 0.65f}), 6));
    const std::uint32_t tiles = add(s, textured(chequer(s, {0.8f, 0.78f, 0.7f}, {0.3f, 0.2f, 0.16f}), 5));
    room(s, {5, 2.8, 5}, {brick, paper, tiles, white, white, brick});
    wall(s, 0.4, 0.2, 3.4, 2.4, 0.01, mirror);
    sphere(s, {3.5f, 0.5f, 1.4f}, 0.5f, mirror);
    box(s, {1.1, 0, 1.2}, {1.7, 0.7, 1.8}, add(s, textured(planks(s), 1)), 0.4);
    box(s, {2.2, 0, 0.8}, {2.6, 1.2, 1.2}, add(s, plain({0.15f, 0.4f, 0.2f})), -0.3);
    sphere(s, {1.4f, 0.9f, 1.5f}, 0.2f, add(s, plastic(plain({0.7f, 0.1f, 0.08f}), 0.15f)));
    sphere(s, {2.3f, 2.2f, 2.2f}, 0.18f, add(s, lamp({42, 36, 26})));
    s.cameras.push_back({{3.1, 1.5, 4.7}, {2.2, 0.95, 0.6}, {0, 1, 0}, 48, ""});
    return s;
}

} // namespace denoise_scenes
