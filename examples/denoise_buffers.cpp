// Denoises buffers that stay where your renderer has them: strided views, no copies.
#include <algorithm>
#include <cmath>
#include <cstdio>
// readme: begin
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise.hpp>
#include <vector>

struct MyPixel {
    float color[4];
    float normal[3];
    float albedo[3];
};

int main() {
    // readme: end
    // Two walls that meet in the middle, lit evenly; a checkered texture; noise.
    // readme: begin
    constexpr int width = 128, height = 64;
    std::vector<MyPixel> pixels(width * height);
    // readme: end
    unsigned random = 1;
    for (int i = 0; i < width * height; ++i) {
        const bool left = i % width < width / 2;
        const float albedo = (i % width / 4 + i / width / 4) % 2 == 0 ? 0.8f : 0.2f, light = left ? 1.0f : 0.25f;
        const float noise = float((random = random * 1664525u + 1013904223u) >> 8) / float(1 << 23);
        pixels[std::size_t(i)] = {{albedo * light * noise, albedo * light * noise, albedo * light * noise, 1},
                                  {left ? 1.0f : 0.0f, left ? 0.0f : 1.0f, 0},
                                  {albedo, albedo, albedo}};
    }

    // readme: begin
    const lambent::PixelStrides strides{.pixel = sizeof(MyPixel) / sizeof(float)};
    const auto view = [&](float* first) { return lambent::rgb_view(first, width, height, strides); };
    const lambent::FrameView<float> frame{
        .radiance = view(pixels[0].color), .albedo = view(pixels[0].albedo), .normal = view(pixels[0].normal)};
    lambent::ThreadExecutor threads;
    lambent::denoise(frame, view(pixels[0].color), {}, threads);
    // readme: end

    double worst = 0;
    for (int i = 0; i < width * height; ++i) {
        const MyPixel& p = pixels[std::size_t(i)];
        const double error = double(p.color[0] / p.albedo[0]) / (i % width < width / 2 ? 1 : 0.25) - 1;
        worst = std::max(worst, std::abs(error));
    }
    std::printf("the noise of 100 %% is down to %s, the texture and the edge are sharp\n", worst < 0.25 ? "a quarter or less" : "more than a quarter");
// readme: begin
}
// readme: end
