#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <lambent/core/simd.hpp>
#include <lambent/sampling/hash.hpp>
#include <lambent/sampling/sampler.hpp>
#include <lambent/sampling/sobol_order.hpp>
#include <limits>
#include <type_traits>

namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {

/// Four numbers side by side, on the compilers' vector extension.
using FourWords [[gnu::vector_size(16)]] = std::uint32_t;

/// Of a number, or of each of FourWords; so with what follows.
template <class W>
constexpr W reverse_bits(W x) {
    if constexpr (std::is_same_v<W, std::uint32_t>) {
        x = __builtin_bswap32(x);
    } else {
        x = (x & 0x00ff00ffu) << 8 | (x >> 8 & 0x00ff00ffu);
        x = x << 16 | x >> 16;
    }
    x = (x & 0x0f0f0f0fu) << 4 | (x >> 4 & 0x0f0f0f0fu);
    x = (x & 0x33333333u) << 2 | (x >> 2 & 0x33333333u);
    return (x & 0x55555555u) << 1 | (x >> 1 & 0x55555555u);
}

/// Owen's scrambling of a number whose bits stand in reverse, most significant lowest: each bit is flipped or
/// not by a hash of the seed and the bits below it, which is what a carry does.
/// source  the idea: Laine, Karras, EGSR 2011; the multipliers: Vegdahl, "Building a better LK hash" (2021)
template <class W>
constexpr W owen_scramble_reversed(W x, W seed) {
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

/// Sobol's second dimension, bits in reverse. Its matrix is Pascal's triangle modulo 2, where entry (j, i) is
/// odd if and only if the bits of j are among those of i: a sum over supersets, five steps instead of 32.
template <class W>
constexpr W sobol_second_reversed(W index) {
    index ^= index >> 1 & 0x55555555u;
    index ^= index >> 2 & 0x33333333u;
    index ^= index >> 4 & 0x0f0f0f0fu;
    index ^= index >> 8 & 0x00ff00ffu;
    return index ^ index >> 16;
}

/// What to add (xor) to the Sobol points of each pixel of a tile of 8 x 8, by its Morton number m with the bits in
/// reverse, such that 4^k samples of the 4^l pixels of an aligned square make one net: one point in each of the
/// 4^(k + l) boxes of every shape 4^-p x 4^-q.
///
/// Over the field of four elements 0, 1, w, w + 1, two bits a digit, Sobol's points are the Taylor coefficients at
/// z = 0 and z = 1 of the polynomial whose coefficients are the digits of the sample's index (the second ones up to a
/// fixed map of each digit). To it is added m_j / (z - w)^(j + 1) for each digit of m. The sum has at most
/// k + l - 1 poles, so as many zeros at 0 and 1 together only if it vanishes: no two points share a box.
struct TileShift {
    std::uint32_t x, y; ///< bits in reverse
};
constexpr std::array<TileShift, 64> make_tile_shifts() {
    const auto times_w = [](std::uint32_t a, std::uint32_t power) { // a = bit 0 + bit 1 times w; w^2 = w + 1
        for (; power % 3 != 0; --power) a = (a >> 1 & 1u) | ((a ^ a >> 1) & 1u) << 1;
        return a;
    };
    std::array<TileShift, 64> shifts{};
    for (std::uint32_t reversed = 0; reversed < 64; ++reversed)
        for (std::uint32_t j = 0; j < 3; ++j) { // digit j of m, the lowest first
            const std::uint32_t digit = (reversed >> (5 - 2 * j) & 1u) | (reversed >> (4 - 2 * j) & 1u) << 1;
            for (std::uint32_t r = 0; r < 16; ++r) { // digit r of the point, the most significant first
                if ((r & j) != 0) continue;          // (r + j) over r is even
                const std::uint32_t n = r + j + 1;
                const std::uint32_t at_0 = times_w(digit, 2 * n), at_1 = times_w(digit, n); // 1/w^n, 1/(w + 1)^n
                shifts[reversed].x ^= at_0 << 2 * r;
                shifts[reversed].y ^= (at_1 ^ at_1 >> 1) << 2 * r; // the fixed map
            }
        }
    return shifts;
}
inline constexpr std::array<TileShift, 64> tile_shifts = make_tile_shifts();

/// From the key of a dimension, whose halves are the seeds of its numbers.
constexpr std::uint32_t place_seed(std::uint64_t key) { return std::uint32_t((key * golden_ratio_64) >> 24); }

/// Morton number of (x, y) in its tile, the three bits of each, in reverse.
constexpr std::uint32_t place_in_tile_reversed(std::uint32_t x, std::uint32_t y) {
    const auto spread = [](std::uint32_t a) { return (a & 1u) << 4 | (a & 2u) << 1 | (a >> 2 & 1u); };
    return spread(x) << 1 | spread(y);
}

} // namespace detail

/// Owen-scrambled Sobol points: the default. Every dimension, 1D or 2D, is its own randomised copy of Sobol's
/// first two dimensions, a (0,2)-sequence: any aligned 2^k samples put one point into each of the 2^k boxes
/// of every power-of-two shape. Each dimension takes the points in an order of its own, chosen such that what a path makes
/// of two dimensions together is spread as well (see sobol_order.hpp). Best at 4^k samples, unbiased at any number.
/// Neighbouring pixels share their points out among them: 4^k samples of each pixel of an aligned square of 1, 4, 16
/// or 64 pixels are one such set too (in boxes of powers of four), so errors of neighbours cancel and the noise
/// is blue at few samples, whatever their number and order.
/// source  Burley, "Practical hash-based Owen scrambling", JCGT 9:4 (2020); the aim: Ahmed, Wonka, "Screen-space
///         blue-noise diffusion of Monte Carlo sampling error", SIGGRAPH Asia 2020. We differ: no sample count has
///         to be known (see detail::TileShift), and orders are not drawn by chance
template <class T>
class SobolSampler {
public:
    explicit SobolSampler(std::uint32_t seed = 0) : seed_(seed) {}

    /// One sample's numbers: a pure function of pixel, sample, dimension and seed.
    class Stream {
    public:
        using Scalar = T;

        T get_1d(std::uint32_t dimension) const {
            const std::uint64_t key = derive_key(key_, dimension);
            return unit(detail::owen_scramble_reversed(ordered_index(dimension) ^ tile_shift(key).x, std::uint32_t(key)));
        }

        Vec2<T> get_2d(std::uint32_t dimension) const {
            const std::uint64_t key = derive_key(key_, dimension);
            const std::uint32_t index = ordered_index(dimension);
            const std::uint32_t second = detail::sobol_second_reversed(index);
            const detail::TileShift& shift = tile_shift(key);
            return {unit(detail::owen_scramble_reversed(index ^ shift.x, std::uint32_t(key))),
                    unit(detail::owen_scramble_reversed(second ^ shift.y, std::uint32_t(key >> 32)))};
        }

        /// Whether get_2d_of_four() is faster than three or four calls: where four products of 32 bits are one instruction.
#if defined(__SSE4_1__) || defined(__aarch64__)
        static constexpr bool four_at_once = true;
#else
        static constexpr bool four_at_once = false;
#endif
        /// get_2d() of four dimensions from this one on, which has to be 4k + 2; their first numbers are get_1d()'s.
        std::array<Vec2<T>, 4> get_2d_of_four(std::uint32_t dimension) const {
            using Four = detail::FourWords;
            const std::uint32_t first_order = order(dimension) & ~3u; // never past the table, whatever was asked for
            Four place_seed, low, high, masks[4];
            for (int i = 0; i < 4; ++i) {
                const std::uint64_t key = derive_key(key_, dimension + std::uint32_t(i));
                place_seed[i] = detail::place_seed(key);
                low[i] = std::uint32_t(key);
                high[i] = std::uint32_t(key >> 32);
                std::memcpy(&masks[i], &detail::sobol_order_masks[i][first_order], sizeof(Four));
            }
            const Four first = detail::apply_order(Four{} + index_in_round(dimension), masks[0], masks[1], masks[2], masks[3]);
            const Four second = detail::sobol_second_reversed(first);
            const Four place = detail::owen_scramble_reversed(Four{} + place_, place_seed) & 63u;
            Four shift_x, shift_y;
            for (int i = 0; i < 4; ++i) {
                shift_x[i] = detail::tile_shifts[place[i]].x;
                shift_y[i] = detail::tile_shifts[place[i]].y;
            }
            const Four x = detail::reverse_bits(detail::owen_scramble_reversed(first ^ shift_x, low));
            const Four y = detail::reverse_bits(detail::owen_scramble_reversed(second ^ shift_y, high));
            std::array<Vec2<T>, 4> numbers;
            for (int i = 0; i < 4; ++i)
                numbers[std::size_t(i)] = {to_unit<T>(std::uint32_t(x[i])), to_unit<T>(std::uint32_t(y[i]))};
            return numbers;
        }

        /// See StreamPack.
        template <int N>
        class Together {
        public:
            using Numbers = Pack<T, N>;

            void set(int lane, const Stream& stream) {
                keys_[std::size_t(lane)] = stream.key_;
                index_[lane] = stream.index_;
                place_[lane] = stream.place_;
                one_tile_ = lane == 0 || (one_tile_ && stream.key_ == keys_[0]);
            }
            Numbers get_1d(std::uint32_t dimension) const {
                const Drawn d(*this, dimension);
                return unit(detail::owen_scramble_reversed(d.index ^ d.shift_x, d.low));
            }
            Vec2<Numbers> get_2d(std::uint32_t dimension) const {
                const Drawn d(*this, dimension);
                const Words second = detail::sobol_second_reversed(d.index);
                return {unit(detail::owen_scramble_reversed(d.index ^ d.shift_x, d.low)),
                        unit(detail::owen_scramble_reversed(second ^ d.shift_y, d.high))};
            }

        private:
            using Words = typename detail::VectorOf<std::uint32_t, N>::Type;

            /// What the two numbers of a dimension are made of.
            struct Drawn {
                Words low{}, high{}, index, shift_x{}, shift_y{};

                Drawn(const Together& streams, std::uint32_t dimension) : index(streams.index_) {
                    const std::uint32_t o = order(dimension), round = round_of(dimension);
                    Words place{}, round_seeds{};
                    const int tiles = streams.one_tile_ ? 1 : N; // neighbours' keys are the same, and need hashing once
                    for (int i = 0; i < tiles; ++i) {
                        const std::uint64_t key = derive_key(streams.keys_[std::size_t(i)], dimension);
                        low[i] = std::uint32_t(key);
                        high[i] = std::uint32_t(key >> 32);
                        place[i] = detail::place_seed(key);
                        round_seeds[i] = round_seed(streams.keys_[std::size_t(i)], round);
                    }
                    if (tiles == 1) {
                        low = Words{} + low[0];
                        high = Words{} + high[0];
                        place = Words{} + place[0];
                        round_seeds = Words{} + round_seeds[0];
                    }
                    if (round > 0) index = shuffled(index, round_seeds);
                    const auto& masks = detail::sobol_order_masks;
                    index = detail::apply_order(index, Words{} + masks[0][o], Words{} + masks[1][o], Words{} + masks[2][o],
                                                Words{} + masks[3][o]);
                    place = detail::owen_scramble_reversed(streams.place_, place) & 63u;
                    for (int i = 0; i < N; ++i) {
                        shift_x[i] = detail::tile_shifts[place[i]].x;
                        shift_y[i] = detail::tile_shifts[place[i]].y;
                    }
                }
            };

            static Numbers unit(Words reversed) { // as to_unit()
                static_assert(std::numeric_limits<T>::digits < 32);
                const Words bits = detail::reverse_bits(reversed) >> (32 - std::numeric_limits<T>::digits);
                return Numbers(__builtin_convertvector(bits, typename Numbers::Vector)) *
                       Numbers(std::numeric_limits<T>::epsilon() / 2);
            }

            std::array<std::uint64_t, std::size_t(N)> keys_{};
            Words index_{}, place_{};
            bool one_tile_ = true;
        };

    private:
        friend SobolSampler;
        Stream(std::uint64_t key, std::uint32_t index, std::uint32_t place)
            : key_(key), index_(index), place_(place) {}

        static T unit(std::uint32_t reversed) { return to_unit<T>(detail::reverse_bits(reversed)); }

        std::uint32_t ordered_index(std::uint32_t dimension) const {
            const std::uint32_t d = order(dimension);
            const auto& masks = detail::sobol_order_masks;
            return detail::apply_order(index_in_round(dimension), masks[0][d], masks[1][d], masks[2][d], masks[3][d]);
        }

        static std::uint32_t order(std::uint32_t dimension) { return (dimension + 2) % detail::sobol_orders; }

        /// Past the last order they begin again, with samples shuffled by chance: by Owen's scrambling of the index as a
        /// number, so aligned blocks of 2^k samples stay such blocks.
        std::uint32_t index_in_round(std::uint32_t dimension) const {
            const std::uint32_t round = round_of(dimension);
            return round == 0 ? index_ : shuffled(index_, round_seed(key_, round));
        }
        static std::uint32_t round_of(std::uint32_t dimension) { return (dimension + 2) / detail::sobol_orders; }
        static std::uint32_t round_seed(std::uint64_t key, std::uint32_t round) { return std::uint32_t(derive_key(~key, round)); }
        template <class W>
        static W shuffled(W index, W seed) {
            return detail::reverse_bits(detail::owen_scramble_reversed(detail::reverse_bits(index), seed));
        }

        /// Which pixel of the tile takes which share is shuffled per dimension as well, squares staying squares.
        const detail::TileShift& tile_shift(std::uint64_t key) const {
            return detail::tile_shifts[detail::owen_scramble_reversed(place_, detail::place_seed(key)) & 63u];
        }

        std::uint64_t key_; ///< of the tile
        std::uint32_t index_;
        std::uint32_t place_; ///< in the tile, bits in reverse
    };

    Stream at(std::uint32_t x, std::uint32_t y, std::uint32_t index) const {
        return Stream(pixel_key(seed_, x >> 3, y >> 3), index, detail::place_in_tile_reversed(x, y));
    }

private:
    std::uint32_t seed_;
};

} // namespace LAMBENT_ABI
} // namespace lambent
