#pragma once
#include <lambent/core/numerics.hpp>
#include <charconv>
#include <cstdint>
#include <string_view>
#include <system_error>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Reads the decimal number that [p, end) begins with, where that is cheap: at most 19 digits, of a value below 2^53,
/// and a power of ten of at most 22. Both are exact doubles then, so that one product or quotient is rounded correctly.
/// Returns one past the number, or nullptr where parse_number() has to decide.
/// source  Clinger, How to read floating point numbers accurately, PLDI 1990
inline const char* parse_short_decimal(const char* p, const char* end, double& value) {
    static constexpr double powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                        1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    const auto digit = [&] { return p != end && unsigned(*p - '0') < 10; };
    bool negative = false;
    if (p != end && (*p == '-' || *p == '+')) negative = *p++ == '-';

    std::uint64_t digits = 0; // those of 20 or more overflow, and are sent away
    const char* const first = p;
    for (; digit(); ++p) digits = 10 * digits + std::uint64_t(*p - '0');
    std::ptrdiff_t count = p - first, exponent = 0;
    if (p != end && *p == '.') {
        const char* const fraction = ++p;
        for (; digit(); ++p) digits = 10 * digits + std::uint64_t(*p - '0');
        exponent = fraction - p;
        count -= exponent;
    }
    if (count == 0 || count > 19 || digits > (std::uint64_t(1) << 53)) return nullptr;

    if (p != end && (*p | 0x20) == 'e') {
        ++p;
        bool minus = false;
        if (p != end && (*p == '-' || *p == '+')) minus = *p++ == '-';
        const char* const power = p;
        int size = 0;
        for (; digit() && p - power < 5; ++p) size = 10 * size + (*p - '0');
        if (p == power || digit()) return nullptr;
        exponent += minus ? -size : size;
    }
    if (exponent < -22 || exponent > 22) return nullptr;
    const double exact = double(digits);
    const double size = exponent < 0 ? exact / powers[-exponent] : exact * powers[exponent];
    value = negative ? -size : size;
    return p;
}

/// Whether `text` is a finite decimal number as a whole, with or without a sign; `value` is the double nearest to it.
inline bool parse_number(std::string_view text, double& value) {
    const char* const end = text.data() + text.size();
    if (parse_short_decimal(text.data(), end, value) == end && !text.empty()) return true;
    if (text.starts_with('+')) {
        text.remove_prefix(1);
        if (text.starts_with('-')) return false;
    }
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    return error == std::errc() && stop == end && is_finite(value);
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
