#pragma once
#include <lambent/core/config.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Parameters that go with the number of samples, between those at 1, 4, 16, 64 and 256.
struct BySamples {
    std::array<double, 5> at;
    double operator()(double samples) const {
        const double place = std::clamp(std::log2(std::max(1.0, samples)) / 2, 0.0, 4.0);
        const auto i = std::min(std::size_t(place), std::size_t(3));
        const double part = place - double(i);
        return at[i] * (1 - part) + at[i + 1] * part;
    }
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
