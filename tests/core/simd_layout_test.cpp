#include <array>
#include <doctest/doctest.h>
#include <lambent/core/simd_layout.hpp>

using namespace lambent;

namespace {
template <class T, int N>
void check_layouts() {
    CAPTURE(N);
    std::array<Pack<T, N>, std::size_t(N)> square;
    for (int i = 0; i < N; ++i)
        for (int j = 0; j < N; ++j) square[std::size_t(i)].set(j, T(100 * i + j));
    transpose(square);
    for (int i = 0; i < N; ++i)
        for (int j = 0; j < N; ++j) REQUIRE(square[std::size_t(i)][j] == T(100 * j + i));

    std::array<T, std::size_t(3 * N)> pixels, back{};
    for (int i = 0; i < 3 * N; ++i) pixels[std::size_t(i)] = T(i + 1);
    const auto channels = load_interleaved<T, N>(pixels.data());
    for (int i = 0; i < N; ++i)
        for (int c = 0; c < 3; ++c) REQUIRE(channels[std::size_t(c)][i] == T(3 * i + c + 1));
    store_interleaved(channels, back.data());
    CHECK(back == pixels);
}
} // namespace

TEST_CASE("simd layout: squares are transposed, three channels taken apart and put together") {
    check_layouts<float, 4>();
    check_layouts<float, 8>();
    check_layouts<float, 16>();
    check_layouts<double, 2>();
    check_layouts<double, 4>();
    check_layouts<double, 8>();
}
