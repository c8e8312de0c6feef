#pragma once
#include <lambent/denoise/between_blocks.hpp>
#include <lambent/denoise/denoise_options.hpp>
#include <lambent/denoise/noise_level.hpp>
#include <lambent/film/pixel_view.hpp>
#include <lambent/film/region.hpp>
#include <algorithm>
#include <concepts>
#include <cstddef>
#include <limits>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Where so few samples find light that tests of their statistics say nothing: most pixels have none at all and look sure
/// of that. A wide filter that goes by features alone takes the regression's place there. Where that is follows from
/// noise_level() of squares of pixels, which may be counted in any order.
class SparseLight {
public:
    static constexpr int side = 16; ///< of a square, in pixels
    static constexpr double regression_up_to = 0.7, filter_from = 0.85; ///< levels of noise; both in between

    SparseLight(int width, int height)
        : w_(width), h_(height), across_((width + side - 1) / side), down_((height + side - 1) / side),
          blocks_(std::size_t(across_) * std::size_t(down_)) {}

    /// Pixel (x, y) of the image with its right and its lower neighbour, which is pixel `at` of the illumination.
    template <std::floating_point T>
    void add(int x, int y, const PixelView<const T, 3>& illumination, int at_x, int at_y) {
        add_noise_pairs(blocks_[index(x / side, y / side)], illumination, at_x, at_y);
    }

    /// Once all are there; before what follows.
    void find() {
        levels_.resize(blocks_.size());
        for (int j = 0; j < down_; ++j)
            for (int i = 0; i < across_; ++i) levels_[index(i, j)] = level(i, j);
    }

    /// All pixels that the filter has a part in lie there; empty where there are none.
    PixelWindow part() const {
        PixelWindow box{across_, down_, 0, 0}; // of squares
        for (int j = 0; j < down_; ++j)
            for (int i = 0; i < across_; ++i)
                if (levels_[index(i, j)] > regression_up_to)
                    box = {std::min(box.x0, i), std::min(box.y0, j), std::max(box.x1, i + 1), std::max(box.y1, j + 1)};
        if (box.empty()) return {};
        return PixelWindow{box.x0 * side, box.y0 * side, std::min(w_, box.x1 * side), std::min(h_, box.y1 * side)}.grown(
            side / 2, w_, h_); // half a square further to the middle of the next
    }
    /// The filter's part in a pixel, in [0, 1]: linear between the middles of squares.
    double share(int x, int y) const {
        const double level = BetweenBlocks(x, y, side, across_, down_).mean([&](int i, int j) { return levels_[index(i, j)]; });
        return std::clamp((level - regression_up_to) / (filter_from - regression_up_to), 0.0, 1.0);
    }
    /// The filter, up to three times as wide as elsewhere and in the end without regard to outliers, the less light there
    /// is where it works.
    DenoiseOptions filter() const {
        NoisePairs sparse;
        for (std::size_t i = 0; i < blocks_.size(); ++i)
            if (levels_[i] > regression_up_to) sparse.add(blocks_[i]);
        const double dark = std::clamp((sparse.level() - filter_from) / 0.1, 0.0, 1.0);
        DenoiseOptions options;
        options.kernel = 2 * int(16 + 32 * dark) + 1;
        options.despike = dark < 1 ? options.despike / (1 - dark) : std::numeric_limits<double>::infinity();
        return options;
    }

private:
    /// Of a square, or of as many around it as it takes to know: where no sample found light there is no noise.
    double level(int i, int j) const {
        NoisePairs sum;
        for (int reach = 0; reach < 4; ++reach) {
            sum = {};
            for (int v = std::max(0, j - reach); v <= std::min(down_ - 1, j + reach); ++v)
                for (int u = std::max(0, i - reach); u <= std::min(across_ - 1, i + reach); ++u)
                    sum.add(blocks_[index(u, v)]);
            if (sum.pairs >= 8) break; // two pixels with light, alone
        }
        return sum.level();
    }
    std::size_t index(int i, int j) const { return std::size_t(j) * std::size_t(across_) + std::size_t(i); }

    int w_, h_, across_, down_;
    std::vector<NoisePairs> blocks_;
    std::vector<double> levels_; ///< of the squares
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
