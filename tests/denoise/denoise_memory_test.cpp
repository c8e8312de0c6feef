#include "lit_wall.hpp"
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <doctest/doctest.h>
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise.hpp>
#include <lambent/denoise/denoise_tiles.hpp>
#include <new>
#include <utility>

namespace lambent_test {
namespace {

std::atomic<std::size_t> in_use{0}, most{0}; ///< bytes

void* counted_new(std::size_t size, std::size_t alignment) {
    const std::size_t header = std::max(alignment, std::size_t(64));
    void* const raw = std::aligned_alloc(header, (size + header - 1) / header * header + header);
    if (raw == nullptr) std::abort();
    std::memcpy(raw, &size, sizeof size);
    const std::size_t now = in_use += size;
    if (now > most) most = now;
    return static_cast<std::byte*>(raw) + header;
}
void counted_delete(void* memory, std::size_t alignment) {
    if (memory == nullptr) return;
    void* const raw = static_cast<std::byte*>(memory) - std::max(alignment, std::size_t(64));
    std::size_t size = 0;
    std::memcpy(&size, raw, sizeof size);
    in_use -= size;
    std::free(raw);
}

/// The most memory, in bytes, that f() takes at once beside what is there.
template <class F>
double memory_of(F&& f) {
    const std::size_t before = in_use;
    most = before;
    f();
    return double(most - before);
}

} // namespace
} // namespace lambent_test

void* operator new(std::size_t size) { return lambent_test::counted_new(size, 1); }
void* operator new(std::size_t size, std::align_val_t alignment) {
    return lambent_test::counted_new(size, std::size_t(alignment));
}
void operator delete(void* memory) noexcept { lambent_test::counted_delete(memory, 1); }
void operator delete(void* memory, std::size_t) noexcept { lambent_test::counted_delete(memory, 1); }
void operator delete(void* memory, std::align_val_t alignment) noexcept {
    lambent_test::counted_delete(memory, std::size_t(alignment));
}
void operator delete(void* memory, std::size_t, std::align_val_t alignment) noexcept {
    lambent_test::counted_delete(memory, std::size_t(alignment));
}

TEST_CASE("denoise: at most 200 bytes a pixel beside input and output") {
    using namespace lambent;
    constexpr int width = 256, height = 144;
    for (const auto& [spp, chance] : {std::pair(1, 1.0), std::pair(9, 1.0), std::pair(1, 0.04)}) { // of finding light
        const lambent_test::LitWall wall{.width = width, .height = height, .chance = chance};
        const PixelData<float> frame = wall.frame(spp, 1);
        Plane<float, 3> out(width, height), error(width, height);
        SerialExecutor serial;
        for (const char* method : {"best", "balanced", "fast"}) {
            CAPTURE(method);
            CAPTURE(spp);
            CAPTURE(chance);
            const double bytes = lambent_test::memory_of([&] {
                denoise<float>(frame.view(), out.view(), denoise_options(method), serial, error.view());
            });
            CHECK(bytes > 16.0 * width * height); // it was counted
            CHECK(bytes < 200.0 * width * height);
        }
    }
}

TEST_CASE("denoise_tiles: memory goes with the tile, and 2 bytes a pixel of the image") {
    using namespace lambent;
    struct Nowhere { // what is stored is of no account here
        void store(const PixelWindow&, const PixelView<const float, 4>&) {}
        void load(const PixelWindow&, const PixelView<float, 4>&) {}
    };
    SerialExecutor serial;
    const auto measured = [&](int width, int height, const char* method) {
        const PixelData<float> frame = lambent_test::LitWall{.width = width, .height = height}.frame(2, 1);
        return lambent_test::memory_of([&] {
            const auto planes = [&](const PixelWindow& w) { return window_of(frame.view(), w); };
            denoise_tiles<float>(width, height, {128, 64}, planes,
                                 [](const PixelWindow&, const auto&, const auto&) {}, denoise_options(method), serial,
                                 Nowhere{});
        });
    };
    for (const char* method : {"balanced", "fast"}) { // best has balanced's planes
        CAPTURE(method);
        const double small = measured(384, 256, method), large = measured(768, 512, method);
        CAPTURE(small);
        CAPTURE(large);
        const double more = 768.0 * 512 - 384.0 * 256;
        CHECK(large - small < 2 * more);
        CHECK(large < 40.0 * 768 * 512); // 200 with the whole image at once
    }
}
