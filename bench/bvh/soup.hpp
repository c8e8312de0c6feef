#pragma once
#include <lambent/core/ray.hpp>
#include <lambent/core/vec.hpp>
#include <cstdint>
#include <string>
#include <vector>

/// The triangles of a bench: a soup, three vertices each.
struct Soup {
    std::string name;
    lambent::Vec3d origin{0}; ///< of the vertices' coordinates
    std::vector<lambent::Vec3f> vertices;
    std::vector<lambent::UVec3> faces;

    void add(const lambent::Vec3f& a, const lambent::Vec3f& b, const lambent::Vec3f& c) {
        const auto first = std::uint32_t(vertices.size());
        vertices.insert(vertices.end(), {a, b, c});
        faces.push_back({first, first + 1, first + 2});
    }
};

/// Rays of one kind, all closest-hit or all any-hit.
struct RayClass {
    std::string name;
    bool any = false;
    bool coherent = false; ///< neighbours in the array run side by side
    std::vector<lambent::Rayf> rays;
};

/// uint32 count, then nine float32 a triangle, little endian. All four throw lambent::Error
Soup read_soup(const std::string& path);
void write_soup(const std::string& path, const Soup& soup);

/// uint32 magic 'RAYS', kind (0 closest, 1 any), count, 0; then eight float32 a ray: origin, t_min, direction,
/// t_max; little endian.
RayClass read_rays(const std::string& path);
void write_rays(const std::string& path, const RayClass& rays);
