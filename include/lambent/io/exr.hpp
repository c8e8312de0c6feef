#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/vec.hpp>
#include <lambent/io/exr_image.hpp>
#include <lambent/io/exr_read.hpp>
#include <lambent/io/file.hpp>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <map>
#include <string>
#include <variant>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// A file for OpenEXR to write to. It swallows what goes wrong in the end, when it puts its table of offsets in place
/// and what the system's buffer holds: this remembers.
class ExrFile final : public Imf::OStream {
public:
    explicit ExrFile(const std::string& name) : Imf::OStream(name.c_str()), file_(std::fopen(name.c_str(), "wb")) {
        require(file_ != nullptr, "cannot be opened for writing");
    }
    void write(const char c[], int n) override {
        check(std::fwrite(c, 1, std::size_t(n), file_.get()) == std::size_t(n));
    }
    std::uint64_t tellp() override { return std::uint64_t(std::ftell(file_.get())); }
    void seekp(std::uint64_t position) override { check(std::fseek(file_.get(), long(position), SEEK_SET) == 0); }

    /// throws lambent::Error unless all has been written
    void close() {
        check(std::fclose(file_.release()) == 0);
        check(!failed_);
    }

private:
    void check(bool good) {
        failed_ = failed_ || !good;
        require(good, "cannot be written; is the disk full?");
    }
    OpenFile file_;
    bool failed_ = false;
};

/// The nearest half, ±65504 for whatever lies beyond; NaN stays NaN.
inline Imath::half saturated_half(float x) {
    constexpr float largest = 65504;
    if (x > largest) x = largest;
    if (x < -largest) x = -largest;
    return Imath::half(x);
}

inline Imath::M44f row_vector_matrix(const Mat4d& m) {
    Imath::M44f out;
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j) out[i][j] = float(m[i][j]); // column i of ours is row i of theirs
    return out;
}

inline void add_attributes(Imf::Header& header, const std::map<std::string, ExrValue>& attributes) {
    for (const auto& [name, value] : attributes) {
        if (const int* i = std::get_if<int>(&value)) header.insert(name, Imf::IntAttribute(*i));
        if (const double* d = std::get_if<double>(&value)) header.insert(name, Imf::DoubleAttribute(*d));
        if (const std::string* s = std::get_if<std::string>(&value))
            header.insert(name, Imf::StringAttribute(*s));
        if (const Mat4d* m = std::get_if<Mat4d>(&value))
            header.insert(name, Imf::M44fAttribute(row_vector_matrix(*m)));
    }
}

} // namespace detail

/// Writes a scan-line EXR, ZIP-compressed, with no clock in it: equal images give equal files. Half channels
/// saturate at ±65504. The file appears whole or not at all.
/// throws lambent::Error when a channel has the wrong size or the file cannot be written
inline void write_exr(const std::string& path, const ExrImage& image) {
    require(image.width > 0 && image.height > 0 && !image.channels.empty(),
            [&] { return path + ": an EXR image needs pixels and channels"; });
    const std::size_t pixels = std::size_t(image.width) * std::size_t(image.height);
    std::vector<std::vector<Imath::half>> halves(image.channels.size());
    detail::PendingFile pending(path);
    try {
        Imf::Header header(image.display_width > 0 ? image.display_width : image.width,
                           image.display_height > 0 ? image.display_height : image.height);
        header.dataWindow() = {{image.left, image.top}, {image.left + image.width - 1, image.top + image.height - 1}};
        header.compression() = Imf::ZIP_COMPRESSION;
        detail::add_attributes(header, image.attributes);
        Imf::FrameBuffer frame;
        for (std::size_t i = 0; i < image.channels.size(); ++i) {
            const ExrChannel& channel = image.channels[i];
            require(channel.values.size() == pixels, [&] {
                return "channel '" + channel.name + "' has " + std::to_string(channel.values.size()) +
                       " values for " + std::to_string(pixels) + " pixels";
            });
            if (channel.type == ExrType::half) {
                halves[i].reserve(pixels);
                for (const float v : channel.values) halves[i].push_back(detail::saturated_half(v));
                header.channels().insert(channel.name, Imf::Channel(Imf::HALF));
                frame.insert(channel.name, Imf::Slice::Make(Imf::HALF, halves[i].data(), header.dataWindow()));
            } else {
                header.channels().insert(channel.name, Imf::Channel(Imf::FLOAT));
                frame.insert(channel.name, Imf::Slice::Make(Imf::FLOAT, channel.values.data(), header.dataWindow()));
            }
        }
        detail::ExrFile out(pending.name());
        {
            Imf::OutputFile file(out, header);
            file.setFrameBuffer(frame);
            file.writePixels(image.height);
        }
        out.close();
    } catch (const std::exception& error) {
        fail(path + ": " + error.what());
    }
    pending.commit();
}

} // namespace LAMBENT_ABI
} // namespace lambent
