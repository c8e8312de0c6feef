#pragma once
#include <algorithm>
#include <bit>
#include <cmath>
#include <lambent/core/error.hpp>
#include <lambent/sampling/hash.hpp>
#include <lambent/sampling/sampler.hpp>
#include <string>

namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {
/// Where item i of [0, n) goes in a shuffle picked by `key`; n > 0. Walks cycles of a bijection on the next
/// power of two, then rotates by a random amount: each item lands on each place with chance exactly 1/n,
/// which a hash alone does not give for small n, and without which estimates are biased.
/// source  cycle walking: Black, Rogaway, CT-RSA 2002; for strata: Kensler, Pixar TM 13-01 (2013)
constexpr std::uint32_t permute(std::uint32_t i, std::uint32_t n, std::uint64_t key) {
    const std::uint32_t mask = std::bit_ceil(n) - 1u;
    const int shift = (int(std::bit_width(mask)) + 1) / 2; // 0 only where mask is
    const std::uint64_t more = mix_bits(key);
    const std::uint32_t keys[] = {std::uint32_t(key), std::uint32_t(key >> 32), std::uint32_t(more),
                                  std::uint32_t(more >> 32)};
    do {
        for (unsigned round = 0; round < 6; ++round) { // with fewer, some pairs are dealt more often
            const std::uint32_t k = keys[round % 4];
            i = ((i + k) * (k >> (8 + round / 4 * 4) | 1u)) & mask;
            i ^= i >> shift;
        }
    } while (i >= n);
    i += to_range(keys[3] * 0x9e3779b9u, n);
    return i >= n ? i - n : i;
}
} // namespace detail

/// Jittered strata: n samples a pixel put one into each of n intervals of every 1D dimension; in 2D one into
/// each cell of a grid as square as n allows, and one into each of n rows. Strata are dealt to the
/// samples by a shuffle of each dimension's own. Unbiased at every n, primes too; samples n, 2n, … begin a
/// new pattern.
/// source  Kensler, "Correlated multi-jittered sampling", Pixar TM 13-01 (2013)
template <class T>
class StratifiedSampler {
public:
    /// Throws lambent::Error unless 0 < samples_per_pixel <= 2^24.
    StratifiedSampler(std::uint32_t seed, std::uint32_t samples_per_pixel)
        : seed_(seed), strata_{samples_per_pixel, 1, 1} {
        require(samples_per_pixel > 0 && samples_per_pixel <= (1u << 24), [&] {
            return "StratifiedSampler: samples_per_pixel must be in [1, 2^24], it is " +
                   std::to_string(samples_per_pixel);
        });
        strata_.columns = std::uint32_t(std::sqrt(double(samples_per_pixel)));
        strata_.rows = (samples_per_pixel + strata_.columns - 1) / strata_.columns;
    }

    class Stream;

    Stream at(std::uint32_t x, std::uint32_t y, std::uint32_t index) const {
        const std::uint32_t pattern = index / strata_.count;
        return Stream(derive_key(pixel_key(seed_, x, y), pattern), index - pattern * strata_.count, strata_);
    }

private:
    struct Strata {
        std::uint32_t count, columns, rows; // columns · rows >= count
    };

public:
    /// One sample's numbers: a pure function of pixel, sample, dimension and seed.
    class Stream {
    public:
        using Scalar = T;

        T get_1d(std::uint32_t dimension) const {
            const std::uint64_t key = derive_key(key_, dimension);
            const std::uint64_t jitter = derive_key(key, index_);
            const std::uint32_t stratum = detail::permute(index_, strata_.count, key);
            return below_one((T(stratum) + to_unit<T>(jitter)) / T(strata_.count));
        }

        Vec2<T> get_2d(std::uint32_t dimension) const {
            const std::uint64_t key = derive_key(key_, dimension);
            const std::uint64_t jitter = derive_key(key, index_);
            const std::uint32_t place = detail::permute(index_, strata_.count, key);
            const std::uint32_t row = place / strata_.columns;
            const std::uint32_t column =
                detail::permute(place - row * strata_.columns, strata_.columns, mix_bits(key ^ 1));
            const std::uint32_t sub_column = detail::permute(row, strata_.rows, mix_bits(key ^ 2));
            const T jitter_x = to_unit<T>(std::uint32_t(jitter >> 32));
            const T jitter_y = to_unit<T>(std::uint32_t(jitter));
            return {
                below_one((T(column) + (T(sub_column) + jitter_x) / T(strata_.rows)) / T(strata_.columns)),
                below_one((T(place) + jitter_y) / T(strata_.count))};
        }

    private:
        friend StratifiedSampler;
        Stream(std::uint64_t key, std::uint32_t index, Strata strata)
            : key_(key), index_(index), strata_(strata) {}

        static T below_one(T x) { return std::min(x, one_minus_epsilon<T>); }

        std::uint64_t key_;
        std::uint32_t index_;
        Strata strata_;
    };

private:
    std::uint32_t seed_;
    Strata strata_;
};

} // namespace LAMBENT_ABI
} // namespace lambent
