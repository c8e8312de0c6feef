#pragma once
#include <lambent/core/vec.hpp>
#include <lambent/denoise/between_blocks.hpp>
#include <lambent/film/pixel_view.hpp>
#include <lambent/film/region.hpp>
#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// What restore_energy() knows of an image: sums over squares of pixels, which can be taken of one part of the image
/// after the other, and the factors that follow from them.
class EnergyBlocks {
public:
    static constexpr int side = 16; ///< of a square, in pixels
    static constexpr double brightest = 2; ///< the most that a square gets: where hardly any sample found light, it
                                           ///< may have next to nothing, and share its factor with lit ones beside it

    EnergyBlocks(int width, int height)
        : across_((width + side - 1) / side), down_((height + side - 1) / side),
          blocks_(std::size_t(across_) * std::size_t(down_)) {}

    /// Takes a part of the image that begins at multiples of `side`.
    /// dim  in the sum of channels: what is much darker does not count by its own light
    template <std::floating_point T>
    void add(const PixelWindow& part, const PixelView<const T, 3>& image, const PixelView<const T, 3>& noisy,
             double dim) {
        for (int y = 0; y < part.height(); ++y)
            for (int x = 0; x < part.width(); ++x) {
                Block& b = at((part.x0 + x) / side, (part.y0 + y) / side);
                const Vec3<double> has(image.load(x, y)), given(noisy.load(x, y));
                const double light = std::max(0.0, has.x + has.y + has.z);
                const double weight = dim > 0 ? dim / (dim + light) : 1;
                b.pixels += 1;
                for (std::size_t c = 0; c < 3; ++c) {
                    b.relative[c].add(weight * has[int(c)], weight * given[int(c)]);
                    b.light[c].add(has[int(c)], given[int(c)]);
                }
            }
    }

    /// Once all parts are there. Over ever smaller squares, then over the whole image.
    void solve() {
        for (const int reach : {4, 2, 1, 0})
            for (std::size_t c = 0; c < 3; ++c) {
                std::vector<double> factors(blocks_.size());
                for (int j = 0; j < down_; ++j)
                    for (int i = 0; i < across_; ++i) {
                        Sums sums;
                        double pixels = 0;
                        for (int v = std::max(0, j - reach); v <= std::min(down_ - 1, j + reach); ++v)
                            for (int u = std::max(0, i - reach); u <= std::min(across_ - 1, i + reach); ++u) {
                                sums.add(at(u, v).relative[c]);
                                pixels += at(u, v).pixels;
                            }
                        factors[std::size_t(j * across_ + i)] = sums.factor(pixels);
                    }
                for (std::size_t i = 0; i < blocks_.size(); ++i) {
                    Block& b = blocks_[i];
                    const double factor = std::min(factors[i], brightest / b.factor[c]);
                    b.factor[c] *= factor;
                    b.relative[c].scale(factor);
                }
            }
        for (std::size_t c = 0; c < 3; ++c) {
            Sums all;
            double pixels = 0;
            for (int j = 0; j < down_; ++j)
                for (int i = 0; i < across_; ++i) {
                    Sums sums = at(i, j).light[c];
                    sums.scale(mean_factor(i, j, c));
                    all.add(sums);
                    pixels += at(i, j).pixels;
                }
            const double factor = all.factor(pixels);
            for (Block& b : blocks_) b.factor[c] *= factor;
        }
    }

    /// What a pixel is to be multiplied by, linear between the middles of squares.
    Vec3<double> factor(int x, int y) const {
        const BetweenBlocks between(x, y, side, across_, down_);
        Vec3<double> out;
        for (std::size_t c = 0; c < 3; ++c)
            out[int(c)] = between.mean([&](int i, int j) { return at(i, j).factor[c]; });
        return out;
    }

private:
    /// Of one channel: what the image has, what it was given, and their products.
    struct Sums {
        double has = 0, given = 0, has2 = 0, both = 0, given2 = 0;

        void add(double h, double g) {
            has += h, given += g, has2 += h * h, both += h * g, given2 += g * g;
        }
        void add(const Sums& s) {
            has += s.has, given += s.given, has2 += s.has2, both += s.both, given2 += s.given2;
        }
        void scale(double f) {
            has *= f, has2 *= f * f, both *= f;
        }
        /// 1 where what is lacking does not stand out from its noise.
        double factor(double pixels) const {
            const double mean = (given - has) / pixels, squares = (given2 - 2 * both + has2) / pixels;
            const double mean2 = mean * mean, noise2 = std::max(0.0, squares - mean2) / pixels;
            if (!(mean2 > 2 * noise2) || !(has > 1e-12 * pixels)) return 1;
            return std::max(0.0, 1 + (1 - 2 * noise2 / mean2) * mean * pixels / has);
        }
    };
    struct Block {
        std::array<Sums, 3> relative{}, light{};
        std::array<double, 3> factor{1, 1, 1};
        double pixels = 0;
    };

    /// The mean of factor() over a square.
    double mean_factor(int i, int j, std::size_t c) const {
        double sum = 0;
        for (int v = -1; v <= 1; ++v)
            for (int u = -1; u <= 1; ++u)
                sum += at(std::clamp(i + u, 0, across_ - 1), std::clamp(j + v, 0, down_ - 1)).factor[c] *
                       (u == 0 ? 0.75 : 0.125) * (v == 0 ? 0.75 : 0.125);
        return sum;
    }
    std::size_t index(int i, int j) const { return std::size_t(j) * std::size_t(across_) + std::size_t(i); }
    Block& at(int i, int j) { return blocks_[index(i, j)]; }
    const Block& at(int i, int j) const { return blocks_[index(i, j)]; }

    int across_, down_;
    std::vector<Block> blocks_;
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
