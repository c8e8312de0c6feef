#pragma once
#include <lambent/core/bounds.hpp>
#include <lambent/core/error.hpp>
#include <lambent/core/vec.hpp>
#include <lambent/io/file.hpp>
#include <lambent/io/load_options.hpp>
#include <lambent/io/mtl.hpp>
#include <lambent/io/mtl_surface.hpp>
#include <lambent/io/obj_text.hpp>
#include <lambent/io/obj_vertices.hpp>
#include <lambent/io/polygon.hpp>
#include <lambent/io/recentre.hpp>
#include <lambent/io/scene_root.hpp>
#include <lambent/io/textures.hpp>
#include <lambent/scene/attributes.hpp>
#include <lambent/scene/scene.hpp>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Reads one OBJ file. Vertices are the distinct corners of its faces.
template <class T>
class ObjLoader {
public:
    /// `path` is for messages, and libraries and textures are looked for beside it.
    ObjLoader(const std::string& path, const LoadOptions& options) : path_(path), options_(options) {}

    template <class E>
    Scene<T> load(ObjLines lines, E& executor) {
        // About as many v as a text full of them has, within a bound, since a file's size is cheap to claim.
        const std::size_t expected = std::min(lines.size() / 32, most_expected);
        v_.reserve(expected);
        vertices_.reserve(expected);
        while (lines.next()) parse_line(lines);
        store_vertices();
        store_materials(executor);
        store_notes();
        add_tangents(scene_);
        return std::move(scene_);
    }

private:
    static constexpr std::uint32_t none = ObjVertices::none;
    static constexpr std::size_t most_libraries = 1024, most_expected = std::size_t(1) << 21;

    void parse_line(const ObjLines& lines) {
        ObjWords words(lines);
        if (words.done()) return;
        const std::string_view key = words.word();
        if (key.size() == 1 && key[0] == 'v') {
            parse_position(lines, words);
        } else if (key.size() == 1 && key[0] == 'f') {
            parse_face(lines, words);
        } else if (key == "vt") {
            const double u = words.number<float>(), v = words.no_more() ? 0 : words.number<float>();
            vt_.push_back({float(u), 1 - float(v)}); // our v grows downwards
            limit(lines, vt_.size(), "texture coordinates");
        } else if (key == "vn") {
            const double x = words.number<float>(), y = words.number<float>(), z = words.number<float>();
            const double size = length(Vec3d(x, y, z));
            vn_.push_back(size > 0 ? Vec3f(Vec3d(x, y, z) / size) : Vec3f(0));
            limit(lines, vn_.size(), "normals");
        } else if (key == "fo") { // fo: a face of the format's first version
            parse_face(lines, words);
        } else if (key == "usemtl") {
            material_ = material_index(words.rest());
        } else if (key == "s") {
            parse_smoothing(lines, words.word());
        } else if (key == "mtllib") {
            parse_libraries(lines, words);
        } else if (key == "p" || key == "l") {
            points_and_lines_.add(lines);
        } else if (key == "curv" || key == "surf" || key == "curv2") {
            curves_.add(lines);
        } else if (key.front() != '#' && !ignored(key)) {
            unknown_.add(lines, key);
        }
    }

    /// Statements of the format that say nothing about a surface's triangles.
    static bool ignored(std::string_view key) {
        static constexpr std::string_view known[] = {
            "g",    "o",      "mg",     "vp",   "deg", "bmat",       "step",      "cstype",   "parm",
            "trim", "hole",   "scrv",   "sp",   "end", "con",        "bevel",     "c_interp", "d_interp",
            "lod",  "maplib", "usemap", "call", "csh", "shadow_obj", "trace_obj", "ctech",    "stech"};
        return std::find(std::begin(known), std::end(known), key) != std::end(known);
    }

    void limit(const ObjLines& lines, std::size_t size, const char* what) const {
        if (size > options_.max_vertices || size >= ObjVertices::smooth)
            lines.refuse("over the limit of " + std::to_string(options_.max_vertices) + " " + what);
    }

    void parse_position(const ObjLines& lines, ObjWords& words) {
        double x[7];
        int count = 0;
        for (; count < 7 && !words.no_more(); ++count) x[count] = words.number<T>();
        if (count < 3) lines.refuse("a vertex of " + std::to_string(count) + " numbers; three are needed");
        if (count >= 6) {
            vertex_colors_.resize(v_.size(), Vec3f(1));
            const double* rgb = x + count - 3;
            vertex_colors_.push_back({float(rgb[0]), float(rgb[1]), float(rgb[2])});
        }
        v_.push_back({x[0], x[1], x[2]});
        vertices_.add_position();
        limit(lines, v_.size(), "vertices");
    }

