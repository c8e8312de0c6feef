#pragma once
#include "support/statistics.hpp"
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <lambent/core/frame.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec.hpp>
#include <vector>

/// Directions for tests of what is drawn from hemispheres and spheres.
namespace lambent_test {

using lambent::Vec2d;
using lambent::Vec3d;

/// Unit, at this cosine to z.
inline Vec3d direction(double cosine, double phi = 0.4) {
    const double sine = std::sqrt((1 - cosine) * (1 + cosine));
    return {sine * std::cos(phi), sine * std::sin(phi), cosine};
}

/// The i-th of points that fill the unit cube evenly: (x, y) and z.
/// source  Roberts, The unreasonable effectiveness of quasirandom sequences (2018): powers of the root of x⁴ = x + 1
struct CubePoint {
    Vec2d u;
    double pick;
    explicit CubePoint(int i) {
        const auto part = [i](double step) { return std::fmod(0.5 + step * i, 1.0); };
        u = {part(0.8191725133961645), part(0.6710436067037893)};
        pick = part(0.5497004779019703);
    }
};

/// Bins about an axis whose rings are even in the cube root of tan(angle / 2) / scale: peaks of any width get their
/// share, and what is far from them as well.
class PeakBins {
public:
    PeakBins(const Vec3d& axis, double scale) : frame_(axis), scale_(scale) {}
    static constexpr int rings = 16, sectors = 6;

    std::size_t bin(const Vec3d& world) const {
        const Vec3d w = frame_.to_local(world);
        const double across = w.x * w.x + w.y * w.y; // for small angles, where 1 - w.z cancels
        const double s =
            std::cbrt(std::sqrt(w.z > 0 ? across / ((1 + w.z) * (1 + w.z)) : (1 - w.z) / (1 + w.z)) / scale_);
        const double ring = s < 1e6 ? rings * s / (1 + s) : rings;
        const double sector = sectors * (std::atan2(w.y, w.x) / (2 * lambent::pi<double>)+0.5);
        return std::size_t(std::clamp(int(ring), 0, rings - 1) * sectors + std::clamp(int(sector), 0, sectors - 1));
    }

    /// Integral of a density per solid angle over each bin, by fine² midpoints.
    template <class Pdf>
    std::vector<double> integrals(Pdf&& pdf, int fine = 24) const {
        std::vector<double> out(rings * sectors);
        for (int i = 0; i < rings * fine; ++i)
            for (int j = 0; j < sectors * fine; ++j) {
                const double t = (i + 0.5) / (rings * fine), root = t / (1 - t), s = scale_ * root * root * root;
                const double c = (1 - s * s) / (1 + s * s), sine = 2 * s / (1 + s * s);
                const double phi = ((j + 0.5) / (sectors * fine) - 0.5) * 2 * lambent::pi<double>;
                const double ds = scale_ * 3 * root * root / ((1 - t) * (1 - t)) / (rings * fine);
                const double area = sine * 2 * ds / (1 + s * s) * 2 * lambent::pi<double> / (sectors * fine);
                const Vec3d w = frame_.to_world({sine * std::cos(phi), sine * std::sin(phi), c});
                out[std::size_t(i / fine * sectors + j / fine)] += pdf(w) * area;
            }
        return out;
    }

private:
    lambent::Frame<double> frame_;
    double scale_;
};

/// How directions that were drawn agree with their density.
struct DensityTest {
    double integral = 0; ///< of the density
    double excess = 0; ///< |share of draws that gave none, less 1 - integral|, in units of what chance and 0.1 % allow
    double p = 0;      ///< chi-square's, of those that gave one
};

/// draw() gives a direction, or the zero vector for none, n times; pdf is its density per solid angle, in double.
template <class Draw, class Pdf>
DensityTest test_density(const PeakBins& bins, int n, Draw&& draw, Pdf&& pdf) {
    std::vector<double> observed(PeakBins::rings * PeakBins::sectors);
    double drawn = 0;
    for (int i = 0; i < n; ++i) {
        const Vec3d w = draw();
        if (w == Vec3d(0)) continue;
        ++observed[bins.bin(w)];
        ++drawn;
    }
    std::vector<double> expected = bins.integrals(pdf);
    DensityTest result;
    for (const double e : expected) result.integral += e;
    const double none = std::max(0.0, 1 - result.integral) * n;
    result.excess = std::abs(n - drawn - none) / (max_z * std::sqrt(none + 5) + 0.001 * n);
    // Bins that reach over the horizon by a sliver may expect nothing.
    for (double& e : expected) e = std::max(0.01, e * drawn / result.integral);
    result.p = chi_square_test(observed, expected);
    return result;
}

} // namespace lambent_test
