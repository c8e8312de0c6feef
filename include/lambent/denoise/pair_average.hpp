#pragma once
#include <lambent/core/parallel.hpp>
#include <lambent/film/pixel_data.hpp>
#include <algorithm>
#include <cmath>
#include <concepts>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// What a plane is after pair_average(), and the variance that is left.
template <class T>
struct PairAveraged {
    Plane<T, 3> mean, variance;
};

/// The mean of each pixel and those around it, up to `radius` away, that could be of the same value by their variance:
/// tested by patches of 3 x 3. A plane without variance comes out as it went in, and so do pixels that are not finite and
/// those beside them. Features of depth of field and of glass are as noisy as light, but have no shadows to lose.
/// cost    (2 · radius + 1)² taps a pixel
/// source  Welch's t; Rousselle, Manzi, Zwicker, Robust denoising using feature and color information (2013), for the idea
template <std::floating_point T, Executor E>
PairAveraged<T> pair_average(const PixelView<const T, 3>& plane, const PixelView<const T, 3>& variance, int radius,
                             double softness, E& executor) {
    const int width = plane.width(), height = plane.height();
    PairAveraged<T> out{Plane<T, 3>(width, height), Plane<T, 3>(width, height)};
    bool noisy = false;
    Plane<T, 1> noise(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const Vec3<T> v = variance.load(x, y);
            noise.view().store(x, y, v.x + v.y + v.z);
            noisy = noisy || v.x + v.y + v.z > 0;
            out.mean.view().store(x, y, plane.load(x, y));
            out.variance.view().store(x, y, v);
        }
    if (!noisy) return out;
    constexpr T floor = T(1e-6); // of features of about 1: rounding is no difference
    executor.parallel_for(std::size_t(height), 8, [&](std::size_t begin, std::size_t end) {
        const std::size_t row = std::size_t(width) + 2;
        std::vector<T> tests(3 * row);
        std::vector<Vec3<T>> sums(static_cast<std::size_t>(width));
        std::vector<T> weights(sums.size()), squares(sums.size());
        for (int y = int(begin); y < int(end); ++y) {
            std::fill(sums.begin(), sums.end(), Vec3<T>(0));
            std::fill(weights.begin(), weights.end(), T(0));
            std::fill(squares.begin(), squares.end(), T(0));
            for (int dy = -radius; dy <= radius; ++dy)
                for (int dx = -radius; dx <= radius; ++dx) {
                    const int there = y + dy;
                    if (there < 0 || there >= height) continue;
                    for (int k = 0; k < 3; ++k) {
                        const int v = std::clamp(y + k - 1, 0, height - 1), w = std::clamp(there + k - 1, 0, height - 1);
                        for (int x = 0; x < width; ++x) {
                            const int u = std::clamp(x + dx, 0, width - 1);
                            const Vec3<T> d = plane.load(x, v) - plane.load(u, w);
                            tests[std::size_t(k) * row + std::size_t(x) + 1] =
                                dot(d, d) / (noise.load(x, v) + noise.load(u, w) + floor);
                        }
                        T* const t = &tests[std::size_t(k) * row];
                        t[0] = t[1];
                        t[row - 1] = t[row - 2];
                    }
                    for (int x = std::max(0, -dx); x < std::min(width, width - dx); ++x) {
                        T sum = 0;
                        for (std::size_t k = 0; k < 3; ++k)
                            for (std::size_t i = 0; i < 3; ++i) sum += tests[k * row + std::size_t(x) + i];
                        const T excess = sum / 9 - 1;
                        if (!(excess <= T(8 * softness))) continue; // nor where a value is not finite
                        const T weight = excess > 0 ? std::exp(-excess / T(softness)) : T(1);
                        const auto i = std::size_t(x);
                        sums[i] += weight * plane.load(x + dx, there);
                        weights[i] += weight;
                        squares[i] += weight * weight;
                    }
                }
            for (int x = 0; x < width; ++x) {
                const auto i = std::size_t(x);
                if (!(weights[i] > 0)) continue;
                out.mean.view().store(x, y, sums[i] / weights[i]);
                out.variance.view().store(x, y, variance.load(x, y) * (squares[i] / (weights[i] * weights[i])));
            }
        }
    });
    return out;
}

} // namespace LAMBENT_ABI
} // namespace lambent
