#pragma once
#include <lambent/core/error.hpp>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// What the header of one part of an EXR file claims.
struct ExrHeader {
    struct Channel {
        std::string name;
        std::uint32_t bytes = 0; ///< of a value: 2 or 4
        bool full = true;        ///< a value for every pixel
    };
    struct Box {
        std::int64_t x0 = 0, y0 = 0, x1 = -1, y1 = -1; ///< both ends belong to it
        std::int64_t width() const { return x1 - x0 + 1; }
        std::int64_t height() const { return y1 - y0 + 1; }
    };
    std::vector<Channel> channels;
    Box data, display;
    std::string name;
    bool tiled = false, deep = false;
    std::uint32_t compression = 0, tile_width = 0, tile_height = 0, tile_mode = 0;

    bool has(std::string_view channel) const {
        return std::any_of(channels.begin(), channels.end(),
                           [&](const Channel& c) { return c.full && c.name == channel; });
    }
};

/// Little-endian numbers and texts at the front of an EXR header, taken off one by one.
class ExrBytes {
public:
    explicit ExrBytes(std::string_view bytes) : bytes_(bytes) {}

    std::size_t left() const { return bytes_.size(); }
    std::string_view take(std::size_t n) {
        require(n <= bytes_.size(), "it is cut short within its header");
        const std::string_view piece = bytes_.substr(0, n);
        bytes_.remove_prefix(n);
        return piece;
    }
    std::uint32_t u8() { return std::uint32_t(static_cast<unsigned char>(take(1)[0])); }
    std::uint32_t u32() {
        const std::uint32_t a = u8(), b = u8(), c = u8(), d = u8();
        return a | b << 8 | c << 16 | d << 24;
    }
    /// Up to the zero byte, which goes too.
    std::string_view text() {
        const std::size_t end = bytes_.find('\0');
        require(end != bytes_.npos && end <= 255, "a name in its header does not end");
        const std::string_view value = take(end);
        take(1);
        return value;
    }

private:
    std::string_view bytes_;
};

inline ExrHeader::Box exr_box(ExrBytes in) {
    std::array<std::int32_t, 4> n{};
    for (std::int32_t& i : n) i = std::int32_t(in.u32());
    return {n[0], n[1], n[2], n[3]};
}

inline std::vector<ExrHeader::Channel> exr_channels(ExrBytes in) {
    std::vector<ExrHeader::Channel> channels;
    for (std::string_view name = in.text(); !name.empty(); name = in.text()) {
        const std::uint32_t type = in.u32();
        require(type <= 2, [&] {
            return "channel '" + std::string(name) + "' is of the unknown type " + std::to_string(type);
        });
        in.u32(); // perceptual linearity, of no concern
        const std::uint32_t x = in.u32(), y = in.u32();
        require(x > 0 && y > 0, [&] { return "channel '" + std::string(name) + "' has a sampling rate of 0"; });
        channels.push_back({std::string(name), type == 1 ? 2u : 4u, x == 1 && y == 1});
    }
    require(in.left() == 0, "bytes follow its list of channels");
    return channels;
}

/// The sizes of OpenEXR's own types of attributes, which it reads whatever size the file states.
struct ExrTypeSize {
    std::string_view type;
    std::uint32_t bytes;
};
inline constexpr ExrTypeSize exr_type_sizes[] = {
    {"box2f", 16}, {"box2i", 16}, {"chromaticities", 32}, {"compression", 1}, {"deepImageState", 1}, {"double", 8},
    {"envmap", 1}, {"float", 4},  {"int", 4},             {"keycode", 28},    {"lineOrder", 1},      {"m33d", 72},
    {"m33f", 36},  {"m44d", 128}, {"m44f", 64},           {"rational", 8},    {"tiledesc", 9},       {"timecode", 8},
    {"v2d", 16},   {"v2f", 8},    {"v2i", 8},             {"v3d", 24},        {"v3f", 12},           {"v3i", 12}};

