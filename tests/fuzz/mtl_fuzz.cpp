// libFuzzer target: MTL text. Must give materials that stand for surfaces in their ranges, or an Error.
// Seeds: the shared .mtl files.
#include <lambent/io/mtl_surface.hpp>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace {

void demand(bool holds) {
    if (!holds) std::abort();
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace lambent;
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    const std::string name = "fuzz.mtl";
    std::map<std::string, detail::MtlMaterial> materials;
    std::vector<std::string> notes;
    try {
        detail::parse_mtl(detail::ObjLines(text, name), materials, notes);
    } catch (const Error&) {
    }
    demand(materials.size() <= size / 6 + 1 && notes.size() <= 4);
    const auto unit = [](float x) { return x >= 0 && x <= 1; };
    const auto color = [&](const Vec3f& c) { return unit(c.x) && unit(c.y) && unit(c.z); };
    for (const auto& entry : materials) {
        const detail::MtlSurface s = detail::surface_of(entry.second);
        demand(color(s.base_color) && color(s.sheen_color) && unit(s.alpha) && unit(s.metallic) && unit(s.roughness));
        demand(unit(s.specular) && unit(s.transmission) && unit(s.clearcoat) && unit(s.clearcoat_roughness));
        demand(is_finite(s.ior) && s.ior >= 1 && is_finite(s.emission) && min_component(s.emission) >= 0);
        demand(is_finite(s.specular_color) && min_component(s.specular_color) >= 0);
        const detail::MtlMap& map = entry.second.diffuse_map;
        demand(is_finite(map.offset.x) && is_finite(map.offset.y) && is_finite(map.scale.x) && is_finite(map.scale.y));
        demand(map.file.find('\n') == map.file.npos && map.file.find('\\') == map.file.npos);
    }
    return 0;
}
