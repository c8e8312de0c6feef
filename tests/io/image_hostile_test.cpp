#include <lambent/io/environment.hpp>
#include <lambent/io/hdr.hpp>
#include <lambent/io/image.hpp>
#include <io/image_files.hpp>
#include <support/skip.hpp>
#include <support/temporary_folder.hpp>
#include <doctest/doctest.h>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>
#if __has_include(<sys/stat.h>)
#include <sys/stat.h>
#endif

using namespace lambent;
using namespace lambent_test;

namespace {

/// What decoding says: its error, or "read".
std::string said(const std::function<void()>& decode) {
    try {
        decode();
    } catch (const Error& error) {
        return error.what();
    }
    return "read";
}
std::string texture(const std::string& bytes, std::size_t max_pixels = std::size_t(1) << 28) {
    return said([&] { decode_texture(bytes, "t", max_pixels); });
}
std::string hdr(const std::string& bytes, std::size_t max_pixels = std::size_t(1) << 28) {
    return said([&] { decode_hdr(bytes, "t", max_pixels); });
}
/// What a program without a codec says of a good file.
const std::string good = can_read_images() ? "read" : "t: this program was built without OpenImageIO";
void check_good(const std::string& found) { CHECK(found.substr(0, good.size()) == good); }

constexpr std::size_t frame_at = 89; ///< of 0xff 0xc0: marker, length, bits, height, width, components, …

std::string with(std::string bytes, std::size_t at, const std::string& by) { return bytes.replace(at, by.size(), by); }

} // namespace

TEST_CASE("hostile PNG: structure, numbers and claims are checked before libpng sees them") {
    const std::string raw = std::string("\0\1\2\3\4\5\6\0\7\x8\x9\xa\xb\xc", 14); // 2 x 2 RGB
    const std::string whole = png_file(png_header(2, 2), raw);
    check_good(texture(whole));
    for (std::size_t size = 8; size < whole.size(); ++size)
        CHECK(texture(whole.substr(0, size)) == "t: the image is cut short");
    for (std::size_t at = 8; at < whole.size(); ++at) { // any bit: the checksum, or a length, tells
        if (at >= whole.size() - 12) continue;          // the end is the end
        CAPTURE(at);
        CHECK(texture(with(whole, at, std::string(1, char(whole[at] ^ 0x10)))) != texture(whole));
    }
    CHECK(texture(png_magic + png_header(2, 2) + png_end).find("in 0 bytes") != std::string::npos);
    const auto head = [&](auto... arguments) {
        return texture(png_file(png_header(std::uint32_t(arguments)...), raw));
    };
    CHECK(head(0, 2) == "t: an image of 0 x 2 pixels; allowed are 1 to 268435456");
    CHECK(head(60000, 60000) == "t: an image of 60000 x 60000 pixels; allowed are 1 to 268435456");
    CHECK(head(0x7fffffffu, 0x7fffffffu).find("allowed are") != std::string::npos);
    CHECK(head(0xffffffffu, 1).find("allowed are") != std::string::npos);
    CHECK(head(8000, 8000) == "t: claims 8000 x 8000 pixels in 25 bytes of data; allowed are 186047 or more");
    CHECK(texture(png_file(png_header(16000, 16000, 1, 0), std::string(40000, '\0'))) == // 1 s of black a MB otherwise
          "t: claims 16000 x 16000 pixels in 40011 bytes of data; allowed are 4000000 or more");
    CHECK(texture(png_file(png_header(2, 2, 3), raw)) == "t: PNG chunk IHDR has colour type 2 with 3 bits");
    CHECK(texture(png_file(png_header(2, 2, 0), raw)) == "t: PNG chunk IHDR has colour type 2 with 0 bits");
    CHECK(texture(png_file(png_header(2, 2, 8, 7), raw)) == "t: PNG chunk IHDR has colour type 7 with 8 bits");
    CHECK(texture(png_file(png_header(2, 2, 16, 3), raw)) == "t: PNG chunk IHDR has colour type 3 with 16 bits");
    CHECK(texture(png_file(png_header(2, 2, 8, 2, 2), raw)) == "t: PNG chunk IHDR asks for an unknown method");
    CHECK(texture(png_file(png_header(2, 2, 8, 3), raw)) == "t: PNG chunk IDAT comes before a palette");
    CHECK(texture(png_file(png_header(2, 2) + png_header(2, 2), raw)) == "t: PNG chunk IHDR comes twice");
    CHECK(texture(png_file(chunk("PLTE", "abc") + png_header(2, 2), raw)) == "t: PNG chunk PLTE comes before IHDR");
    CHECK(texture(png_file(png_header(2, 2) + chunk("PLTE", "abcd"), raw)) == "t: PNG chunk PLTE has 4 bytes");
    CHECK(texture(png_file(png_header(2, 2) + chunk("ABCD", ""), raw)) == "t: PNG chunk ABCD is unknown");
    CHECK(texture(png_file(png_header(2, 2) + chunk("\xff\x00zz", ""), raw)) == "t: damaged PNG chunks");
    // What says nothing of pixels is not looked at: a profile and texts that inflate to gigabytes, Exif, wrong sums.
    check_good(
        texture(png_file(png_header(2, 2) + chunk("iCCP", "x") + chunk("zTXt", "k") + chunk("eXIf", "II*"), raw)));
    check_good(texture(png_file(png_header(2, 2) + std::string("\0\0\0\1teXt?none", 13), raw)));
    check_good(texture(png_file(png_header(2, 2) + chunk("tRNS", "odd"), raw))); // a wrong transparency is none
}

