#pragma once
#include <lambent/denoise/box_mean.hpp>
#include <lambent/film/pixel_data.hpp>
#include <algorithm>
#include <concepts>

namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {
inline constexpr int spread_reach = 4; ///< of spread_factor(), in pixels
} // namespace detail

/// What the variance of a mean has to be multiplied by because its samples are spread evenly, as Sobol's points are:
/// the variance between two halves of them over that of all, both summed over channels, in squares of 9 x 9 pixels. In
/// [0.05, 1]; 1 where there are no halves or nothing varies.
/// halves  as PixelData has them, of three channels or their sum
template <std::floating_point T, int C, Executor E>
Plane<T, 1> spread_factor(const PixelView<const T, 3>& variance, const PixelView<const T, C>& halves, E& executor) {
    const int width = variance.width(), height = variance.height();
    if (halves.absent()) return Plane<T, 1>(width, height, T(1));
    require_same_size("spread_factor: variance and halves", variance, halves);
    const auto finite = [](T v) { return is_finite(v) ? v : T(0); };
    Plane<T, 1> factor = box_mean<T>(width, height, detail::spread_reach, [&](int x, int y) {
        if constexpr (C == 1) return finite(halves.load(x, y));
        else return finite(halves.load(x, y).x + halves.load(x, y).y + halves.load(x, y).z);
    }, executor);
    const Plane<T, 1> sampled = box_mean<T>(width, height, detail::spread_reach, [&](int x, int y) {
        const Vec3<T> v = variance.load(x, y);
        return finite(v.x + v.y + v.z);
    }, executor);
    for (std::size_t i = 0; i < factor.values().size(); ++i) {
        T& f = factor.values()[i];
        f = f > 0 && sampled.values()[i] > 0 ? std::clamp(f / sampled.values()[i], T(0.05), T(1)) : T(1);
    }
    return factor;
}

} // namespace LAMBENT_ABI
} // namespace lambent
