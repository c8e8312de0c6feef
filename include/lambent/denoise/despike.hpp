#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/executor.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/film/pixel_view.hpp>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// The seed document's firefly rule, in place: where r² + g² + b² > 3 · threshold², the pixel is divided by the
/// threshold. Not monotone: a little above the threshold comes out darker than a little below. An infinite
/// threshold changes no bit. Gives the number of pixels changed.
/// throws lambent::Error unless threshold is positive
template <std::floating_point T>
std::size_t suppress_fireflies_seed(const PixelView<T, 3>& image, double threshold) {
    require(threshold > 0, [&] {
        return "suppress_fireflies_seed: the threshold must be positive, not " + std::to_string(threshold);
    });
    if (!is_finite(threshold)) return 0;
    std::size_t changed = 0;
    const T limit = T(3 * threshold * threshold), divisor = T(threshold);
    for (int y = 0; y < image.height(); ++y)
        for (int x = 0; x < image.width(); ++x) {
            const Vec3<T> v = image.load(x, y);
            if (!(dot(v, v) > limit)) continue;
            image.store(x, y, v / divisor);
            ++changed;
        }
    return changed;
}

/// Scales pixels that outshine their neighbourhood down to its mean + `deviations` standard deviations, in the sum
/// of their channels, both taken over the 24 pixels around. Monotone: a brighter pixel never comes out darker; an
/// infinite `deviations` changes no bit. Values that are not finite neither count nor change. `out` must not be
/// `image`. Gives the number of pixels scaled.
/// throws lambent::Error unless deviations is positive and the sizes are equal
template <std::floating_point T, Executor E>
std::size_t despike(const PixelView<const T, 3>& image, const PixelView<T, 3>& out, double deviations, E& executor) {
    require(deviations > 0, [&] {
        return "despike: the number of deviations must be positive, not " + std::to_string(deviations);
    });
    require_same_size("despike: image and output", image, out);
    constexpr int radius = 2;
    const bool on = is_finite(deviations);
    const int width = image.width(), height = image.height();
    std::vector<std::size_t> scaled(std::size_t(height), 0);
    executor.parallel_for(scaled.size(), 16, [&](std::size_t begin, std::size_t end) {
        // Of the rows around, with nothing beside them: brightness, and whether it counts. Sums go row by row, several
        // pixels at once.
        const int rows = int(end - begin) + 2 * radius;
        const std::size_t stride = std::size_t(width + 2 * radius);
        std::vector<double> brightness(std::size_t(rows) * stride), counts(brightness.size());
        std::vector<double> mean(static_cast<std::size_t>(width)), squares(mean.size()), count(mean.size());
        const auto in = [&](std::vector<double>& plane, int y) {
            return plane.data() + std::size_t(y - int(begin) + radius) * stride + std::size_t(radius);
        };
        for (int y = std::max(0, int(begin) - radius); y < std::min(height, int(end) + radius); ++y)
            for (int x = 0; x < width; ++x) {
                const Vec3<T> value = image.load(x, y);
                const double b = double(value.x) + double(value.y) + double(value.z);
                in(brightness, y)[x] = is_finite(b) ? b : 0;
                in(counts, y)[x] = is_finite(b) ? 1 : 0;
            }
        const auto each_neighbour = [&](int y, auto&& add) {
            for (int v = -radius; v <= radius; ++v)
                for (int u = -radius; u <= radius; ++u)
                    if (u != 0 || v != 0) add(in(brightness, y + v) + u, in(counts, y + v) + u);
        };
        for (int y = int(begin); y < int(end); ++y) {
            for (std::vector<double>* plane : {&mean, &squares, &count}) std::fill(plane->begin(), plane->end(), 0.0);
            each_neighbour(y, [&](const double* b, const double* n) {
                for (std::size_t x = 0; x < mean.size(); ++x) mean[x] += b[x], count[x] += n[x];
            });
            for (std::size_t x = 0; x < mean.size(); ++x) mean[x] /= std::max(1.0, count[x]);
            each_neighbour(y, [&](const double* b, const double* n) { // no difference of large squares
                for (std::size_t x = 0; x < mean.size(); ++x) squares[x] += n[x] * ((b[x] - mean[x]) * (b[x] - mean[x]));
            });
            for (int x = 0; x < width; ++x) {
                const std::size_t i = std::size_t(x);
                Vec3<T> value = image.load(x, y);
                const double b = in(brightness, y)[x];
                const double limit = mean[i] + deviations * std::sqrt(squares[i] / std::max(1.0, count[i]));
                if (on && in(counts, y)[x] > 0 && count[i] > 0 && b > limit) {
                    value *= T(std::max(0.0, limit) / b);
                    ++scaled[std::size_t(y)];
                }
                out.store(x, y, value);
            }
        }
    });
    std::size_t total = 0;
    for (const std::size_t count : scaled) total += count;
    return total;
}

/// Whether sums over a filter's window can hold it: finite, and below 2^-28 of the largest number (10^30 in float).
template <std::floating_point T>
bool is_summable(const Vec3<T>& v) {
    constexpr T largest = std::numeric_limits<T>::max() / T(1 << 28);
    const auto fits = [](T x) { return is_finite(x) & (x <= largest) & (x >= -largest); }; // fast-math has no NaN
    return fits(v.x) & fits(v.y) & fits(v.z);
}

/// Gives every pixel that is not summable, as with a NaN or an infinity, the mean of its neighbours that are, from the
/// smallest square around it that holds one, up to `radius` pixels; 0 where there is none. In place; repaired pixels
/// do not repair others. Gives the number of pixels repaired.
template <std::floating_point T>
std::size_t repair_non_finite(const PixelView<T, 3>& image, int radius = 32) {
    std::vector<std::pair<std::size_t, Vec3<T>>> repairs;
    const int width = image.width(), height = image.height();
    for (int y = 0; y < height; ++y) {
        bool all = true; // without branches: of several at once
        for (int x = 0; x < width; ++x) all &= is_summable(image.load(x, y));
        for (int x = 0; x < width && !all; ++x) {
            if (is_summable(image.load(x, y))) continue;
            Vec3<T> mean(0);
            int count = 0;
            for (int r = 1; r <= radius && count == 0; ++r)
                for (int v = std::max(0, y - r); v <= std::min(height - 1, y + r); ++v)
                    for (int u = x - r; u <= x + r; u += v == y - r || v == y + r ? 1 : 2 * r) { // the square's rim
                        if (u < 0 || u >= width) continue;
                        const Vec3<T> value = image.load(u, v);
                        if (is_summable(value)) mean += (value - mean) / T(++count);
                    }
            repairs.emplace_back(std::size_t(y) * std::size_t(width) + std::size_t(x), mean);
        }
    }
    for (const auto& [index, value] : repairs)
        image.store(int(index % std::size_t(width)), int(index / std::size_t(width)), value);
    return repairs.size();
}

} // namespace LAMBENT_ABI
} // namespace lambent
