#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/film/pixel_data.hpp>
#include <cmath>
#include <cstdint>
#include <limits>

/// How far an image is from a reference. Sums are taken in double, compensated; an image that is not finite
/// where it counts has an error that is not finite.
namespace lambent {
inline namespace LAMBENT_ABI {

/// Which pixels do not count: those that are not 0. Absent: all count.
using PixelMask = PixelView<const std::uint8_t, 1>;

/// Masks the pixels that see an emitter, at least in part: a frame's `emission` with any channel above 0. They
/// would dominate a squared error though a renderer gets them right for nothing.
template <class T>
Plane<std::uint8_t, 1> emitter_mask(const PixelView<T, 3>& emission) {
    Plane<std::uint8_t, 1> mask(emission.width(), emission.height());
    for (int y = 0; y < emission.height(); ++y)
        for (int x = 0; x < emission.width(); ++x)
            mask.store(x, y, max_component(emission.load(x, y)) > 0 ? 1 : 0);
    return mask;
}

namespace detail {
/// Mean of error(x, reference) over the channels of the pixels that count; 0 where there are none.
template <class A, class B, class Error>
double mean_error(const PixelView<A, 3>& image, const PixelView<B, 3>& reference, const PixelMask& mask,
                  Error&& error) {
    require_same_size("metrics: image and reference", image, reference);
    if (!mask.absent()) require_same_size("metrics: image and mask", image, mask);
    CompensatedSum<double> sum;
    double count = 0;
    for (int y = 0; y < image.height(); ++y)
        for (int x = 0; x < image.width(); ++x) {
            if (!mask.absent() && mask.load(x, y) != 0) continue;
            const Vec3d value(image.load(x, y)), truth(reference.load(x, y));
            for (int c = 0; c < 3; ++c) sum.add(error(value[c], truth[c]));
            count += 3;
        }
    return count > 0 ? sum.value() / count : 0;
}
} // namespace detail

/// Mean squared error over pixels and channels.
/// throws lambent::Error when sizes differ
template <class A, class B>
double mse(const PixelView<A, 3>& image, const PixelView<B, 3>& reference, const PixelMask& mask = {}) {
    return detail::mean_error(image, reference, mask, [](double x, double r) { return (x - r) * (x - r); });
}

/// √mse, in the image's unit.
template <class A, class B>
double rmse(const PixelView<A, 3>& image, const PixelView<B, 3>& reference, const PixelMask& mask = {}) {
    return std::sqrt(mse(image, reference, mask));
}

/// Mean over pixels and channels of (x - ref)² / (ref² + 0.01 · mean(ref²)): a relative error that does not blow
/// up in the dark. All means leave masked pixels out. Where the whole reference is black, 0 if the image is too,
/// else not finite.
/// throws lambent::Error when sizes differ
template <class A, class B>
double rel_mse(const PixelView<A, 3>& image, const PixelView<B, 3>& reference, const PixelMask& mask = {}) {
    const double mean_square = detail::mean_error(reference, reference, mask, [](double, double r) { return r * r; });
    return detail::mean_error(image, reference, mask, [&](double x, double r) {
        const double d = (x - r) * (x - r), scale = r * r + 0.01 * mean_square;
        return scale > 0 ? d / scale : d == 0 ? 0.0 : std::numeric_limits<double>::infinity();
    });
}

} // namespace LAMBENT_ABI
} // namespace lambent
