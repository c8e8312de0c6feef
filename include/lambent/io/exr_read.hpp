#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/vec.hpp>
#include <lambent/io/exr_header.hpp>
#include <lambent/io/exr_image.hpp>
#include <lambent/io/file.hpp>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// A file in memory, as OpenEXR reads files.
class ExrStream final : public Imf::IStream {
public:
    ExrStream(std::string_view bytes, const std::string& name) : Imf::IStream(name.c_str()), bytes_(bytes) {}

    bool isMemoryMapped() const override { return true; }
    char* readMemoryMapped(int n) override {
        const std::size_t from = std::size_t(at_);
        skip(n);
        return const_cast<char*>(bytes_.data()) + from; // it only reads
    }
    bool read(char out[], int n) override {
        std::copy_n(readMemoryMapped(n), n, out);
        return at_ < bytes_.size();
    }
    std::uint64_t tellg() override { return at_; }
    void seekg(std::uint64_t position) override { at_ = position; }

private:
    void skip(int n) {
        require(n >= 0 && at_ <= bytes_.size() && std::uint64_t(n) <= bytes_.size() - at_, "it is cut short");
        at_ += std::uint64_t(n);
    }

    std::string_view bytes_;
    std::uint64_t at_ = 0;
};

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

/// Where a part's pixels lie, and its attributes.
inline void set_exr_frame(const Imf::Header& header, ExrImage& image) {
    const Imath::Box2i window = header.dataWindow(), display = header.displayWindow();
    image.width = window.max.x - window.min.x + 1;
    image.height = window.max.y - window.min.y + 1;
    image.left = int(std::int64_t(window.min.x) - display.min.x);
    image.top = int(std::int64_t(window.min.y) - display.min.y);
    image.display_width = int(std::int64_t(display.max.x) - display.min.x + 1);
    image.display_height = int(std::int64_t(display.max.y) - display.min.y + 1);
    image.attributes = attributes_of(header);
}

/// Reads those channels of one part that `wanted(name)`, at full size, and appends them.
template <class Wanted>
void read_exr_part(Imf::MultiPartInputFile& file, int part, ExrImage& image, const Wanted& wanted) {
    const Imf::Header& header = file.header(part);
    Imf::InputPart input(file, part);
    const Imath::Box2i window = header.dataWindow();
    const std::size_t pixels = std::size_t(image.width) * std::size_t(image.height);
    std::vector<std::string> names;
    for (auto it = header.channels().begin(); it != header.channels().end(); ++it)
        if (it.channel().xSampling == 1 && it.channel().ySampling == 1 && wanted(it.name())) names.push_back(it.name());
    const std::size_t first = image.channels.size();
    for (const std::string& name : names) {
        const bool taken = image.find(name) != nullptr;
        const bool half = header.channels()[name].type == Imf::HALF;
        image.channels.push_back({taken ? header.name() + "." + name : name, half ? ExrType::half : ExrType::float32,
                                  std::vector<float>(pixels)});
    }
    if (names.empty()) return;
    Imf::FrameBuffer frame;
    for (std::size_t i = 0; i < names.size(); ++i)
        frame.insert(names[i], Imf::Slice::Make(Imf::FLOAT, image.channels[first + i].values.data(), window));
    input.setFrameBuffer(frame);
    input.readPixels(window.min.y, window.max.y);
}

/// Opens an EXR file in memory whose headers were checked, and calls f(file, headers); what goes wrong names the file.
template <class F>
void with_exr_file(std::string_view bytes, const std::string& name, std::size_t max_pixels, const F& f) {
    try {
        const std::vector<ExrHeader> headers = exr_headers(bytes, max_pixels);
        ExrStream stream(bytes, name);
        Imf::MultiPartInputFile file(stream);
        require(std::size_t(file.parts()) == headers.size(), "its parts cannot be told apart");
        f(file, headers);
    } catch (const std::exception& error) {
        fail(name + ": " + error.what());
    }
}

} // namespace detail

/// Reads every channel of an EXR file in memory, any compression, order of lines, half, float and integer, scan lines
/// or tiles (of levels, the largest), the data window only. Of a multi-part file, all parts of the first one's size; a
/// channel whose name is taken gets its part's name before it. Sub-sampled channels and deep parts are left out.
/// throws lambent::Error with `name` on a damaged file, more than max_pixels in any part, or more pixels than that many
///         bytes can hold (exr_header.hpp says how many); sizes are checked before anything is allocated
inline ExrImage decode_exr(std::string_view bytes, const std::string& name,
                           std::size_t max_pixels = std::size_t(1) << 28) {
    ExrImage image;
    detail::with_exr_file(bytes, name, max_pixels, [&](Imf::MultiPartInputFile& file, const auto& headers) {
        std::size_t values = 0, deep = 0;
        for (int part = 0; part < file.parts(); ++part) {
            const detail::ExrHeader& header = headers[std::size_t(part)];
            deep += header.deep ? 1u : 0u;
            if (header.deep) continue;
            if (image.width == 0) detail::set_exr_frame(file.header(part), image);
            if (header.data.width() != image.width || header.data.height() != image.height) continue;
            values += header.channels.size() * std::size_t(image.width) * std::size_t(image.height);
            require(values / 64 <= max_pixels, "its channels hold over 64 times the limit of pixels");
            detail::read_exr_part(file, part, image, [](const char*) { return true; });
        }
        require(deep < headers.size(), "a deep image, which is not supported");
        require(!image.channels.empty(), "it has no channel of full size");
    });
    return image;
}

/// decode_exr() of a file.
inline ExrImage read_exr(const std::string& path, std::size_t max_pixels = std::size_t(1) << 28) {
    return decode_exr(detail::FileBytes(path).view(), path, max_pixels);
}

} // namespace LAMBENT_ABI
} // namespace lambent
