#include "support/random.hpp"
#include <array>
#include <doctest/doctest.h>
#include <lambent/sampling/independent.hpp>
#include <lambent/sampling/sobol.hpp>
#include <lambent/sampling/stratified.hpp>
#include <string>
#include <support/statistics.hpp>

using namespace lambent;
using namespace lambent_test;

static_assert(Sampler<SobolSampler<float>> && Sampler<SobolSampler<double>>);
static_assert(Sampler<IndependentSampler<float>> && Sampler<IndependentSampler<double>>);
static_assert(Sampler<StratifiedSampler<float>> && Sampler<StratifiedSampler<double>>);

namespace {

/// Runs f(sampler, name) for the three samplers; strata for n samples a pixel.
template <class T, class F>
void for_each_sampler(std::uint32_t seed, std::uint32_t n, F f) {
    f(SobolSampler<T>(seed), "sobol");
    f(StratifiedSampler<T>(seed, n), "stratified");
    f(IndependentSampler<T>(seed), "independent");
}

std::size_t bin(double x, std::size_t n) { return std::min(n - 1, std::size_t(x * double(n))); }

} // namespace

TEST_CASE("bits to numbers: never 1, not even from all ones; both ends reached") {
    CHECK(to_unit<float>(0xffffffffu) == 0x1.fffffep-1f);
    CHECK(to_unit<float>(0xffffffffffffffffu) == 0x1.fffffep-1f);
    CHECK(to_unit<double>(0xffffffffu) == 1 - 0x1p-32);
    CHECK(to_unit<double>(0xffffffffffffffffu) == 1 - 0x1p-53);
    CHECK(to_unit<float>(0xffu) == 0);
    CHECK(to_unit<float>(0x100u) == 0x1p-24f);
    CHECK(one_minus_epsilon<float> == 0x1.fffffep-1f);
    CHECK(to_range(0xffffffffu, 7) == 6);
    CHECK(to_range(0xffffffffu, 0xffffffffu) == 0xfffffffeu);
}

TEST_CASE("hash: every input bit flips every output bit with a chance near one half") {
    Random random(1);
    constexpr int trials = 4000;
    double worst = 0;
    for (int in = 0; in < 64; ++in) {
        std::array<int, 64> flips{};
        for (int k = 0; k < trials; ++k) {
            // Counters are what we hash: small numbers as well as random ones.
            const std::uint64_t x = k % 2 ? random.bits() : random.bits() >> 44;
            const std::uint64_t changed =
                mix_bits(x + golden_ratio_64) ^ mix_bits((x ^ 1ull << in) + golden_ratio_64);
            for (int out = 0; out < 64; ++out) flips[std::size_t(out)] += int(changed >> out & 1);
        }
        for (const int f : flips)
            worst = std::max(worst, std::abs(f - trials / 2.0) / std::sqrt(trials / 4.0));
    }
    CHECK(worst < 5.0); // of 4096 normal variables; a right hash exceeds it with probability 0.002
}

TEST_CASE_TEMPLATE("samplers: 1e7 draws stay in [0, 1)", T, float, double) {
    constexpr std::uint32_t seed = 3;
    INFO("seed " << seed);
    for_each_sampler<T>(seed, 1009, [&](const auto& sampler, const char* name) {
        INFO(name);
        T low = 1, high = 0;
        for (std::uint32_t i = 0; i < 1000; ++i) {
            const auto stream = sampler.at(i * 7, i, i);
            for (std::uint32_t d = 0; d < 1200; ++d) {
                const T a = stream.get_1d(2 * d);
                const Vec2<T> b = stream.get_2d(2 * d + 1);
                low = std::min({low, a, b.x, b.y});
                high = std::max({high, a, b.x, b.y});
            }
        }
        CHECK(low >= 0);
        CHECK(high < 1);
        CHECK(low < 1e-5);
        CHECK(high > 1 - 1e-5);
    });
    // Strata of which the last ones round up to 1 in float.
    for (const std::uint32_t n : {1u << 24, (1u << 24) - 1, 9999991u}) {
        const StratifiedSampler<T> sampler(seed, n);
        T high = 0;
        for (std::uint32_t i = 0; i < 300000; ++i) {
            const auto stream = sampler.at(1, 2, i * 31 % n);
            const Vec2<T> p = stream.get_2d(0);
            high = std::max({high, stream.get_1d(1), p.x, p.y});
        }
        CHECK(high < 1);
    }
}

