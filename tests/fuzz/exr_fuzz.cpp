// libFuzzer target: EXR files. Must give an image of its own size, or an Error. Seeds: the shared .exr files, and one
// of each kind.
#include <lambent/io/environment.hpp>
#include <lambent/io/exr_read.hpp>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

namespace {

void demand(bool holds) {
    if (!holds) std::abort();
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace lambent;
    const std::string_view bytes(reinterpret_cast<const char*>(data), size);
    constexpr std::size_t max_pixels = 1 << 14;
    try {
        const ExrImage image = decode_exr(bytes, "fuzz.exr", max_pixels);
        const std::size_t pixels = std::size_t(image.width) * std::size_t(image.height);
        demand(pixels > 0 && pixels <= max_pixels);
        for (const ExrChannel& channel : image.channels) demand(channel.values.size() == pixels);
    } catch (const Error&) {
    }
    try {
        const Environment sky = decode_environment(bytes, "fuzz.exr", nullptr, max_pixels);
        demand(sky.map.size() == std::size_t(sky.width) * std::size_t(sky.height));
        for (const Vec3f& v : sky.map) demand(is_finite(v) && min_component(v) >= 0);
    } catch (const Error&) {
    }
    return 0;
}
