#pragma once
#include <lambent/core/error.hpp>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// The formats that are read; all others are known by name only.
enum class ImageFormat : std::uint8_t { png, jpeg, hdr, exr, other };

/// A format and the bytes by which it is known.
struct ImageMagic {
    ImageFormat format;
    const char* name;
    std::size_t offset;
    std::string_view bytes;
};

inline constexpr ImageMagic image_magics[] = {
    {ImageFormat::png, "PNG", 0, "\x89PNG\r\n\x1a\n"},
    {ImageFormat::jpeg, "JPEG", 0, "\xff\xd8\xff"},
    {ImageFormat::hdr, "Radiance HDR", 0, "#?RADIANCE"},
    {ImageFormat::hdr, "Radiance HDR", 0, "#?RGBE"},
    {ImageFormat::exr, "EXR", 0, "\x76\x2f\x31\x01"},
    {ImageFormat::other, "KTX", 0, "\xabKTX 11\xbb"},
    {ImageFormat::other, "KTX2", 0, "\xabKTX 20\xbb"},
    {ImageFormat::other, "Basis Universal", 0, {"sB\x13\0", 4}},
    {ImageFormat::other, "DDS", 0, "DDS "},
    {ImageFormat::other, "WebP", 8, "WEBP"},
    {ImageFormat::other, "AVIF", 4, "ftypavif"},
    {ImageFormat::other, "HEIF", 4, "ftyphei"},
    {ImageFormat::other, "HEIF", 4, "ftypmif1"},
    {ImageFormat::other, "GIF", 0, "GIF8"},
    {ImageFormat::other, "TIFF", 0, {"II*\0", 4}},
    {ImageFormat::other, "TIFF", 0, {"MM\0*", 4}},
    {ImageFormat::other, "BigTIFF", 0, {"II+\0", 4}},
    {ImageFormat::other, "BigTIFF", 0, {"MM\0+", 4}},
    {ImageFormat::other, "PSD", 0, "8BPS"},
    {ImageFormat::other, "JPEG 2000", 4, "jP  \r\n\x87\n"},
    {ImageFormat::other, "JPEG 2000", 0, "\xff\x4f\xff\x51"},
    {ImageFormat::other, "JPEG XL", 0, "\xff\x0a"},
    {ImageFormat::other, "JPEG XL", 4, "JXL \r\n\x87\n"},
    {ImageFormat::other, "QOI", 0, "qoif"},
    {ImageFormat::other, "ICO", 0, {"\0\0\1\0", 4}},
    {ImageFormat::other, "BMP", 0, "BM"},
    {ImageFormat::other, "PBM", 0, "P4\n"},
    {ImageFormat::other, "PGM", 0, "P5\n"},
    {ImageFormat::other, "PPM", 0, "P6\n"},
    {ImageFormat::other, "PFM", 0, "PF\n"},
    {ImageFormat::other, "SVG", 0, "<svg"},
    {ImageFormat::other, "XML", 0, "<?xml"},
    {ImageFormat::other, "HTML", 0, "<!DOCTYPE html"},
    {ImageFormat::other, "Git LFS pointer", 0, "version https://git-lfs"},
};

/// What the first bytes say (TGA: the last ones); nullptr where they say nothing. Names of files lie.
inline const ImageMagic* image_magic(std::string_view bytes) {
    for (const ImageMagic& magic : image_magics)
        if (bytes.size() >= magic.offset && bytes.substr(magic.offset).starts_with(magic.bytes)) return &magic;
    static constexpr ImageMagic tga{ImageFormat::other, "TGA", 0, {}};
    constexpr std::string_view tga_end{"TRUEVISION-XFILE.\0", 18};
    return bytes.ends_with(tga_end) ? &tga : nullptr;
}

/// The format of an image of which only `allowed` ("PNG and JPEG") can be used here.
/// throws lambent::Error with `name` on an empty or unknown one, naming the format where it is known
inline ImageFormat image_format(std::string_view bytes, const std::string& name, const char* allowed) {
    require(!bytes.empty(), [&] { return name + ": an image of zero bytes"; });
    const ImageMagic* magic = image_magic(bytes);
    require(magic != nullptr, [&] { return name + ": no known image format; supported are " + allowed; });
    require(magic->format != ImageFormat::other,
            [&] { return name + ": " + magic->name + " images are not supported, only " + allowed; });
    return magic->format;
}

/// Fails unless 0 < width, height and their product <= max_pixels.
inline void require_image_size(const std::string& name, std::uint64_t width, std::uint64_t height,
                               std::uint64_t max_pixels) {
    require(width > 0 && height > 0 && height <= max_pixels / width, [&] {
        return name + ": an image of " + std::to_string(width) + " x " + std::to_string(height) +
               " pixels; allowed are 1 to " + std::to_string(max_pixels);
    });
}

/// Fails where a file claims more pixels than its format's densest packing can put into its bytes, and where over
/// 2^26 pixels (8192 x 8192, a second of decoding) have less than a byte for each 64: photographs and paintings of that
/// size have ten times as much, pictures made to fill memory a hundredth.
inline void require_image_bytes(const std::string& name, std::uint64_t width, std::uint64_t height,
                                std::uint64_t least, std::uint64_t bytes) {
    if (width * height > std::uint64_t(1) << 26) least = std::max(least, width * height / 64);
    require(bytes >= least, [&] {
        return name + ": claims " + std::to_string(width) + " x " + std::to_string(height) + " pixels in " +
               std::to_string(bytes) + " bytes of data; allowed are " + std::to_string(least) + " or more";
    });
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
