#include <lambent/io/environment.hpp>
#include <lambent/io/exr.hpp>
#include <io/exr_files.hpp>
#include <support/skip.hpp>
#include <support/temporary_folder.hpp>
#include <doctest/doctest.h>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

const std::string scenes_folder = std::string(LAMBENT_SHARED_DIR) + "/scenes/";

/// Largest relative error of the environment's channels against exr_value() + offset.
double worst(const Environment& sky, const Imath::Box2i& window, int offset = 0) {
    REQUIRE(sky.width == window.max.x - window.min.x + 1);
    REQUIRE(sky.height == window.max.y - window.min.y + 1);
    double error = 0;
    for (int y = 0; y < sky.height; ++y)
        for (int x = 0; x < sky.width; ++x)
            for (int c = 0; c < 3; ++c) {
                const double expected = exr_value(c, x, y) + offset;
                const double found = double(sky.map[std::size_t(y * sky.width + x)][c]);
                error = std::max(error, std::abs(found - expected) / expected);
            }
    return error;
}

/// What a compression may lose, of half and of float; integers are never touched.
double loss(Imf::Compression compression, Imf::PixelType type) {
    if (type == Imf::UINT) return 0;
    if (compression == Imf::B44_COMPRESSION || compression == Imf::B44A_COMPRESSION)
        return type == Imf::HALF ? 0.02 : 0;
    if (compression == Imf::DWAA_COMPRESSION || compression == Imf::DWAB_COMPRESSION) return 0.05;
    return 0; // PXR24 keeps 16 bits of a float's mantissa: all of these numbers
}

std::string message(const std::string& bytes, std::size_t max_pixels = 1 << 20) {
    try {
        decode_environment(bytes, "sky", nullptr, max_pixels);
    } catch (const Error& error) {
        return error.what();
    }
    return "none";
}

} // namespace

TEST_CASE("EXR environments: every compression, type, order of lines and kind of tiles") {
    for (int compression = 0; compression < Imf::NUM_COMPRESSION_METHODS; ++compression)
        for (const Imf::PixelType type : {Imf::HALF, Imf::FLOAT, Imf::UINT})
            for (const int tile : {0, 16, 64}) {
                ExrKind kind;
                kind.compression = Imf::Compression(compression);
                kind.type = type;
                kind.tile = tile;
                CAPTURE(compression);
                CAPTURE(int(type));
                CAPTURE(tile);
                CHECK(worst(decode_environment(exr_file(kind), "sky"), kind.data) <= loss(kind.compression, type));
            }
    for (const Imf::LineOrder order : {Imf::INCREASING_Y, Imf::DECREASING_Y, Imf::RANDOM_Y})
        for (const Imf::LevelMode levels : {Imf::ONE_LEVEL, Imf::MIPMAP_LEVELS, Imf::RIPMAP_LEVELS})
            for (const int tile : {0, 8}) {
                if (tile == 0 && (order == Imf::RANDOM_Y || levels != Imf::ONE_LEVEL)) continue;
                ExrKind kind;
                kind.order = order;
                kind.levels = levels;
                kind.tile = tile;
                CAPTURE(int(order));
                CAPTURE(int(levels));
                CHECK(worst(decode_environment(exr_file(kind), "sky"), kind.data) == 0); // lower levels hold others
            }
}