/// Fails where an attribute's bytes are not those that OpenEXR will read: it would take what follows for the header.
inline void check_exr_attribute(std::string_view name, std::string_view type, std::string_view value) {
    bool good = true;
    for (const ExrTypeSize& known : exr_type_sizes)
        if (type == known.type) good = value.size() == known.bytes;
    if (type == "chlist") exr_channels(ExrBytes(value));
    if (type == "preview") {
        ExrBytes preview(value);
        const std::uint64_t width = preview.u32(), height = preview.u32();
        good = (height == 0 || width < (std::uint64_t(1) << 32) / height) && preview.left() == 4 * width * height;
    }
    require(good, [&] {
        return "header attribute '" + std::string(name) + "' has " + std::to_string(value.size()) +
               " bytes, which is wrong for its type '" + std::string(type) + "'";
    });
}

/// One part's attributes, up to the empty name behind them. `empty` says that there were none: the list of parts ends.
inline ExrHeader exr_part_header(ExrBytes& in, bool& empty) {
    ExrHeader header;
    empty = true;
    for (std::string_view name = in.text(); !name.empty(); name = in.text()) {
        empty = false;
        const std::string_view type = in.text();
        const std::uint32_t size = in.u32();
        require(size <= in.left(), [&] {
            return "header attribute '" + std::string(name) + "' claims " + std::to_string(size) + " bytes, " +
                   std::to_string(in.left()) + " are left";
        });
        const std::string_view value = in.take(size);
        check_exr_attribute(name, type, value);
        if (name == "channels" && type == "chlist") header.channels = exr_channels(ExrBytes(value));
        if (name == "dataWindow" && type == "box2i") header.data = exr_box(ExrBytes(value));
        if (name == "displayWindow" && type == "box2i") header.display = exr_box(ExrBytes(value));
        if (name == "compression" && type == "compression") header.compression = ExrBytes(value).u8();
        if (name == "name" && type == "string") header.name = value;
        if (name == "type" && type == "string") {
            header.tiled = value == "tiledimage" || value == "deeptile";
            header.deep = value == "deepscanline" || value == "deeptile";
            require(header.deep || header.tiled || value == "scanlineimage",
                    [&] { return "a part is of the unknown type '" + std::string(value.substr(0, 64)) + "'"; });
        }
        if (name == "tiles" && type == "tiledesc") {
            ExrBytes tiles(value);
            header.tile_width = tiles.u32();
            header.tile_height = tiles.u32();
            header.tile_mode = tiles.u8();
        }
    }
    return header;
}

/// How many bytes of pixels one byte of a file can hold at most, by compression: none, RLE, ZIPS, ZIP, PIZ, PXR24, B44,
/// B44A, DWAA, DWAB. Deflate shortens 1032 times at most; PXR24 drops a quarter of a float before; PIZ writes runs of
/// 255 16-bit values as 9 bits; B44A takes 3 bytes for 16 halves; DWA deflates 4 bytes for 64 floats.
inline constexpr std::uint64_t exr_ratios[] = {1, 64, 1032, 1032, 512, 1376, 3, 11, 66048, 66048};
inline constexpr std::uint32_t exr_lines[] = {1, 1, 1, 16, 32, 16, 32, 32, 32, 256}; ///< of a chunk, likewise

/// Number of tiles of all levels.
inline std::uint64_t exr_tiles(const ExrHeader& h) {
    const std::uint64_t width = std::uint64_t(h.data.width()), height = std::uint64_t(h.data.height());
    const bool up = (h.tile_mode >> 4) == 1;
    const auto level_size = [&](std::uint64_t size, int level) {
        const std::uint64_t rounded = up ? (size + (std::uint64_t(1) << level) - 1) >> level : size >> level;
        return std::max<std::uint64_t>(rounded, 1);
    };
    const auto levels = [&](std::uint64_t size) {
        int n = 1;
        while (level_size(size, n - 1) > 1) ++n;
        return n;
    };
    const auto count = [&](std::uint64_t size, std::uint64_t tile, int level) {
        return (level_size(size, level) + tile - 1) / tile;
    };
    const std::uint32_t mode = h.tile_mode & 15;
    const int nx = levels(width), ny = levels(height);
    std::uint64_t tiles = 0;
    if (mode == 0) tiles = count(width, h.tile_width, 0) * count(height, h.tile_height, 0);
    if (mode == 1)
        for (int i = 0; i < std::max(nx, ny); ++i)
            tiles += count(width, h.tile_width, i) * count(height, h.tile_height, i);
    if (mode == 2)
        for (int j = 0; j < ny; ++j)
            for (int i = 0; i < nx; ++i) tiles += count(width, h.tile_width, i) * count(height, h.tile_height, j);
    return tiles;
}

