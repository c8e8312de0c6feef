#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/numerics.hpp>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// The sigma, in pixels, that fits a kernel of `size` taps: it reaches 3.2 sigma to either side.
constexpr double gaussian_sigma(int size) { return size / 6.4; }

/// Gaussian of `size` taps, exp(-x² / 2 sigma²) with x in pixels from the middle tap, scaled to sum 1.
/// `sigma` in pixels; 0 takes gaussian_sigma(size), infinity gives a box.
/// throws lambent::Error unless size is odd and >= 1 and sigma >= 0
template <std::floating_point T>
std::vector<T> gaussian_kernel(int size, double sigma = 0) {
    require(size >= 1 && size % 2 == 1, [&] {
        return "gaussian_kernel: the size must be odd and at least 1, not " + std::to_string(size);
    });
    require(sigma >= 0, [&] {
        return "gaussian_kernel: sigma must be positive, or 0 for size / 6.4, not " + std::to_string(sigma);
    });
    if (sigma == 0) sigma = gaussian_sigma(size);
    const int radius = size / 2;
    std::vector<double> weights(std::size_t(size), 0.0);
    CompensatedSum<double> sum;
    for (int i = 0; i < size; ++i) {
        const double x = (i - radius) / sigma;
        sum.add(weights[std::size_t(i)] = std::exp(-0.5 * x * x));
    }
    std::vector<T> kernel;
    kernel.reserve(weights.size());
    for (const double weight : weights) kernel.push_back(T(weight / sum.value()));
    return kernel;
}

} // namespace LAMBENT_ABI
} // namespace lambent
