#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/executor.hpp>
#include <lambent/core/exp.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/simd.hpp>
#include <lambent/film/pixel_data.hpp>
#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// What a plane is after pair_average(), and the variance that is left.
template <class T>
struct PairAveraged {
    Plane<T, 3> mean, variance;
};

namespace detail {

/// A plane and its noise channel by channel, with a rim that repeats the border, for whole Packs of pixels at a time.
template <std::floating_point T>
class PairTests {
    static constexpr int lanes = 8;
    using P = Pack<T, lanes>;

public:
    PairTests(const PixelView<const T, 3>& plane, const PixelView<const T, 3>& variance, int radius, double softness)
        : width_(plane.width()), height_(plane.height()), radius_(radius), rim_(radius + 1),
          stride_((width_ + lanes - 1) / lanes * lanes + 2 * rim_ + 2 * lanes), softness_(T(softness)),
          variance_(variance), inside_(std::size_t(stride_)) {
        for (std::vector<T>& channel : channels_)
            channel.resize(std::size_t(stride_) * std::size_t(height_ + 2 * rim_));
        for (int y = -rim_; y < height_ + rim_; ++y)
            for (int x = -rim_; x < stride_ - rim_; ++x) {
                const int u = std::clamp(x, 0, width_ - 1), v = std::clamp(y, 0, height_ - 1);
                const Vec3<T> value = plane.load(u, v), n = variance.load(u, v);
                const T noise = n.x + n.y + n.z;
                const bool usable = is_finite(value) && is_finite(noise);
                const std::size_t i = at(x, y);
                for (int c = 0; c < 3; ++c) channels_[std::size_t(c)][i] = usable ? value[c] : T(0);
                channels_[noise_channel][i] = usable ? noise : T(0);
                channels_[refused][i] = usable ? T(0) : T(1e18);
            }
        for (int x = 0; x < width_; ++x) inside_[std::size_t(x + rim_)] = 1;
    }

    /// Rows [begin, end) of `out`; pixels that nothing is like, not even themselves, stay as they are.
    void average(int begin, int end, PairAveraged<T>& out) const {
        const int rows = end - begin;
        std::vector<T> tests(std::size_t(rows + 2) * std::size_t(stride_)),
            sums(5 * std::size_t(rows) * std::size_t(stride_));
        const auto sum = [&](int k, int y) { return sums.data() + std::size_t(k * rows + y) * std::size_t(stride_); };
        for (int dy = -radius_; dy <= radius_; ++dy)
            for (int dx = -radius_; dx <= radius_; ++dx) {
                for (int y = -1; y <= rows; ++y)
                    test(begin + y, dx, dy, &tests[std::size_t(y + 1) * std::size_t(stride_)]);
                for (int y = 0; y < rows; ++y) {
                    if (begin + y + dy < 0 || begin + y + dy >= height_) continue;
                    T* const to[5] = {sum(0, y), sum(1, y), sum(2, y), sum(3, y), sum(4, y)};
                    add(begin + y, dx, dy, &tests[std::size_t(y) * std::size_t(stride_)], to);
                }
            }
        for (int y = 0; y < rows; ++y)
            for (int x = 0; x < width_; ++x) {
                const T weight = sum(3, y)[x];
                if (!(weight > 0)) continue;
                out.mean.store(x, begin + y, Vec3<T>(sum(0, y)[x], sum(1, y)[x], sum(2, y)[x]) / weight);
                out.variance.store(x, begin + y,
                                          variance_.load(x, begin + y) * (sum(4, y)[x] / (weight * weight)));
            }
    }

private:
    static constexpr std::size_t noise_channel = 3, refused = 4;

    std::size_t at(int x, int y) const {
        return std::size_t(y + rim_) * std::size_t(stride_) + std::size_t(x + rim_);
    }

    /// Welch's t² between the pixels of a row, from x = -1 on, and those at an offset.
    void test(int y, int dx, int dy, T* out) const {
        const std::size_t here = at(-1, y), there = at(dx - 1, y + dy);
        for (int x = 0; x < width_ + 2; x += lanes) {
            const auto both = [&](std::size_t c, auto&& f) {
                return f(P::load(&channels_[c][here + std::size_t(x)]), P::load(&channels_[c][there + std::size_t(x)]));
            };
            const auto square = [](P a, P b) { return (a - b) * (a - b); };
            const auto add = [](P a, P b) { return a + b; };
            const P difference2 = both(0, square) + both(1, square) + both(2, square);
            const P floor(T(1e-6)); // of features of about 1: rounding is no difference
            (difference2 / (both(noise_channel, add) + floor) + both(refused, add)).store(out + x);
        }
    }

