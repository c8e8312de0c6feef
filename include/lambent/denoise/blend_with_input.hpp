#pragma once
#include <lambent/core/executor.hpp>
#include <lambent/denoise/box_mean.hpp>
#include <lambent/film/pixel_data.hpp>
#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstdint>

namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {
inline constexpr int blend_reach = 4; ///< of blend_with_input(), in pixels
} // namespace detail

/// Puts back into the filtered `clean` as much of its input `noisy` as their difference exceeds the input's noise,
/// which is where the filter errs: the share 1 - 2 · variance / difference² (3 below 16 samples), of means over 3 x 3
/// pixels, at least 0, and no more than without the pixel of them that differs most, or with the variance over 5 x 5:
/// where light is rare, few pixels know nothing of their noise. A pixel whose samples agree with each other, but not
/// with a filter that made it more than twice or less than half as bright, is believed alone where it is one of three
/// in its 3 x 3 pixels. Neither where all that these pixels lack is less than a third of what one bright sample
/// brings, by the variances around. As the noise goes to 0 the result becomes the input, whatever the filter did, but
/// never less than black.
/// variance of the means in `noisy`; pixels that are not finite stay as the filter left them
/// samples  in a pixel, on the whole: below 2 there is no variance and nothing is done, below 8 agreement means nothing
/// light    mean of the channels' sum over the image that `clean` is a part of; 0: over `clean`. Pixels that are much
///          darker are compared as if they were not
/// threads  the same bits for any executor
/// source   James, Stein, Estimation with quadratic loss (1961); Firmino et al., Progressive denoising of Monte Carlo
///          rendered images, EGSR 2022, for the idea
template <std::floating_point T, Executor E>
void blend_with_input(const PixelView<T, 3>& clean, const PixelView<const T, 3>& noisy,
                      const PixelView<const T, 3>& variance, double samples, E& executor, double light = 0) {
    require_same_size("blend_with_input: clean and noisy", clean, noisy);
    require_same_size("blend_with_input: clean and variance", clean, variance);
    if (samples < 2) return;
    const int width = clean.width(), height = clean.height();
    const auto sum = [](const Vec3<T>& v) { return v.x + v.y + v.z; };
    const auto usable = [&](int x, int y) { return is_finite(noisy.load(x, y)) && is_finite(variance.load(x, y)); };
    const auto noise2 = [&](int x, int y) { return usable(x, y) ? sum(variance.load(x, y)) : T(0); };
    const auto difference2 = [&](int x, int y) {
        const Vec3<T> d = clean.load(x, y) - noisy.load(x, y);
        return usable(x, y) ? dot(d, d) : T(0);
    };

    // Relative to what is around, so that a bright pixel does not speak for the dark ones beside it.
    const Plane<T, 1> bright = box_mean<T>(
        width, height, 2, [&](int x, int y) { return sum(clean.load(x, y)); }, executor);
    double whole = light;
    if (!(light > 0))
        for (const T b : bright.values()) whole += double(b) / double(bright.values().size());
    const auto relative = [&](int x, int y, T square) {
        const double b = double(bright.load(x, y)), unit = b * b + 1e-3 * whole * whole;
        return unit > 0 ? T(double(square) / unit) : T(0);
    };
    Plane<T, 1> own_noise(width, height), own_difference(width, height);
    executor.parallel_for(std::size_t(height), 16, [&](std::size_t begin, std::size_t end) {
        for (int y = int(begin); y < int(end); ++y)
            for (int x = 0; x < width; ++x) {
                own_noise.store(x, y, relative(x, y, noise2(x, y)));
                own_difference.store(x, y, relative(x, y, difference2(x, y)));
            }
    });
    const auto mean_around = [&](int radius, const Plane<T, 1>& plane) {
        return box_mean<T>(width, height, radius, [&](int x, int y) { return plane.load(x, y); }, executor);
    };
    const Plane<T, 1> noise = mean_around(1, own_noise), noise_around = mean_around(2, own_noise);
    const Plane<T, 1> difference = mean_around(1, own_difference);
    const Plane<T, 1> lack = box_mean<T>(width, height, 1, [&](int x, int y) {
        return usable(x, y) ? std::max(T(0), sum(clean.load(x, y)) - sum(noisy.load(x, y))) : T(0);
    }, executor);
    const T margin = T(samples < 16 ? 3 : 2);                // variances of few samples are noisy themselves
    const double agreement = std::min(1.0, samples / 16); // square of the samples' relative deviation
    Plane<std::uint8_t, 1> sure(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            if (samples < 8 || !usable(x, y)) continue;
            const T g2 = dot(noisy.load(x, y), noisy.load(x, y));
            const T apart = sum(clean.load(x, y)) < sum(noisy.load(x, y)) ? T(0.25) : T(1);
            sure.store(x, y, difference2(x, y) > apart * g2 && noise2(x, y) * T(samples) < T(agreement) * g2);
        }
    const auto sure_around = [&](int x, int y) {
        int count = 0;
        for (int v = std::max(0, y - 1); v <= std::min(height - 1, y + 1); ++v)
            for (int u = std::max(0, x - 1); u <= std::min(width - 1, x + 1); ++u) count += sure.load(u, v);
        return count;
    };
    // A window in which one pixel makes all the difference says no more than that pixel: it has to hold without it too.
    const auto share_by_means = [&](int x, int y) {
        const T by_all = margin * std::max(noise.load(x, y), noise_around.load(x, y)) /
                         std::max(difference.load(x, y), T(1e-20));
        if (by_all >= 1) return T(0);
        T noise_sum = 0, difference_sum = 0, most = 0, its_noise = 0;
        for (int v = std::max(0, y - 1); v <= std::min(height - 1, y + 1); ++v)
            for (int u = std::max(0, x - 1); u <= std::min(width - 1, x + 1); ++u) {
                const T n = own_noise.load(u, v), d = own_difference.load(u, v);
                noise_sum += n;
                difference_sum += d;
                if (d > most) most = d, its_noise = n;
            }
        const T by_others = margin * (noise_sum - its_noise) / std::max(difference_sum - most, T(1e-20));
        return T(1) - std::max(by_all, by_others);
    };
    Plane<T, 1> shares(width, height);
    executor.parallel_for(std::size_t(height), 16, [&](std::size_t begin, std::size_t end) {
        for (int y = int(begin); y < int(end); ++y)
            for (int x = 0; x < width; ++x) {
                if (!usable(x, y)) continue;
                T share = share_by_means(x, y);
                if (sure.load(x, y) != 0 && sure_around(x, y) >= 3)
                    share = std::max(share, T(1) - T(9) * noise2(x, y) / difference2(x, y));
                if (!(share > 0)) continue;
                // Light that comes in few bright samples is absent from most pixels: that alone is no contradiction.
                T event2 = 0; // square of what one such sample adds to a pixel here
                for (int v = std::max(0, y - 2); v <= std::min(height - 1, y + 2); ++v)
                    for (int u = std::max(0, x - 2); u <= std::min(width - 1, x + 2); ++u)
                        event2 = std::max(event2, noise2(u, v));
                const T absent = lack.load(x, y);
                if (absent > 0 && T(27) * absent < std::sqrt(event2)) continue;
                shares.store(x, y, std::min(share, T(1)));
            }
    });
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            if (const T share = shares.load(x, y); share > 0) {
                const Vec3<T> filtered = clean.load(x, y);
                clean.store(x, y, max(filtered + (noisy.load(x, y) - filtered) * share, Vec3<T>(0)));
            }
}

} // namespace LAMBENT_ABI
} // namespace lambent
