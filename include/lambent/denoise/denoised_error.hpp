#pragma once
#include <lambent/core/executor.hpp>
#include <lambent/denoise/box_mean.hpp>
#include <lambent/denoise/spread_factor.hpp>
#include <lambent/film/pixel_data.hpp>
#include <algorithm>
#include <cmath>
#include <concepts>

namespace lambent {
inline namespace LAMBENT_ABI {

/// The expected error of a denoised image, a channel each, as a standard deviation: the truth lies within 1.96 of it in
/// 95 of 100 pixels. Its square is what is left of the input's noise, `own` of it and 2.4 % of that around, by how much
/// the difference to the input exceeds that noise over 7 x 7 pixels, which is bias, and a floor of 0.6 % of the value.
/// own      share that the pixel's own input has in the result, in [0, 1]
/// halves   as of PixelData, or absent: then well-spread samples are thought to err more than they do
/// measured coverage of the factors: `bench_denoise --methods best` prints it
/// threads  the same bits for any executor
template <std::floating_point T, Executor E>
void denoised_error(const PixelView<const T, 3>& clean, const PixelView<const T, 3>& noisy,
                    const PixelView<const T, 3>& variance, const PixelView<const T, 3>& halves,
                    const PixelView<const T, 1>& own, const PixelView<T, 3>& error, E& executor) {
    require_same_size("denoised_error: clean and noisy", clean, noisy);
    require_same_size("denoised_error: clean and variance", clean, variance);
    require_same_size("denoised_error: clean and own share", clean, own);
    require_same_size("denoised_error: clean and error", clean, error);
    const int width = clean.width(), height = clean.height();
    const Plane<T, 1> factor = spread_factor<T>(variance, halves, executor);
    for (int c = 0; c < 3; ++c) {
        const auto noise = [&](int x, int y) {
            const T v = variance.load(x, y)[c] * factor.load(x, y);
            return is_finite(v) ? v : T(0);
        };
        const Plane<T, 1> around = box_mean<T>(width, height, 3, noise, executor);
        const Plane<T, 1> difference = box_mean<T>(width, height, 3, [&](int x, int y) {
            const T d = clean.load(x, y)[c] - noisy.load(x, y)[c];
            return is_finite(d) ? d * d : T(0);
        }, executor);
        executor.parallel_for(std::size_t(height), 16, [&](std::size_t begin, std::size_t end) {
            for (int y = int(begin); y < int(end); ++y)
                for (int x = 0; x < width; ++x) {
                    const T value = clean.load(x, y)[c], n2 = around.load(x, y);
                    const T bias2 = std::max(T(0), difference.load(x, y) - n2);
                    Vec3<T> e = error.load(x, y);
                    e[c] = std::sqrt((T(0.5) * own.load(x, y) + T(0.024)) * n2 + bias2 + T(4e-5) * value * value);
                    error.store(x, y, e);
                }
        });
    }
}

/// The expected √rel_mse of a denoised image against the truth, from its denoised_error(), over the pixels that see no
/// emitter, as estimated_error() of noisy frames. Negative where all do. An absent `emission` leaves out none.
template <class T>
double estimated_error(const PixelView<const T, 3>& clean, const PixelView<const T, 3>& error,
                       const PixelView<const T, 3>& emission) {
    require_same_size("estimated_error: image and its error", clean, error);
    if (!emission.absent()) require_same_size("estimated_error: image and emission", clean, emission);
    const auto each = [&](auto&& visit) {
        for (int y = 0; y < clean.height(); ++y)
            for (int x = 0; x < clean.width(); ++x) {
                if (!emission.absent() && max_component(emission.load(x, y)) > 0) continue;
                const Vec3d value(clean.load(x, y)), e(error.load(x, y));
                for (int c = 0; c < 3; ++c) visit(value[c] * value[c], e[c] * e[c]);
            }
    };
    double squares = 0, n = 0, sum = 0;
    each([&](double value2, double) {
        squares += value2;
        n += 1;
    });
    if (n == 0) return -1;
    const double floor = 0.01 * squares / n;
    each([&](double value2, double error2) {
        if (value2 + floor > 0) sum += error2 / (value2 + floor);
    });
    return std::sqrt(sum / n);
}

} // namespace LAMBENT_ABI
} // namespace lambent