    /// An index of a corner, 1-based or, negative, from the end of what has been read, as an index from 0.
    /// `none` when it is out of range
    std::uint32_t parse_index(const ObjLines& lines, ObjWords& words, std::size_t size, const ObjWords& corner) const {
        std::int64_t index = 0;
        if (!words.take_integer(index))
            refuse_corner(lines, corner, "is not v, v/vt, v//vn or v/vt/vn in whole numbers");
        const std::int64_t at = index < 0 ? std::int64_t(size) + index : index - 1;
        return index == 0 || at < 0 || at >= std::int64_t(size) ? none : std::uint32_t(at);
    }

    [[noreturn]] static void refuse_corner(const ObjLines& lines, ObjWords corner, const std::string& why) {
        lines.refuse("a face's corner " + quoted(corner.word()) + " " + why);
    }

    ObjVertices::Corner parse_corner(const ObjLines& lines, ObjWords& words) {
        const ObjWords start = words;
        ObjVertices::Corner corner;
        corner.v = parse_index(lines, words, v_.size(), start);
        if (corner.v == none)
            refuse_corner(lines, start, "refers to none of the " + std::to_string(v_.size()) + " vertices before it");
        // The surface stands without the other two, so a wrong one only costs it the attribute.
        const auto attribute = [&](std::size_t size) {
            if (words.at_word_end()) return none;
            const std::uint32_t index = parse_index(lines, words, size, start);
            if (index == none) wrong_attributes_.add(lines);
            return index;
        };
        if (words.take('/')) {
            if (!words.take('/')) {
                corner.vt = attribute(vt_.size());
                if (words.take('/')) corner.normal = attribute(vn_.size());
            } else {
                corner.normal = attribute(vn_.size());
            }
        }
        if (!words.at_word_end()) refuse_corner(lines, start, "goes on after its indices");
        words.end_word();
        if (corner.normal == none) corner.normal = smoothing_;
        return corner;
    }

    void parse_face(const ObjLines& lines, ObjWords& words) {
        polygon_.clear();
        while (!words.no_more()) polygon_.push_back(parse_corner(lines, words));
        if (polygon_.size() < 3) return short_faces_.add(lines);
        if (scene_.triangles.size() + polygon_.size() - 2 > options_.max_triangles)
            lines.refuse("over the limit of " + std::to_string(options_.max_triangles) + " triangles");
        if (material_ == none) material_ = material_index("");
        corners_.clear();
        for (const ObjVertices::Corner& corner : polygon_) {
            has_normals_ |= corner.normal != none;
            has_smoothed_ |= corner.smoothed();
            corners_.push_back(vertices_.index_of(corner));
        }
        if (corners_.size() == 3) return add_triangle({0, 1, 2});
        outline_.clear();
        for (const ObjVertices::Corner& corner : polygon_) outline_.push_back(v_[corner.v]);
        for (const Triangulator::Triangle& t : triangulate_(outline_)) add_triangle(t);
    }

    void add_triangle(const Triangulator::Triangle& t) {
        scene_.triangles.push_back({corners_[t[0]], corners_[t[1]], corners_[t[2]]});
        scene_.triangle_materials.push_back(material_);
    }

    void parse_smoothing(const ObjLines& lines, std::string_view group) {
        double number = group == "on" ? 1 : 0;
        const bool known = group.empty() || group == "on" || group == "off" ||
                           (parse_number(group, number) && number >= 0 && number <= double(ObjVertices::most_groups) &&
                            number == std::floor(number));
        if (!known) wrong_groups_.add(lines, group);
        smoothing_ = known && number > 0 ? ObjVertices::smooth | std::uint32_t(number) : none;
    }

    std::uint32_t material_index(std::string_view name) {
        const auto [it, added] = material_names_.emplace(name, std::uint32_t(scene_.materials.size()));
        if (added) scene_.materials.emplace_back().name = name;
        return it->second;
    }

    /// Where a file that the scene names lies: the one place that turns names into paths.
    std::string path_of(std::string name) const {
        std::replace(name.begin(), name.end(), '\\', '/');
        std::replace(name.begin(), name.end(), '\0', '?'); // at which a path would end
        return folder_of(path_) + name;
    }

