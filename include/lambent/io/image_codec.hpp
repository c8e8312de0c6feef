#pragma once
#include <lambent/core/config.hpp>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#if defined(LAMBENT_HAS_OIIO) // set by the target lambent::image, which links OpenImageIO
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <memory>
#include <vector>
#endif

namespace lambent {

/// Who turns PNG and JPEG into pixels, and pixels into PNG. Both functions return what went wrong, or an empty text,
/// and throw nothing. They may be called by several threads at once.
struct ImageCodec {
    /// Decodes a "png" or "jpeg" file of width · height pixels into RGBA8: grey is spread, a missing alpha is 255, 16
    /// bits are rounded to 8.
    std::string (*decode)(std::string_view file, const char* format, std::uint32_t width, std::uint32_t height,
                          std::uint8_t* rgba) = nullptr;
    /// Encodes width · height pixels of RGB8 as a PNG file.
    std::string (*encode_png)(const std::uint8_t* rgb, int width, int height, std::string& file) = nullptr;
};

/// The codec in use. The target lambent::image makes it OpenImageIO; a program that doesn't link that may assign its
/// own before the first call (the programs in examples/ load OpenImageIO when it is first needed, which takes long).
inline ImageCodec& image_codec() {
    static ImageCodec codec;
    return codec;
}

/// Whether this program can read PNG and JPEG.
inline bool can_read_images() { return image_codec().decode != nullptr; }

#if defined(LAMBENT_HAS_OIIO)
inline namespace LAMBENT_ABI {
namespace detail {

inline std::string oiio_decode(std::string_view file, const char* format, std::uint32_t width, std::uint32_t height,
                               std::uint8_t* rgba) try {
    const auto input = OIIO::ImageInput::create(format);
    if (input == nullptr) return std::string("OpenImageIO has no reader '") + format + "'";
    OIIO::Filesystem::IOMemReader memory(const_cast<char*>(file.data()), file.size()); // it only reads
    OIIO::ImageSpec config, spec;
    config.attribute("oiio:UnassociatedAlpha", 1);
    if (!input->set_ioproxy(&memory) || !input->open(std::string("memory.") + format, spec, config))
        return input->geterror();
    if (std::uint32_t(spec.width) != width || std::uint32_t(spec.height) != height || spec.depth != 1 ||
        spec.nchannels < 1 || spec.nchannels > 4)
        return "OpenImageIO finds another size or number of channels";
    const int channels = spec.nchannels;
    if (!input->read_image(0, 0, 0, channels, OIIO::TypeDesc::UINT8, rgba, 4)) return input->geterror();
    for (std::size_t i = 0; channels < 4 && i < std::size_t(width) * height; ++i) {
        std::uint8_t* p = rgba + 4 * i;
        p[3] = channels == 2 ? p[1] : std::uint8_t(255);
        if (channels < 3) p[1] = p[2] = p[0];
    }
    return {};
} catch (const std::exception& error) {
    return error.what();
}

inline std::string oiio_encode_png(const std::uint8_t* rgb, int width, int height, std::string& file) try {
    const auto output = OIIO::ImageOutput::create("png");
    if (output == nullptr) return "OpenImageIO cannot write PNG";
    std::vector<unsigned char> bytes;
    OIIO::Filesystem::IOVecOutput memory(bytes);
    const OIIO::ImageSpec spec(width, height, 3, OIIO::TypeDesc::UINT8);
    if (!output->set_ioproxy(&memory) || !output->open("memory.png", spec) ||
        !output->write_image(OIIO::TypeDesc::UINT8, rgb) || !output->close())
        return output->geterror();
    file.assign(bytes.begin(), bytes.end());
    return {};
} catch (const std::exception& error) {
    return error.what();
}

inline const bool oiio_in_use = [] {
    if (!can_read_images()) image_codec() = {oiio_decode, oiio_encode_png};
    return true;
}();

} // namespace detail
} // namespace LAMBENT_ABI
#endif

} // namespace lambent
