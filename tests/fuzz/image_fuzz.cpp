// libFuzzer target: PNG, JPEG and Radiance HDR files. Must give an image of its own size, or an Error. Only our part is
// instrumented: of PNG and JPEG, what is checked before OpenImageIO decodes them. Seeds: the shared images, and one of
// each kind.
#include <lambent/io/hdr.hpp>
#include <lambent/io/image.hpp>
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
        const Image image = decode_texture(bytes, "fuzz.png", max_pixels);
        const std::size_t pixels = std::size_t(image.width) * std::size_t(image.height);
        demand(pixels > 0 && pixels <= max_pixels && image.rgba.size() == 4 * pixels);
    } catch (const Error&) {
    }
    try {
        const HdrImage image = decode_hdr(bytes, "fuzz.hdr", max_pixels);
        const std::size_t pixels = std::size_t(image.width) * std::size_t(image.height);
        demand(pixels > 0 && pixels <= max_pixels && image.pixels.size() == pixels);
    } catch (const Error&) {
    }
    return 0;
}
