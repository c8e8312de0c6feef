#pragma once
#include <lambent/film/pixel_data.hpp>
#include <algorithm>
#include <cmath>

namespace lambent {
inline namespace LAMBENT_ABI {

/// The expected √rel_mse of the frame's radiance against the truth, from its own variance: rel_mse is the mean of
/// variance / (truth² + 1 % of the mean of truth²) over the channels of all pixels that see no emitter, where
/// truth² is estimated by radiance² − variance. Negative where there are fewer than two samples a pixel, or
/// nothing but emitters.
template <class T>
double estimated_error(const PixelData<T>& frame) {
    if (frame.variance.absent() || frame.samples.absent()) return -1;
    const auto each = [&](auto&& visit) {
        for (int y = 0; y < frame.height; ++y)
            for (int x = 0; x < frame.width; ++x) {
                if (!frame.emission.absent() && max_component(frame.emission.load(x, y)) > 0) continue;
                const Vec3d mean(frame.radiance.load(x, y)), variance(frame.variance.load(x, y));
                for (int c = 0; c < 3; ++c) visit(std::max(0.0, mean[c] * mean[c] - variance[c]), variance[c]);
            }
    };
    double squares = 0, n = 0, error = 0;
    for (int y = 0; y < frame.height; ++y)
        for (int x = 0; x < frame.width; ++x)
            if (frame.samples.load(x, y) < 2) return -1;
    each([&](double truth2, double) {
        squares += truth2;
        n += 1;
    });
    if (n == 0) return -1;
    const double floor = 0.01 * squares / n;
    each([&](double truth2, double variance) {
        if (truth2 + floor > 0) error += variance / (truth2 + floor);
    });
    return std::sqrt(error / n);
}

} // namespace LAMBENT_ABI
} // namespace lambent
