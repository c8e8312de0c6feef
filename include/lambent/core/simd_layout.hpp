#pragma once
#include <lambent/core/simd.hpp>
#include <array>
#include <cstddef>
#include <utility>

/// Packs between the layouts of memory: rows and columns of a square, three channels interleaved or apart.
// See simd.hpp.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {
/// Lane i is the from(i)-th of a's lanes and then b's.
template <class T, int N, class From>
[[gnu::always_inline]] inline Pack<T, N> pick(Pack<T, N> a, Pack<T, N> b, From) {
    return [&]<int... i>(std::integer_sequence<int, i...>) -> Pack<T, N> {
        return __builtin_shufflevector(a.v, b.v, From{}(i)...);
    }(std::make_integer_sequence<int, N>{});
}

template <int distance, class T, int N>
[[gnu::always_inline]] inline void transpose_blocks(Pack<T, N>* rows) {
    if constexpr (distance > 0) {
#pragma GCC unroll 64
        for (int i = 0; i < N; ++i) {
            if ((i & distance) != 0) continue;
            const Pack<T, N> a = rows[i], b = rows[i + distance];
            rows[i] = pick(a, b, [](int j) { return (j & distance) == 0 ? j : N + j - distance; });
            rows[i + distance] = pick(a, b, [](int j) { return (j & distance) == 0 ? j + distance : N + j; });
        }
        transpose_blocks<distance / 2>(rows);
    }
}
} // namespace detail

/// Exchanges lane i of pack j with lane j of pack i.
template <class T, int N>
[[gnu::always_inline]] inline void transpose(std::array<Pack<T, N>, std::size_t(N)>& rows) {
    detail::transpose_blocks<N / 2>(rows.data());
}

/// The three channels of N pixels that lie one behind the other: x y z x y z …
template <class T, int N>
[[gnu::always_inline]] inline std::array<Pack<T, N>, 3> load_interleaved(const T* from) {
    using P = Pack<T, N>;
    const P a = P::load(from), b = P::load(from + N), c = P::load(from + 2 * N);
    const auto channel = [&]<int k>(std::integral_constant<int, k>) __attribute__((always_inline)) {
        const P ab = detail::pick(a, b, [](int i) { return 3 * i + k < 2 * N ? 3 * i + k : 0; });
        return detail::pick(ab, c, [](int i) { return 3 * i + k < 2 * N ? i : 3 * i + k - N; });
    };
    return {channel(std::integral_constant<int, 0>{}), channel(std::integral_constant<int, 1>{}),
            channel(std::integral_constant<int, 2>{})};
}

/// The inverse of load_interleaved().
template <class T, int N>
[[gnu::always_inline]] inline void store_interleaved(const std::array<Pack<T, N>, 3>& channels, T* to) {
    using P = Pack<T, N>;
    const auto part = [&]<int k>(std::integral_constant<int, k>) __attribute__((always_inline)) {
        const P xy = detail::pick(channels[0], channels[1], [](int i) {
            const int e = k * N + i;
            return e % 3 == 2 ? 0 : e % 3 * N + e / 3;
        });
        detail::pick(xy, channels[2], [](int i) {
            const int e = k * N + i;
            return e % 3 == 2 ? N + e / 3 : i;
        }).store(to + k * N);
    };
    part(std::integral_constant<int, 0>{});
    part(std::integral_constant<int, 1>{});
    part(std::integral_constant<int, 2>{});
}

} // namespace LAMBENT_ABI
} // namespace lambent

#pragma GCC diagnostic pop
