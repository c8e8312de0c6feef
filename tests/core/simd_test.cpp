#include <algorithm>
#include <cmath>
#include <cstdint>
#include <doctest/doctest.h>
#include <lambent/core/numerics.hpp>
#include <lambent/core/simd.hpp>
#include <limits>
#include <random>
#include <type_traits>
#include <vector>

using namespace lambent;

namespace {

/// Every width of both types runs on every machine: what registers lack, packs are split into.
template <class T, int N>
struct Kind {
    using Scalar = T;
    static constexpr int width = N;
};
using F2 = Kind<float, 2>;
using F4 = Kind<float, 4>;
using F8 = Kind<float, 8>;
using F16 = Kind<float, 16>;
using D2 = Kind<double, 2>;
using D4 = Kind<double, 4>;
using D8 = Kind<double, 8>;

template <class T>
std::vector<T> values(std::uint64_t seed, std::size_t n) {
    std::mt19937_64 random(seed);
    constexpr T inf = std::numeric_limits<T>::infinity();
    const T special[] = {0, -T(0), 1, -1, inf, -inf, std::numeric_limits<T>::max(), std::numeric_limits<T>::min()};
    std::vector<T> v(n);
    for (T& x : v) {
        const std::uint64_t bits = random();
        x = bits % 8 == 0 ? special[bits / 8 % 8]
                          : T(std::ldexp(double(std::int64_t(random()) >> 11) * 0x1p-52, int(bits / 8 % 21) - 10));
    }
    return v;
}

template <class T>
bool same(T a, T b) {
    return a == b ? std::signbit(a) == std::signbit(b) : a != a && b != b;
}

} // namespace

TEST_CASE_TEMPLATE("Packs compute what scalars do, lane by lane", K, F2, F4, F8, F16, D2, D4, D8) {
    using T = typename K::Scalar;
    constexpr int n = K::width;
    using P = Pack<T, n>;
    const std::vector<T> a = values<T>(1, std::size_t(n) * 500), b = values<T>(2, a.size()), c = values<T>(3, a.size());
    std::size_t different = 0;
    const auto expect = [&](P got, int lane, T expected) { different += std::size_t(!same(got[lane], expected)); };
    for (std::size_t i = 0; i < a.size(); i += std::size_t(n)) {
        const P x = P::load(&a[i]), y = P::load(&b[i]), z = P::load(&c[i]);
        const P sum = x + y, difference = x - y, product = x * y, quotient = x / y, negated = -x, fused = fma(x, y, z),
                least = min(x, y), most = max(x, y), chosen = select(x < y, x, y), joined = join(low_half(x), high_half(x)), root = sqrt(abs(x));
        unsigned less = 0, less_equal = 0, greater = 0, greater_equal = 0, equal = 0;
        for (int lane = 0; lane < n; ++lane) {
            const std::size_t k = i + std::size_t(lane);
            expect(sum, lane, a[k] + b[k]);
            expect(difference, lane, a[k] - b[k]);
            expect(product, lane, a[k] * b[k]);
            expect(quotient, lane, a[k] / b[k]);
            expect(negated, lane, -a[k]);
            expect(fused, lane, std::fma(a[k], b[k], c[k]));
            expect(least, lane, a[k] < b[k] ? a[k] : b[k]);
            expect(most, lane, a[k] > b[k] ? a[k] : b[k]);
            expect(chosen, lane, a[k] < b[k] ? a[k] : b[k]);
            expect(joined, lane, a[k]);
            expect(root, lane, std::sqrt(std::abs(a[k])));
            less |= unsigned(a[k] < b[k]) << lane;
            less_equal |= unsigned(a[k] <= b[k]) << lane;
            greater |= unsigned(a[k] > b[k]) << lane;
            greater_equal |= unsigned(a[k] >= b[k]) << lane;
            equal |= unsigned(a[k] == b[k]) << lane;
            if (is_finite(a[k]) && is_finite(b[k]) && std::abs(a[k]) < T(1e10) && std::abs(b[k]) < T(1e10) &&
                is_finite(c[k]) && std::abs(c[k]) < T(1e10)) {
                expect(difference_of_products(x, y, z, x), lane, difference_of_products(a[k], b[k], c[k], a[k]));
                const T once = std::fma(a[k], b[k], c[k]), got = exact_multiply_add(x, y, z)[lane];
                different += std::size_t(std::abs(got - once) > std::numeric_limits<T>::epsilon() * std::abs(once));
                different += std::size_t((got > 0) != (once > 0) || (got < 0) != (once < 0));
            }
        }
        const unsigned full = n == 32 ? ~0u : (1u << n) - 1u;
        different += std::size_t(bits(x < y) != less) + std::size_t(bits(x <= y) != less_equal) +
                     std::size_t(bits(x > y) != greater) + std::size_t(bits(x >= y) != greater_equal) +
                     std::size_t(bits(x == y) != equal) + std::size_t(bits(~(x < y)) != (full & ~less)) +
                     std::size_t(bits((x < y) | (x == y)) != less_equal) +
                     std::size_t(bits((x < y) & (x == y)) != 0) + std::size_t(any(x < y) != (less != 0)) +
                     std::size_t(bits((x < y) ^ (x <= y)) != (less ^ less_equal)) +
                     std::size_t(all(x <= y) != (less_equal == full));
    }
    CHECK(different == 0);
}

