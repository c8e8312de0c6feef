#pragma once
#include <lambent/core/executor.hpp>
#include <lambent/film/pixel_data.hpp>
#include <algorithm>
#include <concepts>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// The means of value(x, y) over squares around pixels, (2 · radius + 1) a side, cut off at the image's border. Each is
/// summed anew: what one pixel has is of no account beyond the radius, however large it is.
/// cost    4 · radius + 2 additions a pixel
/// threads the same bits for any executor
template <std::floating_point T, class Value, Executor E>
Plane<T, 1> box_mean(int width, int height, int radius, Value&& value, E& executor) {
    Plane<T, 1> rows(width, height), means(width, height);
    const auto from = [&](int at) { return std::max(0, at - radius); };
    const auto to = [&](int at, int end) { return std::min(end, at + radius + 1); };
    executor.parallel_for(std::size_t(height), 16, [&](std::size_t begin, std::size_t end) {
        std::vector<T> row(std::size_t(width + 2 * radius)); // zeros beside it
        for (int y = int(begin); y < int(end); ++y) {
            T* const here = row.data() + radius;
            T* const out = &rows.values()[std::size_t(y) * std::size_t(width)];
            for (int x = 0; x < width; ++x) here[x] = T(value(x, y));
            for (int u = -radius; u <= radius; ++u)
                for (int x = 0; x < width; ++x) out[x] += here[x + u];
            for (int x = 0; x < width; ++x) out[x] /= T(to(x, width) - from(x));
        }
    });
    executor.parallel_for(std::size_t(height), 16, [&](std::size_t begin, std::size_t end) {
        for (int y = int(begin); y < int(end); ++y) {
            T* const out = &means.values()[std::size_t(y) * std::size_t(width)];
            for (int v = from(y); v < to(y, height); ++v) {
                const T* const in = &rows.values()[std::size_t(v) * std::size_t(width)];
                for (int x = 0; x < width; ++x) out[x] += in[x];
            }
            for (int x = 0; x < width; ++x) out[x] /= T(to(y, height) - from(y));
        }
    });
    return means;
}

} // namespace LAMBENT_ABI
} // namespace lambent