TEST_CASE_TEMPLATE("sobol: one point in each elementary interval of each aligned block of 2^k", T, float,
                   double) {
    for (const std::uint32_t seed : {0u, 1u, 77u}) {
        INFO("seed " << seed);
        const SobolSampler<T> sampler(seed);
        int wrong = 0;
        for (std::uint32_t k = 0; k <= 10; ++k) {
            const std::uint32_t n = 1u << k;
            for (const std::uint32_t block : {0u, 1u, 5u, 0x100000u, (0xffffffffu >> k)}) {
                for (const std::uint32_t d : {0u, 1u, 19u, 31u, 70u}) {
                    std::vector<Vec2<T>> p(n);
                    std::vector<int> line(n);
                    for (std::uint32_t i = 0; i < n; ++i) {
                        const auto stream = sampler.at(12, 34, (block << k) + i);
                        p[i] = stream.get_2d(d);
                        ++line[std::size_t(stream.get_1d(d) * T(n))];
                    }
                    for (const int c : line) wrong += c != 1;
                    for (std::uint32_t a = 0; a <= k; ++a) {
                        std::vector<int> box(n);
                        for (const Vec2<T>& q : p)
                            ++box[(std::size_t(q.x * T(1u << a)) << (k - a)) +
                                  std::size_t(q.y * T(1u << (k - a)))];
                        for (const int c : box) wrong += c != 1;
                    }
                }
            }
        }
        CHECK(wrong == 0);
    }
}

TEST_CASE("sobol: the five-step matrix is Sobol's second dimension") {
    // Direction numbers by the recurrence for the polynomial x + 1: v_i = v_(i-1) ^ (v_(i-1) >> 1).
    Random random(2);
    for (int k = 0; k < 10000; ++k) {
        const std::uint32_t index = random.bits32() >> random.below(32);
        std::uint32_t expected = 0, v = 1u << 31;
        for (std::uint32_t i = 0; i < 32; ++i, v ^= v >> 1)
            if (index >> i & 1) expected ^= v;
        REQUIRE(detail::reverse_bits(detail::sobol_second_reversed(index)) == expected);
    }
    CHECK(detail::reverse_bits(1u) == 0x80000000u);
    CHECK(detail::reverse_bits(0x12345678u) == 0x1e6a2c48u);
}

TEST_CASE("sobol: the hash scrambles a tree: each bit depends on the bits above it alone, and is random") {
    Random random(4);
    for (int k = 0; k < 20000; ++k) {
        const std::uint32_t x = random.bits32(), seed = random.bits32(), bit = random.below(32);
        const std::uint32_t changed =
            detail::owen_scramble_reversed(x, seed) ^ detail::owen_scramble_reversed(x ^ 1u << bit, seed);
        REQUIRE((changed & ((1u << bit) - 1)) == 0);
        REQUIRE((changed >> bit & 1) == 1);
    }
}

TEST_CASE("sobol: hashed scrambling is as good as Owen's own, drawn bit by bit from a tree") {
    const auto integrand = [](double x, double y) { return std::exp(-3 * x * x) * std::cos(2 * y + x); };
    double exact = 0;
    for (int i = 0; i < 1000; ++i)
        for (int j = 0; j < 1000; ++j) exact += integrand((i + 0.5) / 1000, (j + 0.5) / 1000) * 1e-6;

    const auto tree_owen = [](std::uint32_t x, std::uint64_t key) { // most significant bit first
        std::uint32_t result = 0;
        for (int bit = 31; bit >= 0; --bit) {
            const std::uint64_t above = bit == 31 ? 0 : x >> (bit + 1);
            const std::uint32_t flip = derive_key(key + std::uint64_t(bit), above) >> 40 & 1;
            result |= ((x >> bit & 1) ^ flip) << bit;
        }
        return result;
    };
    for (const std::uint32_t n : {4u, 16u, 64u, 256u}) {
        CAPTURE(n);
        double ours = 0, tree = 0;
        constexpr std::uint32_t runs = 3000;
        const SobolSampler<double> sampler(9);
        for (std::uint32_t run = 0; run < runs; ++run) {
            double a = 0, b = 0;
            const std::uint64_t key = mix_bits(run + 1);
            for (std::uint32_t i = 0; i < n; ++i) {
                const Vec2d u = sampler.at(run, 0, i).get_2d(0);
                a += integrand(u.x, u.y) / n;
                const std::uint32_t first = detail::reverse_bits(i);
                const std::uint32_t second = detail::reverse_bits(detail::sobol_second_reversed(i));
                b += integrand(tree_owen(first, key) * 0x1p-32, tree_owen(second, ~key) * 0x1p-32) / n;
            }
            ours += (a - exact) * (a - exact) / runs;
            tree += (b - exact) * (b - exact) / runs;
        }
        INFO("variance, hash over tree: " << ours / tree);
        CHECK(ours / tree < 1.25);
        CHECK(ours / tree > 0.75);
    }
}

