// Writes a small EXR file of each kind: seeds for exr_fuzz.
//   seeds FOLDER
#include <io/exr_files.hpp>
#include <cstdio>
#include <fstream>

int main(int argc, char** argv) {
    using namespace lambent_test;
    if (argc != 2) return 2;
    int count = 0;
    const auto write = [&](const std::string& bytes) {
        std::ofstream out(argv[1] + ("/kind_" + std::to_string(count++)) + ".exr", std::ios::binary);
        out.write(bytes.data(), std::streamsize(bytes.size()));
        out.close();
        if (!out) std::exit(1);
    };
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
                write(exr_file(kind));
            }
    write(exr_parts({{.part = "a"}, {.channels = {"Z"}, .part = "b"}}));
    write(exr_deep());
    write(exr_luminance_chroma(12, 10, {1, 2, 3, 1}));
}
