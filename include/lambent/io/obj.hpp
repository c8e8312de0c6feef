#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/vec.hpp>
#include <lambent/io/file.hpp>
#include <lambent/io/load_options.hpp>
#include <lambent/io/mtl.hpp>
#include <lambent/io/obj_text.hpp>
#include <lambent/io/polygon.hpp>
#include <lambent/io/recentre.hpp>
#include <lambent/io/scene_root.hpp>
#include <lambent/io/textures.hpp>
#include <lambent/scene/scene.hpp>
#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Reads one OBJ file. Vertices are the distinct (v, vt, vn) triples of its faces.
template <class T>
class ObjLoader {
public:
    ObjLoader(const std::string& path, const LoadOptions& options) : path_(path), options_(options) {}

    template <class E>
    Scene<T> load(E& executor) {
        parse();
        store_vertices();
        store_materials(executor);
        store_notes();
        scene_.validate();
        return std::move(scene_);
    }

private:
    static constexpr std::uint32_t none = 0xffffffffu;
    struct Vertex {
        std::uint32_t v, vt, vn;
        std::uint32_t next; ///< the next vertex of the same v, or none
    };

    void parse() {
        const std::string text = read_file(path_);
        ObjLines lines(text, path_);
        while (lines.next()) {
            ObjWords words(lines);
            if (words.done()) continue;
            const std::string_view key = words.word();
            if (key == "v") {
                parse_position(lines, words);
            } else if (key == "vt") {
                const float u = float(words.number());
                vt_.push_back({u, words.done() ? 1.0f : 1 - float(words.number())}); // our v grows downwards
            } else if (key == "vn") {
                const double x = words.number(), y = words.number(), z = words.number();
                const double size = length(Vec3d(x, y, z));
                vn_.push_back(size > 0 ? Vec3f(Vec3d(x, y, z) / size) : Vec3f(0));
            } else if (key == "f") {
                parse_face(lines, words);
            } else if (key == "usemtl") {
                material_ = material_index(std::string(words.rest()));
            } else if (key == "mtllib") {
                parse_libraries(words);
            } else if (key == "p" || key == "l") {
                ++points_and_lines_;
            } else if (key == "curv" || key == "surf" || key == "curv2") {
                ++curves_;
            }
        }
    }

    void parse_position(const ObjLines& lines, ObjWords& words) {
        double x[7];
        int count = 0;
        for (; count < 7 && !words.done(); ++count) x[count] = words.number();
        if (count < 3) lines.refuse("a vertex of " + std::to_string(count) + " numbers; three are needed");
        if (count >= 6) {
            vertex_colors_.resize(v_.size(), Vec3f(1));
            const double* rgb = x + count - 3;
            vertex_colors_.push_back({float(rgb[0]), float(rgb[1]), float(rgb[2])});
        }
        v_.push_back({x[0], x[1], x[2]});
        first_.push_back(none);
        require(v_.size() <= options_.max_vertices && v_.size() < none, [&] {
            return path_ + ": over the limit of " + std::to_string(options_.max_vertices) + " vertices";
        });
    }

