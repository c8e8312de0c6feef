#include <lambent/core/numerics.hpp>
#include <lambent/sampling/independent.hpp>
#include <lambent/sampling/sobol.hpp>
#include <lambent/sampling/stratified.hpp>
#include <support/statistics.hpp>
#include <doctest/doctest.h>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

using namespace lambent;
using namespace lambent_test;

TEST_CASE("sobol: 4^k samples of the 4^l pixels of an aligned square make one net, at any number of samples") {
    for (const std::uint32_t seed : {3u, 78u})
        for (std::uint32_t l = 0; l <= 3; ++l)
            for (std::uint32_t k = 0; k + l <= 5; ++k) {
                CAPTURE(l);
                CAPTURE(k);
                const SobolSampler<double> sampler(seed);
                const std::uint32_t samples = 1u << 2 * k, side = 1u << l, n = samples * side * side;
                int wrong = 0;
                for (const std::uint32_t block : {0u, 3u, 0x10001u})
                    for (const std::uint32_t corner : {0u, 1u, 77u})
                        for (const std::uint32_t d : {0u, 7u, 31u, 70u}) {
                            std::vector<Vec2d> p;
                            std::vector<int> line(n);
                            for (std::uint32_t i = 0; i < samples; ++i)
                                for (std::uint32_t pixel = 0; pixel < side * side; ++pixel) {
                                    const auto stream = sampler.at(corner * side + pixel % side, (corner + 2) * side + pixel / side,
                                                                   block * samples + i);
                                    p.push_back(stream.get_2d(d));
                                    ++line[std::size_t(stream.get_1d(d + 1) * n)];
                                }
                            for (const int c : line) wrong += c != 1;
                            for (std::uint32_t a = 0; a <= k + l; ++a) {
                                const std::uint32_t columns = 1u << 2 * a;
                                std::vector<int> box(n);
                                for (const Vec2d& q : p) ++box[std::size_t(q.x * columns) * (n / columns) + std::size_t(q.y * (n / columns))];
                                for (const int c : box) wrong += c != 1;
                            }
                        }
                CHECK(wrong == 0);
            }
}

TEST_CASE("sobol: errors of neighbours cancel: blurred, the noise of few samples is far below that of lone pixels") {
    constexpr std::uint32_t size = 64;
    const auto integrand = [](Vec2d u, double v) { return u.x < 0.3 + 0.5 * u.y ? 1 + v * u.y : 0.2; };
    for (const std::uint32_t n : {1u, 2u, 4u}) {
        const auto errors = [&](const auto& sampler) { // mean square of pixels, and of means of 4 x 4 anywhere
            std::vector<double> image;
            double mean = 0;
            for (std::uint32_t pixel = 0; pixel < size * size; ++pixel) {
                double sum = 0;
                for (std::uint32_t i = 0; i < n; ++i) {
                    const auto stream = sampler.at(pixel % size, pixel / size, i);
                    sum += integrand(Vec2d(stream.get_2d(3)), double(stream.get_1d(4)));
                }
                image.push_back(sum / n);
                mean += image.back() / (size * size);
            }
            double single = 0, blurred = 0, count = 0;
            for (std::uint32_t y = 0; y + 4 <= size; ++y)
                for (std::uint32_t x = 0; x + 4 <= size; ++x, ++count) {
                    double sum = 0;
                    for (std::uint32_t j = 0; j < 16; ++j) sum += image[(y + j / 4) * size + x + j % 4] / 16;
                    single += (image[y * size + x] - mean) * (image[y * size + x] - mean);
                    blurred += (sum - mean) * (sum - mean);
                }
            return Vec2d(single, blurred) / count;
        };
        const Vec2d sobol = errors(SobolSampler<float>(5)), independent = errors(IndependentSampler<float>(5));
        INFO(n << " samples: of independent noise's, " << sobol.x / independent.x << " alone, " << sobol.y / independent.y << " blurred");
        CHECK(sobol.y / sobol.x < 0.8 / 16); // independent: 1 / 16
    }
}