    /// One library whose name has spaces, if there is such a file, else one a word.
    void parse_libraries(const ObjLines& lines, ObjWords& words) {
        const std::string whole(words.rest());
        if (parse_library(whole)) return;
        while (!words.done())
            if (const std::string name(words.word()); name == whole || !parse_library(name))
                missing_libraries_.add(lines, name);
    }

    /// Each file is read once, and the file system asked for so many names: a scene may repeat itself endlessly.
    bool parse_library(const std::string& name) {
        if (const auto known = libraries_.find(name); known != libraries_.end()) return known->second;
        if (libraries_.size() >= most_libraries) return false;
        const std::string file = path_of(name);
        std::error_code error;
        const bool found = std::filesystem::is_regular_file(file, error) && is_inside(root_of(path_, options_), file);
        libraries_.emplace(name, found);
        if (found && library_files_.insert(std::filesystem::canonical(file, error).string()).second)
            parse_mtl(ObjLines(file), definitions_, scene_.notes);
        return found;
    }

    void store_vertices() {
        const std::uint32_t count = std::uint32_t(vertices_.size());
        if (has_normals_) {
            scene_.normals.reserve(count);
            for (std::uint32_t i = 0; i < count; ++i) {
                const ObjVertices::Corner& corner = vertices_[i];
                const bool given = corner.normal != none && !corner.smoothed();
                scene_.normals.push_back(given ? vn_[corner.normal] : Vec3f(0));
            }
            if (has_smoothed_) smooth_normals(vertices_, v_, scene_.triangles, scene_.normals);
        }
        vn_ = {};
        Bounds3<double> bounds;
        for (std::uint32_t i = 0; i < count; ++i) bounds.add(v_[vertices_[i].v]);
        scene_.origin = scene_origin(bounds);
        scene_.positions.reserve(count);
        for (std::uint32_t i = 0; i < count; ++i)
            scene_.positions.push_back(Vec3<T>(v_[vertices_[i].v] - scene_.origin));
        if (!vertex_colors_.empty()) {
            vertex_colors_.resize(v_.size(), Vec3f(1));
            scene_.colors.reserve(count);
            for (std::uint32_t i = 0; i < count; ++i) scene_.colors.push_back(Vec4f(vertex_colors_[vertices_[i].v], 1));
        }
        v_ = {};
        if (!vertices_.has_texcoords()) return;
        scene_.texcoords.reserve(count);
        for (std::uint32_t i = 0; i < count; ++i)
            scene_.texcoords.push_back(vertices_[i].vt == none ? Vec2f(0) : vt_[vertices_[i].vt]);
    }

    template <class E>
    void store_materials(E& executor) {
        ImageLibrary library;
        for (Material& material : scene_.materials) {
            const auto known = definitions_.find(material.name);
            if (known == definitions_.end()) {
                if (!material.name.empty()) ++undefined_;
                continue;
            }
            const MtlMaterial& mtl = known->second;
            const MtlSurface surface = surface_of(mtl);
            material.base_color = surface.base_color;
            material.emission = surface.emission;
            material.alpha = surface.alpha;
            material.metallic = surface.metallic;
            material.roughness = surface.roughness;
            material.ior = surface.ior;
            material.specular = surface.specular;
            material.specular_color = surface.specular_color;
            material.transmission = surface.transmission;
            if (surface.transmission > 0 && (mtl.illumination == 6 || mtl.illumination == 7)) material.thickness = 1;
            material.clearcoat = surface.clearcoat;
            material.clearcoat_roughness = surface.clearcoat_roughness;
            material.sheen_color = surface.sheen_color;
            material.sheen_roughness = surface.sheen_roughness;
            if (surface.transmission <= 0) material.base_color_texture = texture(library, mtl.diffuse_map, ColorSpace::srgb);
            material.emission_texture = texture(library, mtl.emission_map, ColorSpace::srgb);
            material.normal_texture = texture(library, mtl.normal_map, ColorSpace::linear);
            // A Ke of 0 beside a map_Ke is what exporters write by default; the map alone counts then.
            if (material.emission_texture && is_black(material.emission)) material.emission = Vec3f(1);
            material.alpha_texture = texture(library, mtl.opacity_map, ColorSpace::linear);
            if (material.alpha_texture) material.alpha_mode = AlphaMode::mask;
            else if (material.alpha < 1) material.alpha_mode = AlphaMode::blend;
            for (const MtlMap* map : {&mtl.specular_map, &mtl.shininess_map, &mtl.bump_map, &mtl.roughness_map, &mtl.metallic_map})
                if (!map->file.empty()) ++unused_maps_;
        }
        library.store(scene_, options_.images, executor);
    }

