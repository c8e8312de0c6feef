#include "support/random.hpp"
#include <array>
#include <doctest/doctest.h>
#include <lambent/core/numerics.hpp>
#include <lambent/core/sincos.hpp>
#include <lambent/core/ray.hpp>
#include <support/statistics.hpp>
#include <vector>

// Compiled twice: as every test, and once more with -ffast-math, under which all of it must hold as well. So
// NaN and infinity are made and looked at by their bits alone here, and so are denormals, which that flag
// flushes to zero.
using namespace lambent;
using namespace lambent_test;

namespace {

__extension__ typedef __int128 Int128;

template <class T>
using Bits = typename detail::FloatBits<T>::Type;

template <class T>
Bits<T> bits_of(T x) {
    return std::bit_cast<Bits<T>>(x);
}
template <class T>
T from_bits(Bits<T> bits) {
    return std::bit_cast<T>(bits);
}

int sign_of(Int128 x) { return x > 0 ? 1 : x < 0 ? -1 : 0; }

template <class T>
int sign_of(T x) {
    return x > 0 ? 1 : x < 0 ? -1 : 0;
}

/// Error of `result` against the whole number `exact`, in ulps of T at it.
template <class T>
double error_in_ulps(T result, Int128 exact) {
    Int128 error = Int128(result) - exact, magnitude = exact < 0 ? -exact : exact;
    if (error < 0) error = -error;
    int exponent = 0;
    for (; magnitude > 1; magnitude /= 2) ++exponent;
    return std::ldexp(double(error), std::numeric_limits<T>::digits - 1 - exponent);
}

} // namespace

TEST_CASE_TEMPLATE("numerics: is_finite by the bits", T, float, double) {
    using Info = detail::FloatBits<T>;
    Random random(1);
    volatile T zero = 0; // values that the compiler cannot know
    for (const T x : {T(0), T(-0.0), std::numeric_limits<T>::max(), std::numeric_limits<T>::lowest(),
                      std::numeric_limits<T>::min(), from_bits<T>(1), T(1)})
        CHECK(is_finite(T(x + zero)));
    int wrong = 0;
    for (int i = 0; i < 100000; ++i) {
        const auto mantissa = Bits<T>(random.bits()) & ~(Info::exponent | Info::sign);
        const auto sign = i % 2 ? Info::sign : 0;
        wrong += is_finite(from_bits<T>(Info::exponent | mantissa | sign)); // NaN, or infinity
        const auto any = Bits<T>(random.bits());
        wrong += is_finite(from_bits<T>(any)) != ((any & Info::exponent) != Info::exponent);
    }
    CHECK(wrong == 0);
    const T infinity = from_bits<T>(Info::exponent), nan = from_bits<T>(Info::exponent | 1);
    CHECK(!is_finite(infinity));
    CHECK(!is_finite(T(1) / T(zero)));
    for (const T bad : {infinity, nan}) {
        CHECK(!is_finite(Vec3<T>(bad, 0, 0)));
        CHECK(!is_finite(Vec3<T>(0, bad, 0)));
        CHECK(!is_finite(Vec3<T>(0, 0, bad)));
    }
    CHECK(is_finite(Vec3<T>(1, 2, 3)));
}

TEST_CASE_TEMPLATE("numerics: next_up and next_down step by one value, through zero, and stop at infinity", T,
                   float, double) {
    using Info = detail::FloatBits<T>;
    const Bits<T> largest = Info::exponent - 1;
    CHECK(bits_of(next_up(T(0))) == 1);
    CHECK(bits_of(next_up(T(-0.0))) == 1);
    CHECK(bits_of(next_down(T(0))) == (Info::sign | 1));
    CHECK(bits_of(next_up(from_bits<T>(Info::sign | 1))) == Info::sign); // −0
    CHECK(bits_of(next_up(from_bits<T>(largest))) == Info::exponent);
    CHECK(bits_of(next_up(from_bits<T>(Info::exponent))) == Info::exponent);
    CHECK(bits_of(next_down(from_bits<T>(Info::exponent | Info::sign))) == (Info::exponent | Info::sign));
    CHECK(bits_of(next_up(from_bits<T>(Info::exponent | 5))) == (Info::exponent | 5));
    Random random(2);
    int wrong = 0;
    for (int i = 0; i < 200000; ++i) {
        const Bits<T> positive = Bits<T>(random.bits()) % (Info::exponent - 1) + 1;
        const T x = from_bits<T>(positive), minus_x = from_bits<T>(positive | Info::sign);
        wrong += bits_of(next_up(x)) != positive + 1;
        wrong += bits_of(next_down(x)) != positive - 1;
        wrong += bits_of(next_up(minus_x)) != ((positive - 1) | Info::sign);
        wrong += bits_of(next_down(minus_x)) != ((positive + 1) | Info::sign);
    }
    CHECK(wrong == 0);
}

