// libFuzzer target: .gltf and .glb files. Must give a scene whose indices lead somewhere, or an Error. Seeds: the
// shared files.
#include <lambent/core/parallel.hpp>
#include <lambent/io/gltf.hpp>
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
    LoadOptions options;
    options.max_triangles = options.max_vertices = 1 << 16;
    options.max_nodes = 1 << 12;
    options.max_pixels = 1 << 14;
    SerialExecutor serial;
    try { // no folder: no buffer and no image from files
        const Scene<float> scene = load_gltf_bytes<float>(bytes, "/nonexistent/fuzz.gltf", options, serial);
        demand(scene.triangles.size() <= options.max_triangles);
        for (const Vec3f& p : scene.positions) demand(is_finite(p));
        for (const auto& t : scene.triangles)
            for (int i = 0; i < 3; ++i) demand(std::size_t(t[i]) < scene.positions.size());
        for (const auto material : scene.triangle_materials) demand(std::size_t(material) < scene.materials.size());
    } catch (const Error&) {
    }
    return 0;
}
