#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/film/pixel_view.hpp>
#include <algorithm>
#include <cstddef>
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

/// Gives every pixel with a NaN or an infinity the mean of its finite neighbours, from the smallest square
/// around it that holds one, up to `radius` pixels; 0 where there is none. In place; repaired pixels do not
/// repair others. Gives the number of pixels repaired.
template <std::floating_point T>
std::size_t repair_non_finite(const PixelView<T, 3>& image, int radius = 32) {
    std::vector<std::pair<std::size_t, Vec3<T>>> repairs;
    const int width = image.width(), height = image.height();
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            if (is_finite(image.load(x, y))) continue;
            Vec3<T> mean(0);
            int count = 0;
            for (int r = 1; r <= radius && count == 0; ++r)
                for (int v = std::max(0, y - r); v <= std::min(height - 1, y + r); ++v)
                    for (int u = x - r; u <= x + r; u += v == y - r || v == y + r ? 1 : 2 * r) { // the square's rim
                        if (u < 0 || u >= width) continue;
                        const Vec3<T> value = image.load(u, v);
                        if (is_finite(value)) mean += (value - mean) / T(++count);
                    }
            repairs.emplace_back(std::size_t(y) * std::size_t(width) + std::size_t(x), mean);
        }
    for (const auto& [index, value] : repairs)
        image.store(int(index % std::size_t(width)), int(index / std::size_t(width)), value);
    return repairs.size();
}

} // namespace LAMBENT_ABI
} // namespace lambent
