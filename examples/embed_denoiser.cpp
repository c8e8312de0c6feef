// Our denoiser on the buffers of another renderer, in three layouts: interleaved RGBA, planes one behind the other, and
// 16-bit floats. The first two are filtered where they are; halves are widened first, since filters count in T.
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise.hpp>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>

// half: begin
using Half = std::uint16_t; // yours may be Imath's, CUDA's or _Float16
float widened(Half h) {
    const std::uint32_t sign = std::uint32_t(h & 0x8000) << 16, rest = h & 0x7fff;
    return std::bit_cast<float>(sign) + (sign ? -1.0f : 1.0f) * std::bit_cast<float>(rest << 13) * 0x1p112f;
}
// half: end
Half narrowed(float x) { return Half(std::bit_cast<std::uint32_t>(x * 0x1p-112f) >> 13); } // of 0 <= x < 65504

int main() {
    using lambent::PixelView;
    constexpr int width = 96, height = 64, pixels = width * height;
    std::vector<float> rgba(4 * pixels), planes(3 * pixels), normals(3 * pixels);
    std::vector<Half> halves(3 * pixels);
    unsigned random = 1;
    for (int i = 0; i < pixels; ++i) { // two walls, evenly lit, with the noise of one sample a pixel
        const bool left = i % width < width / 2;
        for (int c = 0; c < 3; ++c) {
            const float noise = float((random = random * 1664525u + 1013904223u) >> 8) / float(1 << 23);
            const Half value = narrowed((left ? 1.0f : 0.25f) * float(c + 1) / 3 * noise);
            halves[std::size_t(3 * i + c)] = value;
            rgba[std::size_t(4 * i + c)] = planes[std::size_t(c * pixels + i)] = widened(value);
        }
        normals[std::size_t(3 * i + (left ? 0 : 2))] = 1;
    }

    // layouts: begin
    lambent::ThreadExecutor threads; // or your own pool: see embed_bvh.cpp
    const PixelView<const float, 3> normal(normals.data(), width, height);

    // RGBARGBA...: a step of four from pixel to pixel; alpha stays what it is
    const PixelView<float, 3> interleaved(rgba.data(), width, height, {.pixel = 4});
    lambent::denoise<float>({.radiance = interleaved, .normal = normal}, interleaved, {}, threads);

    // RRR...GGG...BBB...: a step of one, and a plane's length between channels
    const PixelView<float, 3> planar(planes.data(), width, height, {.pixel = 1, .row = width, .channel = pixels});
    lambent::denoise<float>({.radiance = planar, .normal = normal}, planar, {}, threads);

    // halves: into a plane of ours and, if you like, back
    lambent::Plane<float, 3> wide(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const Half* const p = halves.data() + 3 * (y * width + x);
            wide.view().store(x, y, {widened(p[0]), widened(p[1]), widened(p[2])});
        }
    lambent::denoise<float>({.radiance = wide.view(), .normal = normal}, wide.view(), {}, threads);
    // layouts: end

    int different = 0;
    double worst = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const lambent::Vec3f a = interleaved.load(x, y), b = planar.load(x, y), c = wide.load(x, y);
            different += a == b && a == c ? 0 : 1;
            worst = std::max(worst, std::abs(double(a.z) / (x < width / 2 ? 1 : 0.25) - 1));
        }
    std::printf("%d pixels differ between the layouts; noise of 100 %% is %s\n", different,
                worst < 0.25 ? "a quarter of that, or less" : "too much still");
}
