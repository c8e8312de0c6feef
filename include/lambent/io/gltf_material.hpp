#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/io/gltf_parse.hpp>
#include <lambent/io/load_options.hpp>
#include <lambent/io/notes.hpp>
#include <lambent/io/scene_root.hpp>
#include <lambent/io/textures.hpp>
#include <lambent/scene/scene.hpp>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <tiny_gltf.h>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// A number of an extension's object; `fallback` where it is absent or not a finite number.
inline double gltf_number(const tinygltf::Value& object, const char* key, double fallback) {
    if (!object.Has(key) || !object.Get(key).IsNumber()) return fallback;
    const double value = object.Get(key).GetNumberAsDouble();
    return is_finite(value) ? value : fallback;
}

/// An array of numbers of an extension's object; `fallback` where an entry is absent.
inline Vec3d gltf_numbers(const tinygltf::Value& object, const char* key, Vec3d fallback) {
    if (!object.Has(key) || !object.Get(key).IsArray()) return fallback;
    const tinygltf::Value& array = object.Get(key);
    for (int i = 0; i < 3 && std::size_t(i) < array.ArrayLen(); ++i)
        if (array.Get(i).IsNumber() && is_finite(array.Get(i).GetNumberAsDouble()))
            fallback[i] = array.Get(i).GetNumberAsDouble();
    return fallback;
}

/// The named extension's object, or a null value.
inline const tinygltf::Value& gltf_extension(const tinygltf::ExtensionMap& extensions, const char* name) {
    static const tinygltf::Value none;
    const auto it = extensions.find(name);
    return it != extensions.end() && it->second.IsObject() ? it->second : none;
}

/// Puts KHR_texture_transform into a texture: scale, then turn counter-clockwise as v grows downwards, then shift.
inline void set_gltf_transform(Texture& texture, const tinygltf::Value& transform) {
    if (!transform.IsObject()) return;
    const Vec3d shift = gltf_numbers(transform, "offset", {0, 0, 0});
    const Vec3d scale = gltf_numbers(transform, "scale", {1, 1, 1});
    const double angle = gltf_number(transform, "rotation", 0), c = std::cos(angle), n = std::sin(angle);
    texture.shift = Vec2f(float(shift.x), float(shift.y));
    texture.row_u = Vec2f(float(c * scale.x), float(n * scale.y));
    texture.row_v = Vec2f(float(-n * scale.x), float(c * scale.y));
}

/// Turns the materials of a validated model into ours.
template <class T>
class GltfMaterials {
public:
    GltfMaterials(const GltfModel& model, const std::string& path, const LoadOptions& options, Scene<T>& scene,
                  Notes& notes)
        : model_(model), path_(path), options_(options), scene_(scene), notes_(notes) {
        for (std::size_t i = 0; i < model_.materials.size(); ++i) add(model_.materials[i], pointer("materials", int(i)));
    }

    /// Index of glTF's default material, for primitives without one.
    std::uint32_t default_material() {
        if (default_ == none) {
            default_ = std::uint32_t(scene_.materials.size());
            Material& material = scene_.materials.emplace_back();
            material.base_color = Vec3f(1);
            material.metallic = 1;
            material.specular = 1;
            material.name = "default";
        }
        return default_;
    }

    /// Decodes the images, once all triangles are there.
    template <class E>
    void load_images(E& executor) { images_.store(scene_, options_.images, executor); }

private:
    static constexpr std::uint32_t none = 0xffffffffu;

    static std::string pointer(const char* array, int i) { return std::string("/") + array + "/" + std::to_string(i); }