    Texture texture(ImageLibrary& library, const MtlMap& map, ColorSpace space) {
        Texture out;
        if (map.file.empty()) return out;
        out.color_space = space;
        if (map.clamp) out.wrap_u = out.wrap_v = Wrap::clamp;
        out.row_u = {map.scale.x, 0};
        out.row_v = {0, map.scale.y};
        out.shift = {map.offset.x, 1 - map.scale.y - map.offset.y}; // the file's v grows upwards
        const std::string file = path_of(map.file);
        out.image = library.get(file, [this, file] {
            check_inside(root_of(path_, options_), file, path_);
            return read_texture(file, options_.max_pixels);
        });
        return out;
    }

    void store_notes() {
        const auto note = [&](const Counted& counted, const char* what) { counted.note(path_, what, scene_.notes); };
        note(short_faces_, "faces of fewer than three corners were skipped");
        note(wrong_attributes_, "corners have a texture or normal index out of range, which is ignored");
        note(wrong_groups_, "smoothing groups are no whole numbers and count as off");
        note(points_and_lines_, "point or line elements were skipped");
        note(curves_, "curves and surfaces were skipped");
        note(unknown_, "lines begin with an unknown word and were skipped");
        note(missing_libraries_, "material libraries are missing");
        note({.count = undefined_}, "materials are used but defined nowhere and show a grey of 0.8");
        note({.count = unused_maps_}, "maps of Ks, Ns, bumps, Pr and Pm are not applied");
    }

    std::string path_;
    LoadOptions options_;
    Scene<T> scene_;
    std::vector<Vec3d> v_;
    std::vector<Vec2f> vt_;
    std::vector<Vec3f> vn_, vertex_colors_; ///< colours: of the first so many v, or none
    ObjVertices vertices_;
    bool has_normals_ = false, has_smoothed_ = false;
    std::uint32_t material_ = none;
    std::uint32_t smoothing_ = none; ///< the normal of a corner without vn
    std::map<std::string, std::uint32_t, std::less<>> material_names_;
    std::map<std::string, MtlMaterial> definitions_;
    std::map<std::string, bool> libraries_; ///< by the name in the scene: is there such a file?
    std::set<std::string> library_files_;
    std::vector<ObjVertices::Corner> polygon_;
    std::vector<std::uint32_t> corners_;
    std::vector<Vec3d> outline_;
    Triangulator triangulate_;
    Counted short_faces_, wrong_attributes_, wrong_groups_, points_and_lines_, curves_, unknown_, missing_libraries_;
    std::size_t undefined_ = 0, unused_maps_ = 0;
};

} // namespace detail

/// Loads a Wavefront OBJ file with its MTL libraries: triangles and polygons (concave ones cut properly),
/// vertex colours (taken as linear), normals where given; else smooth ones in a smoothing group (`s 1`), else flat.
/// Materials as mtl_surface.hpp says, with map_Kd, map_Ke, map_d (an alpha mask) and norm. A missing library or texture
/// is a note, and the surface shows its factors. Notes also count what was left out.
/// throws lambent::Error, with file and line, on malformed numbers, on vertex indices out of range, and over a limit
/// cost    one pass over the text, which is read in pieces; memory for 64 bytes a vertex beside the scene
template <class T = float, class E>
Scene<T> load_obj(const std::string& path, const LoadOptions& options, E& executor) {
    return detail::ObjLoader<T>(path, options).load(detail::ObjLines(path), executor);
}
/// The same, images decoded on the calling thread.
template <class T = float>
Scene<T> load_obj(const std::string& path, const LoadOptions& options = {}) {
    SerialExecutor serial;
    return load_obj<T>(path, options, serial);
}

/// The same of OBJ text in memory. `name` is for messages, and its folder is where libraries and textures are.
template <class T = float>
Scene<T> parse_obj(std::string_view text, const std::string& name, const LoadOptions& options = {}) {
    SerialExecutor serial;
    return detail::ObjLoader<T>(name, options).load(detail::ObjLines(text, name), serial);
}

} // namespace LAMBENT_ABI
} // namespace lambent