TEST_CASE("hostile JPEG: segments and claims are checked before libjpeg sees them") {
    check_good(texture(jpeg_file));
    CHECK(texture(jpeg_file, 127) == "t: an image of 16 x 8 pixels; allowed are 1 to 127");
    for (std::size_t size = 3; size < jpeg_file.size(); ++size) {
        CAPTURE(size);
        CHECK(texture(jpeg_file.substr(0, size)) == "t: the image is cut short");
    }
    REQUIRE(jpeg_file.substr(frame_at, 2) == "\xff\xc0");
    const auto size = [&](std::uint32_t width, std::uint32_t height) {
        return texture(with(jpeg_file, frame_at + 5, big_endian(height, 2) + big_endian(width, 2)));
    };
    CHECK(size(65535, 65535).find("allowed are 1 to 268435456") != std::string::npos);
    CHECK(size(0, 8).find("0 x 8") != std::string::npos);
    CHECK(size(16, 0).find("16 x 0") != std::string::npos); // its height would follow the scan
    CHECK(size(16000, 16000) == "t: claims 16000 x 16000 pixels in 171 bytes of data; allowed are 4000000 or more");
    for (const char marker : {'\xc3', '\xc5', '\xc9', '\xca', '\xcf'})
        CHECK(texture(with(jpeg_file, frame_at + 1, std::string(1, marker))) ==
              "t: a JPEG that is lossless, hierarchical or arithmetic-coded");
    CHECK(texture(with(jpeg_file, frame_at + 4, "\x0c")) ==
          "t: a JPEG of 1 components of 12 bits; allowed are 1, 3 or 4 of 8");
    CHECK(texture(with(jpeg_file, frame_at + 9, "\x02")).find("of 2 components") != std::string::npos);
    CHECK(texture(with(jpeg_file, frame_at + 9, "\x03")) == "t: the image is cut short"); // the segment holds one
    CHECK(texture(with(jpeg_file, 2, "\x01")) == "t: no known image format; supported are PNG and JPEG");
    CHECK(texture(with(jpeg_file, 20, "\x01")) == "t: damaged JPEG segments at byte 20");
    CHECK(texture(with(jpeg_file, 22, std::string(2, '\0'))) == "t: damaged JPEG segments at byte 20");
    CHECK(texture(jpeg_file.substr(0, 20) + "\xff\xd9") == "t: a JPEG without a scan");
    const std::string frame = jpeg_file.substr(frame_at, 13), scan = jpeg_file.substr(151, 10);
    REQUIRE(scan.substr(0, 2) == "\xff\xda");
    CHECK(texture(jpeg_file.substr(0, frame_at) + frame + jpeg_file.substr(frame_at)) ==
          "t: a JPEG with several frames");
    CHECK(texture(jpeg_file.substr(0, frame_at) + scan + "\xff\xd9") == "t: a JPEG scan before its frame");
    std::string scans = jpeg_file.substr(0, jpeg_file.size() - 2);
    for (int i = 0; i < 64; ++i) scans += scan;
    CHECK(texture(scans + "\xff\xd9") == "t: a JPEG of more than 64 scans");
    // Exif, profiles and comments are not looked at.
    check_good(texture(with(jpeg_file, 0, "\xff\xd8")
                           .insert(2, std::string("\xff\xe1\0\x08"
                                                  "Exif\0\xff",
                                                  10) +
                                          std::string("\xff\xfe\0\x03!", 5))));
}

