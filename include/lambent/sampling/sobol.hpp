#pragma once
#include <lambent/sampling/hash.hpp>
#include <lambent/sampling/sampler.hpp>

namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {

constexpr std::uint32_t reverse_bits(std::uint32_t x) {
    x = __builtin_bswap32(x);
    x = (x & 0x0f0f0f0fu) << 4 | (x >> 4 & 0x0f0f0f0fu);
    x = (x & 0x33333333u) << 2 | (x >> 2 & 0x33333333u);
    return (x & 0x55555555u) << 1 | (x >> 1 & 0x55555555u);
}

/// Owen's scrambling of a number whose bits stand in reverse, most significant lowest: each bit is flipped or
/// not by a hash of the seed and the bits below it, which is what a carry does.
/// source  the idea: Laine, Karras, EGSR 2011; the multipliers: Vegdahl, "Building a better LK hash" (2021)
constexpr std::uint32_t owen_scramble_reversed(std::uint32_t x, std::uint32_t seed) {
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

/// Sobol's second dimension, bits in reverse. Its matrix is Pascal's triangle modulo 2, where entry (j, i) is
/// odd if and only if the bits of j are among those of i: a sum over supersets, five steps instead of 32.
constexpr std::uint32_t sobol_second_reversed(std::uint32_t index) {
    index ^= index >> 1 & 0x55555555u;
    index ^= index >> 2 & 0x33333333u;
    index ^= index >> 4 & 0x0f0f0f0fu;
    index ^= index >> 8 & 0x00ff00ffu;
    return index ^ index >> 16;
}

} // namespace detail

/// Owen-scrambled Sobol points: the default. Every dimension, 1D or 2D, is its own randomised copy of Sobol's
/// first two dimensions, a (0,2)-sequence: any aligned 2^k samples put one point into each of the 2^k boxes
/// of every power-of-two shape. The order of the points is shuffled per dimension as well, so that pairs of
/// dimensions are as good as independent. Best at 2^k samples, unbiased at any number.
/// source  Burley, "Practical hash-based Owen scrambling", JCGT 9:4 (2020)
template <class T>
class SobolSampler {
public:
    explicit SobolSampler(std::uint32_t seed = 0) : seed_(seed) {}

    class Stream {
    public:
        using Scalar = T;

        T get_1d(std::uint32_t dimension) const {
            const std::uint64_t key = derive_key(key_, dimension);
            return unit(detail::owen_scramble_reversed(shuffled_index(key), std::uint32_t(key)));
        }

        Vec2<T> get_2d(std::uint32_t dimension) const {
            const std::uint64_t key = derive_key(key_, dimension);
            const std::uint32_t index = shuffled_index(key);
            const std::uint32_t second = detail::sobol_second_reversed(index);
            return {unit(detail::owen_scramble_reversed(index, std::uint32_t(key))),
                    unit(detail::owen_scramble_reversed(second, std::uint32_t(key >> 32)))};
        }

    private:
        friend SobolSampler;
        Stream(std::uint64_t key, std::uint32_t index)
            : key_(key), reversed_index_(detail::reverse_bits(index)) {}

        static T unit(std::uint32_t reversed) { return to_unit<T>(detail::reverse_bits(reversed)); }

        /// Owen's scrambling of the index as a number: aligned blocks of 2^k samples stay such blocks.
        std::uint32_t shuffled_index(std::uint64_t key) const {
            const auto seed = std::uint32_t((key * golden_ratio_64) >> 32);
            return detail::reverse_bits(detail::owen_scramble_reversed(reversed_index_, seed));
        }

        std::uint64_t key_;
        std::uint32_t reversed_index_;
    };

    Stream at(std::uint32_t x, std::uint32_t y, std::uint32_t index) const {
        return Stream(pixel_key(seed_, x, y), index);
    }

private:
    std::uint32_t seed_;
};

} // namespace LAMBENT_ABI
} // namespace lambent
