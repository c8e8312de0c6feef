#pragma once
#include <lambent/core/config.hpp>
#include <array>
#include <cstddef>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// N sums over an image, the same to the bit in whatever order its parts come: kept for squares of pixels, which lie in
/// one part each, and added up at the end.
template <std::size_t N>
class BlockSums {
public:
    static constexpr int side = 16; ///< of a square; parts begin at its multiples

    BlockSums(int width, int height)
        : across_((width + side - 1) / side), sums_(std::size_t(across_) * std::size_t((height + side - 1) / side)) {}

    void add(int x, int y, std::size_t which, double value) {
        sums_[std::size_t(y / side) * std::size_t(across_) + std::size_t(x / side)][which] += value;
    }
    double total(std::size_t which) const {
        double sum = 0;
        for (const auto& block : sums_) sum += block[which];
        return sum;
    }

private:
    int across_;
    std::vector<std::array<double, N>> sums_;
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
