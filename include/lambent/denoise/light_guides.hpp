#pragma once
#include <lambent/denoise/feature_noise.hpp>
#include <lambent/denoise/light_regression.hpp>
#include <lambent/denoise/pair_average.hpp>
#include <lambent/film/pixel_data.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {

/// Parameters that go with the number of samples, between those at 1, 4, 16, 64 and 256.
struct BySamples {
    std::array<double, 5> at;
    double operator()(double samples) const {
        const double place = std::clamp(std::log2(std::max(1.0, samples)) / 2, 0.0, 4.0);
        const auto i = std::min(std::size_t(place), std::size_t(3));
        const double part = place - double(i);
        return at[i] * (1 - part) + at[i + 1] * part;
    }
};

/// A feature of one to three channels as three, times a factor; 0 where it is not finite.
template <class T, int C>
Plane<T, 3> as_guide(const PixelView<const T, C>& plane, double factor) {
    Plane<T, 3> out(plane.width(), plane.height());
    for (int y = 0; y < plane.height(); ++y)
        for (int x = 0; x < plane.width(); ++x) {
            Vec3<T> value(0);
            if constexpr (C == 1) value.x = plane.load(x, y);
            else value = plane.load(x, y);
            value *= T(factor);
            if (is_finite(value)) out.view().store(x, y, value);
        }
    return out;
}

/// The features that models are fitted to, cleaned of their own noise. One sample has no variance, so that its features'
/// noise is seen by their neighbours. From 8 samples on the nearest neighbours are enough, and what they differ by is
/// believed less: features of things behind glass differ where its reflections begin.
template <class T>
struct LightGuides {
    struct Guide {
        int channel, size;
        PairAveraged<T> plane;
    };
    std::vector<Guide> guides;

    template <class E>
    LightGuides(const FrameView<T>& frame, int radius, double samples, E& executor) {
        if (samples >= 8) radius = std::min(radius, 1);
        const double softness = BySamples{{0.25, 0.25, 1, 1, 1}}(samples);
        const int width = frame.radiance.width(), height = frame.radiance.height();
        const auto add = [&](int channel, int size, const auto& mean, const auto& variance, double factor) {
            if (mean.absent()) return;
            const Plane<T, 3> guide = as_guide(mean, factor);
            Plane<T, 3> noise(width, height);
            if (samples < 2) noise = feature_noise<T>(guide.view(), executor);
            else if (!variance.absent()) noise = as_guide(variance, factor * factor);
            guides.push_back({channel, size,
                              pair_average<T>(guide.view(), std::as_const(noise).view(), radius, softness, executor)});
        };
        add(0, 3, frame.albedo, frame.albedo_variance, 1);
        add(3, 3, frame.normal, frame.normal_variance, 1);
        add(6, 1, frame.depth, frame.depth_variance, 1 / mean_depth(frame));
    }

    void set(LightRegression<T>& fit) const {
        for (const Guide& g : guides)
            for (int c = 0; c < g.size; ++c)
                fit.set_guide(g.channel + c, [&](int x, int y) { return g.plane.mean.load(x, y)[c]; },
                              [&](int x, int y) { return g.plane.variance.load(x, y)[c]; });
    }

private:
    static double mean_depth(const FrameView<T>& frame) {
        double sum = 0, count = 0;
        if (!frame.depth.absent())
            for (int y = 0; y < frame.depth.height(); ++y)
                for (int x = 0; x < frame.depth.width(); ++x) {
                    const double d = double(frame.depth.load(x, y));
                    if (!(d > 0) || !is_finite(d)) continue;
                    sum += d;
                    ++count;
                }
        return count > 0 ? sum / count : 1;
    }
};

} // namespace detail

} // namespace LAMBENT_ABI
} // namespace lambent