    void add(const tinygltf::Material& in, const std::string& where) {
        Material m;
        m.name = in.name;
        const tinygltf::PbrMetallicRoughness& pbr = in.pbrMetallicRoughness;
        m.base_color = Vec3f(1);
        if (const std::vector<double>& base = pbr.baseColorFactor; base.size() == 4) {
            m.base_color = clamp(Vec3f(float(base[0]), float(base[1]), float(base[2])), Vec3f(0), Vec3f(1));
            m.alpha = unit(base[3]);
        }
        m.base_color_texture = texture(pbr.baseColorTexture, ColorSpace::srgb, where);
        m.metallic = unit(pbr.metallicFactor);
        m.roughness = unit(pbr.roughnessFactor);
        m.metallic_roughness_texture = texture(pbr.metallicRoughnessTexture, ColorSpace::linear, where);
        m.normal_texture = texture(in.normalTexture, ColorSpace::linear, where);
        m.normal_scale = float(in.normalTexture.scale);
        if (in.emissiveFactor.size() == 3)
            m.emission = {float(in.emissiveFactor[0]), float(in.emissiveFactor[1]), float(in.emissiveFactor[2])};
        m.emission_texture = texture(in.emissiveTexture, ColorSpace::srgb, where);
        m.alpha_cutoff = float(in.alphaCutoff);
        m.alpha_mode = in.alphaMode == "MASK"    ? AlphaMode::mask
                       : in.alphaMode == "BLEND" ? AlphaMode::blend
                                                 : AlphaMode::opaque;
        m.double_sided = in.doubleSided;
        m.front_only = !in.doubleSided;
        m.specular = 1;
        m.unlit = in.extensions.contains("KHR_materials_unlit");
        add_extensions(m, in, where);
        if (!m.emissive()) m.emission_texture = Texture();
        scene_.materials.push_back(std::move(m));
    }

    void add_extensions(Material& m, const tinygltf::Material& in, const std::string& where) {
        const auto object = [&](const char* name) -> const tinygltf::Value& { return gltf_extension(in.extensions, name); };
        const auto look_up = [&](const tinygltf::Value& extension, const char* key, ColorSpace space) {
            return texture(extension, key, space, where);
        };
        if (const auto& e = object("KHR_materials_emissive_strength"); e.IsObject())
            m.emission = max(m.emission * float(gltf_number(e, "emissiveStrength", 1)), Vec3f(0));
        if (const auto& e = object("KHR_materials_ior"); e.IsObject()) m.ior = float(gltf_number(e, "ior", 1.5));
        if (const auto& e = object("KHR_materials_specular"); e.IsObject()) {
            m.specular = unit(gltf_number(e, "specularFactor", 1));
            m.specular_texture = look_up(e, "specularTexture", ColorSpace::linear);
            m.specular_color = max(Vec3f(gltf_numbers(e, "specularColorFactor", Vec3d(1))), Vec3f(0));
            m.specular_color_texture = look_up(e, "specularColorTexture", ColorSpace::srgb);
        }
        if (const auto& e = object("KHR_materials_transmission"); e.IsObject()) {
            m.transmission = unit(gltf_number(e, "transmissionFactor", 0));
            m.transmission_texture = look_up(e, "transmissionTexture", ColorSpace::linear);
        }
        if (const auto& e = object("KHR_materials_volume"); e.IsObject()) {
            m.thickness = float(std::max(0.0, gltf_number(e, "thicknessFactor", 0)));
            m.attenuation_color =
                clamp(Vec3f(gltf_numbers(e, "attenuationColor", Vec3d(1))), Vec3f(0), Vec3f(1));
            const double distance = gltf_number(e, "attenuationDistance", 0);
            if (distance > 0) m.attenuation_distance = float(distance);
        }
        if (const auto& e = object("KHR_materials_clearcoat"); e.IsObject()) {
            m.clearcoat = unit(gltf_number(e, "clearcoatFactor", 0));
            m.clearcoat_roughness = unit(gltf_number(e, "clearcoatRoughnessFactor", 0));
            m.clearcoat_texture = look_up(e, "clearcoatTexture", ColorSpace::linear);
            m.clearcoat_roughness_texture = look_up(e, "clearcoatRoughnessTexture", ColorSpace::linear);
            if (e.Has("clearcoatNormalTexture"))
                notes_.add("materials have a normal map of their clear coat, which is not used", where);
        }
        if (const auto& e = object("KHR_materials_sheen"); e.IsObject()) {
            m.sheen_color = clamp(Vec3f(gltf_numbers(e, "sheenColorFactor", Vec3d(0))), Vec3f(0), Vec3f(1));
            m.sheen_roughness = unit(gltf_number(e, "sheenRoughnessFactor", 0));
            m.sheen_color_texture = look_up(e, "sheenColorTexture", ColorSpace::srgb);
            m.sheen_roughness_texture = look_up(e, "sheenRoughnessTexture", ColorSpace::linear);
        }
    }