TEST_CASE_TEMPLATE("numerics: difference_of_products has the exact sign and 1.5 ulp", T, float, double) {
    constexpr std::uint64_t seed = 3;
    INFO("seed " << seed);
    Random random(seed);
    constexpr int digits = std::numeric_limits<T>::digits;
    // Whole numbers that T holds: their products, and so the difference, are exact in 128 bits.
    const auto whole = [&](int bits) {
        return std::int64_t(random.bits() >> (64 - bits)) * (random.below(2) ? 1 : -1);
    };
    double worst = 0;
    int wrong = 0, cancelled = 0, zeros = 0;
    for (int i = 0; i < 2000000; ++i) {
        std::int64_t a = whole(digits), b = whole(digits), c = whole(digits), d = whole(digits);
        const std::int64_t limit = std::int64_t(1) << digits;
        switch (i % 6) {
        case 0:
            break; // nothing in common
        case 1:
            c = a + whole(2), d = b + whole(2);
            break; // nearly equal products
        case 2:
            c = b, d = a;
            break; // equal products
        case 3:
            c = a + 1, d = b - 1;
            break;
        case 4:
            a = whole(digits / 2), b = whole(digits / 2), c = a + whole(3), d = b;
            break; // exact
        case 5:
            a = whole(digits - 10) * 2, c = a / 2 + whole(1), d = b * 2 / 2, b = b / 2;
            break;
        }
        if (std::abs(c) > limit || std::abs(d) > limit) continue;
        const Int128 exact = Int128(a) * b - Int128(c) * d;
        const T result = difference_of_products(T(a), T(b), T(c), T(d));
        const T swapped = difference_of_products(T(c), T(d), T(a), T(b));
        wrong += sign_of(result) != sign_of(exact) || sign_of(swapped) != -sign_of(exact);
        zeros += exact == 0;
        if (exact == 0) continue;
        worst = std::max(worst, error_in_ulps(result, exact));
        cancelled += Int128(a) * b / exact > (Int128(1) << (digits - 4));
    }
    CHECK(wrong == 0);
    CHECK(worst <= 1.5);
    CHECK(cancelled > 1000); // the hard cases were met
    CHECK(zeros > 1000);
}

TEST_CASE_TEMPLATE("numerics: robust_cross is orthogonal where the plain one is noise", T, float, double) {
    Random random(4);
    int wrong = 0;
    for (int i = 0; i < 100000; ++i) {
        Int128 a[3], b[3];
        Vec3<T> u, v;
        for (int k = 0; k < 3; ++k) { // nearly parallel, in whole numbers
            a[k] = std::int64_t(random.bits() >> (64 - std::numeric_limits<T>::digits + 1));
            b[k] = a[k] + std::int64_t(random.below(5)) - 2;
            u[k] = T(std::int64_t(a[k]));
            v[k] = T(std::int64_t(b[k]));
        }
        const Vec3<T> c = robust_cross(u, v);
        for (int k = 0; k < 3; ++k) {
            const Int128 exact = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
            wrong += sign_of(c[k]) != sign_of(exact) || (exact != 0 && error_in_ulps(c[k], exact) > 1.5);
        }
    }
    CHECK(wrong == 0);
}

TEST_CASE("numerics: sums of 1e7 floats keep their mean (field figures: naive is off by 1 %)") {
    constexpr std::uint64_t seed = 5;
    INFO("seed " << seed);
    Random random(seed);
    constexpr std::size_t n = 10000000;
    std::vector<float> values(n);
    double exact = 0;
    for (float& v : values) {
        v = float(-std::log(1 - random.uniform()));
        exact += v;
    }
    volatile float naive = 0;
    CompensatedSum<float> compensated;
    for (const float v : values) {
        naive = naive + v;
        compensated.add(v);
    }
    CHECK(std::abs(double(naive) / exact - 1) > 1e-3); // else the test shows nothing
    CHECK(std::abs(double(compensated.value()) / exact - 1) < 1e-7);
    CHECK(std::abs(double(pairwise_sum(std::span<const float>(values))) / exact - 1) < 4e-7);
}

TEST_CASE_TEMPLATE("numerics: a compensated sum survives a large term that goes away again", T, float,
                   double) {
    const T large = T(std::numeric_limits<T>::digits == 24 ? 1e10 : 1e20);
    CompensatedSum<T> sum; // Neumaier's example, where Kahan's own sum gives 0
    for (const T x : {T(1), large, T(1), -large}) sum.add(x);
    CHECK(sum.value() == 2);
    CompensatedSum<T> small;
    small.add(large);
    for (int i = 0; i < 1000; ++i) small.add(T(0.25));
    small.add(-large);
    CHECK(small.value() == 250);
    CHECK(CompensatedSum<T>{}.value() == 0);
}

