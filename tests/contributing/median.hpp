// contributing: begin
#pragma once
#include <lambent/core/parallel.hpp>
#include <lambent/film/pixel_data.hpp>
#include <algorithm>
#include <array>

namespace lambent {
inline namespace LAMBENT_ABI {

/// The median of 3 x 3 pixels, each channel for itself; at the border of those that are there. Takes single bright
/// pixels away and keeps edges. `out` may be the very view of `in`.
/// threads the same bits for any executor
/// throws  lambent::Error on unequal sizes, before anything is written
/// cost    9 loads and a partial sort of 9 a channel
template <std::floating_point T, Executor E>
void median(const PixelView<const T, 3>& in, const std::type_identity_t<PixelView<T, 3>>& out, E& executor) {
    require_same_size("median", in, out);
    Plane<T, 3> result(in.width(), in.height());
    executor.parallel_for(std::size_t(in.height()), 16, [&](std::size_t begin, std::size_t end) {
        for (int y = int(begin); y < int(end); ++y)
            for (int x = 0; x < in.width(); ++x) {
                std::array<std::array<T, 9>, 3> window;
                std::size_t n = 0;
                for (int v = std::max(y - 1, 0); v <= std::min(y + 1, in.height() - 1); ++v)
                    for (int u = std::max(x - 1, 0); u <= std::min(x + 1, in.width() - 1); ++u, ++n)
                        for (std::size_t c = 0; c < 3; ++c) window[c][n] = in.load(u, v)[int(c)];
                Vec3<T> value;
                for (std::size_t c = 0; c < 3; ++c) {
                    const auto middle = window[c].begin() + std::ptrdiff_t(n / 2);
                    std::nth_element(window[c].begin(), middle, window[c].begin() + std::ptrdiff_t(n));
                    value[int(c)] = *middle;
                }
                result.view().store(x, y, value);
            }
    });
    for (int y = 0; y < in.height(); ++y)
        for (int x = 0; x < in.width(); ++x) out.store(x, y, result.load(x, y));
}

} // namespace LAMBENT_ABI
} // namespace lambent
// contributing: end
