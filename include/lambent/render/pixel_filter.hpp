#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace lambent {
inline namespace LAMBENT_ABI {

/// How a pixel weighs the image around its centre. Samples are drawn by the weight, so that each counts as one and pixels
/// stay independent of each other. box: the pixel itself. tent: falls to 0 at the neighbours' centres. blackman_harris:
/// four cosine terms, 0 at 1.5 pixels; the smoothest.
enum class PixelFilter : std::uint8_t { box, tent, blackman_harris };

namespace detail {

/// The inverse of the distribution of the Blackman-Harris window over [-1, 1], at evenly spaced probabilities.
/// source  F. Harris, Proceedings of the IEEE 66:1 (1978)
// A function and not a lambda where it is used: gcc would try to run that when it compiles, which takes it 3 s.
inline std::array<double, 1025> make_blackman_harris_quantiles() {
    // Integral of a0 + a1 cos(πx) + a2 cos(2πx) + a3 cos(3πx) from -1 to x, over that to 1.
    const auto below = [](double x) {
        const double a = pi<double> * x;
        return (0.35875 * (a + pi<double>) + 0.48829 * std::sin(a) + 0.14128 / 2 * std::sin(2 * a) +
                0.01168 / 3 * std::sin(3 * a)) /
               (0.35875 * 2 * pi<double>);
    };
    std::array<double, 1025> t{};
    for (std::size_t i = 0; i < t.size(); ++i) {
        const double p = double(i) / double(t.size() - 1);
        double low = -1, high = 1;
        for (int step = 0; step < 60; ++step) (below((low + high) / 2) < p ? low : high) = (low + high) / 2;
        t[i] = (low + high) / 2;
    }
    t.front() = -1;
    t.back() = 1;
    return t;
}

inline const std::array<double, 1025>& blackman_harris_quantiles() {
    static const std::array<double, 1025> table = make_blackman_harris_quantiles();
    return table;
}

} // namespace detail

/// Offset from a pixel's centre, in pixels, of one coordinate u in [0, 1).
template <class T>
T filter_offset(PixelFilter filter, T u) {
    switch (filter) {
    case PixelFilter::box: break;
    case PixelFilter::tent: return u < T(0.5) ? std::sqrt(2 * u) - 1 : 1 - std::sqrt(2 * (1 - u));
    case PixelFilter::blackman_harris: {
        const auto& table = detail::blackman_harris_quantiles();
        const double at = std::clamp(double(u), 0.0, 1.0) * double(table.size() - 1);
        const auto i = std::min(std::size_t(at), table.size() - 2);
        const double f = at - double(i);
        return T(1.5 * (table[i] * (1 - f) + table[i + 1] * f));
    }
    }
    return u - T(0.5);
}

} // namespace LAMBENT_ABI
} // namespace lambent
