#include <lambent/io/decimal.hpp>
#include <doctest/doctest.h>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <random>
#include <string>

using namespace lambent;

namespace {

/// The standard library's answer, of which ours may differ in no bit.
void compare_with_from_chars(const std::string& text) {
    CAPTURE(text);
    double ours = -7, expected = -7;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), expected);
    const bool whole = error == std::errc() && end == text.data() + text.size() && is_finite(expected);
    REQUIRE(detail::parse_number(text, ours) == whole);
    if (whole) REQUIRE(std::bit_cast<std::uint64_t>(ours) == std::bit_cast<std::uint64_t>(expected));
}

} // namespace

TEST_CASE("decimal numbers: the nearest double, to the bit") {
    std::mt19937_64 random(11);
    const auto pick = [&](std::uint64_t n) { return random() % n; };
    for (int i = 0; i < 300000; ++i) {
        std::string text = pick(3) == 0 ? "-" : "";
        const std::uint64_t whole = pick(12), fraction = pick(12);
        for (std::uint64_t k = 0; k < whole; ++k) text += char('0' + pick(10));
        if (pick(8) != 0) text += '.';
        for (std::uint64_t k = 0; k < fraction; ++k) text += char('0' + pick(10));
        if (pick(3) == 0)
            text += std::string(pick(2) == 0 ? "e" : "E") + (pick(2) == 0 ? "-" : "") + std::to_string(pick(30));
        compare_with_from_chars(text);
    }
    for (int i = 0; i < 100000; ++i) { // doubles of all sizes, with up to 17 digits
        const double value = std::bit_cast<double>(random());
        char text[64];
        std::snprintf(text, sizeof text, "%.*g", int(1 + pick(17)), value);
        compare_with_from_chars(text);
    }
    for (int i = 0; i < 100000; ++i) { // about 2^53, and halfway between doubles
        const std::uint64_t near = (std::uint64_t(1) << (50 + pick(14))) + pick(9) - 4;
        compare_with_from_chars(std::to_string(near) + (pick(2) == 0 ? "e-" : "e") + std::to_string(pick(25)));
    }
    for (const char* text : {"9007199254740991",
                             "9007199254740992",
                             "9007199254740993",
                             "9007199254740993e22",
                             "9007199254740991e22",
                             "9007199254740991e23",
                             "1e22",
                             "1e23",
                             "1e-22",
                             "1e-23",
                             "0.1",
                             "5e-324",
                             "2.2250738585072011e-308",
                             "2.2250738585072014e-308",
                             "1.7976931348623157e308",
                             "1.7976931348623159e308",
                             "8.5e-400",
                             "0e999",
                             "-0",
                             "-0.0",
                             "0000000000000000000000000001",
                             "0.00000000000000000000000000001",
                             "18446744073709551616",
                             "99999999999999999999",
                             "1e00000000022",
                             "1e0000000000000000000000000000022",
                             "1e99999999999999999999"})
        compare_with_from_chars(text);
}

TEST_CASE("decimal numbers: what is none, or not finite, is refused; a plus sign is allowed") {
    double value = 0;
    for (const char* text :
         {"",     "+",  "-",   ".",   "-.",  "e5", "1e", "1e+",    "1.5.2",  "1,5",   "0x10",     "nan",  "inf",
          "-inf", "1f", "+-1", "-+1", "++1", "1 ", " 1", "3.1+e2", "1.#IND", "1e5.0", "infinity", "1e400"}) {
        CAPTURE(text);
        CHECK_FALSE(detail::parse_number(text, value));
    }
    CHECK_FALSE(detail::parse_number(std::string_view("1\0", 2), value));
    for (const char* text :
         {"+1.5", "1.5", "+15e-1", "1.50000000000000000000000000", "+1.50000000000000000000000000"}) {
        CAPTURE(text);
        REQUIRE(detail::parse_number(text, value));
        CHECK(value == 1.5);
    }
}
