#pragma once
#include <lambent/core/config.hpp>
#include <algorithm>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Where a pixel lies between the middles of four squares, of `across` x `down` that an image is cut into.
struct BetweenBlocks {
    int left, right, above, below; ///< columns and rows of squares: the same ones beyond the outermost middles
    double to_right, to_below;     ///< in [0, 1)

    BetweenBlocks(int x, int y, int side, int across, int down) {
        const double u = std::max(0.0, (x + 0.5) / side - 0.5), v = std::max(0.0, (y + 0.5) / side - 0.5);
        left = int(u), above = int(v);
        right = std::min(left + 1, across - 1), below = std::min(above + 1, down - 1);
        to_right = u - left, to_below = v - above;
    }
    /// What value(column, row) is between the four, linearly.
    template <class Value>
    double mean(Value&& value) const {
        return (value(left, above) * (1 - to_right) + value(right, above) * to_right) * (1 - to_below) +
               (value(left, below) * (1 - to_right) + value(right, below) * to_right) * to_below;
    }
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
