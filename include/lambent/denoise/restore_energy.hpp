#pragma once
#include <lambent/core/executor.hpp>
#include <lambent/film/pixel_data.hpp>
#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {
/// Sums of three values over squares around pixels in constant time a pixel, whatever their radius.
class SquareSums {
public:
    using Values = std::array<double, 3>;

    template <class F> // f(x, y) gives Values
    SquareSums(int width, int height, F&& f)
        : width_(width), height_(height), sums_(std::size_t(width + 1) * std::size_t(height + 1)) {
        for (int y = 0; y < height; ++y) {
            Values row{};
            for (int x = 0; x < width; ++x) {
                const Values here = f(x, y), &above = at(x + 1, y);
                Values& to = at(x + 1, y + 1);
                for (std::size_t i = 0; i < 3; ++i) to[i] = above[i] + (row[i] += here[i]);
            }
        }
    }
    Values means(int x, int y, int radius) const {
        const int x0 = std::max(0, x - radius), x1 = std::min(width_, x + radius + 1);
        const int y0 = std::max(0, y - radius), y1 = std::min(height_, y + radius + 1);
        const Values &a = at(x0, y0), &b = at(x1, y0), &c = at(x0, y1), &d = at(x1, y1);
        const double part = 1 / count(x, y, radius);
        return {(d[0] - c[0] - b[0] + a[0]) * part, (d[1] - c[1] - b[1] + a[1]) * part,
                (d[2] - c[2] - b[2] + a[2]) * part};
    }
    double count(int x, int y, int radius) const {
        return double(std::min(width_, x + radius + 1) - std::max(0, x - radius)) *
               double(std::min(height_, y + radius + 1) - std::max(0, y - radius));
    }

private:
    std::size_t index(int x, int y) const {
        return std::size_t(y) * std::size_t(width_ + 1) + std::size_t(x);
    }
    Values& at(int x, int y) { return sums_[index(x, y)]; }
    const Values& at(int x, int y) const { return sums_[index(x, y)]; }

    int width_, height_;
    std::vector<Values> sums_;
};
} // namespace detail

/// Gives back to `image` the light that it lacks, or takes what it has too much, against `noisy`, which is right in the
/// mean: by factors over ever smaller squares, then over the whole image, each only as far as the difference stands out
/// from its noise. In squares a pixel counts by what it lacks relative to what it has and a third of the image's mean:
/// what lamps and their reflections lack does not brighten the dark pixels around them. The whole keeps its energy.
/// cost    5 passes, constant a pixel
template <std::floating_point T>
void restore_energy(const PixelView<T, 3>& image, const PixelView<const T, 3>& noisy) {
    const int width = image.width(), height = image.height();
    double whole = 0;
    const auto sum = [&](int x, int y) {
        const Vec3<T> v = image.load(x, y);
        return std::max(0.0, double(v.x) + double(v.y) + double(v.z));
    };
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) whole += sum(x, y);
    const double dim = whole / (3.0 * width * height);
    std::vector<double> weights(std::size_t(width) * std::size_t(height), 1);
    const auto at = [&](int x, int y) { return std::size_t(y) * std::size_t(width) + std::size_t(x); };
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            if (dim > 0) weights[at(x, y)] = dim / (dim + sum(x, y));
    constexpr int all = 1 << 28;
    for (const int radius : {64, 32, 16, 8, all})
        for (int c = 0; c < 3; ++c) {
            const int r = std::min(radius, std::max(width, height));
            const detail::SquareSums sums(width, height, [&](int x, int y) {
                const double weight = radius == all ? 1 : weights[at(x, y)], has = weight * double(image.load(x, y)[c]);
                const double lack = weight * double(noisy.load(x, y)[c]) - has;
                return detail::SquareSums::Values{lack, lack * lack, has};
            });
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    const auto [mean, squares, there] = sums.means(x, y, r);
                    const double mean2 = mean * mean;
                    const double noise2 = std::max(0.0, squares - mean2) / sums.count(x, y, r);
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
