#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec.hpp>
#include <algorithm>
#include <cmath>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Isotropic GGX microfacets. Directions are unit vectors in the local space of the normal, `wo` and `wi` on its side
/// (z > 0). Sines are taken from x and y, never as 1 - z², so that small alpha keeps its digits in float.
/// source  Walter et al., EGSR 2007; Heitz, JCGT 3:2 (2014)
template <class T>
struct Ggx {
    T alpha; ///< in (0, 1]

    /// Below this alpha, lobes are taken as exact mirrors: float can't tell directions well enough apart.
    static constexpr T smallest_alpha = T(1e-4);

    static T sin2(const Vec3<T>& w) { return w.x * w.x + w.y * w.y; }

    /// Density of facets with normal m, per area and solid angle.
    T distribution(const Vec3<T>& m) const {
        if (!(m.z > 0)) return 0;
        const T a2 = alpha * alpha, t = sin2(m) + m.z * m.z * a2;
        return a2 / (pi<T> * t * t);
    }

    /// Smith's masking and shadowing, correlated by height, over 4 |cos wo| |cos wi|.
    T visibility(const Vec3<T>& wo, const Vec3<T>& wi) const {
        const T a2 = alpha * alpha, o = glm::abs(wo.z), i = glm::abs(wi.z);
        const T sum = i * std::sqrt(o * o + a2 * sin2(wo)) + o * std::sqrt(i * i + a2 * sin2(wi));
        return sum > 0 ? T(0.5) / sum : T(0);
    }

    /// Share of the facets that face w and are seen from it.
    T masking(const Vec3<T>& w) const {
        const T z = glm::abs(w.z);
        return 2 * z / (z + std::sqrt(z * z + alpha * alpha * sin2(w)));
    }

    /// A facet's normal among those that wo sees, by their projected area.
    /// source  Dupuy, Benyoub, Computer Graphics Forum 42:8 (2023)
    Vec3<T> sample_visible(const Vec3<T>& wo, const Vec2<T>& u) const { return facet(wo, u, 1); }
    T visible_pdf(const Vec3<T>& wo, const Vec3<T>& m) const {
        const T facing = dot(wo, m);
        return facing > 0 && wo.z > 0 ? masking(wo) * distribution(m) * facing / wo.z : T(0);
    }

    /// The same, but hardly ever one that reflects wo below the horizon: `bounded_pdf` is of the reflected direction.
    /// source  Eto, Tokuyoshi, SIGGRAPH Asia 2023 Technical Communications
    Vec3<T> sample_bounded(const Vec3<T>& wo, const Vec2<T>& u) const { return facet(wo, u, bound(wo)); }
    T bounded_pdf(const Vec3<T>& wo, const Vec3<T>& m) const {
        const T stretched = std::sqrt(alpha * alpha * sin2(wo) + wo.z * wo.z);
        return distribution(m) / (2 * (bound(wo) * wo.z + stretched));
    }

private:
    /// How far below the horizon of the stretched sphere reflections are still drawn.
    T bound(const Vec3<T>& wo) const {
        const T a2 = alpha * alpha, s = 1 + std::sqrt(sin2(wo)), s2 = s * s;
        return (1 - a2) * s2 / (s2 + a2 * wo.z * wo.z);
    }

    /// The half-way vector between the stretched wo and a point of the cap of the sphere above -lower · z.
    Vec3<T> facet(const Vec3<T>& wo, const Vec2<T>& u, T lower) const {
        const Vec3<T> stretched = normalize(Vec3<T>(alpha * wo.x, alpha * wo.y, wo.z));
        const T b = lower * stretched.z;
        const T phi = 2 * pi<T> * u.x, z = (1 - u.y) * (1 + b) - b;
        const T r = std::sqrt(std::clamp(1 - z * z, T(0), T(1)));
        const Vec3<T> h(r * std::cos(phi) + stretched.x, r * std::sin(phi) + stretched.y, z + stretched.z);
        const Vec3<T> m(alpha * h.x, alpha * h.y, glm::max(h.z, T(0)));
        const T size = length(m);
        return size > 0 ? m / size : Vec3<T>(0, 0, 1);
    }
};

} // namespace LAMBENT_ABI
} // namespace lambent