    /// One index of "v/vt/vn", 1-based or, negative, from the end of what has been read; `text` moves on.
    /// `none` when it is out of range.
    std::uint32_t parse_index(const ObjLines& lines, std::string_view& text, std::size_t size,
                              const char* what) {
        if (text.starts_with('+')) text.remove_prefix(1);
        std::int64_t index = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), index);
        if (error != std::errc() || (end != text.data() + text.size() && *end != '/'))
            lines.refuse(std::string("'") + std::string(text) + "' is not a " + what + " index");
        text.remove_prefix(std::size_t(end - text.data()));
        const std::int64_t at = index < 0 ? std::int64_t(size) + index : index - 1;
        return index == 0 || at < 0 || at >= std::int64_t(size) ? none : std::uint32_t(at);
    }

    std::uint32_t parse_corner(const ObjLines& lines, std::string_view text) {
        const std::string_view corner = text;
        const std::uint32_t v = parse_index(lines, text, v_.size(), "vertex");
        if (v == none)
            lines.refuse("corner '" + std::string(corner) + "' refers to none of the " +
                         std::to_string(v_.size()) + " vertices before it");
        // The surface stands without these two, so a wrong one only costs it the attribute.
        std::uint32_t vt = none, vn = none;
        if (text.starts_with('/')) {
            text.remove_prefix(1);
            if (!text.empty() && text.front() != '/') {
                vt = parse_index(lines, text, vt_.size(), "texture");
                if (vt == none) ++wrong_attributes_;
            }
            if (text.starts_with('/')) {
                text.remove_prefix(1);
                if (!text.empty()) {
                    vn = parse_index(lines, text, vn_.size(), "normal");
                    if (vn == none) ++wrong_attributes_;
                }
            }
        }
        if (!text.empty()) lines.refuse("'" + std::string(text) + "' after a face's corner");
        for (std::uint32_t i = first_[v]; i != none; i = vertices_[i].next)
            if (vertices_[i].vt == vt && vertices_[i].vn == vn) return i;
        vertices_.push_back({v, vt, vn, first_[v]});
        has_texcoords_ |= vt != none;
        has_normals_ |= vn != none;
        return first_[v] = std::uint32_t(vertices_.size() - 1);
    }

    void parse_face(const ObjLines& lines, ObjWords& words) {
        corners_.clear();
        while (!words.done()) corners_.push_back(parse_corner(lines, words.word()));
        if (corners_.size() < 3) {
            ++short_faces_;
            return;
        }
        require(scene_.triangles.size() + corners_.size() - 2 <= options_.max_triangles, [&] {
            return path_ + ": over the limit of " + std::to_string(options_.max_triangles) + " triangles";
        });
        if (material_ == none) material_ = material_index("");
        if (corners_.size() == 3) {
            scene_.triangles.push_back({corners_[0], corners_[1], corners_[2]});
            scene_.triangle_materials.push_back(material_);
            return;
        }
        outline_.clear();
        for (const std::uint32_t c : corners_) outline_.push_back(v_[vertices_[c].v]);
        for (const auto& t : triangulate_(outline_)) {
            scene_.triangles.push_back({corners_[t[0]], corners_[t[1]], corners_[t[2]]});
            scene_.triangle_materials.push_back(material_);
        }
    }

    std::uint32_t material_index(const std::string& name) {
        const auto [it, added] = material_names_.emplace(name, std::uint32_t(scene_.materials.size()));
        if (added) scene_.materials.emplace_back().name = name;
        return it->second;
    }

    /// One library whose name has spaces, if there is such a file, else one a word.
    void parse_libraries(ObjWords& words) {
        const std::string whole(words.rest());
        if (parse_library(whole)) return;
        std::vector<std::string> missing;
        while (!words.done())
            if (std::string name(words.word()); name == whole || !parse_library(name))
                missing.push_back(name);
        for (const std::string& name : missing)
            scene_.notes.push_back(path_ + ": material library '" + name + "' is missing");
    }

    bool parse_library(std::string name) {
        std::replace(name.begin(), name.end(), '\\', '/');
        const std::string file = folder_of(path_) + name;
        std::error_code error;
        if (!std::filesystem::is_regular_file(file, error)) return false;
        parse_mtl(read_file(file), file, definitions_);
        return true;
    }

    void store_vertices() {
        Bounds3<double> bounds;
        std::vector<Vec3d> positions;
        positions.reserve(vertices_.size());
        if (has_normals_) scene_.normals.reserve(vertices_.size());
        if (has_texcoords_) scene_.texcoords.reserve(vertices_.size());
        if (!vertex_colors_.empty()) vertex_colors_.resize(v_.size(), Vec3f(1));
        for (const Vertex& vertex : vertices_) {
            positions.push_back(v_[vertex.v]);
            bounds.add(positions.back());
            if (has_normals_) scene_.normals.push_back(vertex.vn == none ? Vec3f(0) : vn_[vertex.vn]);
            if (has_texcoords_) scene_.texcoords.push_back(vertex.vt == none ? Vec2f(0) : vt_[vertex.vt]);
            if (!vertex_colors_.empty()) scene_.colors.push_back(Vec4f(vertex_colors_[vertex.v], 1));
        }
        store_positions(scene_, positions, bounds);
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
            if (mtl.beyond_lambert) ++beyond_lambert_;
            if (mtl.diffuse_map.moved || mtl.emission_map.moved || mtl.opacity_map.moved) ++moved_;
            material.base_color = clamp(mtl.diffuse, Vec3f(0), Vec3f(1));
            material.base_color_texture = texture(library, mtl.diffuse_map, ColorSpace::srgb);
            material.emission_texture = texture(library, mtl.emission_map, ColorSpace::srgb);
            // A Ke of 0 beside a map_Ke is what exporters write by default; the map alone counts then.
            if (mtl.emission) material.emission = max(*mtl.emission, Vec3f(0));
            if (material.emission_texture && is_black(material.emission)) material.emission = Vec3f(1);
            material.alpha_texture = texture(library, mtl.opacity_map, ColorSpace::linear);
            if (material.alpha_texture) {
                material.alpha_mode = AlphaMode::mask;
            } else if (mtl.opacity < 1) {
                ++translucent_;
            }
        }
        library.store(scene_, options_.images, executor);
    }

    Texture texture(ImageLibrary& library, const MtlMap& map, ColorSpace space) {
        Texture out;
        if (map.file.empty()) return out;
        out.color_space = space;
        if (map.clamp) out.wrap_u = out.wrap_v = Wrap::clamp;
        const std::string file = folder_of(path_) + map.file;
        out.image = library.get(file, [this, file] {
            check_inside(root_of(path_, options_), file, path_);
            return read_texture(file, options_.max_pixels);
        });
        return out;
    }

    void store_notes() {
        const auto note = [&](std::size_t count, const char* what) {
            if (count > 0) scene_.notes.push_back(path_ + ": " + std::to_string(count) + " " + what);
        };
        note(short_faces_, "faces of fewer than three corners were skipped");
        note(wrong_attributes_, "corners have a texture or normal index out of range, which is ignored");
        note(points_and_lines_, "point or line elements were skipped");
        note(curves_, "curves and surfaces were skipped");
        note(undefined_, "materials are used but defined nowhere and show a grey of 0.8");
        note(translucent_, "materials with d < 1 are shown opaque");
        note(moved_, "materials have texture options -o, -s or -t, which are not applied");
        note(beyond_lambert_, "materials are mirrors, glass or metals and show their diffuse colour");
    }

    std::string path_;
    LoadOptions options_;
    Scene<T> scene_;
    std::vector<Vec3d> v_;
    std::vector<Vec2f> vt_;
    std::vector<Vec3f> vn_, vertex_colors_;
    std::vector<std::uint32_t> first_; ///< one a v: the first vertex made of it, or none
    std::vector<Vertex> vertices_;
    bool has_texcoords_ = false, has_normals_ = false;
    std::uint32_t material_ = none;
    std::map<std::string, std::uint32_t> material_names_;
    std::map<std::string, MtlMaterial> definitions_;
    std::vector<std::uint32_t> corners_;
    std::vector<Vec3d> outline_;
    Triangulator triangulate_;
    std::size_t short_faces_ = 0, wrong_attributes_ = 0, points_and_lines_ = 0, curves_ = 0;
    std::size_t undefined_ = 0, translucent_ = 0, moved_ = 0, beyond_lambert_ = 0;
};

} // namespace detail

/// Loads a Wavefront OBJ file with its MTL libraries: triangles and polygons (concave ones cut properly),
/// vertex colours (taken as linear), normals where given, else flat. Of a material: Kd times map_Kd, Ke times
/// map_Ke as emission from the front side, map_d as an alpha mask. A missing library or texture is a note,
/// and the surface shows its Kd. Notes also count what was left out.
/// throws lambent::Error, with file and line, on malformed numbers and on vertex indices out of range
/// cost    one pass over the text; memory about four times the file's size
template <class T = float, class E>
Scene<T> load_obj(const std::string& path, const LoadOptions& options, E& executor) {
    return detail::ObjLoader<T>(path, options).load(executor);
}
template <class T = float>
Scene<T> load_obj(const std::string& path, const LoadOptions& options = {}) {
    SerialExecutor serial;
    return load_obj<T>(path, options, serial);
}

} // namespace LAMBENT_ABI
} // namespace lambent
