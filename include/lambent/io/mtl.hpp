#pragma once
#include <lambent/io/obj_text.hpp>
#include <lambent/scene/scene.hpp>
#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// One map_… statement.
struct MtlMap {
    std::string file;                  ///< as written, backslashes turned; empty = none
    bool clamp = false, moved = false; ///< moved: -o, -s or -t, which we do not apply
};

/// One material of an MTL file, as far as it is used.
struct MtlMaterial {
    Vec3f diffuse{0.8f};
    std::optional<Vec3f> emission;
    float opacity = 1;
    MtlMap diffuse_map, emission_map, opacity_map;
    bool beyond_lambert = false; ///< a mirror or glass illumination model, or a metal
};

/// map_Kd [-option values …] name with spaces.png
inline MtlMap parse_mtl_map(ObjWords& words) {
    MtlMap map;
    while (!words.done() && words.rest().starts_with('-')) {
        ObjWords before = words;
        const std::string_view option = words.word();
        const auto numbers = [&](int most) {
            double ignored = 0;
            for (int k = 0; k < most && !words.done(); ++k) {
                const ObjWords here = words;
                if (!words.try_number(ignored) ||
                    words.done()) { // the last word is the name
                    words = here;
                    return;
                }
            }
        };
        if (option == "-o" || option == "-s" || option == "-t") {
            numbers(3);
            map.moved = true;
        } else if (option == "-mm") {
            numbers(2);
        } else if (option == "-bm" || option == "-boost" || option == "-texres") {
            numbers(1);
        } else if (option == "-clamp") {
            map.clamp = words.word() == "on";
        } else if (option == "-blendu" || option == "-blendv" || option == "-cc" || option == "-imfchan" ||
                   option == "-type") {
            words.word();
        } else {
            words = before; // a name that starts with a minus sign
            break;
        }
    }
    map.file = words.rest();
    std::replace(map.file.begin(), map.file.end(), '\\', '/');
    return map;
}

/// A colour: r g b, or one number for grey; unset for "spectral" and "xyz".
inline std::optional<Vec3f> parse_mtl_color(ObjWords& words) {
    if (words.rest().starts_with("spectral") || words.rest().starts_with("xyz")) return std::nullopt;
    Vec3f color(float(words.number()));
    for (int k = 1; k < 3 && !words.done(); ++k) color[k] = float(words.number());
    return color;
}

/// Adds the materials of an MTL file by name; a name's last definition counts.
/// throws lambent::Error with file and line on a malformed number
inline void parse_mtl(ObjLines lines, std::map<std::string, MtlMaterial>& materials, std::vector<std::string>&) {
    MtlMaterial* current = nullptr;
    while (lines.next()) {
        ObjWords words(lines);
        if (words.done()) continue;
        const std::string_view key = words.word();
        if (key == "newmtl") {
            current = &materials.insert_or_assign(std::string(words.rest()), MtlMaterial{}).first->second;
        } else if (current == nullptr || words.done()) {
            continue;
        } else if (key == "Kd") {
            if (const auto color = parse_mtl_color(words)) current->diffuse = *color;
        } else if (key == "Ke") {
            current->emission = parse_mtl_color(words);
        } else if (key == "d") {
            if (words.rest().starts_with("-halo")) words.word();
            if (!words.done()) current->opacity = float(words.number());
        } else if (key == "Tr") {
            current->opacity = 1 - float(words.number());
        } else if (key == "map_Kd") {
            current->diffuse_map = parse_mtl_map(words);
        } else if (key == "map_Ke") {
            current->emission_map = parse_mtl_map(words);
        } else if (key == "map_d") {
            current->opacity_map = parse_mtl_map(words);
        } else if (key == "illum") {
            current->beyond_lambert |= words.number() >= 3;
        } else if (key == "Pm") {
            current->beyond_lambert |= words.number() > 0;
        }
    }
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