TEST_CASE_TEMPLATE("min and max take the second operand where one is NaN", K, F2, F4, F8, F16, D2, D4, D8) {
    using T = typename K::Scalar;
    using P = Pack<T, K::width>;
    const P nan = std::numeric_limits<T>::quiet_NaN(), one = T(1);
    for (int lane = 0; lane < K::width; ++lane) {
        CHECK(min(nan, one)[lane] == 1);
        CHECK(max(nan, one)[lane] == 1);
        CHECK(std::isnan(min(one, nan)[lane]));
        CHECK(std::isnan(max(one, nan)[lane]));
    }
}

TEST_CASE_TEMPLATE("Lanes that are not finite, and the largest and smallest of those that are", K, F2, F4, F8, F16, D2, D4,
                   D8) {
    using T = typename K::Scalar;
    using P = Pack<T, K::width>;
    constexpr T inf = std::numeric_limits<T>::infinity(), nan = std::numeric_limits<T>::quiet_NaN();
    for (int lane = 0; lane < K::width; ++lane)
        for (const T x : {nan, -nan, inf, -inf, std::numeric_limits<T>::max(), T(-0.0), T(7), T(-7)}) {
            P p = T(1);
            p.set(lane, x);
            const unsigned bit = 1u << lane, full = (1u << K::width) - 1u;
            CHECK(bits(is_finite(p)) == (std::isfinite(x) ? full : full & ~bit));
            CHECK(bits(is_nan(p)) == (std::isnan(x) ? bit : 0u));
            if (!std::isnan(x)) {
                CHECK(largest(p) == std::max(x, T(1)));
                CHECK(smallest(p) == std::min(x, T(1)));
            }
        }
}

TEST_CASE_TEMPLATE("Broadcast, lanes, sums and conversions", K, F2, F4, F8, F16, D2, D4, D8) {
    using T = typename K::Scalar;
    constexpr int n = K::width;
    using P = Pack<T, n>;
    P p = T(-0.0);
    for (int lane = 0; lane < n; ++lane) CHECK(std::signbit(p[lane]));
    T expected = 0;
    for (int lane = 0; lane < n; ++lane) {
        p.set(lane, T(lane + 1));
        expected += T(lane + 1);
    }
    CHECK(sum(p) == expected);
    T stored[16];
    p.store(stored);
    for (int lane = 0; lane < n; ++lane) CHECK(stored[lane] == T(lane + 1));
    using Other = std::conditional_t<sizeof(T) == 4, double, float>;
    const Pack<Other, n> other = convert<Other>(p);
    for (int lane = 0; lane < n; ++lane) CHECK(other[lane] == Other(lane + 1));
    p += P(T(1));
    p *= P(T(2));
    p -= P(T(2));
    for (int lane = 0; lane < n; ++lane) CHECK(p[lane] == T(2 * lane + 2));
}