TEST_CASE_TEMPLATE("stratified: one sample a stratum at any number of samples, and again after it", T, float,
                   double) {
    for (const std::uint32_t n :
         {1u, 2u, 3u, 4u, 5u, 7u, 8u, 12u, 16u, 17u, 31u, 64u, 97u, 100u, 121u, 1000u}) {
        CAPTURE(n);
        const StratifiedSampler<T> sampler(11, n);
        const auto columns = std::uint32_t(std::sqrt(double(n)));
        const std::uint32_t rows = (n + columns - 1) / columns;
        std::uint32_t wrong = 0;
        for (std::uint32_t trial = 0; trial < 40; ++trial) {
            const std::uint32_t pattern = trial % 3;
            std::vector<int> line(n), down(n), across(columns * rows), cell(columns * rows);
            for (std::uint32_t i = 0; i < n; ++i) {
                const auto stream = sampler.at(trial, 3, pattern * n + i);
                const double a = stream.get_1d(trial), x = stream.get_2d(trial + 1).x,
                             y = stream.get_2d(trial + 1).y;
                ++line[std::min(n - 1, std::uint32_t(a * n))];
                const auto place = std::min(n - 1, std::uint32_t(y * n));
                ++down[place];
                ++across[std::min(columns * rows - 1, std::uint32_t(x * columns * rows))];
                ++cell[place / columns * columns + std::min(columns - 1, std::uint32_t(x * columns))];
            }
            for (const int c : line) wrong += c != 1 ? 1u : 0u;
            for (const int c : down) wrong += c != 1 ? 1u : 0u;
            for (const int c : across) wrong += (n == columns * rows ? c != 1 : c > 1) ? 1u : 0u;
            for (const int c : cell) wrong += (n == columns * rows ? c != 1 : c > 1) ? 1u : 0u;
        }
        // A sample that rounds up to the border of its stratum counts in the next one: in float a few do.
        CHECK(wrong <= (sizeof(T) == 4 ? 40 * 4 * n / 10000 : 0));
    }
    CHECK_THROWS_AS(StratifiedSampler<T>(0, 0), Error);
    CHECK_THROWS_AS(StratifiedSampler<T>(0, 0xffffffffu), Error);
}

TEST_CASE("stratified: the shuffle is a permutation and deals all orders alike") {
    Random random(12);
    for (const std::uint32_t n : {1u, 2u, 3u, 4u, 5u, 6u, 7u, 8u, 9u, 31u, 33u, 257u}) {
        CAPTURE(n);
        std::vector<double> pairs(n * n);
        const int runs = int(std::max(2000u, 40 * n * n / 2));
        for (int run = 0; run < runs; ++run) {
            const std::uint64_t key = random.bits();
            if (run < 200) {
                std::vector<int> seen(n);
                for (std::uint32_t i = 0; i < n; ++i) ++seen.at(detail::permute(i, n, key));
                for (const int s : seen) REQUIRE(s == 1);
            }
            ++pairs[detail::permute(0, n, key) * n + detail::permute(n / 2, n, key)];
        }
        std::vector<double> expected(n * n, n == 1 ? runs : runs / double(n * (n - 1)));
        for (std::uint32_t i = 0; i < n && n > 1; ++i) expected[i * n + i] = 0;
        CHECK(chi_square_test(pairs, expected) > 1e-4); // 12 tests
    }
}

TEST_CASE("samplers: each sample alone is uniform, to its last bits") {
    constexpr std::uint32_t seed = 21;
    INFO("seed " << seed);
    for_each_sampler<float>(seed, 16, [&](const auto& sampler, const char* name) {
        for (const std::uint32_t index : {0u, 1u, 6u, 15u, 16u, 1000u}) {
            INFO(name << ", sample " << index);
            std::vector<double> one(64), x(64), y(64), low(64), square(256);
            for (std::uint32_t pixel = 0; pixel < 65536; ++pixel) {
                const auto stream = sampler.at(pixel % 256, pixel / 256, index);
                const Vec2f p = stream.get_2d(4);
                ++one[bin(stream.get_1d(3), 64)];
                ++x[bin(p.x, 64)];
                ++y[bin(p.y, 64)];
                ++low[bin(p.x * 1024 - std::floor(p.x * 1024), 64)];
                ++square[bin(p.x, 16) * 16 + bin(p.y, 16)];
            }
            for (const auto* bins : {&one, &x, &y, &low, &square})
                CHECK(chi_square_uniform(*bins) > 1e-5); // 90 tests
        }
    });
}

