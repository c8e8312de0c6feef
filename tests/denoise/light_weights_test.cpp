#include "support/random.hpp"
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <doctest/doctest.h>
#include <lambent/denoise/light_weights.hpp>
#include <utility>

using namespace lambent;
using namespace lambent_test;

namespace {

constexpr int image_width = 75, image_height = 37;

/// Features and roots of random light, as LightRegression would have them.
struct RandomGuides {
    detail::PhasedPlanes<float> guides, scales, inside, roots;

    RandomGuides(int stride, std::uint64_t seed)
        : guides(image_width, image_height, detail::light_features, stride),
          scales(image_width, image_height, detail::light_features, stride), inside(image_width, 1, 1, stride),
          roots(image_width, image_height, 4, 1) {
        Random random(seed);
        const auto fill = [&](detail::PhasedPlanes<float>& planes, int channel, double low, double high) {
            planes.fill(channel, image_width, image_height, [&](int, int) { return float(random.uniform(low, high)); });
        };
        for (int c = 0; c < detail::light_features; ++c) {
            fill(guides, c, 0, 1);
            fill(scales, c, 0.1, 0.5);
        }
        for (int c = 0; c < 3; ++c) fill(roots, c, 0, 2);
        fill(roots, 3, 0.3, 0.6);
        for (int x = 0; x < image_width; ++x) inside.channel(0)[inside.at(x, 0)] = 1;
    }
    detail::WeightInputs<float> all() const { return {guides, scales, inside, roots, image_height}; }
};

/// In double precision, from the definition.
double expected(const RandomGuides& of, const std::array<double, 2>& softness, int x, int y, int dx, int dy) {
    const auto in = [](int at, int size) { return at >= 0 && at < size; };
    if (!in(x, image_width) || !in(x + dx, image_width) || !in(y + dy, image_height)) return 0;
    const auto value = [](const detail::PhasedPlanes<float>& planes, int c, int u, int v) {
        return double(planes.channel(c)[planes.at(std::clamp(u, 0, image_width - 1), std::clamp(v, 0, image_height - 1))]);
    };
    double distance = 0, sums[2] = {0, 0}, weight = 0;
    for (int c = 0; c < detail::light_features; ++c) {
        const double d = value(of.guides, c, x, y) - value(of.guides, c, x + dx, y + dy);
        distance += d * d * value(of.scales, c, x, y);
    }
    for (int v = -3; v <= 3; ++v)
        for (int u = -3; u <= 3; ++u) {
            double square = 0;
            for (int c = 0; c < 3; ++c) {
                const double d = value(of.roots, c, x + u, y + v) - value(of.roots, c, x + u + dx, y + v + dy);
                square += d * d;
            }
            const double test = square / (value(of.roots, 3, x + u, y + v) + value(of.roots, 3, x + u + dx, y + v + dy));
            sums[1] += test / 49;
            if (std::max(std::abs(u), std::abs(v)) <= 1) sums[0] += test / 9;
        }
    for (int k = 0; k < 2; ++k) weight += std::exp(-distance - std::max(0.0, sums[k] - 1) / softness[std::size_t(k)]);
    return weight;
}

} // namespace

TEST_CASE("LightWeights: those of the definition, for every tap, with one center for each pixel or for four") {
    const std::uint64_t seed = 23;
    CAPTURE(seed);
    const std::array<double, 2> softness = {1.5, 2.5};
    for (const int stride : {1, 2}) {
        CAPTURE(stride);
        const RandomGuides guides(stride, seed);
        for (const int radius : {1, 5, 8}) {
            detail::LightWeights<float> weights(radius, stride, softness);
            CAPTURE(radius);
            CHECK(weights.taps().size() == std::size_t((2 * radius + 1) * (2 * radius + 1)));
            for (const auto& [x0, y0] : {std::pair(0, 0), std::pair(64, 32)}) {
                const int first = y0 == 0 ? 1 : 0, last = (std::min(16, image_height - y0) + stride - 1) / stride;
                weights.find(guides.all(), x0, y0, first, last);
                double worst = 0;
                for (std::size_t tap = 0; tap < weights.taps().size(); ++tap)
                    for (int j = first; j < last; ++j)
                        for (int i = 0; i < 64 / stride; i += 8)
                            for (int lane = 0; lane < 8; ++lane) {
                                const int x = x0 + (i + lane) * stride, y = y0 + j * stride;
                                if (x >= image_width) continue;
                                const auto [dx, dy] = weights.taps()[tap];
                                const double should = expected(guides, softness, x, y, dx, dy);
                                worst = std::max(worst, std::abs(double(weights.of(tap, j, i)[lane]) - should));
                            }
                CHECK(worst < 2e-5); // of weights up to 2
            }
        }
    }
}
