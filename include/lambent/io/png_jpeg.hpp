#pragma once
#include <lambent/core/error.hpp>
#include <lambent/io/image_format.hpp>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// What a decoder is given: an image whose outer structure was checked, and stripped of all that says nothing of
/// pixels: profiles, thumbnails, Exif. Decoders see less to stumble over, and have less to say on stderr.
struct BareImage {
    std::uint32_t width = 0, height = 0;
    std::string bytes;
};

/// Big-endian numbers at the front of a piece of a file, taken off one by one; a piece that is too short fails.
class BigEndianReader {
public:
    BigEndianReader(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(&name) {}

    std::size_t left() const { return bytes_.size(); }
    std::string_view take(std::size_t n) {
        require(n <= bytes_.size(), [&] { return *name_ + ": the image is cut short"; });
        const std::string_view piece = bytes_.substr(0, n);
        bytes_.remove_prefix(n);
        return piece;
    }
    std::uint32_t number(std::size_t n) {
        std::uint32_t value = 0;
        for (const char c : take(n)) value = value << 8 | static_cast<unsigned char>(c);
        return value;
    }

private:
    std::string_view bytes_;
    const std::string* name_;
};

/// CRC-32 of PNG (ISO 3309).
inline std::uint32_t crc32(std::string_view bytes) {
    static constexpr auto table = [] {
        std::array<std::uint32_t, 256> t{};
        for (std::uint32_t i = 0; i < 256; ++i) {
            t[i] = i;
            for (int bit = 0; bit < 8; ++bit) t[i] = (t[i] & 1) != 0 ? 0xedb88320u ^ t[i] >> 1 : t[i] >> 1;
        }
        return t;
    }();
    std::uint32_t crc = 0xffffffffu;
    for (const char c : bytes) crc = table[(crc ^ static_cast<unsigned char>(c)) & 0xff] ^ crc >> 8;
    return ~crc;
}

/// IHDR, PLTE, tRNS, IDAT and IEND of a PNG file, checked as far as that goes without inflating anything.
/// throws lambent::Error on wrong checksums, order or numbers, a file cut short, more than max_pixels, or fewer bytes
///         than deflate can make of that many pixels (it shortens 1032 times at most)
/// source PNG specification, third edition, §5 and §11
inline BareImage bare_png(std::string_view file, const std::string& name, std::size_t max_pixels) {
    BigEndianReader in(file.substr(8), name);
    BareImage image;
    image.bytes.reserve(file.size());
    image.bytes.append(file.substr(0, 8));
    std::uint32_t bits = 0, color = 0, palette = 0;
    std::uint64_t data = 0;
    for (std::string_view type; type != "IEND";) {
        const std::uint32_t size = in.number(4);
        const std::string_view body = in.take(std::size_t(size) + 4);
        const std::uint32_t crc = in.number(4);
        type = body.substr(0, 4);
        const bool first = image.width == 0;
        const auto wrong = [&](const std::string& what) { fail(name + ": PNG chunk " + std::string(type) + what); };
        for (const char c : type)
            require((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'), [&] { return name + ": damaged PNG chunks"; });
        if (first != (type == "IHDR")) wrong(first ? " comes before IHDR" : " comes twice");
        const bool critical = type[0] < 'a';
        if (!critical && type != "tRNS") continue;
        if (crc32(body) != crc) wrong(" has a wrong checksum");
        if (type == "IHDR") {
            if (size != 13) wrong(" has " + std::to_string(size) + " bytes instead of 13");
            BigEndianReader header(body.substr(4), name);
            image.width = header.number(4);
            image.height = header.number(4);
            require_image_size(name, image.width, image.height, max_pixels);
            bits = header.number(1);
            color = header.number(1);
            const std::uint32_t methods = header.number(2), interlace = header.number(1);
            constexpr std::uint32_t bits_of[] = {1 | 2 | 4 | 8 | 16, 0, 8 | 16, 1 | 2 | 4 | 8, 8 | 16, 0, 8 | 16};
            if (color > 6 || bits == 0 || (bits_of[color] & bits) != bits || (bits & (bits - 1)) != 0)
                wrong(" has colour type " + std::to_string(color) + " with " + std::to_string(bits) + " bits");
            if (methods != 0 || interlace > 1) wrong(" asks for an unknown method");
        } else if (type == "PLTE") {
            if (palette != 0 || data != 0) wrong(" is out of place");
            if (size == 0 || size > 768 || size % 3 != 0) wrong(" has " + std::to_string(size) + " bytes");
            palette = size / 3;
            if (color != 3) continue; // a suggestion only
        } else if (type == "tRNS") {
            const std::uint32_t most = color == 0 ? 2 : color == 2 ? 6 : color == 3 ? palette : 0;
            if (data != 0 || size == 0 || size > most || (color != 3 && size != most)) continue; // as libpng does
        } else if (type == "IDAT") {
            if (color == 3 && palette == 0) wrong(" comes before a palette");
            data += size;
        } else if (type != "IEND") {
            wrong(" is unknown");
        }
        image.bytes.append(body.data() - 4, std::size_t(size) + 12);
    }
    constexpr std::uint32_t channels[] = {1, 0, 3, 1, 2, 0, 4};
    const std::uint64_t raw = std::uint64_t(image.width) * image.height * channels[color] * bits / 8;
    require_image_bytes(name, image.width, image.height, raw / 1032 + 1, data);
    return image;
}

/// The segments of a JPEG file that tell of pixels, checked as far as that goes without decoding anything. Baseline
/// and progressive Huffman coding, 8 bits, 1, 3 or 4 components.
/// throws lambent::Error on other kinds, a file cut short (no EOI), more than max_pixels, more than 64 scans, or fewer
///         bytes than the blocks of 8 x 8 pixels take (2 bits each; progressive: 1)
/// source  ITU-T T.81, annexes B, F, G
inline BareImage bare_jpeg(std::string_view file, const std::string& name, std::size_t max_pixels) {
    BigEndianReader in(file, name);
    BareImage image;
    image.bytes.reserve(file.size());
    image.bytes.append(in.take(2));
    std::uint64_t blocks = 0;
    bool progressive = false;
    int scans = 0;
    for (;;) {
        const std::size_t at = file.size() - in.left();
        require(in.number(1) == 0xff, [&] { return name + ": damaged JPEG segments at byte " + std::to_string(at); });
        std::uint32_t marker = 0xff;
        while (marker == 0xff) marker = in.number(1); // fill bytes
        image.bytes.append({'\xff', char(marker)});
        if (marker == 0xd9) break; // EOI
        if (marker == 0x01 || (marker >= 0xd0 && marker <= 0xd7)) continue; // TEM, RST: alone
        const std::uint32_t size = in.number(2);
        require(size >= 2, [&] { return name + ": damaged JPEG segments at byte " + std::to_string(at); });
        const std::string_view body = in.take(size - 2);
        const bool application = (marker >= 0xe1 && marker <= 0xef && marker != 0xee) || marker == 0xfe;
        if (application) { // but for JFIF's and Adobe's, which tell of colours
            image.bytes.resize(image.bytes.size() - 2);
            continue;
        }
        image.bytes.append(body.data() - 2, size);
        const bool frame = marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
        if (frame) {
            require(marker <= 0xc2, [&] { return name + ": a JPEG that is lossless, hierarchical or arithmetic-coded"; });
            require(image.width == 0, [&] { return name + ": a JPEG with several frames"; });
            progressive = marker == 0xc2;
            BigEndianReader header(body, name);
            const std::uint32_t bits = header.number(1);
            image.height = header.number(2);
            image.width = header.number(2);
            const std::uint32_t components = header.number(1);
            require_image_size(name, image.width, image.height, max_pixels);
            require(bits == 8 && (components == 1 || components == 3 || components == 4), [&] {
                return name + ": a JPEG of " + std::to_string(components) + " components of " + std::to_string(bits) +
                       " bits; allowed are 1, 3 or 4 of 8";
            });
            std::array<std::uint32_t, 4> h{}, v{};
            std::uint32_t h_max = 1, v_max = 1;
            for (std::uint32_t i = 0; i < components; ++i) {
                header.number(1);
                const std::uint32_t factors = header.number(1);
                header.number(1);
                h[i] = components == 1 ? 1 : factors >> 4;
                v[i] = components == 1 ? 1 : factors & 15;
                require(h[i] >= 1 && h[i] <= 4 && v[i] >= 1 && v[i] <= 4,
                        [&] { return name + ": a JPEG with a sampling factor out of 1 to 4"; });
                h_max = h[i] > h_max ? h[i] : h_max;
                v_max = v[i] > v_max ? v[i] : v_max;
            }
            const auto eighths = [](std::uint64_t n, std::uint32_t factor, std::uint32_t most) {
                return ((n * factor + most - 1) / most + 7) / 8;
            };
            for (std::uint32_t i = 0; i < components; ++i)
                blocks += eighths(image.width, h[i], h_max) * eighths(image.height, v[i], v_max);
        } else if (marker == 0xda) { // SOS: entropy-coded bytes follow, up to the next marker but RST
            require(image.width != 0, [&] { return name + ": a JPEG scan before its frame"; });
            require(++scans <= 64, [&] { return name + ": a JPEG of more than 64 scans"; });
            const std::size_t from = file.size() - in.left();
            std::size_t to = file.find('\xff', from);
            const auto belongs = [&](unsigned char next) { return next == 0 || (next >= 0xd0 && next <= 0xd7); };
            while (to != file.npos && to + 1 < file.size() && belongs(static_cast<unsigned char>(file[to + 1])))
                to = file.find('\xff', to + 2);
            require(to != file.npos, [&] { return name + ": the image is cut short"; });
            image.bytes.append(in.take(to - from));
        }
    }
    require(scans > 0, [&] { return name + ": a JPEG without a scan"; });
    require_image_bytes(name, image.width, image.height, blocks * (progressive ? 1 : 2) / 8, file.size());
    return image;
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