TEST_CASE("numerics: pairwise sums of aligned power-of-two blocks merge to the same bits") {
    Random random(6);
    std::vector<float> values(1 << 12);
    for (float& v : values) v = float(std::exp(random.uniform(-8, 8)));
    const std::span<const float> all(values);
    for (std::size_t block = 8; block <= values.size(); block *= 2) {
        std::vector<float> partial;
        for (std::size_t i = 0; i < values.size(); i += block)
            partial.push_back(pairwise_sum(all.subspan(i, block)));
        while (partial.size() > 1) {
            for (std::size_t i = 0; i < partial.size() / 2; ++i)
                partial[i] = partial[2 * i] + partial[2 * i + 1];
            partial.resize(partial.size() / 2);
        }
        CHECK(bits_of(partial[0]) == bits_of(pairwise_sum(all)));
    }
    CHECK(pairwise_sum(std::span<const float>()) == 0);
    for (std::size_t n = 1; n < 70; ++n) {
        const std::vector<double> ones(n, 1.0);
        CHECK(pairwise_sum(std::span<const double>(ones)) == double(n));
    }
}

TEST_CASE("numerics: gamma_bound, safe_sqrt") {
    CHECK(gamma_bound<float>(3) > 3 * 0x1p-24f);
    CHECK(gamma_bound<float>(3) == doctest::Approx(3 * 0x1p-24).epsilon(1e-6));
    CHECK(safe_sqrt(-1e-9f) == 0);
    CHECK(safe_sqrt(4.0) == 2);
    CHECK(safe_sqrt(0.0f) == 0);
}

TEST_CASE("sines and cosines of turns: to 2e-7 of the exact ones, quarters of a turn to the bit") {
    for (int i = -100'000; i <= 100'000; ++i) {
        const float x = float(i) / 100'000;
        const auto [sine, cosine] = sincos_of_turn(x);
        REQUIRE(std::abs(double(sine) - std::sin(2 * pi<double> * double(x))) < 2e-7);
        REQUIRE(std::abs(double(cosine) - std::cos(2 * pi<double> * double(x))) < 2e-7);
    }
    const int sines[] = {0, 1, 0, -1};
    for (int quarters = -4; quarters <= 4; ++quarters) {
        const auto [sine, cosine] = sincos_of_turn(float(quarters) / 4);
        CHECK(sine == float(sines[quarters & 3]));
        CHECK(cosine == float(sines[(quarters + 1) & 3]));
        const auto [sine_double, cosine_double] = sincos_of_turn(double(quarters) / 4 + 1e-9);
        CHECK(sine_double == doctest::Approx(std::sin(2 * pi<double> * (quarters / 4.0 + 1e-9))).epsilon(1e-12));
        CHECK(cosine_double == doctest::Approx(std::cos(2 * pi<double> * (quarters / 4.0 + 1e-9))).epsilon(1e-12));
    }
}

TEST_CASE("numerics: angle of a point in turns") {
    Random random(51);
    double worst = 0, worst_small = 0;
    for (int i = 0; i < 2000000; ++i) {
        const double angle = random.uniform(-3.14159265358979, 3.14159265358979), size = std::exp(random.uniform(-20, 20));
        const float x = float(size * std::cos(angle)), y = float(size * std::sin(angle));
        const double truth = std::atan2(double(y), double(x)) / (2 * pi<double>);
        worst = std::max(worst, std::abs(double(turn_of(y, x)) - truth));
        const float tiny = float(y * 1e-6);
        const double small = std::atan2(double(tiny), double(std::abs(x))) / (2 * pi<double>);
        if (std::abs(small) < 0.01) worst_small = std::max(worst_small, std::abs(turn_of(tiny, std::abs(x)) / small - 1));
    }
    CHECK(worst < 4.5e-8); // half a unit in the last place at half a turn is 3e-8
    CHECK(worst_small < 3e-7);
    CHECK(turn_of(0.0f, 1.0f) == 0.0f);
    CHECK(turn_of(1.0f, 0.0f) == 0.25f);
    CHECK(turn_of(-1.0f, 0.0f) == -0.25f);
    CHECK(turn_of(1.0f, 1.0f) == 0.125f);
    CHECK(turn_of(0.0f, -2.0f) == 0.5f);
#ifndef __FAST_MATH__ // which knows no sign of 0
    CHECK(turn_of(-0.0f, -2.0f) == -0.5f);
#endif
    CHECK(turn_of(0.0f, 0.0f) == 0.0f);
    CHECK(turn_of(1e-30, -1.0) == doctest::Approx(0.5));
}
