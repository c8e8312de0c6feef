#pragma once
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDeepFrameBuffer.h>
#include <OpenEXR/ImfDeepScanLineOutputFile.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfRgbaFile.h>
#include <OpenEXR/ImfTiledOutputFile.h>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

/// EXR files of every kind, written through OpenEXR to memory.
namespace lambent_test {

class ExrMemory final : public Imf::OStream {
public:
    explicit ExrMemory(std::string& bytes) : Imf::OStream("memory"), bytes_(&bytes) {}
    void write(const char c[], int n) override {
        bytes_->resize(std::max(bytes_->size(), at_ + std::size_t(n)));
        std::copy_n(c, n, bytes_->begin() + std::ptrdiff_t(at_));
        at_ += std::size_t(n);
    }
    std::uint64_t tellp() override { return at_; }
    void seekp(std::uint64_t position) override { at_ = std::size_t(position); }

private:
    std::string* bytes_;
    std::size_t at_ = 0;
};

/// Pixel (x, y) of a window's upper left corner on, of channel c: a smooth ramp of whole numbers that halves hold.
inline int exr_value(int c, int x, int y) { return 64 * (c + 1) + 2 * x + 3 * y; }

struct ExrKind {
    Imf::Compression compression = Imf::ZIP_COMPRESSION;
    Imf::PixelType type = Imf::HALF;
    Imf::LineOrder order = Imf::INCREASING_Y;
    int tile = 0; ///< 0 = scan lines
    Imf::LevelMode levels = Imf::ONE_LEVEL;
    Imath::Box2i data{{0, 0}, {36, 20}}, display{{0, 0}, {36, 20}};
    std::vector<std::string> channels{"R", "G", "B"};
    int sampling = 1;   ///< of one more channel, "sparse", where it is above 1
    std::string part{}; ///< name
};

inline Imf::Header exr_header(const ExrKind& kind) {
    Imf::Header header(kind.display, kind.data, 1, {0, 0}, 1, kind.order, kind.compression);
    for (const std::string& name : kind.channels) header.channels().insert(name, Imf::Channel(kind.type));
    if (kind.sampling > 1) header.channels().insert("sparse", Imf::Channel(kind.type, kind.sampling, kind.sampling));
    if (kind.tile > 0)
        header.setTileDescription({unsigned(kind.tile), unsigned(kind.tile), kind.levels, Imf::ROUND_DOWN});
    if (!kind.part.empty()) {
        header.setName(kind.part);
        header.setType(kind.tile > 0 ? Imf::TILEDIMAGE : Imf::SCANLINEIMAGE);
    }
    return header;
}

/// Numbers of one type for a window, and the frame buffer that writes them; channels hold exr_value() + offset.
class ExrPixels {
public:
    ExrPixels(const ExrKind& kind, const Imath::Box2i& window, int offset = 0) {
        const int width = window.max.x - window.min.x + 1, height = window.max.y - window.min.y + 1;
        const std::size_t size = kind.type == Imf::HALF ? 2 : 4;
        planes_.resize(kind.channels.size() + 1, std::vector<char>(size * std::size_t(width) * std::size_t(height)));
        for (std::size_t c = 0; c < kind.channels.size(); ++c) {
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x)
                    set(kind.type, &planes_[c][size * std::size_t(y * width + x)], exr_value(int(c), x, y) + offset);
            frame.insert(kind.channels[c], Imf::Slice::Make(kind.type, planes_[c].data(), window));
        }
        if (kind.sampling > 1)
            frame.insert("sparse", Imf::Slice::Make(kind.type, planes_.back().data(), window, 0, 0, kind.sampling,
                                                    kind.sampling));
    }
    Imf::FrameBuffer frame;

private:
    static void set(Imf::PixelType type, char* at, int value) {
        if (type == Imf::HALF) *reinterpret_cast<Imath::half*>(at) = Imath::half(float(value));
        if (type == Imf::FLOAT) *reinterpret_cast<float*>(at) = float(value);
        if (type == Imf::UINT) *reinterpret_cast<std::uint32_t*>(at) = std::uint32_t(value);
    }
    std::vector<std::vector<char>> planes_;
};

inline std::string exr_file(const ExrKind& kind) {
    std::string bytes;
    ExrMemory memory(bytes);
    const Imf::Header header = exr_header(kind);
    if (kind.tile == 0) {
        Imf::OutputFile file(memory, header);
        const ExrPixels pixels(kind, kind.data);
        file.setFrameBuffer(pixels.frame);
        file.writePixels(kind.data.max.y - kind.data.min.y + 1);
        return bytes;
    }
    Imf::TiledOutputFile file(memory, header);
    for (int j = 0; j < file.numYLevels(); ++j)
        for (int i = 0; i < file.numXLevels(); ++i) {
            if (kind.levels != Imf::RIPMAP_LEVELS && i != j) continue;
            const ExrPixels pixels(kind, file.dataWindowForLevel(i, j), 500 * (i + j));
            file.setFrameBuffer(pixels.frame);
            file.writeTiles(0, file.numXTiles(i) - 1, 0, file.numYTiles(j) - 1, i, j);
        }
    return bytes;
}

/// Scan-line parts, one after the other.
inline std::string exr_parts(const std::vector<ExrKind>& kinds) {
    std::string bytes;
    ExrMemory memory(bytes);
    std::vector<Imf::Header> headers;
    for (const ExrKind& kind : kinds) headers.push_back(exr_header(kind));
    Imf::MultiPartOutputFile file(memory, headers.data(), int(headers.size()));
    for (std::size_t i = 0; i < kinds.size(); ++i) {
        Imf::OutputPart part(file, int(i));
        const ExrPixels pixels(kinds[i], kinds[i].data, 1000 * int(i));
        part.setFrameBuffer(pixels.frame);
        part.writePixels(kinds[i].data.max.y - kinds[i].data.min.y + 1);
    }
    return bytes;
}

/// 4 x 2 pixels with a sample of Z each.
inline std::string exr_deep() {
    std::string bytes;
    ExrMemory memory(bytes);
    Imf::Header header(4, 2);
    header.setType(Imf::DEEPSCANLINE);
    header.compression() = Imf::ZIPS_COMPRESSION;
    header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
    Imf::DeepScanLineOutputFile file(memory, header);
    std::vector<float> depth(8, 1.0f);
    std::vector<float*> samples;
    for (float& z : depth) samples.push_back(&z);
    std::vector<unsigned> counts(8, 1);
    Imf::DeepFrameBuffer frame;
    frame.insertSampleCountSlice(Imf::Slice(Imf::UINT, reinterpret_cast<char*>(counts.data()), 4, 16));
    frame.insert("Z", Imf::DeepSlice(Imf::FLOAT, reinterpret_cast<char*>(samples.data()), sizeof(float*),
                                     4 * sizeof(float*), sizeof(float)));
    file.setFrameBuffer(frame);
    file.writePixels(2);
    return bytes;
}

/// width x height pixels of one colour as luminance and sub-sampled chroma.
inline std::string exr_luminance_chroma(int width, int height, const Imf::Rgba& color) {
    std::string bytes;
    ExrMemory memory(bytes);
    Imf::RgbaOutputFile file(memory, Imf::Header(width, height), Imf::WRITE_YC);
    const std::vector<Imf::Rgba> pixels(std::size_t(width) * std::size_t(height), color);
    file.setFrameBuffer(pixels.data(), 1, std::size_t(width));
    file.writePixels(height);
    return bytes;
}

} // namespace lambent_test
