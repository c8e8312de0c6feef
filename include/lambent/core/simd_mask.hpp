#pragma once
#include <lambent/core/config.hpp>
#include <cstdint>
#include <type_traits>
#if defined(__AVX__)
#include <immintrin.h> // with AVX-512, five times what <vector> takes to compile
#elif defined(__SSE4_1__)
#include <smmintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

/// What a comparison of Packs gives; and how wide registers are.
// See simd.hpp.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace lambent {
inline namespace LAMBENT_ABI {

/// The number of T that one register of this build holds; 4 where there is none.
template <class T>
inline constexpr int native_width =
#if defined(__AVX512F__)
    int(64 / sizeof(T));
#elif defined(__AVX__)
    int(32 / sizeof(T));
#else
    sizeof(T) == 4 ? 4 : 2;
#endif

/// Whether one instruction loads a value from memory into all lanes; elsewhere it pays to store them spread.
template <class T>
inline constexpr bool loads_spread =
#if defined(__AVX__) || defined(__aarch64__)
    true;
#else
    false;
#endif

namespace detail {
template <class T, int N>
struct VectorOf {
    typedef T Type __attribute__((vector_size(sizeof(T) * N)));
};

template <class Wanted, int width, class T, int N>
inline constexpr bool is_pack = std::is_same_v<Wanted, T> && width == N;

/// Wider than one register of this build, so made of two halves.
template <class T, int N>
inline constexpr bool splits = N > native_width<T>;

template <class Half>
struct MaskHalves {
    Half low, high;

    friend MaskHalves operator&(MaskHalves a, MaskHalves b) { return {a.low & b.low, a.high & b.high}; }
    friend MaskHalves operator|(MaskHalves a, MaskHalves b) { return {a.low | b.low, a.high | b.high}; }
    friend MaskHalves operator^(MaskHalves a, MaskHalves b) { return {a.low ^ b.low, a.high ^ b.high}; }
    friend MaskHalves operator~(MaskHalves a) { return {~a.low, ~a.high}; }
};
} // namespace detail

/// The result of a comparison: whether, for each lane. Held as lanes of all ones or all zeros; as a bit a lane where
/// the hardware has registers for that and gives nothing else; as two halves where no register holds all lanes, since
/// compilers take comparisons of such vectors lane by lane.
template <class T, int N>
struct Mask {
    using Lane = std::conditional_t<sizeof(T) == 4, std::int32_t, std::int64_t>;
    using Vector = typename detail::VectorOf<Lane, N>::Type;
    static constexpr bool in_halves = detail::splits<T, N>;
#if defined(__AVX512F__)
    static constexpr bool one_bit_a_lane = sizeof(Vector) == 64;
#else
    static constexpr bool one_bit_a_lane = false;
#endif
    using Held = std::conditional_t<in_halves, detail::MaskHalves<Mask<T, N / 2>>,
                                    std::conditional_t<one_bit_a_lane, std::uint16_t, Vector>>;
    Held v;

    friend Mask operator&(Mask a, Mask b) { return {Held(a.v & b.v)}; }
    friend Mask operator|(Mask a, Mask b) { return {Held(a.v | b.v)}; }
    friend Mask operator^(Mask a, Mask b) { return {Held(a.v ^ b.v)}; }
    friend Mask operator~(Mask a) {
        if constexpr (one_bit_a_lane) {
            return {Held(~a.v & ((1u << N) - 1u))};
        } else {
            return {~a.v};
        }
    }
};

/// One bit a lane, lane 0 lowest.
template <class T, int N>
[[gnu::always_inline]] inline unsigned bits(Mask<T, N> mask) {
#if defined(__AVX__)
    if constexpr (sizeof(T) == 4 && N == 8) return unsigned(_mm256_movemask_ps(__m256(mask.v)));
    if constexpr (sizeof(T) == 8 && N == 4) return unsigned(_mm256_movemask_pd(__m256d(mask.v)));
#endif
#if defined(__SSE2__)
    if constexpr (sizeof(T) == 4 && N == 4) return unsigned(_mm_movemask_ps(__m128(mask.v)));
    if constexpr (sizeof(T) == 8 && N == 2) return unsigned(_mm_movemask_pd(__m128d(mask.v)));
#elif defined(__aarch64__)
    if constexpr (sizeof(T) == 4 && N == 4) {
        const uint32x4_t weight = {1, 2, 4, 8};
        return vaddvq_u32(vandq_u32(uint32x4_t(mask.v), weight));
    }
#endif
    if constexpr (Mask<T, N>::one_bit_a_lane) {
        return mask.v;
    } else if constexpr (Mask<T, N>::in_halves) {
        return bits(mask.v.low) | bits(mask.v.high) << (N / 2);
    } else {
        unsigned result = 0;
        for (int i = 0; i < N; ++i) result |= unsigned(mask.v[i] != 0) << i;
        return result;
    }
}

template <class T, int N> inline bool any(Mask<T, N> mask) { return bits(mask) != 0; } ///< whether a lane is set
/// Whether all lanes are set.
template <class T, int N> inline bool all(Mask<T, N> mask) {
    return bits(mask) == (N == 32 ? ~0u : (1u << N) - 1u);
}

} // namespace LAMBENT_ABI
} // namespace lambent

#pragma GCC diagnostic pop
