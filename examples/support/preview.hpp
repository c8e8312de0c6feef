#pragma once
#include <lambent/film/pixel_view.hpp>
#include <lambent/io/image.hpp>
#include <lambent/scene/texture.hpp>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

/// Writes linear radiance times 2^exposure, clipped at 1, as an sRGB PNG: one image, or some of one size side by side.
inline void write_preview(const std::string& path, std::initializer_list<lambent::PixelView<const float, 3>> images,
                          double exposure) {
    const float gain = float(std::exp2(exposure));
    const int height = images.begin()->height(), width = images.begin()->width() * int(images.size());
    std::vector<std::uint8_t> rgb;
    rgb.reserve(3 * std::size_t(width) * std::size_t(height));
    for (int y = 0; y < height; ++y)
        for (const auto& image : images)
            for (int x = 0; x < image.width(); ++x) {
                const lambent::Vec3f v = image.load(x, y) * gain;
                for (int c = 0; c < 3; ++c)
                    rgb.push_back(std::uint8_t(std::lround(255 * lambent::linear_to_srgb(std::clamp(v[c], 0.0f, 1.0f)))));
            }
    lambent::write_png(path, width, height, rgb);
}
