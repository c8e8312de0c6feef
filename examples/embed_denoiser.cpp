// Our denoiser on the buffers of another renderer: interleaved RGBA, planes, 16-bit floats; and tile by tile.
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise.hpp>
#include <lambent/denoise/denoise_half.hpp>
#include <lambent/denoise/denoise_tiles.hpp>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <vector>

int main() {
    using lambent::Half;
    using lambent::PixelView;
    constexpr int width = 96, height = 64, pixels = width * height;
    std::vector<float> rgba(4 * pixels), planes(3 * pixels), normals(3 * pixels), result(3 * pixels);
    std::vector<std::uint16_t> halves(3 * pixels), half_normals(3 * pixels); // yours may be Imath's or CUDA's
    unsigned random = 1;
    for (int i = 0; i < pixels; ++i) { // two walls, evenly lit, with the noise of one sample a pixel
        const bool left = i % width < width / 2;
        for (int c = 0; c < 3; ++c) {
            const float noise = float((random = random * 1664525u + 1013904223u) >> 8) / float(1 << 23);
            const Half value((left ? 1.0f : 0.25f) * float(c + 1) / 3 * noise);
            halves[std::size_t(3 * i + c)] = value.bits;
            rgba[std::size_t(4 * i + c)] = planes[std::size_t(c * pixels + i)] = float(value);
        }
        normals[std::size_t(3 * i + (left ? 0 : 2))] = 1;
        half_normals[std::size_t(3 * i + (left ? 0 : 2))] = Half(1).bits;
    }

    const std::vector<float> file = rgba; // where tiles come from
    // layouts: begin
    lambent::ThreadExecutor threads; // or your own pool: see embed_bvh.cpp
    const PixelView<const float, 3> normal(normals.data(), width, height);

    // RGBARGBA...: a step of four from pixel to pixel; alpha stays what it is
    const PixelView<float, 3> interleaved(rgba.data(), width, height, {.pixel = 4});
    lambent::denoise<float>({.radiance = interleaved, .normal = normal}, interleaved, {}, threads);

    // RRR...GGG...BBB...: a step of one, and a plane's length between channels
    const PixelView<float, 3> planar(planes.data(), width, height, {.pixel = 1, .row = width, .channel = pixels});
    lambent::denoise<float>({.radiance = planar, .normal = normal}, planar, {}, threads);

    // halves: computed in float, tile by tile, and rounded
    const PixelView<Half, 3> half(reinterpret_cast<Half*>(halves.data()), width, height);
    const PixelView<const Half, 3> half_normal(reinterpret_cast<const Half*>(half_normals.data()), width, height);
    lambent::denoise({.radiance = half, .normal = half_normal}, half, {}, threads);
    // layouts: end
    // tiles: begin
    // An image larger than memory: you give the planes of a window, and get the light of a tile.
    const auto read = [&](const lambent::PixelWindow& window) {
        const auto part = [&](const float* first, int channels) {
            const float* const corner = first + channels * (std::ptrdiff_t(window.y0) * width + window.x0);
            return PixelView<const float, 3>(corner, window.width(), window.height(),
                                             {.pixel = channels, .row = channels * width});
        };
        return lambent::FrameView<float>{.radiance = part(file.data(), 4), .normal = part(normals.data(), 3)};
    };
    const auto write = [&](const lambent::PixelWindow& tile, const PixelView<const float, 3>& radiance, const auto&) {
        float* const first = result.data() + 3 * (std::ptrdiff_t(tile.y0) * width + tile.x0);
        for (int y = 0; y < tile.height(); ++y)
            for (int x = 0; x < 3 * tile.width(); ++x)
                first[std::ptrdiff_t(y) * 3 * width + x] = radiance.load(x / 3, y)[x % 3];
    };
    lambent::denoise_tiles<float>(width, height, {.width = 64, .height = 32}, read, write, {}, threads);
    // tiles: end
    int different = 0;
    double worst = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const lambent::Vec3f a = interleaved.load(x, y), b = planar.load(x, y);
            const Half* const c = half.pixel(x, y);
            for (int i = 0; i < 3; ++i) different += result[std::size_t(3 * (y * width + x) + i)] == a[i] ? 0 : 1;
            different += a == b && Half(a.x) == c[0] && Half(a.y) == c[1] && Half(a.z) == c[2] ? 0 : 1;
            worst = std::max(worst, std::abs(double(a.z) / (x < width / 2 ? 1 : 0.25) - 1));
        }
    std::printf("%d pixels differ between the layouts; noise of 100 %% is %s\n", different,
                worst < 0.25 ? "a quarter of that, or less" : "too much still");
}
