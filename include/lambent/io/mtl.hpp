#pragma once
#include <lambent/core/vec.hpp>
#include <lambent/io/obj_text.hpp>
#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// One map_… statement.
struct MtlMap {
    std::string file;          ///< as written, backslashes turned; empty = none
    bool clamp = false;        ///< -clamp on: no repetition
    bool moved = false;        ///< has -o, -s or -t
    Vec2f offset{0}, scale{1}; ///< -o, -s: the texture is looked up at scale · (u, v) + offset, v upwards
    float bump = 1;            ///< -bm: multiplies heights
    float base = 0, gain = 1;  ///< -mm: a value x stands for base + gain · x
    char channel = 0;          ///< -imfchan: r g b m l z, or 0 = as usual for the map
};

/// One material of an MTL file. What is not set there is unset, or the format's default.
struct MtlMaterial {
    Vec3f diffuse{0.8f};                              ///< Kd
    std::optional<Vec3f> specular, emission, ambient; ///< Ks, Ke, Ka
    std::optional<Vec3f> filter;                      ///< Tf: what glass lets through
    std::optional<float> shininess;                   ///< Ns, >= 0
    std::optional<float> index;                       ///< Ni, of refraction
    float opacity = 1;                                ///< d, else 1 - Tr; in [0, 1]
    std::optional<int> illumination;                  ///< illum, 0 to 10

    // Extension for physically based shading: http://exocortex.com/blog/extending_wavefront_mtl_to_support_pbr
    std::optional<float> roughness, metallic, sheen;      ///< Pr, Pm, Ps
    std::optional<float> clearcoat, clearcoat_roughness;  ///< Pc, Pcr
    std::optional<float> anisotropy, anisotropy_rotation; ///< aniso, anisor

    MtlMap diffuse_map, specular_map, shininess_map, emission_map, opacity_map; ///< map_Kd, _Ks, _Ns, _Ke, _d
    MtlMap bump_map, normal_map;                                                ///< map_bump or bump; norm
    MtlMap roughness_map, metallic_map;                                         ///< map_Pr, map_Pm
};

/// Reads an MTL file's statements into materials by name.
class MtlParser {
public:
    MtlParser(std::map<std::string, MtlMaterial>& materials, std::vector<std::string>& notes)
        : materials_(&materials), notes_(&notes) {}

    void parse(ObjLines lines) {
        while (lines.next()) parse_line(lines);
        const auto note = [&](const Counted& counted, const char* what) { counted.note(lines.name(), what, *notes_); };
        note(unknown_, "lines begin with an unknown word and were skipped");
        note(options_, "texture options have wrong values and were skipped");
        note(orphans_, "lines before any newmtl were skipped");
        note(repeated_, "materials are defined more than once, the last definition counts");
    }

private:
    void parse_line(const ObjLines& lines) {
        ObjWords words(lines);
        if (words.no_more()) return;
        const std::string_view key = words.word();
        if (key == "newmtl") {
            std::string name(words.rest());
            const auto [at, is_new] = materials_->insert_or_assign(std::move(name), MtlMaterial{});
            if (!is_new) repeated_.add(lines, at->first);
            current_ = &at->second;
            has_d_ = false;
        } else if (current_ == nullptr) {
            orphans_.add(lines, key);
        } else if (!words.no_more() && !parse_value(words, key) && !parse_texture(lines, words, key) && !ignored(key)) {
            unknown_.add(lines, key);
        }
    }

    bool parse_value(ObjWords& words, std::string_view key) {
        MtlMaterial& m = *current_;
        const auto number = [&] { return float(words.number<float>()); };
        if (key == "Kd") {
            if (const auto color = parse_color(words)) m.diffuse = *color;
        } else if (key == "Ks") {
            m.specular = parse_color(words);
        } else if (key == "Ke") {
            m.emission = parse_color(words);
        } else if (key == "Ka") {
            m.ambient = parse_color(words);
        } else if (key == "Tf") {
            m.filter = parse_color(words);
        } else if (key == "Ns") {
            m.shininess = std::max(number(), 0.0f);
        } else if (key == "Ni") {
            m.index = number();
        } else if (key == "d") {
            if (words.starts_with("-halo")) words.word();
            m.opacity = std::clamp(number(), 0.0f, 1.0f);
            has_d_ = true;
        } else if (key == "Tr") { // exporters write both, and some mean d by it
            const float transparency = number();
            if (!has_d_) m.opacity = std::clamp(1 - transparency, 0.0f, 1.0f);
        } else if (key == "illum") {
            const double model = words.number();
            if (model >= 0 && model <= 10) m.illumination = int(model);
        } else if (key == "Pr") {
            m.roughness = number();
        } else if (key == "Pm") {
            m.metallic = number();
        } else if (key == "Ps") {
            m.sheen = number();
        } else if (key == "Pc") {
            m.clearcoat = number();
        } else if (key == "Pcr") {
            m.clearcoat_roughness = number();
        } else if (key == "aniso") {
            m.anisotropy = number();
        } else if (key == "anisor") {
            m.anisotropy_rotation = number();
        } else {
            return false;
        }
        return true;
    }