TEST_CASE("EXR environments: windows, grey, sub-sampled channels, parts, luminance and chroma") {
    std::vector<std::string> notes;
    ExrKind window;
    window.data = {{-5, 7}, {20, 18}};
    CHECK(worst(decode_environment(exr_file(window), "sky", &notes), window.data) == 0);
    REQUIRE(notes.size() == 1);
    CHECK(notes[0] == "sky: the data window, not the display window, is taken for the whole sphere");
    const ExrImage image = decode_exr(exr_file(window), "sky");
    CHECK(image.left == -5);
    CHECK(image.top == 7);
    CHECK(image.display_width == 37);

    const Environment grey = decode_environment(exr_file({.channels = {"Y"}}), "sky");
    CHECK(grey.map[1] == Vec3f(66));
    ExrKind sparse;
    sparse.data.max = {35, 19};
    sparse.sampling = 2;
    CHECK(worst(decode_environment(exr_file(sparse), "sky"), sparse.data) == 0);
    CHECK(decode_exr(exr_file(sparse), "sky").channels.size() == 3);

    const std::string parts = exr_parts({{.channels = {"Z"}, .part = "depth"}, {.part = "first"}, {.part = "second"}});
    CHECK(worst(decode_environment(parts, "sky"), ExrKind().data, 1000) == 0);
    CHECK(decode_exr(parts, "sky").find("second.G") != nullptr);

    const Environment yc = decode_environment(exr_luminance_chroma(24, 16, {4, 2, 1, 1}), "sky");
    CHECK(yc.width == 24);
    for (const Vec3f& pixel : yc.map) REQUIRE(max_component(abs(pixel - Vec3f(4, 2, 1))) < 0.02f);
}

TEST_CASE("EXR: what is refused, and in which words") {
    CHECK(message(exr_deep()) == "sky: a deep image, which is not supported");
    CHECK_THROWS_WITH_AS(decode_exr(exr_deep(), "deep"), "deep: a deep image, which is not supported", Error);
    CHECK(message(exr_file({.channels = {"R", "G"}})) == "sky: an environment needs the channels R, G and B, or Y");
    CHECK(message(exr_file({}), 37 * 21) == "none");
    CHECK(message(exr_file({}), 37 * 21 - 1).find("37 x 21") != std::string::npos);
    CHECK(message("\x89PNG\r\n\x1a\n").find("not PNG") != std::string::npos);
    CHECK(message("") == "sky: an image of zero bytes");

    const auto change = [](std::string bytes, const std::string& after, std::size_t skip, const std::string& by) {
        const std::size_t at = bytes.find(after);
        REQUIRE(at != bytes.npos);
        return bytes.replace(at + after.size() + skip, by.size(), by);
    };
    const std::string flat = exr_file({}), tiles = exr_file({.tile = 16});
    const std::string huge("\xff\xff\xff\x7f", 4), negative("\0\0\0\x80", 4), window("dataWindow\0box2i\0", 17);
    const std::string tile("tiles\0tiledesc\0", 15);
    CHECK(message(change(flat, window, 12, huge)).find("over") == std::string::npos);
    for (const std::string& bytes :
         {change(flat, window, 12, huge), change(flat, window, 16, huge), change(flat, window, 4, negative),
          change(flat, window, 8, huge), change(tiles, tile, 4, huge), change(tiles, tile, 8, huge),
          change(tiles, tile, 4, std::string(4, '\0')), change(tiles, tile, 12, "\7"),
          change(flat, std::string("compression\0compression\0", 24), 4, "\x0a"), // no such compression
          change(flat, std::string("channels\0chlist\0", 16), 0, huge),           // the attribute's own size
          change(flat, std::string("channels\0chlist\0", 16), 6, "\x09"),         // a channel's type
          change(flat, std::string("lineOrder\0lineOrder\0", 20), 0, "\2")}) {
        CHECK(message(bytes) != "none");
        CHECK(message(bytes, std::size_t(1) << 62) != "none");
    }
}

TEST_CASE("EXR: attributes whose sizes are not their types'") {
    // Found by fuzzing: OpenEXR reads an attribute by its type, whatever size is stated, so that the next one's name
    // and size may be anything; it then allocated 1.6 GB.
    const std::string flat = exr_file({});
    const auto attribute = [&](const std::string& type, const std::string& value) {
        const std::string size{char(value.size()), 0, 0, 0};
        return message(std::string(flat).insert(8, "x" + std::string(1, '\0') + type + '\0' + size + value));
    };
    CHECK(attribute("chlist", "B" + std::string(20, '\0')) == "sky: channel 'B' has a sampling rate of 0");
    CHECK(attribute("chlist", std::string(2, '\0')) == "sky: bytes follow its list of channels");
    for (const auto& [type, bytes] : {std::pair("int", 5), {"float", 3}, {"box2i", 12}, {"m44f", 63}, {"tiledesc", 8}})
        CHECK(attribute(type, std::string(std::size_t(bytes), '\0')) ==
              "sky: header attribute 'x' has " + std::to_string(bytes) + " bytes, which is wrong for its type '" +
                  type + "'");
    CHECK(attribute("preview", std::string("\xff\xff\xff\x7f\xff\xff\xff\x7f", 8)).find("wrong for its type") !=
          std::string::npos);
    CHECK(attribute("preview", std::string("\1\0\0\0\1\0\0\0", 8)).find("wrong for its type") != std::string::npos);
}

