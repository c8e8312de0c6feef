#pragma once
#include <algorithm>
#include <cmath>
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec.hpp>
#include <lambent/material/albedo_table.hpp>

namespace lambent {
inline namespace LAMBENT_ABI {

/// The sheen of cloth: fibres that stand about the normal and scatter at grazing angles. Directions are unit vectors in
/// the local space of the normal, above it.
/// source  Estevez, Kulla, Production Friendly Microfacet Sheen BRDF (2017); as glTF's KHR_materials_sheen has it
template <class T>
struct Charlie {
    T roughness; ///< in [smallest_roughness, 1]

    /// Below it the lobe is but a line at the horizon, and the fit gives back more than it gets.
    static constexpr T smallest_roughness = T(0.07);

    /// Density along h, of any length.
    T distribution(const Vec3<T>& h) const {
        const T s2 = h.x * h.x + h.y * h.y, exponent = 1 / roughness;
        return (2 + exponent) * std::pow(s2 / (s2 + h.z * h.z), exponent / 2) * (inv_pi<T> / 2);
    }

    /// Smith's Λ, by the paper's fit.
    T lambda(T cosine) const {
        if (cosine < T(0.5)) return std::exp(fit(cosine));
        return std::exp(2 * fit(T(0.5)) - fit(glm::max(T(0), 1 - cosine)));
    }

    /// Masking and shadowing over 4 |cos wo| |cos wi|.
    static T visibility(T o, T lambda_o, T i, T lambda_i) { return 1 / ((1 + lambda_o + lambda_i) * 4 * o * i); }

private:
    T fit(T x) const {
        const T t = (1 - roughness) * (1 - roughness);
        const auto mixed = [t](double rough, double smooth) { return T(rough) + (T(smooth) - T(rough)) * t; };
        return mixed(21.5473, 25.3245) / (1 + mixed(3.82987, 3.32435) * std::pow(x, mixed(0.19823, 0.16801))) +
               mixed(-1.97760, -1.27393) * x + mixed(-4.32054, -4.85967);
    }
};

/// What white sheen reflects in all of what comes from a direction at this cosine. Computed at the first call, which
/// takes some milliseconds; later ones interpolate.
inline float charlie_albedo(float cosine, float roughness) {
    static const AlbedoTable<float> table([](double mu, double r) {
        const Charlie<double> sheen{std::max(r, Charlie<double>::smallest_roughness)};
        const Vec3d wo(std::sqrt((1 - mu) * (1 + mu)), 0, mu);
        const double lambda = sheen.lambda(mu);
        constexpr int n = 12;
        double sum = 0;
        for (int i = 0; i < n; ++i) {
            const double x = (i + 0.5) / n, z = x * x; // most of it lies at the horizon
            const double visibility = Charlie<double>::visibility(mu, lambda, z, sheen.lambda(z));
            double around = 0;
            for (int j = 0; j < n; ++j) {
                const double phi = pi<double> * (j + 0.5) / n, s = std::sqrt((1 - z) * (1 + z));
                around += sheen.distribution(wo + Vec3d(s * std::cos(phi), s * std::sin(phi), z));
            }
            sum += visibility * around * z * 2 * x;
        }
        return float(std::min(1.0, sum * 2 * pi<double> / (n * n)));
    });
    return table.at(cosine, roughness);
}

} // namespace LAMBENT_ABI
} // namespace lambent
