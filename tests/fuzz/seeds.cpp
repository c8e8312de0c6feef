// Writes small files of each kind, seeds for fuzzing:
//   seeds exr|image FOLDER
#include <io/exr_files.hpp>
#include <io/image_files.hpp>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

using namespace lambent_test;

namespace {

struct Folder {
    std::string path;
    int count = 0;

    void write(const std::string& bytes) {
        std::ofstream out(path + "/kind_" + std::to_string(count++), std::ios::binary);
        out.write(bytes.data(), std::streamsize(bytes.size()));
        out.close();
        if (!out) std::exit(1);
    }
};

void write_exr_files(Folder& folder) {
    for (int compression = 0; compression < Imf::NUM_COMPRESSION_METHODS; ++compression)
        for (const Imf::PixelType type : {Imf::HALF, Imf::FLOAT, Imf::UINT})
            for (const int tile : {0, 8}) {
                ExrKind kind;
                kind.compression = Imf::Compression(compression);
                kind.type = type;
                kind.tile = tile;
                kind.data = {{-2, 3}, {9, 10}};
                kind.order = tile > 0 ? Imf::RANDOM_Y : Imf::DECREASING_Y;
                kind.levels = type == Imf::HALF ? Imf::MIPMAP_LEVELS : Imf::ONE_LEVEL;
                folder.write(exr_file(kind));
            }
    folder.write(exr_parts({{.part = "a"}, {.channels = {"Z"}, .part = "b"}}));
    folder.write(exr_deep());
    folder.write(exr_luminance_chroma(12, 10, {1, 2, 3, 1}));
}

void write_images(Folder& folder) {
    folder.write(jpeg_file);
    for (const int color : {0, 2, 3, 4, 6})
        for (const int bits : {1, 8, 16}) {
            const std::string palette = chunk("PLTE", "abcdef") + chunk("tRNS", "ab");
            folder.write(png_file(png_header(4, 3, bits, color) + palette, std::string(200, '\1')));
        }
    folder.write("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 10\n" + std::string("\2\2\0\x0a", 4) +
                 "\x8a\xc8\x83\x40\x07" "ABCDEFG" "\x8a\1\x8a\x88");
    folder.write("#?RGBE\n\n+X 2 -Y 2\n0123456789abcdef");
}

} // namespace

int main(int argc, char** argv) {
    if (argc != 3) return 2;
    Folder folder{argv[2]};
    if (std::string(argv[1]) == "exr") write_exr_files(folder);
    else write_images(folder);
}
