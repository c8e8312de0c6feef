#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/executor.hpp>
#include <lambent/core/exp.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/simd.hpp>
#include <lambent/denoise/box_mean.hpp>
#include <lambent/film/pixel_data.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Of atrous().
struct AtrousOptions {
    int levels = 5;            ///< passes; windows reach 2 · (2^levels - 1) pixels, 62 with 5
    double sigma_light = 4;    ///< in standard deviations of a pixel's noise
    double sigma_normal = 0.1; ///< in radians, about
    double sigma_depth = 1;    ///< in steps to the neighbouring pixel, a pixel of distance
};

namespace detail {

/// Channel by channel with a rim, for whole Packs of pixels at a time.
template <std::floating_point T>
class AtrousPlanes {
    static constexpr int lanes = 8, channels = 10;
    static constexpr std::size_t light = 0, noise = 3, deviation = 4, normal = 5, depth = 8,
                                 slope = 9; ///< where each starts
    using P = Pack<T, lanes>;

public:
    AtrousPlanes(const PixelView<const T, 3>& image, const PixelView<const T, 1>& variance,
                 const PixelView<const T, 3>& normals, const PixelView<const T, 1>& depths,
                 const AtrousOptions& options)
        : width_(image.width()), height_(image.height()), rim_(1 << options.levels),
          stride_((width_ + lanes - 1) / lanes * lanes + 2 * rim_ + lanes), options_(options),
          inside_(std::size_t(stride_)) {
        for (std::vector<T>& c : now_) c.resize(std::size_t(stride_) * std::size_t(height_));
        for (int y = 0; y < height_; ++y)
            for (int x = 0; x < width_; ++x) {
                const std::size_t i = at(x, y);
                const Vec3<T> l = image.load(x, y), n = normals.absent() ? Vec3<T>(0) : normals.load(x, y);
                const T d = depths.absent() ? T(0) : depths.load(x, y), v = variance.load(x, y);
                for (std::size_t c = 0; c < 3; ++c) {
                    now_[light + c][i] = l[int(c)];
                    now_[normal + c][i] = is_finite(n) ? n[int(c)] : T(0);
                }
                now_[noise][i] = is_finite(v) ? std::max(v, T(0)) : T(0);
                now_[depth][i] = is_finite(d) ? d : T(0);
            }
        for (int y = 0; y < height_; ++y)
            for (int x = 0; x < width_; ++x) now_[slope][at(x, y)] = steepness(x, y);
        for (int x = 0; x < width_; ++x) inside_[std::size_t(x + rim_)] = 1;
        for (std::size_t c = 0; c < next_.size(); ++c) next_[c] = now_[c];
    }

    template <class E>
    void run(const PixelView<T, 3>& out, E& executor) {
        for (int level = 0; level < options_.levels; ++level) {
            spread_noise(executor);
            executor.parallel_for(std::size_t(height_), 8, [&](std::size_t begin, std::size_t end) {
                for (int y = int(begin); y < int(end); ++y) filter_row(y, 1 << level);
            });
            for (std::size_t c = 0; c < next_.size(); ++c) std::swap(now_[c], next_[c]);
        }
        for (int y = 0; y < height_; ++y)
            for (int x = 0; x < width_; ++x) {
                const std::size_t i = at(x, y);
                out.store(x, y, {now_[0][i], now_[1][i], now_[2][i]});
            }
    }

private:
    std::size_t at(int x, int y) const { return std::size_t(y) * std::size_t(stride_) + std::size_t(x + rim_); }

    /// 1 / (2 sigma²) of depths: the smaller of the steps to both sides, each way.
    T steepness(int x, int y) const {
        const T here = now_[depth][at(x, y)];
        const auto step = [&](int dx, int dy) {
            const T a = now_[depth][at(std::clamp(x - dx, 0, width_ - 1), std::clamp(y - dy, 0, height_ - 1))];
            const T b = now_[depth][at(std::clamp(x + dx, 0, width_ - 1), std::clamp(y + dy, 0, height_ - 1))];
            return std::min(std::abs(a - here), std::abs(b - here));
        };
        const T sigma = T(options_.sigma_depth) * (step(1, 0) + step(0, 1)) + T(2e-3) * std::abs(here) + T(1e-6);
        return T(0.5) / (sigma * sigma);
    }

    /// 1 / sigma of the light's sum of channels, from the noise around.
    template <class E>
    void spread_noise(E& executor) {
        const Plane<T, 1> around =
            box_mean<T>(width_, height_, 1, [&](int x, int y) { return now_[noise][at(x, y)]; }, executor);
        for (int y = 0; y < height_; ++y)
            for (int x = 0; x < width_; ++x)
                now_[deviation][at(x, y)] = 1 / (T(options_.sigma_light) * std::sqrt(around.load(x, y)) + T(1e-6));
    }

