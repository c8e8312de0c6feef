#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/vec.hpp>
#include <lambent/io/image_format.hpp>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Linear RGB, row 0 at the top.
struct HdrImage {
    int width = 0, height = 0;
    std::vector<Vec3f> pixels;
};

namespace detail {

/// Takes the first line off, without its end ("\n" or "\r\n").
inline std::string_view take_hdr_line(std::string_view& bytes, const std::string& name) {
    const std::size_t end = bytes.find('\n');
    require(end != bytes.npos, [&] { return name + ": the HDR file ends within its header"; });
    std::string_view line = bytes.substr(0, end);
    bytes.remove_prefix(end + 1);
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
}

/// How pixels follow each other: "-Y 512 +X 1024" is the usual order, rows from the top.
struct HdrOrder {
    char axis[2];     ///< of the scan lines, and within one
    bool positive[2]; ///< likewise; +Y is up, +X right
    std::uint32_t count[2];
};

inline HdrOrder hdr_order(std::string_view line, const std::string& name) {
    HdrOrder order{};
    const char* at = line.data();
    const char* const end = at + line.size();
    bool good = true;
    for (int i = 0; i < 2 && good; ++i) {
        good = end - at > 3 && (at[0] == '+' || at[0] == '-') && (at[1] == 'X' || at[1] == 'Y') && at[2] == ' ';
        if (!good) break;
        order.positive[i] = at[0] == '+';
        order.axis[i] = at[1];
        const auto [next, error] = std::from_chars(at + 3, end, order.count[i]);
        good = error == std::errc() && (i == 1 ? next == end : next != end && *next == ' ');
        at = next + (i == 0 ? 1 : 0);
    }
    require(good && order.axis[0] != order.axis[1],
            [&] { return name + ": an HDR file needs its size as '-Y height +X width', not '" +
                         std::string(line.substr(0, 80)) + "'"; });
    return order;
}

/// One scan line of RGBE, run-length encoded by channel or plain, taken off `bytes`.
/// source G. Ward, Real Pixels, Graphics Gems II; Radiance's color.c
inline void take_hdr_scanline(std::string_view& bytes, std::vector<std::uint8_t>& rgbe, const std::string& name) {
    const std::size_t width = rgbe.size() / 4;
    const auto byte = [&](std::size_t i) { return std::uint8_t(bytes[i]); };
    const auto need = [&](std::size_t n) {
        require(bytes.size() >= n, [&] { return name + ": the HDR file is cut short"; });
    };
    need(4);
    const bool encoded = width >= 8 && width < 32768 && byte(0) == 2 && byte(1) == 2 && byte(2) < 128;
    if (!encoded) {
        need(4 * width);
        for (std::size_t i = 0; i < 4 * width; ++i) rgbe[i] = byte(i);
        for (std::size_t x = 0; x < width; ++x) // no colour is written so: its greatest part is 128 or more
            require(rgbe[4 * x] != 1 || rgbe[4 * x + 1] != 1 || rgbe[4 * x + 2] != 1,
                    [&] { return name + ": an HDR file with the run lengths of before 1991, which are not supported"; });
        bytes.remove_prefix(4 * width);
        return;
    }
    require((std::size_t(byte(2)) << 8 | byte(3)) == width,
            [&] { return name + ": a damaged HDR file: the length of a scan line is wrong"; });
    bytes.remove_prefix(4);
    for (std::size_t c = 0; c < 4; ++c)
        for (std::size_t x = 0; x < width;) {
            need(2);
            const bool run = byte(0) > 128;
            const std::size_t n = run ? byte(0) - 128u : byte(0);
            require(n > 0 && n <= width - x, [&] { return name + ": a damaged HDR file: a run leaves its scan line"; });
            need(run ? 2 : 1 + n);
            for (std::size_t i = 0; i < n; ++i, ++x) rgbe[4 * x + c] = byte(run ? 1 : 1 + i);
            bytes.remove_prefix(run ? 2 : 1 + n);
        }
}

} // namespace detail

/// Decodes a Radiance HDR file (RGBE) in memory: mantissa · 2^(exponent - 136), all eight orders of pixels. EXPOSURE,
/// GAMMA and PRIMARIES are ignored, as everywhere.
/// throws lambent::Error with `name` on a file cut short or damaged, XYZE, more than max_pixels, or more pixels than
///         that many bytes can hold (16 a byte); the size is checked before anything is allocated
inline HdrImage decode_hdr(std::string_view bytes, const std::string& name,
                           std::size_t max_pixels = std::size_t(1) << 28) {
    require(bytes.starts_with("#?"), [&] { return name + ": not a Radiance HDR image"; });
    for (std::string_view line = "#?"; !line.empty();) {
        line = detail::take_hdr_line(bytes, name);
        require(!line.starts_with("FORMAT=") || line == "FORMAT=32-bit_rle_rgbe", [&] {
            return name + ": an HDR file of " + std::string(line.substr(0, 80)) + "; allowed is FORMAT=32-bit_rle_rgbe";
        });
    }
    const detail::HdrOrder order = detail::hdr_order(detail::take_hdr_line(bytes, name), name);
    const bool rows = order.axis[0] == 'Y';
    const std::uint32_t lines = order.count[0], length = order.count[1];
    const std::uint32_t width = rows ? length : lines, height = rows ? lines : length;
    detail::require_image_size(name, width, height, max_pixels);
    const std::uint64_t plain = 4 * std::uint64_t(length), encoded = 4 + 8 * ((std::uint64_t(length) + 126) / 127);
    const bool may_encode = length >= 8 && length < 32768 && encoded < plain;
    detail::require_image_bytes(name, width, height, lines * (may_encode ? encoded : plain), bytes.size());

    HdrImage image{int(width), int(height), std::vector<Vec3f>(std::size_t(width) * height)};
    std::vector<std::uint8_t> rgbe(4 * std::size_t(length));
    for (std::uint32_t i = 0; i < lines; ++i) {
        detail::take_hdr_scanline(bytes, rgbe, name);
        for (std::uint32_t k = 0; k < length; ++k) {
            std::uint32_t x = rows ? k : i, y = rows ? i : k;
            if (!order.positive[rows ? 1 : 0]) x = width - 1 - x;
            if (order.positive[rows ? 0 : 1]) y = height - 1 - y;
            const std::uint8_t* p = &rgbe[4 * std::size_t(k)];
            const float unit = p[3] == 0 ? 0.0f : std::ldexp(1.0f, int(p[3]) - 136);
            image.pixels[std::size_t(y) * width + x] = Vec3f(float(p[0]), float(p[1]), float(p[2])) * unit;
        }
    }
    return image;
}

} // namespace LAMBENT_ABI
} // namespace lambent
