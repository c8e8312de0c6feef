#pragma once
#include <lambent/core/error.hpp>
#include <lambent/io/file.hpp>
#include <lambent/scene/texture.hpp>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>
#if defined(LAMBENT_HAS_OIIO) // set by the target lambent::image, which links OpenImageIO
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#endif

namespace lambent {
inline namespace LAMBENT_ABI {

/// Whether this program can decode PNG, JPEG and Radiance HDR: whether it links lambent::image.
#if defined(LAMBENT_HAS_OIIO)
inline constexpr bool can_read_images = true;
#else
inline constexpr bool can_read_images = false;
#endif

namespace detail {

enum class ImageFormat : std::uint8_t { unknown, png, jpeg, hdr, exr, ktx2, webp };

/// The format by its first bytes; names lie.
inline ImageFormat image_format(std::string_view bytes) {
    const auto starts = [&](std::string_view magic) { return bytes.starts_with(magic); };
    if (starts("\x89PNG\r\n\x1a\n")) return ImageFormat::png;
    if (starts("\xff\xd8\xff")) return ImageFormat::jpeg;
    if (starts("#?RADIANCE") || starts("#?RGBE")) return ImageFormat::hdr;
    if (starts("\x76\x2f\x31\x01")) return ImageFormat::exr;
    if (starts("\xabKTX 20\xbb")) return ImageFormat::ktx2;
    if (starts("RIFF") && bytes.size() >= 12 && bytes.substr(8, 4) == "WEBP") return ImageFormat::webp;
    return ImageFormat::unknown;
}

/// OpenImageIO's name of a reader that we trust with foreign bytes; fails for every other format.
inline const char* trusted_reader(ImageFormat format, const std::string& name) {
    switch (format) {
    case ImageFormat::png:
        return "png";
    case ImageFormat::jpeg:
        return "jpeg";
    case ImageFormat::hdr:
        return "hdr";
    case ImageFormat::exr:
        fail(name + ": an EXR image, which is read as an environment only");
    case ImageFormat::ktx2:
        fail(name + ": KTX2 images are not supported, only PNG and JPEG");
    case ImageFormat::webp:
        fail(name + ": WebP images are not supported, only PNG and JPEG");
    case ImageFormat::unknown:
        break;
    }
    fail(name + ": not a PNG or JPEG image");
}

/// Whether a PNG's chunks follow each other to the last one inside the file: libpng would complain of a file
/// cut short on stderr, and leak.
inline bool png_is_whole(std::string_view bytes) {
    const auto byte = [&](std::size_t i) { return std::size_t(static_cast<unsigned char>(bytes[i])); };
    for (std::size_t at = 8; bytes.size() - at >= 12;) {
        const std::size_t size = byte(at) << 24 | byte(at + 1) << 16 | byte(at + 2) << 8 | byte(at + 3);
        if (size > bytes.size() - at - 12) return false;
        if (bytes.substr(at + 4, 4) == "IEND") return true;
        at += 12 + size;
    }
    return false;
}

/// Pixels as decoded: 1 to 4 interleaved channels.
template <class Value>
struct RawImage {
    int width = 0, height = 0, channels = 0;
    std::vector<Value> values;
};

/// Decodes a file in memory with the reader that its first bytes ask for, never another.
/// throws lambent::Error with `name` when it can't, before allocating more than max_pixels
template <class Value>
RawImage<Value> decode_image(std::string_view bytes, const std::string& name, std::size_t max_pixels) {
    const ImageFormat format = image_format(bytes);
    const char* const reader = trusted_reader(format, name);
    require(format != ImageFormat::png || png_is_whole(bytes),
            [&] { return name + ": the PNG file is cut short"; });
#if defined(LAMBENT_HAS_OIIO)
    namespace oiio = OIIO;
    const auto input = oiio::ImageInput::create(reader);
    require(input != nullptr, [&] { return name + ": OpenImageIO has no reader '" + reader + "'"; });
    oiio::Filesystem::IOMemReader memory(const_cast<char*>(bytes.data()), bytes.size()); // it only reads
    oiio::ImageSpec config, spec;
    config.attribute("oiio:UnassociatedAlpha", 1);
    const bool opened =
        input->set_ioproxy(&memory) && input->open(std::string("memory.") + reader, spec, config);
    require(opened, [&] { return name + ": " + input->geterror(); });
    require(spec.width > 0 && spec.height > 0 && spec.depth == 1 && spec.nchannels > 0 &&
                std::size_t(spec.height) <= max_pixels / std::size_t(spec.width),
            [&] {
                return name + ": an image of " + std::to_string(spec.width) + " x " +
                       std::to_string(spec.height) + " pixels, over the limit of " +
                       std::to_string(max_pixels);
            });
    RawImage<Value> image{spec.width, spec.height, std::min(spec.nchannels, 4), {}};
    image.values.resize(std::size_t(image.width) * std::size_t(image.height) * std::size_t(image.channels));
    const auto type = sizeof(Value) == 1 ? oiio::TypeDesc::UINT8 : oiio::TypeDesc::FLOAT;
    const bool read = input->read_image(0, 0, 0, image.channels, type, image.values.data());
    require(read, [&] { return name + ": " + input->geterror(); });
    return image;
#else
    static_cast<void>(max_pixels);
    fail(name + ": this program was built without OpenImageIO and cannot read " + reader + " images");
#endif
}

} // namespace detail

/// Decodes a PNG or JPEG file in memory to RGBA8: grey is spread, a missing alpha is 1, 16 bits are rounded
/// to 8.
/// throws lambent::Error with `name` on anything else, damaged data, or more than max_pixels
inline Image decode_texture(std::string_view bytes, const std::string& name,
                              std::size_t max_pixels = std::size_t(1) << 28) {
    const detail::RawImage<std::uint8_t> image = detail::decode_image<std::uint8_t>(bytes, name, max_pixels);
    Image texture;
    texture.width = image.width;
    texture.height = image.height;
    texture.name = name;
    const std::size_t pixels = std::size_t(image.width) * std::size_t(image.height);
    const std::size_t channels = std::size_t(image.channels);
    const bool grey = channels < 3, alpha = channels % 2 == 0;
    texture.rgba.resize(4 * pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
        const std::uint8_t* in = &image.values[channels * i];
        std::uint8_t* out = &texture.rgba[4 * i];
        out[0] = in[0];
        out[1] = grey ? in[0] : in[1];
        out[2] = grey ? in[0] : in[2];
        out[3] = alpha ? in[channels - 1] : std::uint8_t(255);
    }
    return texture;
}

/// decode_texture() of a file.
inline Image read_texture(const std::string& path, std::size_t max_pixels = std::size_t(1) << 28) {
    return decode_texture(detail::read_file(path), path, max_pixels);
}

/// Writes width · height sRGB-encoded RGB8 pixels as PNG. The file appears whole or not at all.
/// throws lambent::Error when the sizes do not fit or the file cannot be written
inline void write_png(const std::string& path, int width, int height, std::span<const std::uint8_t> rgb) {
    require(width > 0 && height > 0 && rgb.size() == 3 * std::size_t(width) * std::size_t(height), [&] {
        return path + ": " + std::to_string(rgb.size()) + " bytes for an RGB image of " +
               std::to_string(width) + " x " + std::to_string(height);
    });
#if defined(LAMBENT_HAS_OIIO)
    detail::PendingFile pending(path);
    const auto output = OIIO::ImageOutput::create("png");
    require(output != nullptr, [&] { return path + ": OpenImageIO cannot write PNG"; });
    const OIIO::ImageSpec spec(width, height, 3, OIIO::TypeDesc::UINT8);
    const bool written = output->open(pending.name(), spec) &&
                         output->write_image(OIIO::TypeDesc::UINT8, rgb.data()) && output->close();
    require(written, [&] { return path + ": " + output->geterror(); });
    pending.commit();
#else
    fail(path + ": this program was built without OpenImageIO and cannot write PNG");
#endif
}

} // namespace LAMBENT_ABI
} // namespace lambent
