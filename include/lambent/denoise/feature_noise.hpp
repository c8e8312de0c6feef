#pragma once
#include <lambent/core/executor.hpp>
#include <lambent/denoise/box_mean.hpp>
#include <lambent/film/pixel_data.hpp>
#include <algorithm>
#include <concepts>
#include <cstddef>

namespace lambent {
inline namespace LAMBENT_ABI {

/// The variance of a feature's noise, by the pixels around, for want of samples: by how much a pixel differs from the
/// mean of two opposite neighbours, in the one of four directions in which it does so least, the mean of 3 x 3 pixels.
/// Slopes and straight edges have none along themselves; what depth of field and the pixels' own area scatter has some
/// in every direction. Textures as fine as pixels count as noise.
/// plane   finite
/// returns its unit squared: 1.1 to 1.9 times the variance of independent normal noise of one to three channels
/// cost    about 100 operations a pixel
/// threads the same bits for any executor
template <std::floating_point T, Executor E>
Plane<T, 3> feature_noise(const PixelView<const T, 3>& plane, E& executor) {
    const int width = plane.width(), height = plane.height();
    Plane<T, 3> least(width, height), noise(width, height);
    const auto inside = [](int at, int size) { // mirrored at the border
        return std::clamp(at < 0 ? -at : at >= size ? 2 * size - 2 - at : at, 0, size - 1);
    };
    const auto sum = [](const Vec3<T>& v) { return v.x + v.y + v.z; };
    const PixelView<T, 3> out = least.view();
    executor.parallel_for(std::size_t(height), 16, [&](std::size_t begin, std::size_t end) {
        for (int y = int(begin); y < int(end); ++y)
            for (int x = 0; x < width; ++x) {
                const int left = inside(x - 1, width), right = inside(x + 1, width);
                const int up = inside(y - 1, height), down = inside(y + 1, height);
                const Vec3<T> here = plane.load(x, y);
                const auto difference2 = [&](const Vec3<T>& before, const Vec3<T>& after) {
                    const Vec3<T> d = here - (before + after) * T(0.5);
                    return d * d;
                };
                Vec3<T> smallest = difference2(plane.load(left, y), plane.load(right, y));
                for (const Vec3<T>& d2 : {difference2(plane.load(x, up), plane.load(x, down)),
                                          difference2(plane.load(left, up), plane.load(right, down)),
                                          difference2(plane.load(left, down), plane.load(right, up))})
                    if (sum(d2) < sum(smallest)) smallest = d2;
                out.store(x, y, smallest);
            }
    });
    // A difference has 3/2 of a pixel's variance. The least of four is .28 (one channel) to .48 (three) of their mean.
    const T factor = T(4 * 2.0 / 3);
    for (int c = 0; c < 3; ++c) {
        const Plane<T, 1> mean = box_mean<T>(width, height, 1, [&](int x, int y) { return out.load(x, y)[c]; }, executor);
        for (std::size_t i = 0; i < mean.values().size(); ++i)
            noise.values()[3 * i + std::size_t(c)] = factor * mean.values()[i];
    }
    return noise;
}

} // namespace LAMBENT_ABI
} // namespace lambent