    static float unit(double value) { return float(std::clamp(value, 0.0, 1.0)); }

    Texture texture(int index, int set, const tinygltf::ExtensionMap& extensions, ColorSpace space,
                    const std::string& where) {
        if (index < 0) return {};
        const tinygltf::Value& transform = gltf_extension(extensions, "KHR_texture_transform");
        return texture(index, int(gltf_number(transform, "texCoord", double(set))), transform, space, where);
    }
    Texture texture(const tinygltf::TextureInfo& t, ColorSpace space, const std::string& where) {
        return texture(t.index, t.texCoord, t.extensions, space, where);
    }
    Texture texture(const tinygltf::NormalTextureInfo& t, ColorSpace space, const std::string& where) {
        return texture(t.index, t.texCoord, t.extensions, space, where);
    }

    /// A textureInfo inside an extension, which tinygltf leaves as it is.
    Texture texture(const tinygltf::Value& extension, const char* key, ColorSpace space, const std::string& where) {
        if (!extension.Has(key) || !extension.Get(key).IsObject()) return {};
        const tinygltf::Value& info = extension.Get(key);
        const double index = gltf_number(info, "index", -1);
        require(index >= 0 && index < double(model_.textures.size()), [&] {
            return path_ + ": " + where + "/extensions/" + key + ": index " + std::to_string(index) + " of " +
                   std::to_string(model_.textures.size());
        });
        static const tinygltf::Value nothing;
        const tinygltf::Value& extensions = info.Has("extensions") ? info.Get("extensions") : nothing;
        const tinygltf::Value& transform = extensions.IsObject() && extensions.Has("KHR_texture_transform")
                                               ? extensions.Get("KHR_texture_transform")
                                               : nothing;
        const double set = gltf_number(info, "texCoord", 0);
        return texture(int(index), int(gltf_number(transform, "texCoord", set)), transform, space, where);
    }

    Texture texture(int index, int set, const tinygltf::Value& transform, ColorSpace space, const std::string& where) {
        const tinygltf::Texture& t = model_.textures[std::size_t(index)];
        if (t.source < 0) {
            notes_.add("textures have no PNG or JPEG image and are left out", pointer("textures", index));
            return {};
        }
        if (set != 0 && set != 1) {
            notes_.add("textures are looked up with texture coordinates beyond TEXCOORD_1 and are left out", where);
            return {};
        }
        Texture out;
        out.color_space = space;
        out.set = std::uint8_t(set);
        if (t.sampler >= 0) {
            const tinygltf::Sampler& s = model_.samplers[std::size_t(t.sampler)];
            out.wrap_u = wrap(s.wrapS);
            out.wrap_v = wrap(s.wrapT);
            if (s.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST) out.filter = TextureFilter::nearest;
        }
        set_gltf_transform(out, transform);
        const std::string name = path_ + ": " + pointer("images", t.source);
        out.image = images_.get(name, [this, source = t.source, name] { return decode(source, name); });
        return out;
    }

    static Wrap wrap(int mode) {
        if (mode == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE) return Wrap::clamp;
        return mode == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ? Wrap::mirror : Wrap::repeat;
    }

    Image decode(int index, const std::string& name) const {
        const tinygltf::Image& image = model_.images[std::size_t(index)];
        if (image.bufferView >= 0) return decode_texture(model_.view_bytes(image.bufferView), name, options_.max_pixels);
        const bool data_uri = image.uri.empty() || image.uri.starts_with("data:");
        const std::string full = data_uri ? name : name + " (" + image.uri + ")";
        if (const auto file = model_.image_files.find(index); file != model_.image_files.end())
            return decode_texture(FileBytes(file->second).view(), full, options_.max_pixels);
        require(!image.image.empty(), [&] {
            if (!data_uri) check_inside(root_of(path_, options_), folder_of(path_) + percent_decoded(image.uri), full);
            return full + ": no such image";
        });
        return decode_texture({reinterpret_cast<const char*>(image.image.data()), image.image.size()}, full,
                              options_.max_pixels);
    }

    const GltfModel& model_;
    const std::string& path_;
    const LoadOptions& options_;
    Scene<T>& scene_;
    Notes& notes_;
    ImageLibrary images_;
    std::uint32_t default_ = none;
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
