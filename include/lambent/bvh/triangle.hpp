#pragma once
#include <lambent/core/ray.hpp>
#include <lambent/core/simd.hpp>
#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Four triangles side by side, with their vertices, not their edges: two triangles that share an edge then
/// compute it from the same numbers. Lanes beyond the last triangle hold one whose vertices coincide, which
/// no ray can hit.
template <class T>
struct alignas(4 * sizeof(T)) TriangleBlock {
    static constexpr int lanes = 4;
    T vertex[3][3][lanes]; ///< [vertex][axis][lane]
    std::uint32_t primitive[lanes];
};

/// A ray in the frame in which it starts at the origin and runs along its largest axis: x and y are sheared
/// along z. Made once a ray.
template <class T>
struct ShearedRay {
    int kx, ky, kz;       ///< where the frame's axes lie in ours
    T origin[3];          ///< by the frame's axes
    T shear_x, shear_y;
    T inverse_z; ///< 1 / direction[kz]

    ShearedRay() = default;
    [[gnu::always_inline]] explicit ShearedRay(const Ray<T>& ray) {
        using Four = Pack<T, 4>;
        const Four size = abs(Four(typename Four::Vector{ray.direction.x, ray.direction.y, ray.direction.z, 0}));
        const T largest = std::max(size[0], std::max(size[1], size[2]));
        kz = std::countr_zero(bits(size >= Four(largest)) | 4u); // without branches: directions are hard to foresee
        constexpr int next[4] = {1, 2, 0, 1};
        kx = next[kz];
        ky = next[kx];
        const T o[3] = {ray.origin.x, ray.origin.y, ray.origin.z}; // GLM's own [] is a switch
        const T d[3] = {ray.direction.x, ray.direction.y, ray.direction.z};
        origin[0] = o[kx];
        origin[1] = o[ky];
        origin[2] = o[kz];
        const Four quotients = Four(typename Four::Vector{d[kx], d[ky], 1, 0}) / Four(d[kz]);
        shear_x = quotients[0];
        shear_y = quotients[1];
        inverse_z = quotients[2];
    }
};

/// Where a ray meets the triangles of one block or of two.
template <class T, int N>
struct BlockHit {
    Mask<T, N> mask; ///< lanes with a hit, t_min <= t < t_max
    Pack<T, N> t;
    Pack<T, N> u, v; ///< barycentric weights of vertices 1 and 2
};

/// The watertight ray/triangle test: a ray that passes between two triangles with a common edge, or through
/// the common vertex of a closed fan, hits one of them. Two things make it so, under any compiler flags:
/// every vertex is moved into the ray's frame by the same three operations whichever triangle it belongs to,
/// and the edge functions have the exact sign for the vertices so moved. A point of the closed triangle,
/// edges included, is a hit; a triangle seen exactly edge-on is none (its neighbours are).
/// range   coordinates relative to the ray's origin within 2^-50 ... 2^60 in float: the products must not
///         vanish or overflow
/// source  Woop, Benthin, Wald, JCGT 2:1 (2013). We differ: the sign is exact by an fma-faithful difference
///         of products, where theirs holds only if the compiler fuses nothing.
/// N       4 tests one block; 8 tests two in the time of one and a half where the registers are that wide
template <int N, class T>
[[gnu::always_inline]] inline BlockHit<T, N> intersect(const ShearedRay<T>& ray, const TriangleBlock<T>* blocks, T t_min,
                                                       T t_max) {
    using Lanes = Pack<T, N>;
    const auto load = [blocks](int i, int axis) {
        if constexpr (N == 4) {
            return Lanes::load(blocks->vertex[i][axis]);
        } else {
            return join(Pack<T, 4>::load(blocks[0].vertex[i][axis]), Pack<T, 4>::load(blocks[1].vertex[i][axis]));
        }
    };
    const Lanes origin_x = ray.origin[0], origin_y = ray.origin[1], origin_z = ray.origin[2];
    const Lanes shear_x = ray.shear_x, shear_y = ray.shear_y;
    Lanes x[3], y[3], z[3];
    for (int i = 0; i < 3; ++i) {
        z[i] = load(i, ray.kz) - origin_z;
        x[i] = negated_multiply_add(shear_x, z[i], load(i, ray.kx) - origin_x);
        y[i] = negated_multiply_add(shear_y, z[i], load(i, ray.ky) - origin_y);
    }
    const Lanes w0 = difference_of_products(x[2], y[1], y[2], x[1]);
    const Lanes w1 = difference_of_products(x[0], y[2], y[0], x[2]);
    const Lanes w2 = difference_of_products(x[1], y[0], y[1], x[0]);

    BlockHit<T, N> hit;
    const Lanes zero = T(0);
    const Lanes least = min(w0, min(w1, w2)), most = max(w0, max(w1, w2));
    hit.mask = (least >= zero) ^ (most <= zero); // both where all three vanish: edge-on
    if (bits(hit.mask) == 0) return hit;
    // Weights first, and no compiler may divide later: their products with the depth could overflow. A mean of the
    // depths with weights of one sign never leaves the triangle, however thin it is seen.
    const Lanes determinant = w0 + w1 + w2;
    hit.u = opaque(w1 / determinant);
    hit.v = opaque(w2 / determinant);
    const Lanes depth =
        multiply_add(opaque(w0 / determinant), z[0], multiply_add(hit.u, z[1], hit.v * z[2]));
    hit.t = depth * Lanes(ray.inverse_z);
    hit.mask = hit.mask & (hit.t >= Lanes(t_min)) & (hit.t < Lanes(t_max));
    return hit;
}

} // namespace LAMBENT_ABI
} // namespace lambent
