#pragma once
#include "support/meshes.hpp"
#include "support/random.hpp"
#include <lambent/core/ray.hpp>
#include <cstddef>

namespace lambent_test {

/// A mesh about the origin, moved by (offset, offset / 3, -offset / 7), then scaled, once and for all rounded to T.
template <class T>
struct Placed {
    Mesh<T> mesh;
    Vec3<double> shift;
    double scale;

    Placed(const Mesh<T>& unit, double offset, double by)
        : mesh(unit), shift(offset, offset / 3, -offset / 7), scale(by) {
        for (Vec3<T>& v : mesh.vertices) v = place(Vec3<double>(v));
    }
    Vec3<T> place(const Vec3<double>& p) const { return Vec3<T>((p + shift) * scale); }
};

/// A ray that must hit, from inside a closed mesh that surrounds the box from -0.4 to 0.4 and is seen from all of it:
/// by turns at a vertex; at an edge; at an edge and of unit length; from straight below a vertex, along an axis. Now
/// and then its direction is zero.
/// face    the one whose vertex or edge it is aimed at
/// origin  in the unit mesh
template <class T>
lambent::Ray<T> aimed_ray(const Placed<T>& placed, std::size_t i, std::size_t face, int corner,
                          const Vec3<double>& origin, Random& random) {
    const UVec3 ids = placed.mesh.faces[face];
    const Vec3<T> a = placed.mesh.vertices[ids[corner]], b = placed.mesh.vertices[ids[(corner + 1) % 3]];
    lambent::Ray<T> ray;
    ray.origin = placed.place(origin);
    switch (i % 4) {
    case 0: ray.direction = a - ray.origin; break;
    case 1: ray.direction = (a + (b - a) * T(random.uniform())) - ray.origin; break;
    case 2: { // rounded once more
        const Vec3<double> d = Vec3<double>(a) + Vec3<double>(b - a) * random.uniform() - Vec3<double>(ray.origin);
        ray.direction = Vec3<T>(normalize(d / placed.scale));
        break;
    }
    default: {
        const int axis = int(random.index(3));
        const Vec3<T> center = placed.place({0, 0, 0});
        ray.direction = Vec3<T>(0);
        ray.direction[axis] = a[axis] < center[axis] ? T(-1) : T(1);
        ray.origin = a;
        ray.origin[axis] = center[axis];
        const Vec3<double> from(ray.origin - center);
        if (length(from) > 0.7 * placed.scale) ray.origin = center; // might lie outside of a rough mesh
    }
    }
    return ray;
}

/// The same at any face, from anywhere in the box.
template <class T>
lambent::Ray<T> aimed_ray(const Placed<T>& placed, std::size_t i, Random& random) {
    const std::size_t face = random.index(placed.mesh.faces.size());
    const int corner = int(random.index(3));
    return aimed_ray(placed, i, face, corner, random.template in_box<double>(-0.4, 0.4), random);
}

/// Every face's first edge gets a vertex on it (exactly, rounded, or at its end), joined to both ends by a needle.
template <class T>
Mesh<T> with_needles(Mesh<T> mesh, std::uint64_t seed) {
    const std::size_t faces = mesh.faces.size();
    Random random(seed);
    for (std::size_t i = 0; i < faces; ++i) {
        const UVec3 f = mesh.faces[i];
        const Vec3<T> a = mesh.vertices[f.x], b = mesh.vertices[f.y];
        const auto middle = std::uint32_t(mesh.vertices.size());
        mesh.vertices.push_back(i % 2 == 0 ? (a + b) * T(0.5) : a + (b - a) * T(random.uniform()));
        if (i % 5 == 0) mesh.vertices.back() = a;
        mesh.faces[i] = {f.x, middle, f.z};
        mesh.faces.push_back({middle, f.y, f.z});
        mesh.faces.push_back({f.x, f.y, middle});
    }
    mesh.faces.push_back({0, 0, 0});
    return mesh;
}

} // namespace lambent_test
