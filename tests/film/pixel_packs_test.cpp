#include <algorithm>
#include <array>
#include <cstddef>
#include <doctest/doctest.h>
#include <lambent/film/pixel_packs.hpp>
#include <vector>

using namespace lambent;

namespace {
template <class T, int N, int C>
void check_packs(const PixelStrides& strides) {
    constexpr int columns = 2 * N + 3, rows = 2;
    constexpr std::size_t channels = std::size_t(C), size = 64 * std::size_t(columns * rows);
    std::vector<T> memory(size), written(size, T(-1)), expected = written;
    for (std::size_t i = 0; i < size; ++i) memory[i] = T(i + 1);
    const PixelView<const T, C> view(memory.data(), columns, rows, strides);
    const PixelView<T, C> out(written.data(), columns, rows, strides), truth(expected.data(), columns, rows, strides);
    for (int x = 0; x < columns; ++x)
        for (int count = 1; count <= std::min(N, columns - x); ++count) {
            const std::array<Pack<T, N>, channels> packs = load_pack<N>(view, x, 1, count);
            for (int i = 0; i < N; ++i)
                for (int c = 0; c < C; ++c)
                    REQUIRE(packs[std::size_t(c)][i] == (i < count ? view.pixel(x + i, 1)[c * view.strides().channel] : T(0)));
            store_pack(out, x, 1, count, packs);
            for (int i = 0; i < count; ++i) truth.store(x + i, 1, view.load(x + i, 1));
            REQUIRE(written == expected); // and no element beside
        }
    for (const int x : {-5, 0, columns - 1, columns + 7})
        for (const int y : {-1, 1, rows}) prefetch(view, x, y, N);
}
} // namespace

TEST_CASE("pixel packs: the pixels of any layout, as many as are asked for, and none beside") {
    check_packs<float, 16, 3>({});
    check_packs<float, 8, 3>({.pixel = 3, .row = 64});
    check_packs<float, 16, 3>({.pixel = 4});
    check_packs<float, 4, 3>({.pixel = 1, .row = 40, .channel = 90});
    check_packs<double, 8, 3>({.pixel = 2, .row = 60, .channel = 200});
    check_packs<double, 2, 3>({.pixel = 3, .row = 30});
    check_packs<float, 16, 1>({});
    check_packs<float, 16, 1>({.pixel = 3});
    check_packs<double, 8, 4>({.pixel = 1, .row = 19 * 4, .channel = 19});
    check_packs<float, 8, 4>({});
}
