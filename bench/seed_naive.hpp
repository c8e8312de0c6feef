#pragma once
// The seed document's filter as a first program writes it: a struct a pixel, four exponentials a pair of
// pixels, no vectors. The base of the ratios in bench_filter, measured within a few per cent of
// shared/seed/baseline.cpp.
#include <algorithm>
#include <cmath>
#include <lambent/film/pixel_data.hpp>
#include <vector>

struct SeedNaive {
    struct Pixel {
        float normal[4], position[4];
        int material;
        float illumination[3], sums[4], filtered[9];
    };
    int width, height, radius;
    float sigma_illumination;
    std::vector<float> spatial;
    std::vector<Pixel> pixels;

    static float gauss(float sigma, float squared) { return std::exp(-squared / (2 * sigma * sigma)); }

    float weight(const Pixel& a, const Pixel& b) const {
        const auto squared = [](const float* p, const float* q) {
            const float x = p[0] - q[0], y = p[1] - q[1], z = p[2] - q[2];
            return x * x + y * y + z * z;
        };
        const float turn =
            1 - (a.normal[0] * b.normal[0] + a.normal[1] * b.normal[1] + a.normal[2] * b.normal[2]);
        return gauss(sigma_illumination, squared(a.illumination, b.illumination)) *
               gauss(2, squared(a.position, b.position)) * gauss(0.5f, turn * turn) *
               gauss(0.5f, a.material == b.material ? 0.0f : 1.0f);
    }

    /// Filters pixel (x, y); gives the number of taps.
    std::size_t filter(int x, int y) {
        Pixel& a = pixels[std::size_t(y * width + x)];
        float sums[3] = {0, 0, 0}, weights = 0;
        std::size_t taps = 0;
        for (int v = std::max(0, y - radius); v <= std::min(height - 1, y + radius); ++v)
            for (int u = std::max(0, x - radius); u <= std::min(width - 1, x + radius); ++u) {
                const Pixel& b = pixels[std::size_t(v * width + u)];
                const float w = spatial[std::size_t(std::abs(u - x))] *
                                spatial[std::size_t(std::abs(v - y))] * weight(a, b);
                weights += w;
                for (int c = 0; c < 3; ++c) sums[c] += w * b.illumination[c];
                ++taps;
            }
        for (int c = 0; c < 3; ++c) a.sums[c] = sums[c] / weights;
        return taps;
    }
};
