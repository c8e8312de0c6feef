#pragma once
#include <cmath>
#include <lambent/core/numerics.hpp>
#include <lambent/core/sincos.hpp>
#include <lambent/core/vec.hpp>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Isotropic GGX microfacets. `wo` and `wi` are unit vectors in the local space of the normal, wo above (z > 0). Sines
/// are taken from x and y, never as 1 - z², and half vectors are as they come from adding directions, of any length: so
/// nothing cancels, in float neither, from alpha 1e-6 to 1 and down to cosines of 1e-7.
/// source  Walter et al., EGSR 2007; Heitz, JCGT 3:2 (2014)
template <class T>
struct Ggx {
    T alpha; ///< in (0, 1]

    /// Below this alpha, BSDFs take exact mirrors: float's directions lie too far apart for the peak.
    static constexpr T smallest_alpha = T(1e-4);

    static T sin2(const Vec3<T>& w) { return w.x * w.x + w.y * w.y; }

    /// Length of w where space is stretched so that facets become a hemisphere.
    T stretched(const Vec3<T>& w) const { return std::sqrt(w.z * w.z + alpha * alpha * sin2(w)); }

    /// Density of facets along h, per area and solid angle.
    T distribution(const Vec3<T>& h) const {
        const T s2 = sin2(h), z2 = h.z * h.z, a2 = alpha * alpha;
        const T ratio = (s2 + z2) / (s2 + a2 * z2);
        return a2 * ratio * ratio * inv_pi<T>;
    }

    /// Smith's masking and shadowing, correlated by height, over 4 |cos wo| |cos wi|, from both cosines' sizes and
    /// stretched lengths. For transmission too.
    static T visibility(T o, T stretched_o, T i, T stretched_i) { return T(0.5) / (i * stretched_o + o * stretched_i); }

    /// A facet's normal among those that wo sees, by their projected area: its density is
    /// distribution(m) · dot(wo, m) · visible_factor.
    /// source  Dupuy, Benyoub, Computer Graphics Forum 42:8 (2023)
    Vec3<T> sample_visible(const Vec3<T>& wo, const Vec2<T>& u) const { return facet(wo, u, 0); }
    static T visible_factor(const Vec3<T>& wo, T stretched_wo) { return 2 / (wo.z + stretched_wo); }

    /// The same, but hardly ever one that mirrors wo to below the horizon: the density of the *mirrored direction* is
    /// distribution(m) · bounded_factor.
    /// source  Eto, Tokuyoshi, SIGGRAPH Asia 2023 Technical Communications
    Vec3<T> sample_bounded(const Vec3<T>& wo, const Vec2<T>& u) const { return facet(wo, u, cut(wo)); }
    T bounded_factor(const Vec3<T>& wo, T stretched_wo) const { return T(0.5) / ((1 - cut(wo)) * wo.z + stretched_wo); }

private:
    /// What the bound cuts off the part below the horizon of the cap of reflections, as a fraction of its height.
    T cut(const Vec3<T>& wo) const {
        const T s = 1 + std::sqrt(sin2(wo)), s2 = s * s, a2 = alpha * alpha, z2 = wo.z * wo.z;
        return a2 * (s2 + z2) / (s2 + a2 * z2);
    }

    /// Halfway between the stretched wo and a point of the unit sphere above -(1 - cut) · (the stretched wo's z).
    Vec3<T> facet(const Vec3<T>& wo, const Vec2<T>& u, T cut) const {
        const T scale = 1 / stretched(wo), x = alpha * wo.x * scale, y = alpha * wo.y * scale, z = wo.z * scale;
        // The point lies `depth` below the pole, and `height` above -z. Of 1 + z - depth and 2 - depth, which r needs,
        // not much may be left: so they are put together from what is.
        const T depth = u.y * (1 + (1 - cut) * z), height = (1 - u.y) * (1 + z) + u.y * cut * z;
        const T r = std::sqrt(depth * (height + (x * x + y * y) / (1 + z)));
        const SineCosine<T> phi = sincos_of_turn(u.x);
        const Vec3<T> m(alpha * (x + r * phi.cosine), alpha * (y + r * phi.sine), height);
        const T length2 = dot(m, m);
        return length2 > 0 ? m / std::sqrt(length2) : Vec3<T>(0, 0, 1);
    }
};

} // namespace LAMBENT_ABI
} // namespace lambent