TEST_CASE("samplers: the mean of an image of paths is unbiased at every number of samples, with roulette") {
    // As a path tracer draws: a light and a direction in 2D, roulette in 1D, four dimensions a vertex. Paths get lost
    // by direction, so that few of them carry what there is; roulette's chance is the throughput's.
    constexpr std::uint32_t seed = 61, side = 16, first_vertex = 2, per_vertex = 4, depth = 12;
    INFO("seed " << seed);
    constexpr double albedo = 0.7;
    double exact = 0;
    for (std::uint32_t k = 0; k <= depth; ++k) exact += std::pow(albedo, k);
    const auto path = [&](const auto& stream) {
        const Vec2f film = stream.get_2d(0);
        double throughput = 2 * film.x, sum = 0;
        for (std::uint32_t k = 0;; ++k) {
            const std::uint32_t base = first_vertex + per_vertex * k;
            const Vec2f light = stream.get_2d(base), direction = stream.get_2d(base + 1);
            sum += throughput * (light.x < 0.25f ? 8 * light.y : 0.0f);
            if (k == depth) return sum;
            throughput *= direction.y < 0.5f ? 4 * albedo * direction.x : 0.0;
            const double survival = std::clamp(throughput, 0.05, 0.99);
            if (!(throughput > 0) || !(stream.get_1d(base + 3) < survival)) return sum;
            throughput /= survival;
        }
    };
    for (const std::uint32_t n : {1u, 2u, 4u, 16u, 64u}) {
        const auto check = [&](const char* name, auto make) {
            Moments images; // of other seeds, so independent of one another whatever pixels share
            for (std::uint32_t run = 0; run < std::max(60u, 1200 / n); ++run) {
                const auto sampler = make(seed + run);
                double sum = 0;
                for (std::uint32_t pixel = 0; pixel < side * side; ++pixel)
                    for (std::uint32_t i = 0; i < n; ++i) sum += path(sampler.at(pixel % side, pixel / side, i));
                images.add(sum / (n * side * side));
            }
            INFO(std::string(name) << " at " << n << " samples: mean " << images.mean() << " +- " << images.standard_error() << ", exact " << exact);
            CHECK(std::abs(images.z(exact)) < max_z);
            CHECK(images.standard_error() < 0.04 * exact);
        };
        check("sobol", [](std::uint32_t s) { return SobolSampler<float>(s); });
        check("stratified", [&](std::uint32_t s) { return StratifiedSampler<float>(s, n); });
        check("independent", [](std::uint32_t s) { return IndependentSampler<float>(s); });
    }
}

TEST_CASE("sobol: what a path makes of two of its dimensions together has less noise than by independent pairs") {
    // Each factor has mean 0 over its square, so that one dimension alone gives nothing.
    const auto slope = [](Vec2d u) { return u.x + 0.7 * u.y - 0.85; };
    const auto wave = [](Vec2d u) { return std::cos(2 * pi<double> * u.x) + (u.y < 0.5 ? 1 : -1); };
    constexpr double slope_square = (1 + 0.49) / 12, wave_square = 0.5 + 1;
    // The pixel, vertices' lights (2, 6, 10) and directions (3, 7, 11): a light goes with the way to its vertex.
    constexpr std::uint32_t pairs[][2] = {{0, 2}, {0, 3}, {0, 6}, {0, 7}, {3, 6}, {3, 7}, {3, 10}, {3, 11}, {7, 10}, {7, 11}};
    constexpr std::uint32_t seed = 91, runs = 400;
    INFO("seed " << seed);
    const SobolSampler<double> sampler(seed);
    struct Bound {
        std::uint32_t samples;
        double on_average, at_most;
    };
    for (const Bound bound : {Bound{16, 1.0, 3.5}, Bound{64, 0.35, 1.5}, Bound{256, 0.12, 0.5}}) {
        const double n = bound.samples;
        double sum = 0, largest = 0, count = 0;
        for (const auto& pair : pairs) {
            const std::uint32_t a = pair[0], b = pair[1];
            double both_slope = 0, both_wave = 0;
            for (std::uint32_t run = 0; run < runs; ++run) {
                double slopes = 0, waves = 0;
                for (std::uint32_t i = 0; i < bound.samples; ++i) {
                    const auto stream = sampler.at(8 * run, 0, i);
                    const Vec2d u = stream.get_2d(a), v = stream.get_2d(b);
                    slopes += slope(u) * slope(v);
                    waves += wave(u) * wave(v);
                }
                both_slope += slopes * slopes / (n * slope_square * slope_square * runs);
                both_wave += waves * waves / (n * wave_square * wave_square * runs);
            }
            CAPTURE(n);
            CAPTURE(a);
            CAPTURE(b);
            CHECK(std::max(both_slope, both_wave) < bound.at_most);
            largest = std::max({largest, both_slope, both_wave});
            sum += both_slope + both_wave;
            count += 2;
        }
        INFO(n << " samples: variance over independent pairs' " << sum / count << " on average, " << largest << " at most");
        CHECK(sum / count < bound.on_average);
    }
}
