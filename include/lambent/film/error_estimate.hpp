#pragma once
#include <lambent/core/error.hpp>
#include <lambent/film/pixel_data.hpp>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// How far each pixel of a frame may be from the truth, relative to it: variance / (truth² + 1 % of the mean of
/// truth²), the mean over channels. The truth is what a pixel's neighbours say: their light over their albedo, times
/// the pixel's own albedo. Its own radiance would not do: the one sample that makes its variance large makes it bright,
/// too.
/// The variance is that of the frame's `halves` where it has them, since it knows of samples that are better than
/// independent ones; else that of its `variance`.
/// throws lambent::Error when the frame has no variance
template <class T>
class RelativeVariance {
public:
    static constexpr int reach = 3; ///< neighbours up to so many pixels away

    explicit RelativeVariance(const PixelData<T>& frame) : frame_(frame) {
        require(!frame.variance.absent(), "RelativeVariance: the frame has no variance");
        std::size_t counted = 0;
        double squares = 0;
        each([&](int x, int y) {
            if (sees_emitter(x, y)) return;
            ++counted;
            const Vec3d mean(frame.radiance.load(x, y));
            const Vec3d square = mean * mean - Vec3d(frame.variance.load(x, y));
            squares += (square.x + square.y + square.z) / 3;
        });
        counted_ = counted;
        floor_ = counted > 0 ? T(0.01 * std::max(0.0, squares / double(counted))) : T(0);
        sum_rows();
    }

    std::size_t counted() const { return counted_; } ///< pixels that see no emitter

    /// Whether it is left out of the image's error.
    bool sees_emitter(int x, int y) const {
        return !frame_.emission.absent() && max_component(frame_.emission.load(x, y)) > 0;
    }

    /// Light for its albedo around a pixel, without itself: (radiance - emission) / albedo of up to 48 neighbours. A
    /// pixel that has none gives its own.
    Vec3<T> light_around(int x, int y) const {
        Sums sum;
        for (int j = std::max(0, y - reach); j <= std::min(frame_.height - 1, y + reach); ++j)
            if (j != y) sum += rows_[index(x, j)];
        for (int i = std::max(0, x - reach); i <= std::min(frame_.width - 1, x + reach); ++i)
            if (i != x) sum += at(i, y);
        if (!(min_component(sum.albedo) > 0)) sum = at(x, y);
        return sum.light / sum.albedo;
    }

    /// That of the pixel under this light.
    T under(const Vec3<T>& light, int x, int y) const {
        const Vec3<T> truth = light * albedo(x, y) + emission(x, y);
        const Vec3<T> variance =
            frame_.halves.absent() ? frame_.variance.load(x, y) : frame_.halves.load(x, y) * halves_hold;
        T sum = 0;
        for (int c = 0; c < 3; ++c) {
            const T scale = truth[c] * truth[c] + floor_;
            if (scale > 0) sum += variance[c] / scale;
        }
        return sum / 3;
    }
    T of(int x, int y) const { return under(light_around(x, y), x, y); }

private:
    /// How the variance of all samples compares to what halves say, which is what the variance falls by from each half
    /// to both. 1 for independent samples; for Sobol's 0.85 to 0.95, of which this is the safe end: measured against
    /// references of builtin:cornell, builtin:room and DamagedHelmet under a sky with 16 to 256 samples a pixel.
    static constexpr T halves_hold = T(0.95);

    struct Sums {
        Vec3<T> light{0}, albedo{0};
        Sums& operator+=(const Sums& o) {
            light += o.light;
            albedo += o.albedo;
            return *this;
        }
    };

    std::size_t index(int x, int y) const { return std::size_t(y) * std::size_t(frame_.width) + std::size_t(x); }
    Vec3<T> emission(int x, int y) const { return frame_.emission.absent() ? Vec3<T>(0) : frame_.emission.load(x, y); }
    Vec3<T> albedo(int x, int y) const {
        return frame_.albedo.absent() ? Vec3<T>(1) : max(frame_.albedo.load(x, y), Vec3<T>(T(albedo_floor)));
    }
    Sums at(int x, int y) const { return {frame_.radiance.load(x, y) - emission(x, y), albedo(x, y)}; }

    template <class F>
    void each(F&& f) const {
        for (int y = 0; y < frame_.height; ++y)
            for (int x = 0; x < frame_.width; ++x) f(x, y);
    }
    void sum_rows() {
        rows_.resize(std::size_t(frame_.width) * std::size_t(frame_.height));
        each([&](int x, int y) {
            Sums sum;
            for (int i = std::max(0, x - reach); i <= std::min(frame_.width - 1, x + reach); ++i) sum += at(i, y);
            rows_[index(x, y)] = sum;
        });
    }

    const PixelData<T>& frame_;
    std::vector<Sums> rows_; ///< of each pixel's neighbours in its row, and itself
    std::size_t counted_ = 0;
    T floor_ = 0;
};

/// The expected √rel_mse of the frame's radiance against the truth: the mean of RelativeVariance over the pixels that
/// see no emitter. Negative where there are fewer than two samples a pixel, or nothing but emitters.
template <class T>
double estimated_error(const PixelData<T>& frame) {
    if (frame.variance.absent() || frame.samples.absent()) return -1;
    for (const T samples : frame.samples.values())
        if (samples < 2) return -1;
    const RelativeVariance<T> relative(frame);
    if (relative.counted() == 0) return -1;
    double error = 0;
    for (int y = 0; y < frame.height; ++y)
        for (int x = 0; x < frame.width; ++x)
            if (!relative.sees_emitter(x, y)) error += double(relative.of(x, y));
    return std::sqrt(error / double(relative.counted()));
}

} // namespace LAMBENT_ABI
} // namespace lambent