/// Fails on claims that a file of so many bytes can't keep, or that go over max_pixels: OpenEXR would allocate by them.
inline void check_exr_header(const ExrHeader& h, std::uint64_t file_bytes, std::uint64_t max_pixels) {
    const std::int64_t width = h.data.width(), height = h.data.height();
    const auto size = [&] { return std::to_string(width) + " x " + std::to_string(height); };
    require(width > 0 && height > 0 && std::uint64_t(height) <= max_pixels / std::uint64_t(width), [&] {
        return "its size, " + size() + ", is not between 1 and the limit of " + std::to_string(max_pixels) + " pixels";
    });
    require(h.compression < std::size(exr_ratios),
            [&] { return "compression " + std::to_string(h.compression) + " is unknown"; });
    require(!h.channels.empty(), "a part has no channels");
    require(!h.tiled || (h.tile_width > 0 && h.tile_height > 0 && (h.tile_mode & 15) <= 2 && (h.tile_mode >> 4) <= 1),
            [&] {
                return "tiles of " + std::to_string(h.tile_width) + " x " + std::to_string(h.tile_height) +
                       " pixels in mode " + std::to_string(h.tile_mode) + " are none";
            });
    const std::uint64_t lines = exr_lines[h.compression];
    const std::uint64_t chunks = h.tiled ? exr_tiles(h) : (std::uint64_t(height) + lines - 1) / lines;
    require(chunks <= file_bytes / 16, [&] { // each has its offset in a table, and a head
        return "a file of " + std::to_string(file_bytes) + " bytes claims " + std::to_string(chunks) + " chunks";
    });
    std::uint64_t pixel_bytes = 0;
    for (const ExrHeader::Channel& c : h.channels) pixel_bytes += c.full ? c.bytes : 0;
    const double pixels = h.tiled ? std::max(double(width) * double(height), double(h.tile_width) * double(h.tile_height))
                                  : double(width) * double(std::max(std::uint64_t(height), lines));
    constexpr double buffers = 1 << 24; // a small image may have large tiles or chunks
    require(pixels * double(pixel_bytes) <= buffers + double(exr_ratios[h.compression]) * double(file_bytes), [&] {
        return "a file of " + std::to_string(file_bytes) + " bytes claims " + std::to_string(h.channels.size()) +
               " channels of " + size() + " pixels" +
               (h.tiled ? " in tiles of " + std::to_string(h.tile_width) + " x " + std::to_string(h.tile_height) : "");
    });
}

/// The headers of all parts, with claims that the file can keep.
/// throws lambent::Error (without the file's name) on damaged headers, more than max_pixels in a part, or more pixels
///         than so many bytes can hold
/// source OpenEXR file layout, openexr.com
inline std::vector<ExrHeader> exr_headers(std::string_view file, std::uint64_t max_pixels) {
    ExrBytes in(file);
    require(in.u32() == 20000630, "not an EXR image");
    const std::uint32_t version = in.u32();
    require((version & 0xff) == 2 && (version & ~0x1effu) == 0,
            [&] { return "an EXR file of the unknown version " + std::to_string(version); });
    const bool many = (version & 0x1000) != 0;
    std::vector<ExrHeader> headers;
    for (bool end = false;;) {
        ExrHeader header = exr_part_header(in, end);
        if (end) break;
        if ((version & 0x200) != 0 && !many) header.tiled = true;
        if ((version & 0x800) != 0 && !many) header.deep = true;
        check_exr_header(header, file.size(), max_pixels);
        headers.push_back(std::move(header));
        if (!many) break;
    }
    require(!headers.empty(), "it has no parts");
    return headers;
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
