#pragma once
#include <lambent/core/config.hpp>
#include <bit>
#include <cstdint>

namespace lambent {
inline namespace LAMBENT_ABI {

/// A 16-bit float as IEEE 754 has it, for planes of a FrameView<Half>. Of other libraries' halves the same bits:
///   PixelView<const Half, 3>(reinterpret_cast<const Half*>(imath_halves), width, height)
struct Half {
    std::uint16_t bits = 0;

    Half() = default;
    /// Rounded to the nearest, ties to even; beyond 65504 and a half step infinite. NaN stays NaN.
    explicit Half(float value) {
        const std::uint32_t v = std::bit_cast<std::uint32_t>(value), sign = v >> 16 & 0x8000u, size = v & 0x7fffffffu;
        if (size > 0x7f800000u) bits = std::uint16_t(sign | 0x7e00u);
        else if (size >= 0x477ff000u) bits = std::uint16_t(sign | 0x7c00u);
        else if (size >= 0x38800000u) // the exponent's bias, 127, becomes 15; then half a step, or less for even digits
            bits = std::uint16_t(sign | (size - 0x38000000u + 0xfffu + (size >> 13 & 1u)) >> 13);
        else { // multiples of 2^-24: adding 1/2 leaves them in the lowest bits, rounded
            const float half = 0.5f;
            bits = std::uint16_t(sign | (std::bit_cast<std::uint32_t>(std::bit_cast<float>(size) + half) -
                                         std::bit_cast<std::uint32_t>(half)));
        }
    }
    /// Exact.
    explicit operator float() const {
        const std::uint32_t sign = std::uint32_t(bits & 0x8000u) << 16, rest = std::uint32_t(bits & 0x7fffu) << 13;
        if (rest >= 0x0f800000u) return std::bit_cast<float>(sign | 0x7f800000u | rest); // infinite, or NaN
        return std::bit_cast<float>(sign | std::bit_cast<std::uint32_t>(std::bit_cast<float>(rest) * 0x1p112f));
    }
    friend bool operator==(const Half&, const Half&) = default; ///< of the bits
};

} // namespace LAMBENT_ABI
} // namespace lambent