    /// Adds what the pixels at an offset give to those of row y. `tests`: rows y - 1 to y + 1.
    void add(int y, int dx, int dy, const T* tests, T* const* to) const {
        const std::size_t there = at(dx, y + dy);
        for (int x = 0; x < width_; x += lanes) {
            P patch(T(0));
            for (int v = 0; v < 3; ++v)
                for (int u = 0; u < 3; ++u) patch = patch + P::load(tests + v * stride_ + x + u);
            const P excess = patch * P(T(1.0 / 9)) - P(T(1)), limit(8 * softness_);
            const P weight = select(excess <= limit,
                                    exp_of_negative(max(min(excess, limit), P(T(0))) * P(-1 / softness_)), P(T(0))) *
                             P::load(&inside_[std::size_t(x + dx + rim_)]);
            for (std::size_t c = 0; c < 3; ++c)
                multiply_add(weight, P::load(&channels_[c][there + std::size_t(x)]), P::load(to[c] + x))
                    .store(to[c] + x);
            (P::load(to[3] + x) + weight).store(to[3] + x);
            multiply_add(weight, weight, P::load(to[4] + x)).store(to[4] + x);
        }
    }

    int width_, height_, radius_, rim_, stride_;
    T softness_;
    PixelView<const T, 3> variance_;
    std::array<std::vector<T>, 5> channels_;
    std::vector<T> inside_; ///< of a row: 1 in the image, 0 in its rim
};

/// pair_average() of arguments that are right, whether there is any variance or not.
template <std::floating_point T, class E>
PairAveraged<T> average_pairs(const PixelView<const T, 3>& plane, const PixelView<const T, 3>& variance, int radius,
                              double softness, E& executor) {
    const int width = plane.width(), height = plane.height();
    PairAveraged<T> out{Plane<T, 3>(width, height), Plane<T, 3>(width, height)};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            out.mean.store(x, y, plane.load(x, y));
            out.variance.store(x, y, variance.load(x, y));
        }
    const PairTests<T> tests(plane, variance, radius, softness);
    executor.parallel_for(std::size_t(height), 8, [&](std::size_t begin, std::size_t end) {
        tests.average(int(begin), int(end), out);
    });
    return out;
}

} // namespace detail

/// The mean of each pixel and those around it, up to `radius` away, that could be of the same value by their variance:
/// tested by patches of 3 x 3. A plane without variance comes out as it went in, and so do pixels that are not finite
/// and those beside them. Features of depth of field and of glass are as noisy as light, but have no shadows to lose.
/// cost    (2 · radius + 1)² taps a pixel
/// source  Welch's t; Rousselle, Manzi, Zwicker, Robust denoising using feature and color information (2013), for the
///         idea
template <std::floating_point T, Executor E>
PairAveraged<T> pair_average(const PixelView<const T, 3>& plane, const PixelView<const T, 3>& variance, int radius,
                             double softness, E& executor) {
    require(radius >= 0 && radius <= 16 && softness > 0, "pair_average: radius must be 0 to 16, softness positive");
    require_same_size("pair_average: plane and variance", plane, variance);
    bool noisy = false;
    for (int y = 0; y < plane.height(); ++y)
        for (int x = 0; x < plane.width(); ++x) {
            const Vec3<T> v = variance.load(x, y);
            noisy = noisy || v.x + v.y + v.z > 0;
        }
    if (noisy) return detail::average_pairs<T>(plane, variance, radius, softness, executor);
    PairAveraged<T> same{Plane<T, 3>(plane.width(), plane.height()), Plane<T, 3>(plane.width(), plane.height())};
    for (int y = 0; y < plane.height(); ++y)
        for (int x = 0; x < plane.width(); ++x) {
            same.mean.store(x, y, plane.load(x, y));
            same.variance.store(x, y, variance.load(x, y));
        }
    return same;
}

} // namespace LAMBENT_ABI
} // namespace lambent