TEST_CASE("samplers: dimensions, pixels, and seeds are independent of one another") {
    constexpr std::uint32_t seed = 22;
    INFO("seed " << seed);
    for_each_sampler<float>(seed, 4, [&](const auto& sampler, const char* name) {
        for (const std::uint32_t index : {0u, 1u, 3u}) {
            INFO(name << ", sample " << index);
            std::vector<double> dimensions(256), far_dimensions(256), right(256), below(256), mirrored(256),
                triple(512), seeds(256);
            auto other = sampler;
            for_each_sampler<float>(seed + 1, 4, [&](const auto& s, const char*) {
                if constexpr (std::is_same_v<decltype(s), decltype(sampler)>) other = s;
            });
            for (std::uint32_t pixel = 0; pixel < 65536; ++pixel) {
                const std::uint32_t px = pixel % 256, py = pixel / 256;
                const auto here = sampler.at(2 * px, 2 * py + 1, index);
                const float a = here.get_1d(0);
                const Vec2f p = here.get_2d(1), q = here.get_2d(2);
                const auto count = [&](std::vector<double>& bins, float b) {
                    ++bins[bin(a, 16) * 16 + bin(b, 16)];
                };
                count(dimensions, p.x);
                count(far_dimensions, here.get_1d(32));
                // Sobol's pixels share points with those of their own tile of 8 x 8, on purpose.
                count(right, sampler.at(2 * px + 8, 2 * py + 1, index).get_1d(0));
                count(below, sampler.at(2 * px, 2 * py + 9, index).get_1d(0));
                count(seeds, other.at(2 * px, 2 * py + 1, index).get_1d(0));
                count(mirrored, sampler.at(2 * py + 1, 2 * px, index).get_1d(0));
                ++triple[(bin(p.x, 8) * 8 + bin(p.y, 8)) * 8 + bin(q.y, 8)];
            }
            for (const auto* bins :
                 {&dimensions, &far_dimensions, &right, &below, &mirrored, &triple, &seeds})
                CHECK(chi_square_uniform(*bins) > 1e-5); // 63 tests
        }
    });
}

TEST_CASE("samplers: values depend on nothing but (pixel, sample, dimension, seed)") {
    for_each_sampler<float>(5, 6, [](const auto& sampler, const char* name) {
        INFO(name);
        struct Draw {
            std::uint32_t x, y, index, dimension;
            float a;
            Vec2f p;
        };
        Random random(7);
        std::vector<Draw> draws(5000);
        for (Draw& d : draws) {
            d = {random.below(100), random.below(100), random.below(100), random.below(40), 0, {}};
            const auto stream = sampler.at(d.x, d.y, d.index);
            d.a = stream.get_1d(2 * d.dimension);
            d.p = stream.get_2d(2 * d.dimension + 1);
        }
        for (std::size_t i = draws.size(); i-- > 0;) {
            std::swap(draws[i], draws[random.below(std::uint32_t(i + 1))]);
            const Draw& d = draws[i];
            const auto copy = sampler;
            const auto stream = copy.at(d.x, d.y, d.index);
            const auto other = stream;
            other.get_2d(random.below(1000));
            REQUIRE(other.get_2d(2 * d.dimension + 1) == d.p);
            REQUIRE(stream.get_1d(2 * d.dimension) == d.a);
        }
    });
}

TEST_CASE_TEMPLATE("sobol: four dimensions at once are the four one by one", T, float, double) {
    const SobolSampler<T> sampler(3);
    Random random(17);
    for (int i = 0; i < 100000; ++i) {
        const auto number = [&] { return std::uint32_t(random.uniform() * 0x1p32); };
        const auto stream = sampler.at(number() >> 12, number() >> 12, i < 50000 ? number() : number() & 255u);
        const std::uint32_t base = (number() >> (i % 2 == 0 ? 28 : 3)) * 4 + 2;
        const auto four = stream.get_2d_of_four(base);
        for (std::uint32_t d = 0; d < 4; ++d) {
            REQUIRE(four[d] == stream.get_2d(base + d));
            REQUIRE(four[d].x == stream.get_1d(base + d));
        }
    }
}

