#pragma once
#include <lambent/film/pixel_view.hpp>
#include <lambent/io/image.hpp>
#include <lambent/scene/texture.hpp>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

/// Writes linear radiance times 2^exposure, clipped at 1, as an sRGB PNG.
inline void write_preview(const std::string& path, const lambent::PixelView<const float, 3>& image, double exposure) {
    const float gain = float(std::exp2(exposure));
    std::vector<std::uint8_t> rgb;
    rgb.reserve(3 * std::size_t(image.width()) * std::size_t(image.height()));
    for (int y = 0; y < image.height(); ++y)
        for (int x = 0; x < image.width(); ++x) {
            const lambent::Vec3f v = image.load(x, y) * gain;
            for (int c = 0; c < 3; ++c)
                rgb.push_back(std::uint8_t(std::lround(255 * lambent::linear_to_srgb(std::clamp(v[c], 0.0f, 1.0f)))));
        }
    lambent::write_png(path, image.width(), image.height(), rgb);
}
