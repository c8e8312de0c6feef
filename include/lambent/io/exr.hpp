#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec.hpp>
#include <lambent/film/pixel_view.hpp>
#include <lambent/io/file.hpp>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <map>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// How a channel is stored. Half keeps 11 bits and reaches 65504; float32 is exact.
enum class ExrType : std::uint8_t { half, float32 };

/// One channel of an EXR file: width · height values, row 0 at the top.
struct ExrChannel {
    std::string name; ///< "R", "albedo.R", "Z" …
    ExrType type = ExrType::half;
    std::vector<float> values;
};

/// A header attribute. Matrices are ours, column vectors (p' = M p); the file holds row vectors (p' = p M).
using ExrValue = std::variant<int, double, std::string, Mat4d>;

/// What an EXR file holds, all in memory.
struct ExrImage {
    int width = 0, height = 0;
    std::vector<ExrChannel> channels;
    std::map<std::string, ExrValue> attributes; ///< those beyond the standard header
    int left = 0, top = 0;                      ///< where the upper left pixel lies in the display window
    int display_width = 0, display_height = 0;  ///< of the display window; 0 = the image's own

    /// The channel of that name, or nullptr.
    const ExrChannel* find(std::string_view name) const {
        for (const ExrChannel& c : channels)
            if (c.name == name) return &c;
        return nullptr;
    }

    /// Adds the C channels of `pixels` as `layer` + "." + suffix, or the suffix alone for an empty layer;
    /// one character of `suffixes` names a channel. The first plane sets the image's size.
    /// throws lambent::Error when the sizes differ
    template <class T, int C>
    void add(const std::string& layer, std::string_view suffixes, const PixelView<T, C>& pixels,
             ExrType type = ExrType::half) {
        require(suffixes.size() == std::size_t(C), "ExrImage::add: one suffix character a channel");
        if (channels.empty()) {
            width = pixels.width();
            height = pixels.height();
        }
        require(pixels.width() == width && pixels.height() == height, [&] {
            return "ExrImage::add: plane '" + layer + "' is " + std::to_string(pixels.width()) + " x " +
                   std::to_string(pixels.height()) + ", the image " + std::to_string(width) + " x " +
                   std::to_string(height);
        });
        for (int c = 0; c < C; ++c) {
            ExrChannel channel;
            channel.name = (layer.empty() ? std::string() : layer + ".") + suffixes[std::size_t(c)];
            channel.type = type;
            channel.values.reserve(std::size_t(width) * std::size_t(height));
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x)
                    channel.values.push_back(float(pixels.pixel(x, y)[c * pixels.strides().channel]));
            channels.push_back(std::move(channel));
        }
    }
};

namespace detail {

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

/// Those beyond what every header has and what tells the parts of a file apart: they can be written again.
inline std::map<std::string, ExrValue> attributes_of(const Imf::Header& header) {
    std::map<std::string, ExrValue> out;
    const Imf::Header standard;
    for (auto it = header.begin(); it != header.end(); ++it) {
        const std::string_view name = it.name();
        if (standard.find(it.name()) != standard.end() || name == "name" || name == "type" || name == "view" ||
            name == "chunkCount")
            continue;
        const Imf::Attribute* a = &it.attribute();
        if (const auto* i = dynamic_cast<const Imf::IntAttribute*>(a)) out[it.name()] = i->value();
        if (const auto* f = dynamic_cast<const Imf::FloatAttribute*>(a)) out[it.name()] = double(f->value());
        if (const auto* d = dynamic_cast<const Imf::DoubleAttribute*>(a)) out[it.name()] = d->value();
        if (const auto* s = dynamic_cast<const Imf::StringAttribute*>(a)) out[it.name()] = s->value();
        if (const auto* m = dynamic_cast<const Imf::M44fAttribute*>(a)) {
            Mat4d matrix;
            for (int i = 0; i < 4; ++i)
                for (int j = 0; j < 4; ++j) matrix[i][j] = double(m->value()[i][j]);
            out[it.name()] = matrix;
        }
    }
    return out;
}

/// Reads one part's channels at its full size and appends them.
inline void read_exr_part(Imf::MultiPartInputFile& file, int part, ExrImage& image) {
    const Imf::Header& header = file.header(part);
    Imf::InputPart input(file, part);
    const Imath::Box2i window = header.dataWindow();
    const std::size_t pixels = std::size_t(image.width) * std::size_t(image.height);
    const std::size_t first = image.channels.size();
    for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
        if (it.channel().xSampling != 1 || it.channel().ySampling != 1) continue;
        std::string name = it.name();
        if (image.find(name) != nullptr) name = header.name() + "." + name;
        const ExrType type = it.channel().type == Imf::HALF ? ExrType::half : ExrType::float32;
        image.channels.push_back({name, type, std::vector<float>(pixels)});
    }
    Imf::FrameBuffer frame;
    std::size_t k = first;
    for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
        if (it.channel().xSampling != 1 || it.channel().ySampling != 1) continue;
        frame.insert(it.name(), Imf::Slice::Make(Imf::FLOAT, image.channels[k++].values.data(), window));
    }
    input.setFrameBuffer(frame);
    input.readPixels(window.min.y, window.max.y);
}

} // namespace detail

