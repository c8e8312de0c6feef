#include "support/random.hpp"
#include <doctest/doctest.h>
#include <support/statistics.hpp>

using namespace lambent_test;

TEST_CASE("statistics: chi-square's tail equals closed forms and tables") {
    for (const double x : {0.01, 1.0, 5.0, 30.0, 100.0}) {
        CHECK(chi_square_p(x, 2) == doctest::Approx(std::exp(-x / 2)).epsilon(1e-10));
        CHECK(chi_square_p(x, 1) == doctest::Approx(std::erfc(std::sqrt(x / 2))).epsilon(1e-9));
        CHECK(chi_square_p(x, 4) == doctest::Approx(std::exp(-x / 2) * (1 + x / 2)).epsilon(1e-10));
    }
    CHECK(chi_square_p(124.342, 100) == doctest::Approx(0.05).epsilon(1e-3));
    CHECK(chi_square_p(149.449, 100) == doctest::Approx(0.001).epsilon(1e-2));
}

TEST_CASE("statistics: p of true hypotheses is uniform, p of a false one is small") {
    constexpr std::uint64_t seed = 5;
    INFO("seed " << seed);
    Random random(seed);
    std::vector<double> p_bins(10);
    for (int run = 0; run < 1000; ++run) {
        std::vector<double> bins(16);
        for (int i = 0; i < 3200; ++i) ++bins[random.below(16)];
        ++p_bins[std::min<std::size_t>(9, std::size_t(chi_square_uniform(bins) * 10))];
    }
    CHECK(chi_square_uniform(p_bins) > min_p);

    std::vector<double> skewed(16);
    for (int i = 0; i < 100000; ++i) ++skewed[std::size_t(16 * std::pow(random.uniform(), 1.05))];
    CHECK(chi_square_uniform(skewed) < 1e-6);
}

TEST_CASE("statistics: z of a mean has unit variance") {
    constexpr std::uint64_t seed = 6;
    INFO("seed " << seed);
    Random random(seed);
    Moments z;
    for (int run = 0; run < 2000; ++run) {
        Moments m;
        for (int i = 0; i < 200; ++i) m.add(random.uniform());
        z.add(m.z(0.5));
    }
    CHECK(std::abs(z.z(0)) < max_z);
    CHECK(z.variance() ==
          doctest::Approx(1).epsilon(0.13)); // four standard errors of a variance, sqrt(2 / 2000)
}
