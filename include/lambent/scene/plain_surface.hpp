#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/core/ray.hpp>
#include <lambent/core/vec_packs.hpp>
#include <lambent/light/triangle_light.hpp>
#include <lambent/scene/scene.hpp>
#include <array>
#include <cstddef>

// See simd.hpp.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace lambent {
inline namespace LAMBENT_ABI {

/// N points of plain surfaces, see plain_features: what Surface says of one. Material and light are left to the caller.
template <class T, int N>
struct PlainSurfaces {
    Vec3Pack<T, N> position, position_error, geometric_normal, shading_normal, lift;
    Mask<T, N> front;
};

/// Where N rays met triangles of a scene, put in one by one and looked at together.
template <class T, int N>
class PlainHits {
public:
    void set(std::size_t lane, const Scene<T>& scene, const Ray<T>& ray, const Hit<T>& hit) {
        const UVec3 t = scene.triangles[hit.primitive];
        for (int k = 0; k < 3; ++k) corner_[k].set(lane, scene.positions[t[k]]);
        to_viewer_.set(lane, -ray.direction);
        u_[lane] = hit.u;
        v_[lane] = hit.v;
        smooth_ = !scene.normals.empty();
        if (!smooth_) return;
        for (int k = 0; k < 3; ++k) normal_[k].set(lane, Vec3<T>(scene.normals[t[k]]));
    }

    /// What PreparedScene::surface() makes of each, to rounding.
    PlainSurfaces<T, N> surfaces() const {
        const V a = corner_[0].load(), b = corner_[1].load(), c = corner_[2].load(), wo = to_viewer_.load();
        const P u = P::load(u_.data()), v = P::load(v_.data()), w = P(1) - u - v;
        const V p0 = a * w, p1 = b * u, p2 = c * v, first_edge = b - a, second_edge = c - a;
        const P extent = triangle_extent(first_edge, second_edge);
        PlainSurfaces<T, N> s;
        s.position = p0 + p1 + p2;
        s.position_error = triangle_error(p0, p1, p2, extent);
        const V normal = unit_normal(first_edge, second_edge, extent);
        s.front = dot(normal, wo) >= P(0);
        s.shading_normal = s.geometric_normal = select(s.front, normal, -normal);
        s.lift = V(P(0), P(0), P(0));
        if (smooth_) interpolate_normals(s, {a, b, c}, {w, u, v}, wo);
        return s;
    }

private:
    using P = Pack<T, N>;
    using V = Vec3Pack<T, N>;

    /// Of the front.
    static V unit_normal(const V& first_edge, const V& second_edge, P extent) {
        const P zero(0), tiny(T(1e-24)), huge(T(1e24));
        V n = robust_cross(first_edge, second_edge);
        P size2 = dot_xzy(n, n);
        const auto in_range = (size2 > tiny) & (size2 < huge); // else squares could under- or overflow
        if (!all(in_range)) {
            n = select(in_range, n, robust_cross(first_edge / extent, second_edge / extent));
            size2 = dot_xzy(n, n);
        }
        return select(size2 > zero, n / sqrt(size2), V(zero, zero, P(1)));
    }

    void interpolate_normals(PlainSurfaces<T, N>& s, const std::array<V, 3>& corners, const std::array<P, 3>& weights,
                             const V& wo) const {
        const P zero(0), least(T(1e-12)), side = select(s.front, P(1), P(-1));
        V sum(zero, zero, zero);
        for (std::size_t k = 0; k < 3; ++k) {
            const V n = normal_[k].load(), seen = n * side; // see smooth_lift()
            const P length2 = dot(n, n), below = dot(corners[k] - s.position, seen);
            const auto lifts = (below > zero) & (dot(seen, s.geometric_normal) > zero) & (length2 > least);
            s.lift += seen * select(lifts, weights[k] * below / length2, zero);
            sum += n * weights[k];
        }
        const P length2 = dot(sum, sum), facing = dot(sum, s.geometric_normal);
        const V unit = sum / sqrt(length2);
        s.shading_normal = select(length2 > least, select(facing < zero, -unit, unit), s.geometric_normal);
        keep_reflection_above(s, wo);
    }

    /// See PreparedScene.
    static void keep_reflection_above(PlainSurfaces<T, N>& s, const V& wo) {
        const P zero(0), two(2);
        const P facing = dot(s.shading_normal, wo), above = dot(s.geometric_normal, wo);
        const V mirrored = s.shading_normal * (two * facing) - wo;
        const P height = dot(mirrored, s.geometric_normal), least = min(P(T(0.01)), above / two);
        const auto keeps = (facing > zero) & (height >= least);
        if (all(keeps)) return;
        const V lifted = normalize(mirrored + s.geometric_normal * (least - min(height, least))), half = lifted + wo;
        const P size = sqrt(dot(half, half));
        V bent = select(size > P(T(1e-6)), half / size, s.geometric_normal);
        bent = select(dot(bent, wo) > zero, bent, s.geometric_normal);
        s.shading_normal = select(keeps, s.shading_normal, bent);
    }

    Vec3Column<T, N> corner_[3], normal_[3], to_viewer_;
    alignas(64) std::array<T, std::size_t(N)> u_, v_; ///< barycentric coordinates
    bool smooth_ = false; ///< whether the scene has normals
};

} // namespace LAMBENT_ABI
} // namespace lambent

#pragma GCC diagnostic pop
