#include "support/random.hpp"
#include <doctest/doctest.h>
#include <lambent/sampling/alias.hpp>
#include <lambent/sampling/distribution.hpp>
#include <string>
#include <support/statistics.hpp>

using namespace lambent;
using namespace lambent_test;

namespace {

std::vector<std::vector<double>> weight_sets() {
    Random random(301);
    std::vector<std::vector<double>> sets{{1},
                                          {0, 3},
                                          {3, 0},
                                          {1, 1, 1},
                                          {0, 0, 5, 0},
                                          {1, 1e-6},
                                          {1e-300, 1e300},
                                          {4e-320, 8e-320},
                                          {1.7e308, 1.7e308, 1.7e308},
                                          {1e-40, 1}};
    for (const std::size_t n : {2u, 5u, 16u, 100u, 1000u}) {
        std::vector<double> uniform(n), steep(n), holes(n), sun(n, 1);
        for (std::size_t i = 0; i < n; ++i) {
            uniform[i] = random.uniform();
            steep[i] = std::exp(random.uniform(-12, 12));
            holes[i] = random.below(3) == 0 ? random.uniform() : 0;
        }
        holes[n / 2] = 1;
        sun[n / 3] = 1e6;
        for (const auto& w : {uniform, steep, holes, sun}) sets.push_back(w);
    }
    return sets;
}

double sum_of(const std::vector<double>& weights) {
    double sum = 0;
    for (const double w : weights) sum += w / 2;
    return sum * 2;
}
double share_of(const std::vector<double>& weights, std::size_t i) {
    double sum = 0;
    for (const double w : weights) sum += w * 0.125; // 1.7e308 three times
    return weights[i] * 0.125 / sum;
}

template <class D, class... A>
std::string error_of(A... arguments) {
    try {
        D{arguments...};
    } catch (const Error& error) {
        return error.what();
    }
    return "";
}

} // namespace

TEST_CASE("alias: a sweep over all u draws each index as often as its probability says") {
    constexpr int steps = 1 << 20;
    for (const std::vector<double>& weights : weight_sets()) {
        const std::size_t n = weights.size();
        CAPTURE(n);
        CAPTURE(weights[0]);
        const AliasTable table{std::span(weights)};
        REQUIRE(table.size() == n);
        std::vector<int> count(n);
        std::vector<Moments> rest(n);
        int bad = 0;
        for (int k = 0; k < steps; ++k) {
            const auto s = table.sample((k + 0.5) / steps);
            ++count[s.index];
            rest[s.index].add(s.u);
            bad += s.probability != double(table.probability(s.index)) || !(s.u >= 0 && s.u < 1) ||
                   weights[s.index] == 0;
        }
        double total = 0;
        for (std::size_t i = 0; i < n; ++i) {
            const double p = table.probability(i);
            total += p;
            // n slots cut at one place each: a sweep misses by at most two steps a slot that holds the item.
            bad += std::abs(count[i] / double(steps) - p) > 1e-7 * p + 2.0 * double(n) / steps;
            bad += std::abs(p - share_of(weights, i)) > 1e-6 * p + 0x1p-31 / double(n);
            bad += (p == 0) != (weights[i] == 0);
            if (count[i] > 1000) { // what is left of u is spread over [0, 1)
                bad += std::abs(rest[i].mean() - 0.5) > 0.01;
                bad += std::abs(rest[i].variance() - 1.0 / 12) > 0.005;
            }
        }
        CHECK(bad == 0);
        CHECK(total == doctest::Approx(1).epsilon(1e-6));
    }
}

TEST_CASE("alias: float u, a million items, draws as the weights say (chi-square)") {
    constexpr std::uint64_t seed = 302;
    INFO("seed " << seed);
    Random random(seed);
    std::vector<double> weights(1000000), expected(100), observed(100);
    for (double& w : weights) w = std::exp(random.uniform(-5, 5));
    const double sum = sum_of(weights);
    constexpr int draws = 2000000;
    for (std::size_t i = 0; i < weights.size(); ++i) expected[i % 100] += weights[i] / sum * draws;
    const AliasTable table{std::span<const double>(weights)};
    for (int k = 0; k < draws; ++k) ++observed[table.sample(random.uniform()).index % 100];
    CHECK(chi_square_test(observed, expected) > min_p);

    const AliasTable small{std::span<const double>(weights).first(1000)};
    observed.assign(1000, 0);
    expected.assign(1000, 0);
    for (std::size_t i = 0; i < 1000; ++i) expected[i] = small.probability(i) * double(draws);
    int bad = 0;
    for (int k = 0; k < draws; ++k) {
        const auto s = small.sample(random.uniform_float());
        ++observed[s.index];
        bad += s.probability != small.probability(s.index);
    }
    CHECK(bad == 0);
    CHECK(chi_square_test(observed, expected) > min_p);
    CHECK(small.sample(one_minus_epsilon<float>).index < 1000);
    CHECK(small.sample(one_minus_epsilon<float>).u < 1);
}

