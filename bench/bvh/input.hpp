#pragma once
#include "rays.hpp"
#include <lambent/io/file.hpp>
#include <lambent/io/scene_file.hpp>
#include <lambent/scene/builtin.hpp>
#include <cstring>
#include <span>

/// A closed sphere with bumps, of about `faces` triangles: what a bench has without any file.
inline Soup blob_soup(int faces) {
    using namespace lambent;
    Soup soup;
    soup.name = "blob";
    const int rings = int(std::sqrt(double(faces) / 4)), segments = 2 * rings;
    const auto at = [&](int ring, int segment) {
        const double theta = pi<double> * ring / rings, phi = 2 * pi<double> * (segment % segments) / segments;
        const Vec3d d(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi));
        return Vec3f(d * (1 + 0.15 * std::sin(7 * d.x) * std::sin(9 * d.y) * std::sin(8 * d.z + 1)));
    };
    for (int r = 0; r < rings; ++r)
        for (int s = 0; s < segments; ++s) {
            const Vec3f a = at(r, s), b = at(r + 1, s), c = at(r + 1, s + 1), d = at(r, s + 1);
            if (r + 1 < rings) soup.add(a, b, c);
            if (r > 0) soup.add(a, c, d);
        }
    return soup;
}

/// uint32 count, then nine float32 a triangle, little endian. throws lambent::Error
inline Soup read_soup(const std::string& path) {
    using namespace lambent;
    const std::string bytes = detail::read_file(path);
    std::uint32_t count = 0;
    require(bytes.size() >= 4, [&] { return path + ": too short for a soup of triangles"; });
    std::memcpy(&count, bytes.data(), 4);
    require(bytes.size() - 4 == std::size_t(count) * 36, [&] {
        return path + ": " + std::to_string(count) + " triangles do not fill " + std::to_string(bytes.size()) + " bytes";
    });
    Soup soup;
    soup.name = path;
    for (std::size_t i = 0; i < count; ++i) {
        Vec3f v[3];
        static_assert(sizeof v == 36);
        std::memcpy(static_cast<void*>(v), bytes.data() + 4 + i * 36, 36);
        soup.add(v[0], v[1], v[2]);
    }
    return soup;
}

/// uint32 magic 'RAYS', kind (0 closest, 1 any), count, 0; then eight float32 a ray: origin, t_min, direction,
/// t_max. throws lambent::Error
inline RayClass read_rays(const std::string& path) {
    using namespace lambent;
    const std::string bytes = detail::read_file(path);
    std::uint32_t head[4] = {};
    require(bytes.size() >= sizeof head, [&] { return path + ": too short for a file of rays"; });
    std::memcpy(head, bytes.data(), sizeof head);
    require(head[0] == 0x53594152u && head[1] <= 1 && bytes.size() - sizeof head == std::size_t(head[2]) * 32,
            [&] { return path + ": not a file of rays, or " + std::to_string(head[2]) + " rays do not fill it"; });
    RayClass rays;
    rays.name = path;
    rays.any = head[1] == 1;
    for (std::size_t i = 0; i < head[2]; ++i) {
        float f[8];
        std::memcpy(f, bytes.data() + sizeof head + i * 32, 32);
        rays.rays.push_back({{f[0], f[1], f[2]}, {f[4], f[5], f[6]}, f[3], f[7]});
    }
    return rays;
}

/// The triangles of a scene, and its first camera or one that frames it. throws lambent::Error
inline Soup scene_soup(const std::string& name, lambent::Camera& camera) {
    using namespace lambent;
    const Scene<float> scene = name == "builtin:cornell" ? cornell_scene<float>() : load_scene<float>(name);
    Soup soup;
    soup.name = name;
    soup.origin = scene.origin;
    for (const UVec3& t : scene.triangles)
        soup.add(scene.positions[t.x], scene.positions[t.y], scene.positions[t.z]);
    camera = scene.cameras.empty() ? framing_camera(scene.bounds(), 1) : scene.cameras.front();
    camera.eye -= scene.origin;
    camera.target -= scene.origin;
    return soup;
}
