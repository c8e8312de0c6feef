#pragma once
#include <concepts>
#include <cstdint>
#include <lambent/core/config.hpp>
#include <limits>

/// Integer hashing and the way from bits to numbers in [0, 1): all the randomness of the library is a hash of
/// what is asked for, so there is no state to carry, to seed or to lock.
namespace lambent {
inline namespace LAMBENT_ABI {

/// 2^64 over the golden ratio, odd: its multiples spread counters over the keys.
inline constexpr std::uint64_t golden_ratio_64 = 0x9e3779b97f4a7c15u;

/// A bijection of 64 bits in which flipping any input bit flips each output bit with a chance near one half.
/// source  variant 13 of D. Stafford's finalisers (2011), as in SplitMix64: Steele, Lea, Flood, OOPSLA 2014
constexpr std::uint64_t mix_bits(std::uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

/// Key number `counter` below `key`. Counters of one key never collide; two keys share a stretch of
/// their sequences only by a 64-bit accident.
constexpr std::uint64_t derive_key(std::uint64_t key, std::uint64_t counter) {
    return mix_bits(key + (counter + 1) * golden_ratio_64);
}

/// The key from which everything in pixel (x, y) is drawn.
constexpr std::uint64_t pixel_key(std::uint32_t seed, std::uint32_t x, std::uint32_t y) {
    return mix_bits(derive_key(0, seed) ^ (std::uint64_t(y) << 32 | x));
}

/// The largest T below 1.
template <std::floating_point T>
inline constexpr T one_minus_epsilon = T(1) - std::numeric_limits<T>::epsilon() / 2;

/// 32 bits to [0, 1): the top 24 for float, since 32 would round to 1 once in 2^25; all of them for double.
template <std::floating_point T>
constexpr T to_unit(std::uint32_t bits) {
    if constexpr (std::numeric_limits<T>::digits < 32) {
        constexpr int drop = 32 - std::numeric_limits<T>::digits;
        return T(bits >> drop) * (std::numeric_limits<T>::epsilon() / 2);
    } else {
        return T(bits) * T(0x1p-32);
    }
}

/// 64 bits to [0, 1): the top 24 for float, 53 for double.
template <std::floating_point T>
constexpr T to_unit(std::uint64_t bits) {
    return T(bits >> (64 - std::numeric_limits<T>::digits)) * (std::numeric_limits<T>::epsilon() / 2);
}

/// An integer in [0, n) from 32 bits, each with chance 1/n up to 2^-32; n > 0.
constexpr std::uint32_t to_range(std::uint32_t bits, std::uint32_t n) {
    return std::uint32_t((std::uint64_t(bits) * n) >> 32);
}

} // namespace LAMBENT_ABI
} // namespace lambent