TEST_CASE("images of other formats are refused by name") {
    const auto name = [](std::string_view bytes) { return texture(std::string(bytes)); };
    using namespace std::string_view_literals;
    CHECK(name("") == "t: an image of zero bytes");
    CHECK(name("not an image") == "t: no known image format; supported are PNG and JPEG");
    CHECK(name("\xabKTX 11\xbb\r\n\x1a\n") == "t: KTX images are not supported, only PNG and JPEG");
    CHECK(name("\xabKTX 20\xbb\r\n\x1a\n") == "t: KTX2 images are not supported, only PNG and JPEG");
    CHECK(name("RIFF\x24\0\0\0WEBPVP8 "sv) == "t: WebP images are not supported, only PNG and JPEG");
    for (const auto& [bytes, format] : std::vector<std::pair<std::string_view, std::string>>{
             {"GIF89a\1\0\1\0"sv, "GIF"},
             {"II*\0\x08"sv, "TIFF"},
             {"MM\0*"sv, "TIFF"},
             {"DDS |"sv, "DDS"},
             {"BM\x46\0"sv, "BMP"},
             {"\0\0\2\0 pixels TRUEVISION-XFILE.\0"sv, "TGA"},
             {"\0\0\1\0\1"sv, "ICO"},
             {"\0\0\0\x20"
              "ftypavif"sv,
              "AVIF"},
             {"\0\0\0\x0cjP  \r\n\x87\n"sv, "JPEG 2000"},
             {"qoif"sv, "QOI"},
             {"8BPS\0\1"sv, "PSD"},
             {"P6\n1 1\n255\n"sv, "PPM"},
             {"<svg xmlns"sv, "SVG"},
             {"version https://git-lfs.github.com/spec/v1\n"sv, "Git LFS pointer"}})
        CHECK(name(bytes) == "t: " + format + " images are not supported, only PNG and JPEG");
    CHECK(name("#?RADIANCE\n") == "t: EXR and Radiance HDR images are read as environments only");
    CHECK(name("\x76\x2f\x31\x01") == "t: EXR and Radiance HDR images are read as environments only");
}