TEST_CASE("alias and distributions: nothing to draw, and weights that cannot be") {
    CHECK(AliasTable{}.empty());
    CHECK(AliasTable(std::span<const double>()).empty());
    const std::vector<double> black{0, 0, 0};
    CHECK(AliasTable(std::span(black)).empty());
    CHECK(AliasTable(std::span(black)).sample(0.5f).probability == 0);
    CHECK(AliasTable(std::span(black)).probability(1) == 0);
    CHECK(Distribution1D{}.sample(0.5f).pdf == 0);
    CHECK(Distribution1D(std::span<const double>()).empty());
    CHECK(Distribution1D(std::span<const double>(black)).empty());
    CHECK(Distribution1D(std::span<const double>(black)).pdf(0.5f) == 0);
    const std::vector<float> dark(12, 0.0f);
    const Distribution2D empty(std::span<const float>(dark), 4, 3);
    CHECK(empty.empty());
    CHECK(empty.sample(Vec2f(0.3f)).pdf == 0);
    CHECK(empty.pdf(Vec2f(0.3f)) == 0);
    CHECK(Distribution2D{}.empty());
    CHECK(Distribution2D(std::span<const float>(), 0, 0).empty());

    for (const double wrong : {-1.0, -1e-300, double(INFINITY), -double(INFINITY), double(NAN)}) {
        const std::vector<double> weights{1, 2, wrong};
        CHECK(error_of<AliasTable>(std::span<const double>(weights)).find("weight 2") != std::string::npos);
        CHECK(error_of<Distribution1D>(std::span<const double>(weights)).find("weight 2") !=
              std::string::npos);
    }
    const std::vector<float> image{1, 2, 3, 4, 5, NAN};
    CHECK(error_of<Distribution2D>(std::span<const float>(image), 3u, 2u) != "");
    CHECK(error_of<Distribution2D>(std::span<const float>(image), 4u, 2u).find("6 weights for 4 x 2") !=
          std::string::npos);
}

TEST_CASE_TEMPLATE(
    "distribution 1D: what is drawn is what pdf says, to the bit; sorted, and spread within a cell", T, float,
    double) {
    constexpr int steps = 1 << 20;
    for (const std::vector<double>& weights : weight_sets()) {
        const std::size_t n = weights.size();
        CAPTURE(n);
        CAPTURE(weights[0]);
        const Distribution1D distribution{std::span<const double>(weights)};
        std::vector<int> count(n);
        int bad = 0;
        T last = 0;
        for (int k = 0; k < steps; ++k) {
            const auto s = distribution.sample(T(k) / T(steps));
            ++count[s.index];
            bad += s.pdf != distribution.pdf(s.x) || !(s.pdf > 0) || weights[s.index] == 0;
            bad += !(s.x >= last && s.x < 1);
            last = s.x;
        }
        double total = 0;
        for (std::size_t i = 0; i < n; ++i) {
            const double p = distribution.probability(i);
            total += p;
            bad += std::abs(count[i] / double(steps) - p) > 1.01 / steps;
            bad += std::abs(p - share_of(weights, i)) > 1e-6 * p + double(n + 1) * 0x1p-31;
            bad += (p == 0) != (weights[i] == 0);
        }
        CHECK(bad == 0);
        CHECK(total == 1.0);
        for (const T u : {T(0), one_minus_epsilon<T>, T(1)}) { // 1 must not be asked for, and must not harm
            const auto s = distribution.sample(u);
            CHECK(s.index < n);
            CHECK(s.x < 1);
            CHECK(s.pdf == distribution.pdf(s.x));
            CHECK(weights[s.index] > 0);
        }
        CHECK(distribution.pdf(T(1)) == distribution.pdf(one_minus_epsilon<T>));
    }
}

