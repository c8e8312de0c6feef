// Writes small files of each kind, seeds for fuzzing:
//   seeds exr|image|film|tree FOLDER
#include <io/exr_files.hpp>
#include <io/image_files.hpp>
#include <lambent/bvh/compact.hpp>
#include <lambent/bvh/primitive_leaves.hpp>
#include <lambent/bvh/serialize.hpp>
#include <lambent/bvh/sphere.hpp>
#include <lambent/film/film_pass.hpp>
#include <lambent/io/film_file.hpp>
#include <support/meshes.hpp>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

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

void write_films(Folder& folder) {
    using namespace lambent;
    for (const FilmPlanes planes : {FilmPlanes::radiance, FilmPlanes::features, FilmPlanes::statistics})
        for (const std::uint64_t samples : {1, 2, 7}) {
            FilmPass<float> pass(2, 1, planes, 0, samples);
            for (int x = 0; x < 2; ++x) {
                FilmPass<float>::Pixel pixel(pass, x, 0);
                for (std::uint64_t i = 0; i < samples; ++i) {
                    PixelSample<float> sample;
                    sample.radiance = Vec3f(float(i), 1, 1e20f);
                    sample.hit = x == 0;
                    pixel.add(sample);
                }
            }
            FilmState<float> state;
            state.film = pass.finish();
            state.width = 3;
            state.height = 2;
            state.window = {1, 0, 3, 1};
            state.identity = {{"seed", "7"}, {"scene", ""}};
            const std::string path = folder.path + "/kind_" + std::to_string(folder.count++);
            write_film(path, state);
        }
}

template <class T>
void write_trees(Folder& folder) {
    using namespace lambent;
    const auto write = [&](const std::vector<std::byte>& bytes) {
        folder.write(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
    };
    for (const std::size_t count : {std::size_t(2), std::size_t(60)}) {
        const lambent_test::Mesh<T> mesh = soup<T>(count, 0.3, 2);
        const std::vector<T> radii(mesh.vertices.size(), T(0.1));
        const auto set = triangles(mesh.vertices, mesh.faces);
        const auto balls = spheres(mesh.vertices, radii);
        write(save(BasicBvh<T>::build(set)));
        write(save(CompactBvh<std::remove_const_t<decltype(set)>>::build(set)));
        write(save(PrimitiveBvh<std::remove_const_t<decltype(balls)>>::build(balls)));
    }
}

} // namespace

int main(int argc, char** argv) {
    if (argc != 3) return 2;
    Folder folder{argv[2]};
    if (std::string(argv[1]) == "exr") write_exr_files(folder);
    else if (std::string(argv[1]) == "film") write_films(folder);
    else if (std::string(argv[1]) == "tree") write_trees<float>(folder), write_trees<double>(folder);
    else write_images(folder);
}