TEST_CASE("Radiance HDR: every order of pixels, plain and run-length encoded, against its definition") {
    const auto pixel = [](int x, int y) { // red says where it is
        return std::string{char(128 + 16 * y + x), char(64), char(1), char(130)};
    };
    for (const int mirror : {0, 1, 2, 3})
        for (const bool rows : {true, false}) {
            const std::string sign_y = mirror & 1 ? "+Y" : "-Y", sign_x = mirror & 2 ? "-X" : "+X";
            const int width = 3, height = 2, lines = rows ? height : width, length = rows ? width : height;
            std::string bytes = "#?RADIANCE\r\n# a comment\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\n\n";
            bytes += rows ? sign_y + " 2 " + sign_x + " 3\n" : sign_x + " 3 " + sign_y + " 2\n";
            for (int i = 0; i < lines; ++i)
                for (int k = 0; k < length; ++k) {
                    const int x = rows ? k : i, y = rows ? i : k;
                    bytes += pixel(mirror & 2 ? width - 1 - x : x, mirror & 1 ? height - 1 - y : y);
                }
            const HdrImage image = decode_hdr(bytes, "t");
            REQUIRE(image.width == 3);
            REQUIRE(image.height == 2);
            for (int y = 0; y < 2; ++y)
                for (int x = 0; x < 3; ++x)
                    CHECK(image.pixels[std::size_t(3 * y + x)] == Vec3f(float(128 + 16 * y + x), 64, 1) / 64.0f);
        }
    const std::string head = "#?RGBE\n\n-Y 1 +X 10\n";
    const std::string runs = std::string("\2\2\0\x0a", 4) + "\x8a\xc8"
                                                            "\x83\x40\x07"
                                                            "ABCDEFG"
                                                            "\x8a\1"
                                                            "\x8a\x88";
    const HdrImage image = decode_hdr(head + runs, "t");
    CHECK(image.pixels[2] == Vec3f(200, 64, 1));
    CHECK(image.pixels[3] == Vec3f(200, 'A', 1));
    CHECK(image.pixels[9] == Vec3f(200, 'G', 1));
    CHECK(decode_hdr(head + std::string(40, '\0'), "t").pixels[9] == Vec3f(0));

    const auto changed = [&](std::size_t at, char by) {
        return hdr(with(head + runs, head.size() + at, std::string(1, by)));
    };
    CHECK(changed(3, '\x0b') == "t: a damaged HDR file: the length of a scan line is wrong");
    CHECK(changed(4, '\x8b') == "t: a damaged HDR file: a run leaves its scan line");
    CHECK(changed(4, '\x80') == "t: a damaged HDR file: a run leaves its scan line"); // 128 values as they are
    CHECK(changed(18, '\x0a') == "t: the HDR file is cut short");                     // 10 values as they are
    CHECK(changed(4, '\0') == "t: a damaged HDR file: a run leaves its scan line");
    CHECK(hdr(head + std::string(runs).insert(4, 1, '\0')) == "t: a damaged HDR file: a run leaves its scan line");
    for (std::size_t size = 2; size < head.size() + runs.size(); ++size)
        CHECK(hdr((head + runs).substr(0, size)) != "read");
    CHECK(hdr(head + std::string(4, '\1') + std::string(36, '\x80')).find("before 1991") != std::string::npos);
    CHECK(hdr("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\nabcd") ==
          "t: an HDR file of FORMAT=32-bit_rle_xyze; allowed is FORMAT=32-bit_rle_rgbe");
    for (const char* size :
         {"-Y 1 +Y 1", "-Y 1", "-Y -1 +X 1", "-Y 1 +X 1 ", "Y 1 X 1", "-Y 99999999999 +X 1", "", "-Y 1+X 1"})
        CHECK(hdr(std::string("#?RGBE\n\n") + size + "\nabcd").find("needs its size as") != std::string::npos);
    CHECK(hdr("#?RGBE\n\n-Y 0 +X 1\nabcd").find("1 x 0 pixels") != std::string::npos);
    CHECK(hdr("#?RGBE\n\n-Y 16000 +X 16000\nabcd") ==
          "t: claims 16000 x 16000 pixels in 4 bytes of data; allowed are 16192000 or more");
    CHECK(hdr("#?RGBE\n\n-Y 4294967295 +X 4294967295\nabcd").find("allowed are") != std::string::npos);
    CHECK(hdr("#?RGBE\n\n-Y 2 +X 2\n0123456789abcdef", 3).find("allowed are 1 to 3") != std::string::npos);
}

