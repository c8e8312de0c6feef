#include <lambent/core/numerics.hpp>
#include <lambent/render/pixel_filter.hpp>
#include <doctest/doctest.h>
#include <cmath>

using namespace lambent;

namespace {

/// A filter's weight as its name has it, not normalised.
double weight(PixelFilter filter, double x) {
    switch (filter) {
    case PixelFilter::box: return std::abs(x) <= 0.5 ? 1 : 0;
    case PixelFilter::tent: return std::max(0.0, 1 - std::abs(x));
    case PixelFilter::blackman_harris: break;
    }
    if (std::abs(x) > 1.5) return 0;
    const double a = pi<double> * x / 1.5;
    return 0.35875 + 0.48829 * std::cos(a) + 0.14128 * std::cos(2 * a) + 0.01168 * std::cos(3 * a);
}

} // namespace

TEST_CASE("pixel filters: offsets are drawn by their weight") {
    for (const PixelFilter filter : {PixelFilter::box, PixelFilter::tent, PixelFilter::blackman_harris}) {
        CAPTURE(int(filter));
        // The share of the weight below an offset is the number that it is drawn with: integrated by midpoints.
        constexpr int steps = 60000;
        double total = 0;
        for (int i = 0; i < steps; ++i) total += weight(filter, -1.5 + 3 * (i + 0.5) / steps);
        double below = 0, last = -2, worst = 0;
        int at = 0;
        for (int k = 1; k < 400; ++k) {
            const double u = k / 400.0, offset = filter_offset(filter, u);
            CHECK(offset > last);
            last = offset;
            for (; at < steps && -1.5 + 3 * (at + 0.5) / steps < offset; ++at)
                below += weight(filter, -1.5 + 3 * (at + 0.5) / steps);
            worst = std::max(worst, std::abs(below / total - u));
        }
        CHECK(worst < 1e-4);
        CHECK(filter_offset(filter, 0.5) == doctest::Approx(0).epsilon(1e-9));
        const float edge = filter == PixelFilter::box ? 0.5f : filter == PixelFilter::tent ? 1.0f : 1.5f;
        CHECK(filter_offset(filter, 0.0f) == -edge);
        CHECK(filter_offset(filter, 0.99999994f) <= edge);
    }
}
