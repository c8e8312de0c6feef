#pragma once
#include <lambent/core/simd.hpp>
#include <array>
#include <cstdint>

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
} // namespace detail

/// The lanes from the largest to the smallest as the integers that their bits are: the order of values ≥ 0; then come
/// negative ones, from -inf up, and last -0.
/// source  Batcher's bitonic network
template <class T, int N>
[[gnu::always_inline]] inline Pack<T, N> sorted_descending(Pack<T, N> a) {
    using Ints = typename Mask<T, N>::Vector;
    constexpr std::make_integer_sequence<int, N> n{};
    static_assert(N == 4 || N == 8);
    Ints v = Ints(a.v);
    detail::sort_step<2, 1>(v, n);
    detail::sort_step<4, 2>(v, n);
    detail::sort_step<4, 1>(v, n);
    if constexpr (N == 8) {
        detail::sort_step<8, 4>(v, n);
        detail::sort_step<8, 2>(v, n);
        detail::sort_step<8, 1>(v, n);
    }
    return typename Pack<T, N>::Vector(v);
}

/// to[i] = table[number of the lane that sorted[i] came from], for lanes that were tagged.
template <class T, int N>
[[gnu::always_inline]] inline void look_up(Pack<T, N> sorted, const std::uint32_t* table, std::uint32_t* to) {
#if defined(__AVX2__)
    if constexpr (detail::is_pack<float, 8, T, N>) {
        const __m256i values = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(table));
        _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), _mm256_permutevar8x32_epi32(values, __m256i(sorted.v)));
        return;
    }
#endif
    using Ints = typename Mask<T, N>::Vector;
    const Ints v = Ints(sorted.v);
    for (int i = 0; i < N; ++i) to[i] = table[v[i] & (N - 1)];
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
