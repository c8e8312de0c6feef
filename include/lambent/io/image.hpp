#pragma once
#include <lambent/core/error.hpp>
#include <lambent/io/file.hpp>
#include <lambent/io/image_codec.hpp>
#include <lambent/io/image_format.hpp>
#include <lambent/io/png_jpeg.hpp>
#include <lambent/scene/texture.hpp>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Decodes a PNG or JPEG file in memory to RGBA8: grey is spread, a missing alpha is 1, 16 bits are rounded to 8. The
/// first bytes decide what it is. Colour profiles, gamma and orientation are ignored.
/// needs   a codec (image_codec.hpp): lambent::image, or one of your own
/// throws  lambent::Error with `name` on anything else, damaged data, more than max_pixels, or more pixels than that
///         many bytes can hold; the size is checked before anything is allocated or decoded
/// stderr  libpng prints a line where a PNG with right checksums holds wrong data
inline Image decode_texture(std::string_view bytes, const std::string& name,
                              std::size_t max_pixels = std::size_t(1) << 28) {
    const detail::ImageFormat format = detail::image_format(bytes, name, "PNG and JPEG");
    const bool png = format == detail::ImageFormat::png;
    require(png || format == detail::ImageFormat::jpeg,
            [&] { return name + ": EXR and Radiance HDR images are read as environments only"; });
    const detail::BareImage bare =
        png ? detail::bare_png(bytes, name, max_pixels) : detail::bare_jpeg(bytes, name, max_pixels);
    require(can_read_images(), [&] {
        return name + ": this program was built without OpenImageIO and cannot read " + (png ? "PNG" : "JPEG") +
               " images";
    });
    Image texture;
    texture.width = int(bare.width);
    texture.height = int(bare.height);
    texture.name = name;
    texture.rgba.resize(4 * std::size_t(bare.width) * bare.height);
    const std::string error =
        image_codec().decode(bare.bytes, png ? "png" : "jpeg", bare.width, bare.height, texture.rgba.data());
    require(error.empty(), [&] { return name + ": " + error; });
    return texture;
}

/// decode_texture() of a file.
inline Image read_texture(const std::string& path, std::size_t max_pixels = std::size_t(1) << 28) {
    return decode_texture(detail::FileBytes(path).view(), path, max_pixels);
}

/// Writes width · height sRGB-encoded RGB8 pixels as PNG. The file appears whole or not at all.
/// throws lambent::Error when the sizes do not fit or the file cannot be written
inline void write_png(const std::string& path, int width, int height, std::span<const std::uint8_t> rgb) {
    require(width > 0 && height > 0 && rgb.size() == 3 * std::size_t(width) * std::size_t(height), [&] {
        return path + ": " + std::to_string(rgb.size()) + " bytes for an RGB image of " + std::to_string(width) + " x " +
               std::to_string(height);
    });
    require(image_codec().encode_png != nullptr,
            [&] { return path + ": this program was built without OpenImageIO and cannot write PNG"; });
    std::string bytes;
    const std::string error = image_codec().encode_png(rgb.data(), width, height, bytes);
    require(error.empty(), [&] { return path + ": " + error; });
    detail::write_file(path, bytes);
}

} // namespace LAMBENT_ABI
} // namespace lambent
