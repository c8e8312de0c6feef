#pragma once
#include <lambent/core/executor.hpp>
#include <lambent/film/pixel_data.hpp>
#include <algorithm>
#include <concepts>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {
/// Sums over squares around pixels in constant time a pixel, whatever their radius.
class SquareSums {
public:
    template <class F> // f(x, y)
    SquareSums(int width, int height, F&& f)
        : width_(width), height_(height), sums_(std::size_t(width + 1) * std::size_t(height + 1)) {
        for (int y = 0; y < height; ++y) {
            double row = 0;
            for (int x = 0; x < width; ++x) {
                row += f(x, y);
                at(x + 1, y + 1) = at(x + 1, y) + row;
            }
        }
    }
    double mean(int x, int y, int radius) const {
        const int x0 = std::max(0, x - radius), x1 = std::min(width_, x + radius + 1);
        const int y0 = std::max(0, y - radius), y1 = std::min(height_, y + radius + 1);
        return (at(x1, y1) - at(x0, y1) - at(x1, y0) + at(x0, y0)) / count(x, y, radius);
    }
    double count(int x, int y, int radius) const {
        return double(std::min(width_, x + radius + 1) - std::max(0, x - radius)) *
               double(std::min(height_, y + radius + 1) - std::max(0, y - radius));
    }

private:
    double& at(int x, int y) { return sums_[std::size_t(y) * std::size_t(width_ + 1) + std::size_t(x)]; }
    double at(int x, int y) const { return sums_[std::size_t(y) * std::size_t(width_ + 1) + std::size_t(x)]; }

    int width_, height_;
    std::vector<double> sums_;
};
} // namespace detail

/// Gives back to `image` the light that it lacks, or takes what it has too much, against `noisy`, which is right in the
/// mean: by factors over the whole image, then over ever smaller squares, each only as far as the difference stands out
/// from its noise.
/// cost    5 passes, constant a pixel
template <std::floating_point T>
void restore_energy(const PixelView<T, 3>& image, const PixelView<const T, 3>& noisy) {
    const int width = image.width(), height = image.height();
    for (const int radius : {1 << 28, 64, 32, 16, 8})
        for (int c = 0; c < 3; ++c) {
            const auto lack = [&](int x, int y) { return double(noisy.load(x, y)[c]) - double(image.load(x, y)[c]); };
            const int r = std::min(radius, std::max(width, height));
            const detail::SquareSums lacks(width, height, lack);
            const detail::SquareSums squares(width, height, [&](int x, int y) { return lack(x, y) * lack(x, y); });
            const detail::SquareSums has(width, height, [&](int x, int y) { return double(image.load(x, y)[c]); });
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    const double mean = lacks.mean(x, y, r), mean2 = mean * mean, there = has.mean(x, y, r);
                    const double noise2 = std::max(0.0, squares.mean(x, y, r) - mean2) / lacks.count(x, y, r);
                    if (!(mean2 > 2 * noise2) || !(there > 1e-12)) continue;
                    const double factor = 1 + (1 - 2 * noise2 / mean2) * mean / there;
                    Vec3<T> v = image.load(x, y);
                    v[c] *= T(std::max(0.0, factor));
                    image.store(x, y, v);
                }
        }
}

} // namespace LAMBENT_ABI
} // namespace lambent
