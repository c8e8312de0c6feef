#pragma once
#include <lambent/core/executor.hpp>
#include <lambent/film/pixel_data.hpp>
#include <algorithm>

namespace lambent {
inline namespace LAMBENT_ABI {

/// How far apart the surface points of neighbouring pixels are, in the positions' unit: the smaller of the steps
/// along the row and along the column, each over both neighbours, so that an edge on one axis does not count.
/// Scaling the scene scales it; 0 where all neighbours lie on one point.
template <std::floating_point T, Executor E>
Plane<T, 1> pixel_footprint(const PixelView<const T, 3>& position, E& executor) {
    const int width = position.width(), height = position.height();
    Plane<T, 1> footprint(width, height);
    executor.parallel_for(std::size_t(height), 16, [&](std::size_t begin, std::size_t end) {
        for (int y = int(begin); y < int(end); ++y)
            for (int x = 0; x < width; ++x) {
                const int left = std::max(0, x - 1), right = std::min(width - 1, x + 1);
                const int up = std::max(0, y - 1), down = std::min(height - 1, y + 1);
                const auto step = [](const Vec3<T>& a, const Vec3<T>& b, int pixels) {
                    return pixels > 0 ? length(b - a) / T(pixels) : std::numeric_limits<T>::infinity();
                };
                const T row = step(position.load(left, y), position.load(right, y), right - left);
                const T column = step(position.load(x, up), position.load(x, down), down - up);
                const T smaller = std::min(row, column);
                footprint.store(x, y, is_finite(smaller) ? smaller : T(0));
            }
    });
    return footprint;
}

} // namespace LAMBENT_ABI
} // namespace lambent