TEST_CASE("distribution 1D: at its largest size float still lands in the drawn cell") {
    Random random(303);
    for (const std::size_t n : {std::size_t(1) << 20, (std::size_t(1) << 20) - 1, std::size_t(999983)}) {
        CAPTURE(n);
        std::vector<float> weights(n);
        for (float& w : weights) w = random.uniform_float();
        const Distribution1D distribution{std::span<const float>(weights)};
        int bad = 0;
        for (int k = 0; k < 500000; ++k) {
            const auto s = distribution.sample(random.uniform_float());
            bad += s.pdf != distribution.pdf(s.x) || detail::cell_of(s.x, n) != s.index;
        }
        CHECK(bad == 0);
    }
    const std::vector<float> too_many((std::size_t(1) << 20) + 1, 1.0f);
    CHECK_THROWS_AS(Distribution1D(std::span<const float>(too_many)), Error);
}

namespace {
struct Map {
    std::string name;
    std::uint32_t width, height;
    std::vector<float> weights;
};

std::vector<Map> maps() {
    Random random(304);
    std::vector<Map> result{{"1x1", 1, 1, {2}},
                            {"2x1", 2, 1, {1, 3}},
                            {"1x2", 1, 2, {1, 3}},
                            {"one row", 7, 1, {0, 1, 2, 3, 0, 5, 6}},
                            {"one column", 1, 5, {0, 1, 0, 2, 9}}};
    Map pole{"one pixel at the pole", 64, 32, std::vector<float>(64 * 32)};
    pole.weights[5] = 1e-20f;
    Map corner{"one pixel in the last corner", 64, 32, std::vector<float>(64 * 32)};
    corner.weights.back() = 3e38f;
    Map sun{"sun 1e6 : 1", 64, 32, std::vector<float>(64 * 32, 1)};
    sun.weights[64 * 9 + 17] = 1e6f;
    Map noise{"noise with dark rows", 61, 37, std::vector<float>(61 * 37)};
    for (std::size_t i = 0; i < noise.weights.size(); ++i)
        noise.weights[i] = i / 61 % 5 == 0 ? 0.0f : random.below(4) == 0 ? 0.0f : random.uniform_float();
    Map bright{"sums beyond float", 8, 8, std::vector<float>(64, 3e38f)};
    for (auto* m : {&pole, &corner, &sun, &noise, &bright}) result.push_back(*m);
    return result;
}
} // namespace

TEST_CASE_TEMPLATE(
    "distribution 2D: draws follow the image, pdf is the drawn one to the bit, and integrates to 1", T, float,
    double) {
    constexpr std::uint64_t seed = 305;
    INFO("seed " << seed);
    constexpr int draws = 300000;
    for (const Map& map : maps()) {
        CAPTURE(map.name);
        Random random(seed);
        const Distribution2D distribution(std::span<const float>(map.weights), map.width, map.height);
        CHECK(distribution.width() == map.width);
        CHECK(distribution.height() == map.height);
        double sum = 0, integral = 0;
        for (const float w : map.weights) sum += w;
        const double pixels = double(map.width) * map.height;
        std::vector<double> observed(map.weights.size()), expected(map.weights.size());
        int bad = 0;
        for (std::uint32_t y = 0; y < map.height; ++y)
            for (std::uint32_t x = 0; x < map.width; ++x) {
                const std::size_t i = y * map.width + x;
                const double share = map.weights[i] / sum;
                const T pdf = distribution.pdf(
                    Vec2<T>((T(x) + T(0.5)) / T(map.width), (T(y) + T(0.5)) / T(map.height)));
                integral += double(pdf) / pixels;
                bad += std::abs(double(pdf) / pixels - share) > 1e-5 * share + 1e-7;
                bad += (pdf == 0) != (share == 0);
                expected[i] = share * draws;
            }
        CHECK(integral == doctest::Approx(1).epsilon(1e-6));
        for (int k = 0; k < draws; ++k) {
            const Vec2<T> u(T(random.uniform_float()), T(random.uniform_float()));
            const auto s = distribution.sample(u);
            ++observed[s.index];
            bad += s.pdf != distribution.pdf(s.p) || !(s.pdf > 0);
            bad += !(s.p.x >= 0 && s.p.x < 1 && s.p.y >= 0 && s.p.y < 1);
        }
        for (const T x : {T(0), one_minus_epsilon<T>, T(1)})
            for (const T y : {T(0), one_minus_epsilon<T>, T(1)}) {
                const auto s = distribution.sample(Vec2<T>(x, y));
                bad += s.index >= map.weights.size() || map.weights[s.index] == 0 ||
                       s.pdf != distribution.pdf(s.p);
            }
        CHECK(bad == 0);
        CHECK(chi_square_test(observed, expected) > min_p);
    }
}