#if defined(LAMBENT_HAS_OIIO)
TEST_CASE("Radiance HDR: the shared files, to the bit as OpenImageIO reads them") {
    const std::string folder = std::string(LAMBENT_SHARED_DIR) + "/scenes/environments";
    if (!std::filesystem::exists(folder)) return skip("HDR files: no folder");
    int files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        const std::string path = entry.path().string();
        if (!path.ends_with(".hdr")) continue;
        CAPTURE(path);
        const HdrImage ours = decode_hdr(file_bytes(path), path);
        const auto theirs = OIIO::ImageInput::open(path);
        REQUIRE(theirs != nullptr);
        REQUIRE(theirs->spec().width == ours.width);
        REQUIRE(theirs->spec().height == ours.height);
        std::vector<Vec3f> pixels(ours.pixels.size());
        REQUIRE(theirs->read_image(0, 0, 0, 3, OIIO::TypeDesc::FLOAT, pixels.data()));
        CHECK(pixels == ours.pixels);
        ++files;
    }
    CHECK(files == 3);
}
#endif

TEST_CASE("files: what is none is an error at once, through every reader") {
    const TemporaryFolder folder;
    const auto read = [](const std::string& path) { return said([&] { read_environment(path); }); };
    const auto ends = [](const std::string& text, std::string_view end) {
        CAPTURE(text);
        CHECK(text.ends_with(end));
    };
    ends(read(folder.file("absent.hdr")), "absent.hdr: no such file");
    ends(read(folder.file("no/such/folder.hdr")), ": no such file");
    ends(read(folder.file("")), ": not a regular file");
    ends(read(""), ": no such file");
    ends(read("/dev/zero"), "/dev/zero: not a regular file");
    ends(read(folder.write("empty.hdr", "")), "empty.hdr: an image of zero bytes");
    ends(read(folder.write("a", "#?RGBE\n") + "/b.hdr"), "b.hdr: no such file");
    CHECK(read(folder.file(std::string(300, 'x'))).find("File name too long") != std::string::npos);
    CHECK(read(std::string(100000, 'x')).find("File name too long") != std::string::npos);
    CHECK(read(folder.file("a") + std::string("\0.hdr", 5)).ends_with("a…: a file's name cannot hold a zero byte"));
    ends(read(folder.write("\xff\xfe.hdr", "#?RGBE\n\n-Y 1 +X 1\n")),
         ": claims 1 x 1 pixels in 0 bytes of data; allowed are 4 or more");
    std::filesystem::create_symlink(folder.file("loop2"), folder.file("loop1"));
    std::filesystem::create_symlink(folder.file("loop1"), folder.file("loop2"));
    CHECK(read(folder.file("loop1")).find("Too many levels of symbolic links") != std::string::npos);
    std::filesystem::create_symlink(folder.file("gone"), folder.file("dangling"));
    ends(read(folder.file("dangling")), "dangling: no such file");
    std::filesystem::create_symlink(folder.write("good.hdr", "#?RGBE\n\n-Y 1 +X 1\nabcd"), folder.file("link.hdr"));
    CHECK(read(folder.file("link.hdr")) == "read");
#if __has_include(<sys/stat.h>)
    REQUIRE(mkfifo(folder.file("pipe.hdr").c_str(), 0600) == 0);
    ends(read(folder.file("pipe.hdr")), "pipe.hdr: not a regular file");
#endif
}

TEST_CASE("files: one that shrinks while it is read is an error") {
    const TemporaryFolder folder;
    const std::string path = folder.write("a.hdr", std::string(1000, 'x'));
    struct Shrinking { // its memory is made between the question for the size and the reading
        std::string path, bytes;
        void resize(std::size_t n) {
            bytes.resize(n);
            std::filesystem::resize_file(path, 10);
        }
        char* data() { return bytes.data(); }
    } shrinking{path, {}};
    CHECK_THROWS_WITH_AS(detail::read_file(path, shrinking), (path + ": read 10 of 1000 bytes").c_str(), Error);
}

TEST_CASE("CRC-32 against its definition and its check value") {
    CHECK(detail::crc32("123456789") == 0xcbf43926u);
    for (const std::string& text : {std::string(), std::string("IEND"), std::string(300, '\xa5')})
        CHECK(detail::crc32(text) == slow_crc(text));
}
