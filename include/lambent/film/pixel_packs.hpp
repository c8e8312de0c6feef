#pragma once
#include <lambent/core/simd_layout.hpp>
#include <lambent/film/pixel_view.hpp>
#include <array>
#include <cstddef>

// See simd.hpp.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace lambent {
inline namespace LAMBENT_ABI {

/// Pixels (x, y) to (x + count - 1, y), count <= N, one a lane and one pack a channel; further lanes are 0. Fast where
/// N pixels are wanted that lie planar or as dense RGB; the same values with any strides.
template <int N, class T, int C>
[[gnu::always_inline]] inline auto load_pack(const PixelView<T, C>& view, int x, int y, int count) {
    using Scalar = typename PixelView<T, C>::Scalar;
    using P = Pack<Scalar, N>;
    const PixelStrides strides = view.strides();
    const Scalar* const first = view.pixel(x, y);
    std::array<P, std::size_t(C)> packs;
    if (count == N && strides.pixel == 1) {
        for (std::size_t c = 0; c < std::size_t(C); ++c) packs[c] = P::load(first + std::ptrdiff_t(c) * strides.channel);
        return packs;
    }
    if constexpr (C == 3)
        if (count == N && strides.pixel == 3 && strides.channel == 1) return load_interleaved<Scalar, N>(first);
    Scalar lanes[std::size_t(C)][std::size_t(N)] = {};
    for (int i = 0; i < count; ++i)
        for (int c = 0; c < C; ++c) lanes[c][i] = first[i * strides.pixel + c * strides.channel];
    for (std::size_t c = 0; c < std::size_t(C); ++c) packs[c] = P::load(lanes[c]);
    return packs;
}

/// Asks for the memory of pixels (x, y) to (x + count - 1, y), which will be loaded or stored a little later; any x and y
/// will do.
template <class T, int C>
[[gnu::always_inline]] inline void prefetch(const PixelView<T, C>& view, int x, int y, int count) {
    if (y < 0 || y >= view.height() || x < 0 || x + count > view.width()) return;
    constexpr int line = 64 / int(sizeof(T));
    const PixelStrides strides = view.strides();
    const bool planar = strides.pixel < strides.channel;
    for (int c = 0; c < (planar ? C : 1); ++c) {
        const T* const first = view.pixel(x, y) + c * strides.channel;
        const std::ptrdiff_t last = (count - 1) * strides.pixel + (planar ? 0 : (C - 1) * strides.channel);
        for (std::ptrdiff_t i = 0; i < last; i += line) __builtin_prefetch(first + i);
        __builtin_prefetch(first + last);
    }
}

/// Writes what load_pack() reads.
template <class T, int C, int N>
[[gnu::always_inline]] inline void store_pack(const PixelView<T, C>& view, int x, int y, int count,
                                              const std::array<Pack<T, N>, std::size_t(C)>& packs) {
    const PixelStrides strides = view.strides();
    T* const first = view.pixel(x, y);
    if (count == N && strides.pixel == 1) {
        for (std::size_t c = 0; c < std::size_t(C); ++c) packs[c].store(first + std::ptrdiff_t(c) * strides.channel);
        return;
    }
    if constexpr (C == 3)
        if (count == N && strides.pixel == 3 && strides.channel == 1) return store_interleaved(packs, first);
    T lanes[std::size_t(C)][std::size_t(N)];
    for (std::size_t c = 0; c < std::size_t(C); ++c) packs[c].store(lanes[c]);
    for (int i = 0; i < count; ++i)
        for (int c = 0; c < C; ++c) first[i * strides.pixel + c * strides.channel] = lanes[c][i];
}

} // namespace LAMBENT_ABI
} // namespace lambent

#pragma GCC diagnostic pop