    bool parse_texture(const ObjLines& lines, ObjWords& words, std::string_view key) {
        struct Known {
            std::string_view key;
            MtlMap MtlMaterial::*map;
        };
        static constexpr Known known[] = {
            {"map_Kd", &MtlMaterial::diffuse_map},   {"map_Ks", &MtlMaterial::specular_map},
            {"map_Ns", &MtlMaterial::shininess_map}, {"map_Ke", &MtlMaterial::emission_map},
            {"map_d", &MtlMaterial::opacity_map},    {"map_bump", &MtlMaterial::bump_map},
            {"map_Bump", &MtlMaterial::bump_map},    {"bump", &MtlMaterial::bump_map},
            {"norm", &MtlMaterial::normal_map},      {"map_Pr", &MtlMaterial::roughness_map},
            {"map_Pm", &MtlMaterial::metallic_map}};
        const auto found =
            std::find_if(std::begin(known), std::end(known), [&](const Known& k) { return k.key == key; });
        if (found == std::end(known)) return false;
        current_->*(found->map) = parse_map(lines, words);
        return true;
    }

    /// Statements that say nothing which we could show.
    static bool ignored(std::string_view key) {
        static constexpr std::string_view known[] = {
            "map_Ka", "map_Ps", "map_Pc", "map_Pcr",   "map_aniso", "map_anisor", "disp",     "decal",
            "refl",   "Km",     "Kt",     "sharpness", "map_refl",  "map_aat",    "map_Disp", "map_disp"};
        return std::find(std::begin(known), std::end(known), key) != std::end(known);
    }

    /// r g b, or one number for grey; unset for "spectral" and "xyz".
    static std::optional<Vec3f> parse_color(ObjWords& words) {
        if (words.starts_with("spectral") || words.starts_with("xyz")) return std::nullopt;
        Vec3f color(float(words.number<float>()));
        for (int k = 1; k < 3 && !words.no_more(); ++k) color[k] = float(words.number<float>());
        return color;
    }

    /// [-option values …] name with spaces.png [-option values …]
    MtlMap parse_map(const ObjLines& lines, ObjWords& words) {
        MtlMap map;
        for (;;) {
            const std::string_view option = ObjWords(words).word();
            const Option read = parse_option(words, map);
            if (read == Option::none) break;
            if (read == Option::wrong) options_.add(lines, option);
        }
        // Options behind the name are none of the format's, but are met with: one or a few, up to the line's end.
        std::string_view name = words.rest();
        std::size_t at = name.size(), end = at;
        for (int k = 0; k < most_behind && at > 0 && (at = name.rfind(" -", at - 1)) != name.npos; ++k) {
            ObjWords behind(lines, name.substr(at));
            MtlMap with = map;
            while (parse_option(behind, with) == Option::right) continue;
            if (behind.done()) end = at;
        }
        if (end < name.size()) {
            ObjWords behind(lines, name.substr(end));
            while (parse_option(behind, map) == Option::right) continue;
            name = name.substr(0, end);
        }
        map.file = name.substr(0, name.find_last_not_of(" \t") + 1);
        std::replace(map.file.begin(), map.file.end(), '\\', '/');
        if (map.file.empty()) options_.add(lines, "no file name");
        return map;
    }
    static constexpr int most_behind = 8;

    enum class Option { none, right, wrong };

    /// One option with its values; where there is none, nothing moves.
    static Option parse_option(ObjWords& words, MtlMap& map) {
        if (!words.starts_with("-")) return Option::none;
        const ObjWords before = words;
        const std::string_view option = words.word();
        float x[3];
        const auto numbers = [&](int most) {
            int count = 0;
            double value = 0;
            for (ObjWords here = words; count < most && !here.done() && here.try_number(value); words = here)
                x[count++] = float(std::clamp(value, -1e30, 1e30));
            return count;
        };
        const auto one_of = [&](std::initializer_list<std::string_view> allowed) {
            ObjWords here = words;
            const auto value = std::find(allowed.begin(), allowed.end(), here.word());
            if (value == allowed.end()) return std::string_view();
            words = here;
            return *value;
        };
        bool right = true;
        if (option == "-o" || option == "-s") {
            const int count = numbers(3);
            Vec2f& target = option == "-o" ? map.offset : map.scale;
            for (int k = 0; k < std::min(count, 2); ++k) target[k] = x[k];
            map.moved = true;
            right = count > 0;
        } else if (option == "-t") {
            map.moved = true;
            right = numbers(3) > 0;
        } else if (option == "-mm") {
            const int count = numbers(2);
            if (count > 0) map.base = x[0];
            if (count > 1) map.gain = x[1];
            right = count > 0;
        } else if (option == "-bm") {
            right = numbers(1) == 1;
            if (right) map.bump = x[0];
        } else if (option == "-boost" || option == "-texres") {
            right = numbers(1) == 1;
        } else if (option == "-clamp") {
            const std::string_view clamp = one_of({"on", "off"});
            map.clamp = clamp == "on";
            right = !clamp.empty();
        } else if (option == "-blendu" || option == "-blendv" || option == "-cc") {
            right = !one_of({"on", "off"}).empty();
        } else if (option == "-imfchan") {
            const std::string_view channel = one_of({"r", "g", "b", "m", "l", "z"});
            right = !channel.empty();
            if (right) map.channel = channel.front();
        } else if (option == "-type") {
            right = !one_of({"sphere", "cube_top", "cube_bottom", "cube_front", "cube_back", "cube_left", "cube_right"})
                         .empty();
        } else {
            words = before; // a name that starts with a minus sign
            return Option::none;
        }
        return right ? Option::right : Option::wrong;
    }

    std::map<std::string, MtlMaterial>* materials_;
    std::vector<std::string>* notes_;
    MtlMaterial* current_ = nullptr;
    bool has_d_ = false;
    Counted unknown_, options_, orphans_, repeated_;
};

/// Adds the materials of an MTL file by name; a name's last definition counts.
/// throws lambent::Error with file and line on a malformed number
inline void parse_mtl(ObjLines lines, std::map<std::string, MtlMaterial>& materials, std::vector<std::string>& notes) {
    MtlParser(materials, notes).parse(std::move(lines));
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
