#include "support/random.hpp"
#include <algorithm>
#include <doctest/doctest.h>
#include <lambent/sampling/mis.hpp>
#include <support/statistics.hpp>

using namespace lambent;
using namespace lambent_test;

// Compiled with -ffast-math too, where only bits tell an infinity.
TEST_CASE_TEMPLATE("mis: finite weights that sum to 1 within 2 ulp over the whole range", T, float, double) {
    constexpr std::uint64_t seed = 201;
    INFO("seed " << seed);
    Random random(seed);
    const T infinite = std::bit_cast<T>(detail::FloatBits<T>::exponent),
            ulp = std::numeric_limits<T>::epsilon();
    const double range = std::is_same_v<T, float> ? 87.4 : 708; // natural logarithm of 1e±38, 1e±307
    const auto draw = [&]() -> T {
        const std::uint32_t kind = random.below(16);
        return kind == 0 ? T(0) : kind == 1 ? infinite : T(std::exp(random.uniform(-range, range)));
    };
#if defined(__clang__) && defined(__FAST_MATH__)
    const T least = T(1e-30); // its refined reciprocals underflow below
#else
    const T least = std::numeric_limits<T>::min();
#endif
    int bad = 0;
    double worst = 0;
    for (int i = 0; i < 3000000; ++i) {
        const T a = draw();
        const T b = i % 4 ? draw() : T(a * random.uniform(0.1, 10)); // of like size, too
        for (const bool power : {false, true}) {
            const T wa = power ? power_heuristic(a, b) : balance_heuristic(a, b);
            const T wb = power ? power_heuristic(b, a) : balance_heuristic(b, a);
            bad += !is_finite(wa) || !is_finite(wb) || !(wa >= 0 && wa <= 1 && wb >= 0 && wb <= 1);
            const bool none = a == 0 && b == 0;
            bad += none && (wa != 0 || wb != 0);
            bad += a == 0 && wa != 0;
            bad += !is_finite(a) && is_finite(b) && wa != 1;
            const bool tiny = std::max(a, b) < least;
            if (!none && !tiny) bad += std::abs(wa + wb - 1) > 2 * ulp;
            // The exact weight; but where -ffast-math flushes a pdf or its reciprocal to zero.
            const bool normal = std::min(a, b) >= least &&
                                std::max(a, b) <= std::numeric_limits<T>::max() / 8;
            if (is_finite(a) && is_finite(b) && normal && i < 300000) {
                const long double ratio = (static_cast<long double>(b)) / a;
                const long double exact = 1 / (1 + (power ? ratio * ratio : ratio));
                worst = std::max(worst, double(std::abs(wa - exact)));
            }
        }
    }
    CHECK(bad == 0);
    CHECK(worst < 4 * double(ulp));
}

TEST_CASE("mis: known values; NaN weighs nothing") {
    CHECK(balance_heuristic(1.0f, 3.0f) == 0.25f);
    CHECK(power_heuristic(1.0f, 3.0f) == doctest::Approx(0.1));
    CHECK(power_heuristic(2.0, 2.0) == 0.5);
    CHECK(power_heuristic(1e20f, 1e20f) == 0.5f);
    CHECK(power_heuristic(1e-23f, 1e-23f) == 0.5f);
#if !defined(__FAST_MATH__)
    CHECK(balance_heuristic(INFINITY, INFINITY) == 0.5f);
    CHECK(balance_heuristic(NAN, 1.0f) == 0.0f);
    CHECK(balance_heuristic(1.0f, NAN) == 1.0f);
#endif
}

TEST_CASE("mis: lanes weigh as numbers do") {
    Random random(202);
    using P = Pack<float, 4>;
    for (int i = 0; i < 10000; ++i) {
        P a(0.0f), b(0.0f);
        for (int lane = 0; lane < 4; ++lane) {
            a.set(lane, random.below(8) == 0 ? 0.0f : float(std::exp(random.uniform(-60, 60))));
            b.set(lane, random.below(8) == 0 ? 0.0f : float(std::exp(random.uniform(-60, 60))));
        }
        const P power = power_heuristic(a, b), balance = balance_heuristic(a, b);
        for (int lane = 0; lane < 4; ++lane) {
            REQUIRE(std::abs(power[lane] - power_heuristic(a[lane], b[lane])) <= std::numeric_limits<float>::epsilon());
            REQUIRE(std::abs(balance[lane] - balance_heuristic(a[lane], b[lane])) <= std::numeric_limits<float>::epsilon());
        }
    }
}
