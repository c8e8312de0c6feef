#include <bit>
#include <cmath>
#include <cstdint>
#include <doctest/doctest.h>
#include <lambent/film/half.hpp>
#include <limits>
#include <vector>

using lambent::Half;

namespace {
/// As the standard defines it.
double value_of(int bits) {
    const int exponent = bits >> 10 & 31, digits = bits & 1023;
    const double size = exponent == 0 ? std::ldexp(digits, -24) : std::ldexp(1024 + digits, exponent - 25);
    return bits >> 15 != 0 ? -size : size;
}
Half of_bits(int bits) {
    Half h;
    h.bits = std::uint16_t(bits);
    return h;
}
} // namespace

TEST_CASE("Half: all 65536 values are what the standard says, and come back from float") {
    int wrong = 0;
    for (int bits = 0; bits < 65536; ++bits) {
        const float value = float(of_bits(bits));
        if ((bits & 0x7c00) != 0x7c00) wrong += double(value) != value_of(bits);
        else if ((bits & 1023) == 0) wrong += value != (bits >> 15 != 0 ? -1.0f : 1.0f) * std::numeric_limits<float>::infinity();
        else {
            wrong += !std::isnan(value) || !std::isnan(float(Half(value)));
            continue;
        }
        wrong += Half(value).bits != bits;
    }
    CHECK(wrong == 0);
}

TEST_CASE("Half: floats are rounded to the nearest half, ties to even digits") {
    int wrong = 0;
    for (int bits = 0; bits < 0x7bff; ++bits) { // between each half and the next
        const double low = value_of(bits), high = value_of(bits + 1), middle = (low + high) / 2; // exact in float
        const int even = bits % 2 == 0 ? bits : bits + 1;
        for (const float sign : {1.0f, -1.0f}) {
            const int negative = sign < 0 ? 0x8000 : 0;
            wrong += Half(sign * float(middle)).bits != (even | negative);
            wrong += Half(sign * std::nextafter(float(middle), 0.0f)).bits != (bits | negative);
            wrong += Half(sign * std::nextafter(float(middle), 1e9f)).bits != ((bits + 1) | negative);
        }
    }
    CHECK(wrong == 0);
    CHECK(Half(65519.99f).bits == 0x7bff);
    CHECK(Half(65520.0f).bits == 0x7c00);
    CHECK(Half(-std::numeric_limits<float>::max()).bits == 0xfc00);
    CHECK(Half(std::numeric_limits<float>::denorm_min()).bits == 0);
}