TEST_CASE("samplers: a path with roulette is unbiased at every number of samples") {
    // Each vertex emits 2y and survives by roulette with chance q; throughput takes albedo · (0.5 + x) / q.
    constexpr double albedo = 0.8, q = 0.7;
    constexpr std::uint32_t depth = 8, seed = 31;
    double exact = 0;
    for (std::uint32_t k = 0; k <= depth; ++k) exact += std::pow(albedo, k);
    for (const std::uint32_t n : {1u, 2u, 3u, 4u, 5u, 7u, 16u, 17u, 64u, 100u}) {
        for_each_sampler<float>(seed, n, [&](const auto& sampler, const char* name) {
            Moments pixels;
            for (std::uint32_t pixel = 0; pixel < 300000 / n; ++pixel) {
                double sum = 0;
                for (std::uint32_t i = 0; i < n; ++i) {
                    const auto stream = sampler.at(pixel % 640, pixel / 640, i);
                    double throughput = 1;
                    for (std::uint32_t k = 0;; ++k) {
                        const Vec2f p = stream.get_2d(2 * k);
                        sum += throughput * 2 * p.y;
                        if (k == depth || !(stream.get_1d(2 * k + 1) < q)) break;
                        throughput *= albedo * (0.5 + p.x) / q;
                    }
                }
                pixels.add(sum / n);
            }
            INFO(name << " at " << n << " samples: mean " << pixels.mean() << ", exact " << exact);
            CHECK(std::abs(pixels.z(exact)) < max_z);
            CHECK(pixels.standard_error() < 0.01 * exact);
        });
    }
}

TEST_CASE("S7: stratification: error falls faster than N^-0.5") {
    const auto smooth = [](Vec2d u) {
        return 1 / (1 + 4 * (u.x - 0.3) * (u.x - 0.3) + 2 * (u.y - 0.6) * (u.y - 0.6));
    };
    const auto edge = [](Vec2d u) { return u.y < 0.3 + 0.37 * u.x ? 1.0 : 0.0; };
    const auto soft_edge = [](Vec2d u) { return std::clamp((0.4 + 0.37 * u.x - u.y) * 5 + 0.5, 0.0, 1.0); };
    constexpr std::uint32_t seed = 41, runs = 1500;
    INFO("seed " << seed);
    const auto rmse = [&](const auto& sampler, std::uint32_t n, auto f, double exact) {
        double squares = 0;
        for (std::uint32_t run = 0; run < runs; ++run) {
            double sum = 0;
            for (std::uint32_t i = 0; i < n; ++i) {
                const Vec2f u = sampler.at(run, 5, i).get_2d(1);
                sum += f(Vec2d(u));
            }
            squares += (sum / n - exact) * (sum / n - exact) / runs;
        }
        return std::sqrt(squares);
    };
    const auto rates = [&](const char* what, auto f, double sobol_rate, double stratified_rate,
                           double sobol_64, double stratified_64) {
        double exact = 0;
        for (int i = 0; i < 2000; ++i)
            for (int j = 0; j < 2000; ++j) exact += f({(i + 0.5) / 2000, (j + 0.5) / 2000}) / 4e6;
        std::vector<double> log_n, sobol, stratified, independent;
        for (const std::uint32_t n : {4u, 16u, 64u, 256u}) {
            log_n.push_back(std::log(n));
            sobol.push_back(std::log(rmse(SobolSampler<float>(seed), n, f, exact)));
            stratified.push_back(std::log(rmse(StratifiedSampler<float>(seed, n), n, f, exact)));
            independent.push_back(std::log(rmse(IndependentSampler<float>(seed), n, f, exact)));
        }
        INFO(std::string(what) << ", variance of independent over sobol and over stratified at 64: "
                               << std::exp(2 * (independent[2] - sobol[2])) << ", "
                               << std::exp(2 * (independent[2] - stratified[2])));
        CHECK(slope(log_n, independent) == doctest::Approx(-0.5).epsilon(0.08));
        CHECK(slope(log_n, sobol) < sobol_rate);
        CHECK(slope(log_n, stratified) < stratified_rate);
        CHECK(std::exp(2 * (independent[2] - sobol[2])) > sobol_64);
        CHECK(std::exp(2 * (independent[2] - stratified[2])) > stratified_64);
    };
    rates("smooth light", smooth, -1.2, -0.9, 400, 100);
    rates("soft edge", soft_edge, -0.9, -0.8, 40, 40);
    rates("hard edge", edge, -0.65, -0.65, 8, 8);
}