    void filter_row(int y, int step) {
        static constexpr std::array<T, 3> kernel = {T(3.0 / 8), T(1.0 / 4), T(1.0 / 16)};
        const T per_normal = T(0.5 / (options_.sigma_normal * options_.sigma_normal));
        const auto load = [](const std::vector<T>& c, std::size_t i) { return P::load(&c[i]); };
        for (int x = 0; x < width_; x += lanes) {
            const std::size_t here = at(x, y);
            P sum[3] = {P(T(0)), P(T(0)), P(T(0))}, weights(T(0)), noises(T(0));
            const P brightness = load(now_[0], here) + load(now_[1], here) + load(now_[2], here);
            const P per_light = load(now_[deviation], here), per_depth = load(now_[slope], here);
            for (int v = -2; v <= 2; ++v) {
                if (y + v * step < 0 || y + v * step >= height_) continue;
                for (int u = -2; u <= 2; ++u) {
                    const std::size_t there = at(x + u * step, y + v * step);
                    const P l[3] = {load(now_[0], there), load(now_[1], there), load(now_[2], there)};
                    const P apart = l[0] + l[1] + l[2] - brightness;
                    P distance = max(apart, -apart) * per_light;
                    P turned(T(0));
                    for (std::size_t c = 0; c < 3; ++c) {
                        const P d = load(now_[normal + c], there) - load(now_[normal + c], here);
                        turned = multiply_add(d, d, turned);
                    }
                    distance = multiply_add(turned, P(per_normal), distance);
                    const P deeper = load(now_[depth], there) - load(now_[depth], here);
                    const T far =
                        T(step * step * std::max(1, u * u + v * v)); // a plane's depth grows with the distance
                    distance = multiply_add(deeper * deeper, per_depth * P(1 / far), distance);
                    const P w = exp_of_negative(-min(distance, P(T(80)))) *
                                P(kernel[std::size_t(std::abs(u))] * kernel[std::size_t(std::abs(v))]) *
                                P::load(&inside_[std::size_t(x + u * step + rim_)]);
                    for (std::size_t c = 0; c < 3; ++c) sum[c] = multiply_add(w, l[c], sum[c]);
                    weights = weights + w;
                    noises = multiply_add(w * w, load(now_[noise], there), noises);
                }
            }
            weights = max(weights, P(T(1e-20))); // in the rim: what is stored there has weight 0, but must not be NaN
            for (std::size_t c = 0; c < 3; ++c) (sum[c] / weights).store(&next_[c][here]);
            (noises / (weights * weights)).store(&next_[noise][here]);
        }
    }

    int width_, height_, rim_, stride_;
    AtrousOptions options_;
    std::array<std::vector<T>, channels> now_;
    std::array<std::vector<T>, 4> next_; ///< light and its noise
    std::vector<T> inside_;              ///< of a row: 1 in the image, 0 in its rim
};

} // namespace detail

/// Filters `image` by a 5 x 5 window that is spread twice as far in each pass, its weights by how far pixels differ in
/// light, in units of their noise, which each pass makes less, in normal and in depth. Fast and wide; it blurs what is
/// fainter than the noise, so its error does not go to 0 as that of denoise_light() does. `out` may be the image.
/// variance of the sum of the image's channels; 0: neighbours must be equal
/// normals, depths  world space and metres; absent: nothing to go by
/// nan      the image and its squares must be finite; features that are not count as 0
/// throws   lambent::Error on options out of their ranges or unequal sizes
/// threads  the same bits for any executor
/// cost     25 taps a pixel and level of about 40 operations; 14 floats a pixel
/// source   Dammertz et al., Edge-avoiding À-Trous wavelet transform (2010); Schied et al., Spatiotemporal
///          variance-guided filtering (2017)
template <std::floating_point T, Executor E>
void atrous(const PixelView<const T, 3>& image, const PixelView<const T, 1>& variance,
            const PixelView<const T, 3>& normals, const PixelView<const T, 1>& depths, const PixelView<T, 3>& out,
            const AtrousOptions& options, E& executor) {
    require(options.levels >= 0 && options.levels <= 10 && options.sigma_light > 0 && options.sigma_normal > 0 &&
                options.sigma_depth > 0,
            "atrous: levels must be 0 to 10, sigmas positive");
    require_same_size("atrous: image and variance", image, variance);
    require_same_size("atrous: image and output", image, out);
    if (!normals.absent()) require_same_size("atrous: image and normals", image, normals);
    if (!depths.absent()) require_same_size("atrous: image and depths", image, depths);
    if (image.width() == 0 || image.height() == 0) return;
    detail::AtrousPlanes<T>(image, variance, normals, depths, options).run(out, executor);
}

} // namespace LAMBENT_ABI
} // namespace lambent
