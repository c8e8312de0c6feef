#pragma once
#include "support/random.hpp"
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <lambent/core/vec.hpp>
#include <string>
#include <utility>
#include <vector>

/// Meshes made in code, for tests of ray queries.
namespace lambent_test {

using lambent::UVec3;
using lambent::Vec3;

template <class T>
struct Mesh {
    std::string name;
    std::vector<Vec3<T>> vertices;
    std::vector<UVec3> faces;

    std::array<Vec3<T>, 3> triangle(std::size_t i) const {
        return {vertices[faces[i].x], vertices[faces[i].y], vertices[faces[i].z]};
    }
};

/// A closed sphere of 2 · slices · (stacks - 1) triangles, its vertices shifted at random by `noise` edge lengths.
template <class T>
Mesh<T> sphere(int slices, int stacks, double noise, std::uint64_t seed) {
    Mesh<T> mesh{"sphere", {}, {}};
    Random random(seed);
    const auto vertex = [&](double theta, double phi) {
        theta += noise * random.uniform(-0.5, 0.5) / stacks;
        phi += noise * random.uniform(-0.5, 0.5) / slices;
        const double r = 1 + noise * random.uniform(-0.1, 0.1);
        mesh.vertices.push_back({T(r * std::sin(theta) * std::cos(phi)), T(r * std::cos(theta)),
                                 T(r * std::sin(theta) * std::sin(phi))});
    };
    const double pi = 3.14159265358979323846;
    vertex(0, 0);
    for (int i = 1; i < stacks; ++i)
        for (int j = 0; j < slices; ++j) vertex(pi * i / stacks, 2 * pi * j / slices);
    vertex(pi, 0);
    const auto at = [&](int i, int j) { return std::uint32_t(1 + (i - 1) * slices + j % slices); };
    for (int j = 0; j < slices; ++j) {
        mesh.faces.push_back({0u, at(1, j + 1), at(1, j)});
        for (int i = 1; i + 1 < stacks; ++i) {
            mesh.faces.push_back({at(i, j), at(i, j + 1), at(i + 1, j)});
            mesh.faces.push_back({at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)});
        }
        mesh.faces.push_back({at(stacks - 1, j), at(stacks - 1, j + 1), std::uint32_t(mesh.vertices.size() - 1)});
    }
    return mesh;
}

/// A closed cube from -1 to 1 whose faces are grids of n × n squares, their vertices shared.
template <class T>
Mesh<T> cube(int n) {
    Mesh<T> mesh{"cube", {}, {}};
    const int side = n + 1;
    std::vector<std::uint32_t> ids(std::size_t(side * side * side), 0xffffffffu);
    const auto id = [&](int x, int y, int z) {
        std::uint32_t& slot = ids[std::size_t((x * side + y) * side + z)];
        if (slot == 0xffffffffu) {
            slot = std::uint32_t(mesh.vertices.size());
            mesh.vertices.push_back({T(2 * x - n) / T(n), T(2 * y - n) / T(n), T(2 * z - n) / T(n)});
        }
        return slot;
    };
    for (int axis = 0; axis < 3; ++axis)
        for (int end = 0; end <= n; end += n)
            for (int i = 0; i < n; ++i)
                for (int j = 0; j < n; ++j) {
                    const auto corner = [&](int a, int b) {
                        int c[3];
                        c[axis] = end;
                        c[(axis + 1) % 3] = a;
                        c[(axis + 2) % 3] = b;
                        return id(c[0], c[1], c[2]);
                    };
                    mesh.faces.push_back({corner(i, j), corner(i + 1, j), corner(i + 1, j + 1)});
                    mesh.faces.push_back({corner(i, j), corner(i + 1, j + 1), corner(i, j + 1)});
                }
    return mesh;
}

/// Unconnected triangles in the box from -1 to 1, with edges of about `size`.
template <class T>
Mesh<T> soup(std::size_t count, double size, std::uint64_t seed) {
    Mesh<T> mesh{"soup", {}, {}};
    Random random(seed);
    for (std::size_t i = 0; i < count; ++i) {
        const Vec3<T> center = random.in_box<T>(-1, 1);
        for (int k = 0; k < 3; ++k) mesh.vertices.push_back(center + random.in_box<T>(-size, size));
        const auto first = std::uint32_t(3 * i);
        mesh.faces.push_back({first, first + 1, first + 2});
    }
    return mesh;
}

/// Long thin triangles, across the whole box, some along the axes.
template <class T>
Mesh<T> slivers(std::size_t count, std::uint64_t seed) {
    Mesh<T> mesh{"slivers", {}, {}};
    Random random(seed);
    for (std::size_t i = 0; i < count; ++i) {
        Vec3<T> a = random.in_box<T>(-1, 1), b = random.in_box<T>(-1, 1);
        if (i % 4 == 0) {
            b = a;
            b[int(i / 4 % 3)] = T(random.uniform(-1, 1));
        }
        mesh.vertices.push_back(a);
        mesh.vertices.push_back(b);
        mesh.vertices.push_back(b + random.in_box<T>(-1e-3, 1e-3));
        const auto first = std::uint32_t(3 * i);
        mesh.faces.push_back({first, first + 1, first + 2});
    }
    return mesh;
}

/// Sound triangles among points, needles, copies, flat layers and faces with NaN and infinite vertices.
template <class T>
Mesh<T> degenerate(std::size_t count, std::uint64_t seed) {
    Mesh<T> mesh = soup<T>(count, 0.4, seed);
    mesh.name = "degenerate";
    for (std::size_t i = 0; i < count; ++i) {
        Vec3<T>* const v = &mesh.vertices[3 * i];
        switch (i % 10) {
        case 0: v[1] = v[2] = v[0]; break;
        case 1: v[2] = v[1]; break;
        case 2: v[2] = (v[0] + v[1]) * T(0.5); break;
        case 3: v[int(i / 10 % 3)][int(i / 30 % 3)] = std::numeric_limits<T>::quiet_NaN(); break;
        case 4: v[int(i / 10 % 3)][int(i / 30 % 3)] = std::numeric_limits<T>::infinity(); break;
        case 5: v[0].y = v[1].y = v[2].y = T(0.25); break;
        case 6:
            if (i >= 10)
                for (int k = 0; k < 3; ++k) v[k] = v[k - 30 + 3];
            break;
        default: break;
        }
    }
    return mesh;
}

/// One of each kind, small enough for brute force.
template <class T>
std::vector<Mesh<T>> small_meshes() {
    return {sphere<T>(12, 8, 0.3, 1), cube<T>(4), soup<T>(160, 0.3, 2), slivers<T>(160, 3),
            degenerate<T>(160, 4), soup<T>(3, 1, 5)};
}

} // namespace lambent_test