/// Reads every channel of a scan-line or tiled EXR file, any compression, half, float and integer, the data
/// window only. Of a multi-part file, all parts of the first one's size; a channel whose name is taken gets
/// its part's name before it. Sub-sampled channels and deep parts are left out.
/// throws lambent::Error on a missing, damaged or implausibly large file (over max_pixels, or claiming more
///         than 4096 times its bytes)
inline ExrImage read_exr(const std::string& path, std::size_t max_pixels = std::size_t(1) << 28) {
    const std::uint64_t bytes = detail::file_size(path);
    ExrImage image;
    try {
        Imf::MultiPartInputFile file(path.c_str());
        std::uint64_t planes = 0;
        for (int part = 0; part < file.parts(); ++part) {
            const Imf::Header& header = file.header(part);
            if (header.hasType() && Imf::isDeepData(header.type())) continue;
            const Imath::Box2i window = header.dataWindow();
            const std::int64_t width = std::int64_t(window.max.x) - window.min.x + 1;
            const std::int64_t height = std::int64_t(window.max.y) - window.min.y + 1;
            require(width > 0 && height > 0 && std::uint64_t(width) <= max_pixels &&
                        std::uint64_t(height) <= max_pixels / std::uint64_t(width),
                    [&] {
                        return "its size, " + std::to_string(width) + " x " + std::to_string(height) +
                               ", is over the limit of " + std::to_string(max_pixels) + " pixels";
                    });
            if (image.channels.empty()) {
                image.width = int(width);
                image.height = int(height);
                const Imath::Box2i display = header.displayWindow();
                image.left = window.min.x - display.min.x;
                image.top = window.min.y - display.min.y;
                image.display_width = display.max.x - display.min.x + 1;
                image.display_height = display.max.y - display.min.y + 1;
                image.attributes = detail::attributes_of(header);
            } else if (width != image.width || height != image.height) {
                continue;
            }
            for (auto it = header.channels().begin(); it != header.channels().end(); ++it) ++planes;
            require(planes <= (std::uint64_t(1) << 20) &&
                        std::uint64_t(width * height) <= 4096 * bytes / std::max<std::uint64_t>(planes, 1),
                    [&] {
                        return "a file of " + std::to_string(bytes) + " bytes claims " +
                               std::to_string(planes) + " channels of " + std::to_string(width) + " x " +
                               std::to_string(height) + " pixels";
                    });
            detail::read_exr_part(file, part, image);
        }
        require(!image.channels.empty(), "it has no image that can be read");
    } catch (const std::exception& error) {
        fail(path + ": " + error.what());
    }
    return image;
}

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
        Imf::OutputFile file(pending.name().c_str(), header);
        file.setFrameBuffer(frame);
        file.writePixels(image.height);
    } catch (const std::exception& error) {
        fail(path + ": " + error.what());
    }
    pending.commit();
}

} // namespace LAMBENT_ABI
} // namespace lambent
