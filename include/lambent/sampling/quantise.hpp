#pragma once
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <lambent/core/error.hpp>
#include <lambent/core/numerics.hpp>
#include <span>
#include <string>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Shares `total` whole quanta out in proportion to `weights`: a probability that is a count cannot differ
/// between the code that draws and the code that asks. Zero weights get 0, all others at least 1, and the
/// counts add up to `total` to the last one. Returns false, all counts 0, where no weight is above 0.
/// throws  lambent::Error, with `what` in front, on a negative or non-finite weight, or when total is less than
///         four times the number of weights
/// cost    O(n), one pass in double after one for the largest
template <std::floating_point T, class Count>
inline bool quantise_weights(std::span<const T> weights, std::uint64_t total, std::span<Count> counts,
                             const char* what) {
    require(weights.size() <= total / 4,
            [&] { return std::string(what) + ": too many weights, " + std::to_string(weights.size()); });
    T largest = 0;
    std::size_t largest_index = 0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
        require(is_finite(weights[i]) && weights[i] >= 0, [&] {
            return std::string(what) + ": weight " + std::to_string(i) +
                   " must be finite and not negative, it is " + std::to_string(weights[i]);
        });
        if (weights[i] > largest) largest = weights[largest_index = i];
    }
    if (!(largest > 0)) {
        for (Count& count : counts) count = 0;
        return false;
    }
    CompensatedSum<double> sum; // of weights over the largest, so that it cannot overflow
    for (const T weight : weights) sum.add(double(weight) / double(largest));
    const double scale = double(total) / sum.value();

    std::uint64_t shared = 0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
        std::uint64_t count = 0;
        if (weights[i] > 0)
            count = std::uint64_t(std::fmax(1.0, double(weights[i]) / double(largest) * scale + 0.5));
        counts[i] = Count(count);
        shared += count;
    }
    // Rounding left or took at most one quantum a weight: small beside the largest.
    counts[largest_index] = Count(std::uint64_t(counts[largest_index]) + total - shared);
    return true;
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
