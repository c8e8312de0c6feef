#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/matrix.hpp>
#include <lambent/core/vec.hpp>
#include <lambent/film/pixel_view.hpp>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// How a channel is stored. Half keeps 11 bits and reaches 65504; float32 is exact.
enum class ExrType : std::uint8_t { half, float32 };

/// One channel of an EXR file: width · height values, row 0 at the top.
struct ExrChannel {
    std::string name; ///< "R", "albedo.R", "Z" …
    ExrType type = ExrType::half;
    std::vector<float> values;
};

/// A header attribute. Matrices are ours, column vectors (p' = M p); the file holds row vectors (p' = p M).
using ExrValue = std::variant<int, double, std::string, Mat4d>;

/// What an EXR file holds, all in memory.
struct ExrImage {
    int width = 0, height = 0;
    std::vector<ExrChannel> channels;
    std::map<std::string, ExrValue> attributes; ///< those beyond the standard header
    int left = 0, top = 0;                      ///< where the upper left pixel lies in the display window
    int display_width = 0, display_height = 0;  ///< of the display window; 0 = the image's own

    /// The channel of that name, or nullptr.
    const ExrChannel* find(std::string_view name) const {
        for (const ExrChannel& c : channels)
            if (c.name == name) return &c;
        return nullptr;
    }

    /// Adds the C channels of `pixels` as `layer` + "." + suffix, or the suffix alone for an empty layer;
    /// one character of `suffixes` names a channel. The first plane sets the image's size.
    /// throws lambent::Error when the sizes differ
    template <class T, int C>
    void add(const std::string& layer, std::string_view suffixes, const PixelView<T, C>& pixels,
             ExrType type = ExrType::half) {
        require(suffixes.size() == std::size_t(C), "ExrImage::add: one suffix character a channel");
        if (channels.empty()) {
            width = pixels.width();
            height = pixels.height();
        }
        require(pixels.width() == width && pixels.height() == height, [&] {
            return "ExrImage::add: plane '" + layer + "' is " + std::to_string(pixels.width()) + " x " +
                   std::to_string(pixels.height()) + ", the image " + std::to_string(width) + " x " +
                   std::to_string(height);
        });
        for (int c = 0; c < C; ++c) {
            ExrChannel channel;
            channel.name = (layer.empty() ? std::string() : layer + ".") + suffixes[std::size_t(c)];
            channel.type = type;
            channel.values.reserve(std::size_t(width) * std::size_t(height));
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x)
                    channel.values.push_back(float(pixels.pixel(x, y)[c * pixels.strides().channel]));
            channels.push_back(std::move(channel));
        }
    }
};

} // namespace LAMBENT_ABI
} // namespace lambent
