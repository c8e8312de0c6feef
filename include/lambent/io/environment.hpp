#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/io/exr.hpp>
#include <lambent/io/image.hpp>
#include <lambent/scene/scene.hpp>
#include <cstddef>
#include <string>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Reads a latitude-longitude map of linear radiance: OpenEXR (needs lambent::exr) or Radiance HDR (needs
/// lambent::image too). Negative and non-finite values become 0, which `notes`, where given, counts.
/// throws lambent::Error on any other format, a damaged file, missing R, G, B, or more than max_pixels
inline Environment read_environment(const std::string& path, std::vector<std::string>* notes = nullptr,
                                    std::size_t max_pixels = std::size_t(1) << 28) {
    Environment environment;
    environment.scale = Vec3f(1);
    const std::string bytes = detail::read_file(path);
    const detail::ImageFormat format = detail::image_format(bytes);
    if (format == detail::ImageFormat::exr) {
        const ExrImage image = read_exr(path, max_pixels);
        const ExrChannel *r = image.find("R"), *g = image.find("G"), *b = image.find("B");
        const ExrChannel* grey = image.find("Y");
        if (r == nullptr && g == nullptr && b == nullptr) r = g = b = grey;
        require(r != nullptr && g != nullptr && b != nullptr,
                [&] { return path + ": an environment needs the channels R, G and B, or Y"; });
        environment.width = image.width;
        environment.height = image.height;
        environment.map.resize(r->values.size());
        for (std::size_t i = 0; i < environment.map.size(); ++i)
            environment.map[i] = {r->values[i], g->values[i], b->values[i]};
    } else {
        require(format == detail::ImageFormat::hdr,
                [&] { return path + ": not an OpenEXR or Radiance HDR image"; });
        const auto image = detail::decode_image<float>(bytes, path, max_pixels);
        require(image.channels >= 3, [&] { return path + ": an environment needs three channels"; });
        environment.width = image.width;
        environment.height = image.height;
        environment.map.resize(std::size_t(image.width) * std::size_t(image.height));
        for (std::size_t i = 0; i < environment.map.size(); ++i) {
            const float* p = &image.values[i * std::size_t(image.channels)];
            environment.map[i] = {p[0], p[1], p[2]};
        }
    }
    std::size_t bad = 0;
    for (Vec3f& pixel : environment.map)
        for (int c = 0; c < 3; ++c)
            if (!is_finite(pixel[c]) || pixel[c] < 0) {
                pixel[c] = 0;
                ++bad;
            }
    if (bad > 0 && notes != nullptr)
        notes->push_back(path + ": " + std::to_string(bad) + " negative or non-finite values were set to 0");
    return environment;
}

} // namespace LAMBENT_ABI
} // namespace lambent
