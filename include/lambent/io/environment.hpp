#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/io/exr_read.hpp>
#include <lambent/io/file.hpp>
#include <lambent/io/hdr.hpp>
#include <lambent/io/image_format.hpp>
#include <lambent/scene/scene.hpp>
#include <OpenEXR/ImfRgbaFile.h>
#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Luminance and sub-sampled chroma (Y RY BY), in half precision as they are stored.
inline void read_luminance_chroma(std::string_view bytes, const std::string& name, HdrImage& image) {
    ExrStream stream(bytes, name);
    Imf::RgbaInputFile file(stream);
    const Imath::Box2i window = file.dataWindow();
    std::vector<Imf::Rgba> pixels(image.pixels.size());
    const std::ptrdiff_t start = window.min.x + std::ptrdiff_t(window.min.y) * image.width;
    file.setFrameBuffer(pixels.data() - start, 1, std::size_t(image.width));
    file.readPixels(window.min.y, window.max.y);
    std::transform(pixels.begin(), pixels.end(), image.pixels.begin(),
                   [](const Imf::Rgba& p) { return Vec3f(p.r, p.g, p.b); });
}

/// The first flat part with R, G and B, or else Y.
inline HdrImage decode_exr_radiance(std::string_view bytes, const std::string& name, std::vector<std::string>* notes,
                                    std::size_t max_pixels) {
    HdrImage image;
    with_exr_file(bytes, name, max_pixels, [&](Imf::MultiPartInputFile& file, const std::vector<ExrHeader>& headers) {
        const auto rgb = [](const ExrHeader& h) { return h.has("R") && h.has("G") && h.has("B"); };
        const auto part = std::find_if(headers.begin(), headers.end(),
                                       [&](const ExrHeader& h) { return !h.deep && (rgb(h) || h.has("Y")); });
        require(part != headers.end(), [&] {
            const bool deep = std::all_of(headers.begin(), headers.end(), [](const ExrHeader& h) { return h.deep; });
            return deep ? "a deep image, which is not supported" : "an environment needs the channels R, G and B, or Y";
        });
        const auto& [x0, y0, x1, y1] = part->display;
        if (notes != nullptr && (part->data.width() != x1 - x0 + 1 || part->data.height() != y1 - y0 + 1))
            notes->push_back(name + ": the data window, not the display window, is taken for the whole sphere");
        image.width = int(part->data.width());
        image.height = int(part->data.height());
        image.pixels.resize(std::size_t(image.width) * std::size_t(image.height));
        const bool chroma = !rgb(*part) && std::any_of(part->channels.begin(), part->channels.end(), [](const auto& c) {
            return !c.full && (c.name == "RY" || c.name == "BY");
        });
        if (chroma) {
            require(part == headers.begin(), "luminance and chroma are read from a file's first part only");
            return read_luminance_chroma(bytes, name, image);
        }
        ExrImage channels;
        channels.width = image.width;
        channels.height = image.height;
        const bool color = rgb(*part);
        read_exr_part(file, int(part - headers.begin()), channels, [&](std::string_view channel) {
            return color ? channel == "R" || channel == "G" || channel == "B" : channel == "Y";
        });
        for (int c = 0; c < 3; ++c) {
            const ExrChannel* plane = channels.find(color ? std::string_view("RGB").substr(std::size_t(c), 1) : "Y");
            for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i][c] = plane->values[i];
        }
    });
    return image;
}

} // namespace detail

/// Decodes a latitude-longitude map of linear radiance in memory: OpenEXR or Radiance HDR, by its first bytes. Of an EXR
/// file, the first part that is not deep and has R, G, B, or Y (grey; with RY and BY beside it, colour), all of its data
/// window. Primaries are taken for Rec.709's. Negative and non-finite values become 0, which `notes`, where given,
/// counts.
/// throws lambent::Error with `name` on any other format, a damaged file, missing channels, more than max_pixels, or more
///         pixels than that many bytes can hold
inline Environment decode_environment(std::string_view bytes, const std::string& name,
                                      std::vector<std::string>* notes = nullptr,
                                      std::size_t max_pixels = std::size_t(1) << 28) {
    const char* const allowed = "OpenEXR and Radiance HDR";
    const detail::ImageFormat format = detail::image_format(bytes, name, allowed);
    require(format == detail::ImageFormat::exr || format == detail::ImageFormat::hdr,
            [&] { return name + ": an environment is one of " + allowed + ", not PNG or JPEG"; });
    HdrImage image = format == detail::ImageFormat::exr ? detail::decode_exr_radiance(bytes, name, notes, max_pixels)
                                                        : decode_hdr(bytes, name, max_pixels);
    Environment environment;
    environment.scale = Vec3f(1);
    environment.width = image.width;
    environment.height = image.height;
    environment.map = std::move(image.pixels);
    std::size_t bad = 0;
    for (Vec3f& pixel : environment.map)
        for (int c = 0; c < 3; ++c)
            if (!is_finite(pixel[c]) || pixel[c] < 0) {
                pixel[c] = 0;
                ++bad;
            }
    if (bad > 0 && notes != nullptr)
        notes->push_back(name + ": " + std::to_string(bad) + " negative or non-finite values were set to 0");
    return environment;
}

/// decode_environment() of a file.
inline Environment read_environment(const std::string& path, std::vector<std::string>* notes = nullptr,
                                    std::size_t max_pixels = std::size_t(1) << 28) {
    return decode_environment(detail::FileBytes(path).view(), path, notes, max_pixels);
}

} // namespace LAMBENT_ABI
} // namespace lambent
