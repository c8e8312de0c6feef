#pragma once
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <lambent/denoise/bilateral_lines.hpp>
#include <lambent/denoise/bilateral_window.hpp>
#include <lambent/denoise/despike.hpp>
#include <lambent/denoise/features.hpp>
#include <lambent/denoise/gaussian.hpp>
#include <lambent/film/pixel_data.hpp>
#include <lambent/film/region.hpp>
#include <limits>
#include <string>

namespace lambent {
inline namespace LAMBENT_ABI {

/// How the filter weighs its window of n x n taps.
enum class BilateralForm {
    naive_2d,        ///< every pixel weighs its whole window: n² - 1 weights a pixel
    reuse_2d,        ///< the same result, each pair weighed once: (n² - 1) / 2
    separable,       ///< along the rows, then along the columns: 2 (n - 1); not the same filter, but near
    separable_reuse, ///< equal to `separable` but for rounding: n - 1
};

/// What the second pass of the separable forms takes as illumination when it weighs.
enum class SecondPassGuide {
    first_pass, ///< the result of the first pass, all of it finished
    input,      ///< the image as it came
};

/// Of cross_bilateral(). Lengths are in pixels.
struct CrossBilateralOptions {
    int kernel = 65;          ///< taps along a side, odd; 0 = off: the output is the input, bit for bit
    double sigma_spatial = 0; ///< in pixels; 0 = kernel / 6.4
    double sigma_illumination = std::numeric_limits<double>::infinity(); ///< in the image's unit
    double second_pass_factor = 1; ///< on sigma_illumination in the second pass of the separable forms
    BilateralForm form = BilateralForm::separable_reuse;
    SecondPassGuide guide = SecondPassGuide::first_pass;
    PixelWindow window{}; ///< the pixels to filter, with taps from all of the image; default: all
};

/// The work of a cross_bilateral(). Lanes of registers that hold no pixel are not counted.
struct BilateralCounts {
    std::uint64_t exponentials = 0; ///< pairs of pixels that are weighed: one each
    std::uint64_t taps = 0;         ///< weighted pixels that are added to the sum of another
    BilateralCounts& operator+=(const BilateralCounts& other) {
        exponentials += other.exponentials;
        taps += other.taps;
        return *this;
    }
};

namespace detail {
inline void check(const CrossBilateralOptions& o) {
    require(o.kernel >= 0 && (o.kernel == 0 || o.kernel % 2 == 1),
            [&] { return "cross_bilateral: the kernel must be odd, or 0 for off, not " + std::to_string(o.kernel); });
    require(o.sigma_spatial >= 0, [&] {
        return "cross_bilateral: the spatial sigma must be positive, or 0 for kernel / 6.4, not " +
               std::to_string(o.sigma_spatial);
    });
    require_sigma("cross_bilateral: illumination", o.sigma_illumination);
    require_sigma("cross_bilateral: factor of the second pass", o.second_pass_factor);
}

/// `window`, or the whole image where it is empty.
inline PixelWindow checked_window(const PixelWindow& window, int width, int height) {
    if (window == PixelWindow{}) return {0, 0, width, height};
    require(!window.empty() && window.inside(width, height), [&] {
        return "cross_bilateral: the window [" + std::to_string(window.x0) + ", " + std::to_string(window.x1) +
               ") x [" + std::to_string(window.y0) + ", " + std::to_string(window.y1) +
               ") is not within the image of " + std::to_string(width) + " x " + std::to_string(height);
    });
    return window;
}

/// `window` and `radius` pixels around, as far as the image goes.
inline PixelWindow with_halo(const PixelWindow& window, int radius, int width, int height) {
    return {std::max(0, window.x0 - radius), std::max(0, window.y0 - radius), std::min(width, window.x1 + radius),
            std::min(height, window.y1 + radius)};
}

/// Whether all pixels have the bits of the first, and it is finite; ends at the first that differs.
template <class T>
bool is_constant(const PixelView<const T, 3>& image) {
    if (image.absent()) return false;
    const Vec3<T> first = image.load(0, 0);
    for (int y = 0; y < image.height(); ++y)
        for (int x = 0; x < image.width(); ++x)
            if (const Vec3<T> here = image.load(x, y); std::memcmp(&here, &first, sizeof first) != 0) return false;
    return is_finite(first);
}

/// Whether all values in `window` are.
template <class T, Executor E>
bool all_finite(const PixelView<const T, 3>& image, const PixelWindow& window, E& executor) {
    constexpr int lanes = FeaturePack<T>::width;
    std::atomic<bool> result{true};
    executor.parallel_for(std::size_t(window.height()), 16, [&](std::size_t begin, std::size_t end) {
        auto finite = is_finite(FeaturePack<T>(T(0)));
        for (int y = window.y0 + int(begin); y < window.y0 + int(end); ++y)
            for (int x = window.x0; x < window.x1; x += lanes)
                for (const auto& channel : load_pack<lanes>(image, x, y, std::min(lanes, window.x1 - x)))
                    finite = finite & is_finite(channel);
        if (!all(finite)) result = false;
    });
    return result;
}

/// Pairs (i, j) with i in [first, last) and j in [i + low, i + high], as far as j is in [begin, end).
inline std::uint64_t count_pairs(int first, int last, int low, int high, int begin, int end) {
    std::uint64_t pairs = 0;
    for (int i = first; i < last; ++i)
        pairs += std::uint64_t(std::max(0, std::min(end, i + high + 1) - std::max(begin, i + low)));
    return pairs;
}
/// Those that filter_lines() weighs in a line whose pixels [first, last) of `end` are filtered.
inline std::uint64_t count_line_pairs(bool twice, int first, int last, int radius, int end) {
    if (!twice) return count_pairs(first, last, -radius, radius, 0, end) - std::uint64_t(last - first);
    return count_pairs(std::max(0, first - radius), last, 1, radius, first, std::min(end, last + radius));
}
} // namespace detail

/// What cross_bilateral() of a width × height image does: a matter of sizes, not of pixels.
/// throws lambent::Error on a bad option
/// cost   width + height
inline BilateralCounts bilateral_counts(int width, int height, const CrossBilateralOptions& options) {
    detail::check(options);
    if (options.kernel == 0) return {};
    const int r = options.kernel / 2;
    const PixelWindow w = detail::checked_window(options.window, width, height);
    const PixelWindow seen = detail::with_halo(w, r, width, height);
    const auto number = [](int n) { return std::uint64_t(n); };
    std::uint64_t pairs = 0;
    const bool twice = options.form == BilateralForm::reuse_2d || options.form == BilateralForm::separable_reuse;
    if (options.form == BilateralForm::naive_2d)
        pairs = detail::count_pairs(w.x0, w.x1, -r, r, 0, width) * detail::count_pairs(w.y0, w.y1, -r, r, 0, height) -
                number(w.width()) * number(w.height());
    else if (options.form == BilateralForm::reuse_2d) // those to the right, and those in rows below
        pairs = detail::count_pairs(seen.x0, seen.x1, 1, r, 0, width) * number(seen.height()) +
                detail::count_pairs(seen.x0, seen.x1, -r, r, 0, width) *
                    detail::count_pairs(seen.y0, seen.y1, 1, r, seen.y0, seen.y1);
    else
        pairs = detail::count_line_pairs(twice, w.x0, w.x1, r, width) * number(seen.height()) +
                detail::count_line_pairs(twice, w.y0, w.y1, r, height) * number(w.width());
    return {pairs, twice ? 2 * pairs : pairs};
}

/// Cross-bilateral filter: every pixel becomes the mean of those around it, each weighted by the product of a
/// Gaussian of the distance in pixels, one of the difference in illumination and one for every feature:
///   cross_bilateral(noisy, out, {.sigma_illumination = 50}, executor,
///                   NormalFeature<float>(normals, 0.5), IdentityFeature<float>(materials, hard_stop));
/// A feature that is absent, constant or of infinite sigma is left out before the loops.
/// shape   image, out and features: width × height each; `out` may be the very view of `image`
/// space   linear light; illumination with the albedo divided out keeps textures sharp
/// border  taps outside are left out and the rest renormalised: a constant image comes out bit for bit, for it is not
///         filtered; regions of one value, but for rounding (5e-7 of it in float)
/// nan     a pixel that is not finite gives nothing to others and takes its neighbours' value; one with a feature
///         that is not finite gives nothing and stays; no effect reaches further than the kernel's radius
/// window  separable forms give the bits that the whole image would have there; give the next tile the same image
/// threads the same bits for any executor: rows, columns or bands of fixed height are owned by one thread
/// returns what it did, as bilateral_counts() has it; nothing for a constant image
/// throws  lambent::Error on a bad option or unequal sizes, before anything is written
/// cost    see BilateralForm; one exponential a weight. Memory: 4 numbers a pixel (separable forms), else 5 + the
///         features' channels, and 8 more with re-use; windows are laid out in segments, so narrow images take a
///         few times that
template <std::floating_point T, Executor E, PixelFeature... Features>
BilateralCounts cross_bilateral(const PixelView<const T, 3>& image, const PixelView<T, 3>& out,
                                const CrossBilateralOptions& options, E& executor, const Features&... features) {
    const BilateralCounts counts = bilateral_counts(image.width(), image.height(), options);
    require_same_size("cross_bilateral: image and output", image, out);
    const int width = image.width(), height = image.height();
    detail::FeatureList<T> list;
    (list.add(features, width, height), ...);
    const PixelWindow window = detail::checked_window(options.window, width, height);
    if (options.kernel == 0 || detail::is_constant(image)) {
        for (int y = window.y0; y < window.y1; ++y)
            for (int x = window.x0; x < window.x1; ++x) out.store(x, y, image.load(x, y));
        return {};
    }
    const int radius = options.kernel / 2;
    const std::vector<T> kernel = gaussian_kernel<T>(options.kernel, options.sigma_spatial);

    // Bad pixels are never taps (load below), but need an illumination of their own to weigh their neighbours.
    using P = FeaturePack<T>;
    const PixelWindow seen = detail::with_halo(window, radius, width, height);
    Plane<T, 3> repaired;
    PixelView<const T, 3> guide = image;
    const bool all_finite = detail::all_finite(image, seen, executor);
    if (!all_finite) {
        repaired.allocate(width, height);
        const auto view = repaired.view();
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) view.store(x, y, image.load(x, y));
        repair_non_finite(view, radius);
        guide = view;
    }
    const auto load = [&](int x, int y, int count) -> detail::Homogeneous<T> {
        const auto [r, g, b] = load_pack<P::width>(image, x, y, count);
        if (all_finite) return {r, g, b, P(T(1))};
        const auto finite = is_finite(r) & is_finite(g) & is_finite(b);
        const P zero(T(0));
        return {select(finite, r, zero), select(finite, g, zero), select(finite, b, zero), select(finite, P(T(1)), zero)};
    };
    const auto store = [&](int x, int y, const Vec3<T>& mean, bool filtered) {
        out.store(x, y, filtered ? mean : guide.load(x, y));
    };
    // Pixels without a mean keep their value.
    const auto complete = [&](int x, int y, int count, detail::Homogeneous<T>& mean) {
        if (all(mean[3] > P(T(0)))) return;
        for (int i = 0; i < count; ++i)
            if (!(mean[3][i] > 0))
                for (int c = 0; c < 3; ++c) mean[std::size_t(c)].set(i, guide.load(x + i, y)[c]);
    };

    detail::FeatureList<T> with_light = list;
    const DistanceFeature<T> light(guide, options.sigma_illumination);
    with_light.add(light, width, height);
    if (options.form == BilateralForm::naive_2d) {
        const detail::WindowPlanes<T> planes(width, height, window, kernel, with_light, executor, load);
        detail::filter_window(planes, executor, store);
        return counts;
    }
    if (options.form == BilateralForm::reuse_2d) {
        const detail::WindowPlanes<T> planes(width, height, seen, kernel, with_light, executor, load);
        detail::filter_window_pairs(planes, executor, [&](int x, int y, const Vec3<T>& mean, bool filtered) {
            if (x >= window.x0 && x < window.x1 && y >= window.y0 && y < window.y1) store(x, y, mean, filtered);
        });
        return counts;
    }

    using detail::LineDirection;
    const auto use =
        options.form == BilateralForm::separable_reuse ? detail::WeightUse::twice : detail::WeightUse::once;
    const PixelWindow first_window{window.x0, seen.y0, window.x1, seen.y1};
    ScratchArray<T> first(4 * std::size_t(width) * std::size_t(height));
    const PixelView<T, 4> rows(first.data(), width, height, {.pixel = 1, .row = 4 * width, .channel = width});
    detail::filter_lines(
        LineDirection::rows, use, width, height, first_window, kernel, with_light, executor, load,
        [&](int x, int y, int count) { prefetch(image, x, y, count); },
        [&](int x, int y, int count, detail::Homogeneous<T> mean) {
            complete(x, y, count, mean);
            store_pack(rows, x, y, count, mean);
        });
    const PixelView<const T, 3> first_rgb(rows.data(), width, height, rows.strides());
    const DistanceFeature<T> second_light(options.guide == SecondPassGuide::first_pass ? first_rgb : guide,
                                          options.sigma_illumination * options.second_pass_factor);
    list.add(second_light, width, height);
    detail::filter_lines(
        LineDirection::columns, use, width, height, window, kernel, list, executor,
        [&](int x, int y, int count) -> detail::Homogeneous<T> {
            const auto [r, g, b, filtered] = load_pack<P::width>(rows, x, y, count);
            return {r * filtered, g * filtered, b * filtered, filtered};
        },
        [&](int x, int y, int count) {
            prefetch(rows, x, y, count);
            prefetch(out, x, y, count);
        },
        [&](int x, int y, int count, detail::Homogeneous<T> mean) {
            complete(x, y, count, mean);
            store_pack(out, x, y, count, std::array<P, 3>{mean[0], mean[1], mean[2]});
        });
    return counts;
}

} // namespace LAMBENT_ABI
} // namespace lambent
