#pragma once
#include "support/meshes.hpp"
#include "support/random.hpp"
#include <lambent/core/numerics.hpp>
#include <lambent/core/ray.hpp>
#include <limits>

namespace lambent_test {

/// Rays that are hard for ray queries, by turns: at random; along an axis, with zeros of both signs; aimed at a
/// vertex; aimed at an edge; from a vertex; along an edge; in the plane of an axis-parallel wall. Half of them
/// with a range. The mesh lies in about [-extent, extent]³ + center.
template <class T>
lambent::Ray<T> hard_ray(const Mesh<T>& mesh, std::size_t i, Random& random, double extent = 1,
                         Vec3<T> center = Vec3<T>(0)) {
    const auto vertex = [&](std::size_t face) {
        const Vec3<T> v = mesh.vertices[mesh.faces[face][int(random.index(3))]];
        return lambent::is_finite(v) ? v : center;
    };
    const auto finite_edge = [&](Vec3<T>& a, Vec3<T>& b) {
        const std::size_t face = random.index(mesh.faces.size());
        a = vertex(face);
        b = vertex(face);
        return a + (b - a) * T(random.uniform());
    };
    lambent::Ray<T> ray;
    ray.origin = center + random.in_box<T>(-1.5 * extent, 1.5 * extent);
    Vec3<T> a, b;
    const Vec3<T> on_edge = finite_edge(a, b);
    switch (i % 8) {
    case 0:
    case 1: ray.direction = random.in_box<T>(-1, 1); break;
    case 2: {
        const int axis = int(random.index(3));
        ray.origin = on_edge;
        ray.direction = Vec3<T>(random.index(2) ? T(0) : -T(0));
        ray.direction[(axis + 1) % 3] = random.index(2) ? T(0) : -T(0);
        ray.direction[axis] = random.index(2) ? T(1) : T(-1);
        ray.origin[axis] = center[axis] - ray.direction[axis] * T(2 * extent);
        break;
    }
    case 3: ray.direction = a - ray.origin; break;
    case 4: ray.direction = on_edge - ray.origin; break;
    case 5:
        ray.origin = a;
        ray.direction = random.in_box<T>(-1, 1);
        break;
    case 6:
        ray.direction = b - a;
        ray.origin = a - (b - a) * T(0.5);
        break;
    default: {
        const int axis = int(random.index(3));
        ray.direction = random.in_box<T>(-1, 1);
        ray.direction[axis] = random.index(2) ? T(0) : -T(0);
        ray.origin[axis] = a[axis];
        break;
    }
    }
    if (random.index(2)) {
        ray.t_min = T(random.uniform(-0.5, 0.5));
        ray.t_max = ray.t_min + T(random.uniform(0, 3));
    }
    if (random.index(8) == 0) ray.t_min = -std::numeric_limits<T>::infinity();
    return ray;
}

} // namespace lambent_test