TEST_CASE("EXR: a file cut short anywhere is an error, and never more") {
    for (const int tile : {0, 16}) {
        const std::string whole = exr_file({.tile = tile});
        for (std::size_t size = 0; size < whole.size(); ++size) {
            CAPTURE(size);
            CHECK_THROWS_AS(decode_exr(std::string_view(whole).substr(0, size), "cut"), Error);
        }
    }
}

TEST_CASE("EXR: few bytes don't claim many pixels, and a constant image is no claim") {
    // A deep zoom of nothing: 16 Mi pixels of one colour, as densely as each compression packs them.
    for (const Imf::Compression compression : {Imf::RLE_COMPRESSION, Imf::ZIPS_COMPRESSION, Imf::ZIP_COMPRESSION,
                                               Imf::PIZ_COMPRESSION, Imf::PXR24_COMPRESSION, Imf::B44_COMPRESSION,
                                               Imf::B44A_COMPRESSION, Imf::DWAA_COMPRESSION, Imf::DWAB_COMPRESSION})
        for (const Imf::PixelType type : {Imf::HALF, Imf::FLOAT}) {
            std::string bytes;
            ExrMemory memory(bytes);
            ExrKind kind{.compression = compression, .type = type, .channels = {"Y"}};
            kind.data.max = kind.display.max = {4095, 2047};
            const Imf::Header header = exr_header(kind);
            {
                Imf::OutputFile file(memory, header);
                const std::vector<float> row(4096, 0.0f);
                Imf::FrameBuffer frame;
                frame.insert("Y", Imf::Slice(type, reinterpret_cast<char*>(const_cast<float*>(row.data())),
                                             type == Imf::HALF ? 2 : 4, 0));
                file.setFrameBuffer(frame);
                file.writePixels(2048);
            }
            CAPTURE(int(compression));
            CAPTURE(bytes.size());
            CHECK_NOTHROW(detail::exr_headers(bytes, std::size_t(1) << 28));
        }
    const std::string window("dataWindow\0box2i\0", 17), bomb = exr_file({});
    const auto claim = [&](std::size_t skip, const std::string& last) {
        return message(std::string(bomb).replace(bomb.find(window) + window.size() + skip, 4, last), std::size_t(1) << 28);
    };
    CHECK(claim(12, std::string("\xff\xff\x3f\0", 4)).find("claims 3 channels of 4194304 x 21") != std::string::npos);
    CHECK(claim(16, std::string("\xff\xff\x3f\0", 4)).find("claims 262144 chunks") != std::string::npos);
}

TEST_CASE("environments: every shared EXR and HDR") {
    if (!std::filesystem::exists(scenes_folder + "environments")) return skip("environments: no folder");
    for (const auto& entry : std::filesystem::directory_iterator(scenes_folder + "environments")) {
        CAPTURE(entry.path().string());
        const Environment sky = read_environment(entry.path().string());
        CHECK(sky.width > 0);
        CHECK(sky.map.size() == std::size_t(sky.width) * std::size_t(sky.height));
    }
    std::vector<std::string> notes;
    CHECK(read_environment(scenes_folder + "exr_images/BrightRingsNanInf.exr", &notes).width == 800);
    REQUIRE(notes.size() == 1);
    CHECK(notes[0].find("negative or non-finite values were set to 0") != std::string::npos);
}
