// libFuzzer target: OBJ text. Must give a valid scene of finite numbers or an Error; seeds: the shared .obj files.
#include <lambent/io/obj.hpp>
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
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    try {
        const Scene<float> scene = parse_obj(text, "/nonexistent/fuzz.obj"); // no folder: no library, no texture
        for (const Vec3f& p : scene.positions) demand(is_finite(p));
        for (const Vec3f& n : scene.normals) demand(is_finite(n) && (n == Vec3f(0) || std::abs(length(n) - 1) < 1e-5f));
        for (const Vec2f& t : scene.texcoords) demand(is_finite(t.x) && is_finite(t.y));
        for (const Vec4f& c : scene.colors) demand(is_finite(Vec3f(c)) && c.w == 1);
        demand(scene.triangles.size() <= size / 2); // a corner is two bytes at least
        demand(scene.notes.size() <= 16);
    } catch (const Error&) {
    }
    return 0;
}
