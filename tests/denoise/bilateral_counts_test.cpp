// What the cross-bilateral filter says that it did, beside what a feature counts and what the results give away.
#include <array>
#include <atomic>
#include <cmath>
#include <denoise/bilateral_cases.hpp>
#include <doctest/doctest.h>
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise.hpp>

using namespace lambent;
using namespace lambent_test;

namespace {

struct Size {
    int width, height;
};

/// A feature that tells nothing apart and counts the pairs of pixels that are weighed: lanes with a pixel on both sides.
/// Those to the right of a window share a register with the last ones in it, and are nobody's centre.
struct PairCounter {
    using Scalar = float;
    static constexpr int channels = 2;
    PixelView<const float, 3> image;
    PixelWindow centers;
    std::atomic<std::uint64_t>* pairs;
    int width() const { return image.width(); }
    int height() const { return image.height(); }
    bool active() const { return true; }
    std::array<float, 2> prepare(int x, int y) const {
        return {x >= centers.x0 && x < centers.x1 && y >= centers.y0 && y < centers.y1 ? 1.0f : 0.0f, 1};
    }
    template <class P>
    P add_distance2(const P* a, const P* b, P sum) const {
        for (int l = 0; l < P::width; ++l)
            if (a[0][l] == 1 && b[1][l] == 1) ++*pairs;
        return sum;
    }
};

std::uint64_t counted_pairs(const Size& size, const CrossBilateralOptions& options) {
    const int width = size.width, height = size.height;
    const Planes<float> planes = random_planes<float>(width, height, 5);
    PixelWindow centers{0, 0, width, height}; // lines have as many lanes as are wanted
    if (options.window != PixelWindow{} && options.form == BilateralForm::naive_2d) centers = options.window;
    if (options.window != PixelWindow{} && options.form == BilateralForm::reuse_2d)
        centers = lambent::detail::with_halo(options.window, options.kernel / 2, width, height);
    std::atomic<std::uint64_t> pairs{0};
    Plane<float, 3> out(width, height), plain(width, height);
    ThreadExecutor threads(3);
    const PairCounter counter{planes.image.view(), centers, &pairs};
    const BilateralCounts said = cross_bilateral<float>(planes.image.view(), out.view(), options, threads, counter);
    CHECK(said.exponentials == bilateral_counts(width, height, options).exponentials);
    cross_bilateral<float>(planes.image.view(), plain.view(), options, threads);
    CHECK(out.values() == plain.values()); // counting changes no bit
    return pairs;
}

/// The pixels of others that a pixel is a mean of: nothing is told apart, so that it keeps one part in so many of itself.
std::uint64_t taps_of_means(const Size& size, const CrossBilateralOptions& options) {
    const int width = size.width, height = size.height;
    std::uint64_t taps = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            Plane<double, 3> image(width, height), out(width, height);
            image.view().store(x, y, Vec3d(1));
            SerialExecutor serial;
            cross_bilateral<double>(std::as_const(image).view(), out.view(), options, serial);
            taps += std::uint64_t(std::lround(1 / out.load(x, y).x)) - 1;
        }
    return taps;
}

} // namespace

TEST_CASE("counts: an exponential for each pair that a feature is asked for, in every form, image and window") {
    const Size sizes[] = {{1, 1}, {2, 1}, {9, 5}, {33, 17}, {50, 41}, {7, 90}};
    const PixelWindow windows[] = {{}, {0, 0, 2, 1}, {20, 9, 33, 17}, {5, 3, 6, 15}};
    for (const BilateralForm form : all_forms)
        for (const Size& size : sizes)
            for (const PixelWindow& window : windows)
                for (const int kernel : {1, 3, 9, 65}) {
                    if (!window.inside(size.width, size.height)) continue;
                    const CrossBilateralOptions options{.kernel = kernel, .form = form, .window = window};
                    INFO("form ", int(form), ", ", size.width, " x ", size.height, ", kernel ", kernel);
                    INFO("window [", window.x0, ", ", window.x1, ") x [", window.y0, ", ", window.y1, ")");
                    CHECK(bilateral_counts(size.width, size.height, options).exponentials == counted_pairs(size, options));
                }
}

TEST_CASE("counts: as many taps as a pixel's mean is made of") {
    for (const BilateralForm form : all_forms) {
        const bool lines = form == BilateralForm::separable || form == BilateralForm::separable_reuse;
        for (const Size& size : {Size{1, 23}, Size{23, 1}, Size{11, 8}}) {
            if (lines && size.width > 1 && size.height > 1) continue; // there a mean is of means
            const CrossBilateralOptions options{.kernel = 9, .sigma_spatial = 1e6, .form = form};
            INFO("form ", int(form), ", width ", size.width);
            CHECK(bilateral_counts(size.width, size.height, options).taps == taps_of_means(size, options));
        }
    }
}

TEST_CASE("counts: none where nothing is filtered, a bad option is refused, re-use halves the exponentials alone") {
    CHECK(bilateral_counts(40, 30, {.kernel = 0}).taps == 0);
    CHECK_THROWS_AS(bilateral_counts(40, 30, {.kernel = 4}), Error);
    CHECK_THROWS_AS(bilateral_counts(40, 30, {.kernel = 5, .window = {0, 0, 41, 2}}), Error);
    const auto of = [](BilateralForm form) { return bilateral_counts(1280, 720, {.form = form}); };
    for (const auto& [once, twice] : {std::pair{BilateralForm::naive_2d, BilateralForm::reuse_2d},
                                      {BilateralForm::separable, BilateralForm::separable_reuse}}) {
        CHECK(of(once).exponentials == 2 * of(twice).exponentials);
        CHECK(of(once).taps == of(twice).taps);
    }
}

TEST_CASE("counts: denoise() adds up its passes, and has none where it takes another filter") {
    const Planes<float> planes = random_planes<float>(40, 30, 2);
    PixelData<float> frame;
    frame.width = 40, frame.height = 30;
    frame.radiance = planes.image;
    frame.normal = planes.normal;
    frame.position = planes.position;
    SerialExecutor serial;
    const auto passes = [&](const DenoiseOptions& options) {
        return denoise(frame, options, serial).report.bilateral.exponentials;
    };
    const auto one = [](int kernel, BilateralForm form = BilateralForm::separable_reuse) {
        return bilateral_counts(40, 30, {.kernel = kernel, .form = form}).exponentials;
    };
    // The filter, and what tells it light from noise: wider, the more noise there is, and up to half as wide.
    Plane<float, 3> light(40, 30);
    despike<float>(frame.radiance.view(), light.view(), 4, serial);
    const double noise = double(std::lround(16 * noise_level<float>(std::as_const(light).view(), serial))) / 16;
    const int guide = 2 * int(20 * noise) + 1;
    CHECK(guide > 9);
    CHECK(guide < 17);
    CHECK(passes({.kernel = 33}) == one(33) + 2 * one(guide));
    CHECK(passes({.kernel = 17}) == one(17) + 2 * one(9));
    CHECK(passes({.kernel = 5}) == one(5) + 2 * one(3));
    CHECK(passes(denoise_options("best")) ==
          one(25, BilateralForm::reuse_2d) + 2 * one(std::min(guide, 13), BilateralForm::reuse_2d));
    CHECK(passes(denoise_options("seed")) == one(65));
    CHECK(passes(denoise_options("none")) == 0);
    frame.variance = planes.image;
    frame.samples.allocate(40, 30);
    for (float& n : frame.samples.values()) n = 4;
    CHECK(passes(denoise_options("fast")) == 0);
}
