// Sums of very many samples, and variances far smaller than their mean.
#include "stress/table.hpp"
#include "support/random.hpp"
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <doctest/doctest.h>
#include <lambent/film/film.hpp>
#include <lambent/film/film_pass.hpp>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

/// One pixel of the samples [begin, end), whose three channels are alike.
template <class Value>
Film<float> film_of_values(std::uint64_t begin, std::uint64_t end, Value&& value) {
    FilmPass<float> pass(1, 1, FilmPlanes::radiance, begin, end);
    {
        FilmPass<float>::Pixel pixel(pass, 0, 0);
        for (std::uint64_t i = begin; i < end; ++i) {
            PixelSample<float> s;
            s.radiance = Vec3f(value(i));
            pixel.add(s);
        }
    }
    return pass.finish();
}

} // namespace

TEST_CASE("accumulation: very many samples -> relative error of the mean") {
    const std::uint64_t count = inputs(0x1p22, 0x1p26);
    Random random(1);
    double exact = 0;
    float naive = 0;
    const Film<float> film = film_of_values(0, count, [&](std::uint64_t) {
        const float value = float(-std::log(1 - random.uniform())); // exponential
        exact += double(value);
        naive += value;
        return value;
    });
    const double mean = double(film.resolve().radiance.load(0, 0).x), n = double(count);
    record({.subject = "accumulation",
            .property = "samples of mean 1 -> relative error of the mean; naive: a float sum",
            .inputs = n,
            .failures = double(!(std::abs(mean * n / exact - 1) <= 1e-6)),
            .worst = std::abs(mean * n / exact - 1),
            .bound = 1e-6,
            .naive = std::abs(double(naive) / exact - 1)});
}

TEST_CASE("accumulation: mean of 1e4 deviations -> relative error of the variance, and its sign") {
    double worst = 0, naive_worst = 0;
    std::size_t films = 0, negative = 0, samples = 0;
    for (std::uint64_t seed = 0; seed < inputs(40, 4000); ++seed) {
        Random random(seed);
        const std::uint64_t count = 1000 + random.below(seed % 10 == 0 ? 60000 : 4000);
        const double deviation = std::exp(random.uniform(-20, 20)), middle = 1e4 * deviation;
        std::vector<float> values;
        for (std::uint64_t i = 0; i < count; ++i)
            values.push_back(float(middle + deviation * std::sqrt(12.0) * random.uniform(-0.5, 0.5)));
        const Film<float> film = film_of_values(0, count, [&](std::uint64_t i) { return values[std::size_t(i)]; });
        double mean = 0, squares = 0;
        float naive_sum = 0, naive_squares = 0;
        for (const float v : values) {
            mean += double(v) / double(count);
            naive_sum += v;
            naive_squares += v * v;
        }
        for (const float v : values) squares += (double(v) - mean) * (double(v) - mean);
        const double expected = squares / double(count - 1) / double(count);
        const double got = double(film.resolve().variance.load(0, 0).y);
        const float n = float(count), naive_mean = naive_sum / n;
        const double naive = double(naive_squares / n - naive_mean * naive_mean) / double(count);
        worst = std::max(worst, std::abs(got / expected - 1));
        naive_worst = std::max(naive_worst, std::abs(naive / expected - 1));
        negative += std::size_t(!(got >= 0));
        ++films;
        samples += count;
    }
    record({"accumulation", "mean = 1e4 deviations -> relative error of the variance; naive: E[x^2] - E[x]^2",
            double(samples), double(negative), worst, 0.01, naive_worst});
}

TEST_CASE("accumulation: parts merged in any order -> the same mean") {
    constexpr std::size_t parts = 8;
    const std::uint64_t count = inputs(1 << 14, 1 << 20);
    const auto value = [](std::uint64_t i) {
        Random random(i);
        return float(-std::log(1 - random.uniform()));
    };
    std::vector<Film<float>> films;
    std::array<float, parts> sums{};
    for (std::size_t p = 0; p < parts; ++p) {
        const std::uint64_t begin = count * p / parts + (p % 2) * (p > 0 ? 3 : 0), // not aligned either
            end = p + 1 == parts ? count : count * (p + 1) / parts + ((p + 1) % 2) * 3;
        films.push_back(film_of_values(begin, end, value));
        for (std::uint64_t i = begin; i < end; ++i) sums[p] += value(i);
    }
    const double whole = double(film_of_values(0, count, value).resolve().radiance.load(0, 0).x);
    float low = 1e30f, high = 0;
    std::size_t orders = 0, different = 0;
    double worst = 0;
    std::array<std::size_t, parts> order{0, 1, 2, 3, 4, 5, 6, 7};
    Random random(2);
    for (std::uint64_t round = 0; round < inputs(200, 20000); ++round) {
        for (std::uint32_t i = parts; i-- > 1;) std::swap(order[i], order[random.below(i + 1)]);
        Film<float> film = films[order[0]];
        float naive = sums[order[0]];
        for (std::size_t p = 1; p < parts; ++p) {
            film.merge(films[order[p]]);
            naive += sums[order[p]];
        }
        const double mean = double(film.resolve().radiance.load(0, 0).x);
        worst = std::max(worst, std::abs(mean / whole - 1));
        different += std::size_t(mean != whole);
        low = std::min(low, naive);
        high = std::max(high, naive);
        ++orders;
    }
    record({"accumulation", "orders of merging 8 parts -> relative difference; naive: float sums of the parts",
            double(orders), double(different), worst, 0, double(high) / double(low) - 1});
}
