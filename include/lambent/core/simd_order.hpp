#pragma once
#include <lambent/core/simd.hpp>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <utility>

/// Lanes in order of their values or numbers, and a table's entries in that order: how rays visit a node's children.
// See simd.hpp.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace lambent {
inline namespace LAMBENT_ABI {

/// The lanes' bits with the lowest log2(N) replaced by the lane's number: a value that is off by less than N units in
/// the last place, and knows where it comes from.
template <class T, int N>
[[gnu::always_inline]] inline Pack<T, N> tagged(Pack<T, N> a) {
    using Ints = typename Mask<T, N>::Vector;
    Ints lane;
    for (int i = 0; i < N; ++i) lane[i] = i;
    return typename Pack<T, N>::Vector((Ints(a.v) & ~typename Mask<T, N>::Lane(N - 1)) | lane);
}

namespace detail {
/// Exchanges each lane with lane ^ distance where it is the smaller of the two and belongs first.
template <int stage, int distance, class Ints, int... i>
[[gnu::always_inline]] inline void sort_step(Ints& v, std::integer_sequence<int, i...>) {
    constexpr int n = int(sizeof...(i));
    const Ints other = __builtin_shufflevector(v, v, (i ^ distance)...);
    const Ints low = v < other ? v : other, high = v < other ? other : v;
    v = __builtin_shufflevector(low, high, (((i & distance) == 0) == ((i & stage) == 0) ? i + n : i)...);
}

template <int M, class Vector>
[[gnu::always_inline]] inline auto first_lanes(Vector v) {
    return [&]<int... i>(std::integer_sequence<int, i...>) {
        return __builtin_shufflevector(v, v, i...);
    }(std::make_integer_sequence<int, M>{});
}

#if defined(__AVX2__)
/// As the lower lanes of a register whose others may hold anything. By intrinsics: gcc 12 takes a shuffle with lanes that
/// do not matter through memory.
template <class Wide, class Vector>
[[gnu::always_inline]] inline Wide widened(Vector v) {
    if constexpr (sizeof(Wide) == sizeof(Vector)) return Wide(v);
#if defined(__AVX512F__)
    else if constexpr (sizeof(Wide) == 64 && sizeof(Vector) == 32) return Wide(_mm512_castsi256_si512(__m256i(v)));
    else if constexpr (sizeof(Wide) == 64) return Wide(_mm512_castsi128_si512(__m128i(v)));
#endif
    else return Wide(_mm256_castsi128_si256(__m128i(v)));
}

/// table[lanes[i]], by one instruction.
template <class Entries>
[[gnu::always_inline]] inline Entries entries_at(Entries table, Entries lanes) {
#if defined(__AVX512F__) // all lanes by mask, since gcc 12 warns of its own header where there is none
    if constexpr (sizeof(Entries) == 64)
        return Entries(_mm512_maskz_permutexvar_epi32(__mmask16(0xffff), __m512i(lanes), __m512i(table)));
#endif
    if constexpr (sizeof(Entries) == 32) return Entries(_mm256_permutevar8x32_epi32(__m256i(table), __m256i(lanes)));
}
#endif

/// The lanes from the largest to the smallest as the integers that their bits are: the order of values ≥ 0; then come
/// negative ones, from -inf up, and last -0.
/// source  Batcher's bitonic network
template <class T, int N>
[[gnu::always_inline]] inline Pack<T, N> sorted_descending(Pack<T, N> a) {
    using Ints = typename Mask<T, N>::Vector;
    constexpr std::make_integer_sequence<int, N> n{};
    static_assert(N == 4 || N == 8 || N == 16);
    Ints v = Ints(a.v);
    sort_step<2, 1>(v, n);
    sort_step<4, 2>(v, n);
    sort_step<4, 1>(v, n);
    if constexpr (N >= 8) {
        sort_step<8, 4>(v, n);
        sort_step<8, 2>(v, n);
        sort_step<8, 1>(v, n);
    }
    if constexpr (N == 16) {
        sort_step<16, 8>(v, n);
        sort_step<16, 4>(v, n);
        sort_step<16, 2>(v, n);
        sort_step<16, 1>(v, n);
    }
    return typename Pack<T, N>::Vector(v);
}

/// to[i] = table[number of the lane that sorted[i] came from], for lanes of N that were tagged.
template <int N, class T, int M>
[[gnu::always_inline]] inline void look_up(Pack<T, M> sorted, const std::uint32_t* table, std::uint32_t* to) {
    using Ints = typename Mask<T, M>::Vector;
    const Ints v = Ints(sorted.v);
#if defined(__AVX512F__)
    constexpr bool one_step = N == 8 || N == 16;
#elif defined(__AVX2__)
    constexpr bool one_step = N == 8;
#else
    constexpr bool one_step = false;
#endif
    if constexpr (one_step) {
        using Entries = typename VectorOf<std::int32_t, N>::Type;
        Entries all;
        std::memcpy(&all, table, sizeof(all));
        const auto lanes = widened<Entries>(__builtin_convertvector(v, typename VectorOf<std::int32_t, M>::Type));
        const auto found = first_lanes<M>(entries_at(all, lanes));
        std::memcpy(to, &found, sizeof(found));
    } else {
        for (int i = 0; i < M; ++i) to[i] = table[v[i] & (N - 1)];
    }
}

/// The first M lanes of N, ordered, and what stands in the table for each.
template <int M, class T, int N>
[[gnu::always_inline]] inline void store_sorted(Pack<T, N> tagged, const std::uint32_t* table, T* keys,
                                                std::uint32_t* values) {
    const Pack<T, M> sorted = sorted_descending(Pack<T, M>(first_lanes<M>(tagged.v)));
    sorted.store(keys);
    look_up<N>(sorted, table, values);
}
} // namespace detail

/// Writes the keys of the lanes in `set` from the largest to the smallest, tagged with their lanes, and table[lane] of
/// each; up to N places are overwritten. The order is that of keys ≥ 0; below come negative ones, from -inf up.
/// cost  with AVX-512 the lanes are gathered first: to sort four takes a third of the steps for sixteen
template <class T, int N>
[[gnu::always_inline]] inline void store_descending(Mask<T, N> set, Pack<T, N> keys, const std::uint32_t* table,
                                                    T* sorted, std::uint32_t* values) {
#if defined(__AVX512F__)
    if constexpr (Mask<T, N>::one_bit_a_lane) {
        const int count = std::popcount(bits(set));
        Pack<T, N> dense;
        if constexpr (sizeof(T) == 4)
            dense = _mm512_mask_compress_ps(_mm512_set1_ps(-0.0f), __mmask16(set.v), __m512(tagged(keys).v));
        else dense = _mm512_mask_compress_pd(_mm512_set1_pd(-0.0), __mmask8(set.v), __m512d(tagged(keys).v));
        if (count <= 4) return detail::store_sorted<4>(dense, table, sorted, values);
        if (count <= 8) return detail::store_sorted<8>(dense, table, sorted, values);
        return detail::store_sorted<N>(dense, table, sorted, values);
    }
#endif
    detail::store_sorted<N>(select(set, tagged(keys), Pack<T, N>(T(-0.0))), table, sorted, values);
}

namespace detail {
/// For each set of lanes of eight, these lanes from the highest to the lowest, one a byte.
inline constexpr auto descending_lanes = [] {
    std::array<std::uint64_t, 256> table{};
    for (unsigned set = 0; set < 256; ++set)
        for (int lane = 7, place = 0; lane >= 0; --lane)
            if ((set >> lane & 1u) != 0) table[set] |= std::uint64_t(lane) << (8 * place++);
    return table;
}();
} // namespace detail

/// Writes table[lane] for the lanes in `set`, the highest lane first, without branches; up to N places are overwritten.
template <int N>
[[gnu::always_inline]] inline void compress_descending(unsigned set, const std::uint32_t* table, std::uint32_t* to) {
#if defined(__AVX512F__)
    if constexpr (N == 16) {
        const __m512i lane = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
        const __m512i dense = _mm512_maskz_compress_epi32(__mmask16(set), _mm512_loadu_si512(table));
        const __m512i from_last = _mm512_sub_epi32(_mm512_set1_epi32(std::popcount(set) - 1), lane);
        _mm512_storeu_si512(to, detail::entries_at(dense, from_last));
        return;
    }
#endif
#if defined(__AVX2__)
    if constexpr (N == 8) {
        const __m256i lanes =
            _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(&detail::descending_lanes[set])));
        const __m256i values = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(table));
        _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), _mm256_permutevar8x32_epi32(values, lanes));
        return;
    }
#endif
    for (int lane = N - 1, place = 0; lane >= 0; --lane) {
        to[place] = table[lane];
        place += int(set >> lane & 1u);
    }
}

} // namespace LAMBENT_ABI
} // namespace lambent

#pragma GCC diagnostic pop
