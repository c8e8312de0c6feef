#pragma once
#include <lambent/denoise/by_samples.hpp>
#include <lambent/denoise/feature_noise.hpp>
#include <lambent/denoise/light_regression.hpp>
#include <lambent/denoise/pair_average.hpp>
#include <lambent/film/pixel_data.hpp>
#include <algorithm>
#include <array>
#include <utility>

namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {

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
            if (is_finite(value)) out.store(x, y, value);
        }
    return out;
}

/// What the guides have to know of a whole frame.
struct GuideFacts {
    double mean_depth = 1;                                 ///< of the pixels that have one
    std::array<bool, 3> noisy{}; ///< whether albedo, normal and depth have noise anywhere
};

/// How far around a pixel its guides are made from: averages of patches, and of the noise that one sample shows.
inline int guide_reach(int radius) { return radius + 1 + 2; }

/// Sets the features that models are fitted to, cleaned of their own noise. One sample has no variance, so that its
/// features' noise is seen by their neighbours. From 8 samples on the nearest neighbours are enough, and what they differ
/// by is believed less: features of things behind glass differ where its reflections begin.
template <class T, class E>
void set_light_guides(LightRegression<T>& fit, const FrameView<T>& frame, const GuideFacts& facts, int radius,
                      double samples, E& executor) {
    if (samples >= 8) radius = std::min(radius, 1);
    const double softness = BySamples{{0.25, 0.25, 1, 1, 1}}(samples);
    const int width = frame.radiance.width(), height = frame.radiance.height();
    const auto set = [&](int first, int size, const auto& mean, const auto& variance, double factor, bool noisy) {
        if (mean.absent()) return;
        PairAveraged<T> guide{as_guide(mean, factor), Plane<T, 3>(width, height)};
        if (samples < 2) guide.variance = feature_noise<T>(std::as_const(guide.mean).view(), executor);
        else if (!variance.absent()) guide.variance = as_guide(variance, factor * factor);
        if (noisy)
            guide = average_pairs<T>(std::as_const(guide.mean).view(), std::as_const(guide.variance).view(), radius,
                                     softness, executor);
        for (int c = 0; c < size; ++c)
            fit.set_guide(first + c, [&](int x, int y) { return guide.mean.load(x, y)[c]; },
                          [&](int x, int y) { return guide.variance.load(x, y)[c]; });
    };
    set(0, 3, frame.albedo, frame.albedo_variance, 1, facts.noisy[0]);
    set(3, 3, frame.normal, frame.normal_variance, 1, facts.noisy[1]);
    set(6, 1, frame.depth, frame.depth_variance, 1 / facts.mean_depth, facts.noisy[2]);
}

} // namespace detail

} // namespace LAMBENT_ABI
} // namespace lambent
