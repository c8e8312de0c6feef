#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/io/load_options.hpp>
#include <lambent/io/textures.hpp>
#include <lambent/scene/scene.hpp>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <tiny_gltf.h>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Which texture coordinates a glTF texture is looked up with, and how they are changed before
/// (KHR_texture_transform).
struct GltfTexcoords {
    int set = 0;
    Vec2d offset{0, 0}, scale{1, 1};
    double rotation = 0;
    bool operator==(const GltfTexcoords&) const = default;

    Vec2f operator()(const Vec2f& uv) const {
        if (offset == Vec2d(0) && scale == Vec2d(1) && rotation == 0) return uv;
        const Vec2d s = scale * Vec2d(uv);
        const double c = std::cos(rotation), n = std::sin(rotation);
        return Vec2f(Vec2d(c * s.x + n * s.y, c * s.y - n * s.x) + offset);
    }
};

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

inline GltfTexcoords gltf_texcoords(const tinygltf::TextureInfo& info) {
    GltfTexcoords out;
    const tinygltf::Value& transform = gltf_extension(info.extensions, "KHR_texture_transform");
    out.set = int(gltf_number(transform, "texCoord", double(info.texCoord)));
    const Vec3d offset = gltf_numbers(transform, "offset", {0, 0, 0});
    const Vec3d scale = gltf_numbers(transform, "scale", {1, 1, 1});
    out.offset = {offset.x, offset.y};
    out.scale = {scale.x, scale.y};
    out.rotation = gltf_number(transform, "rotation", 0);
    return out;
}

/// Turns the materials of a validated model into ours; adds textures and notes to the scene.
template <class T>
class GltfMaterials {
public:
    GltfMaterials(const tinygltf::Model& model, const std::string& path, const LoadOptions& options,
                  Scene<T>& scene)
        : model_(model), path_(path), options_(options), scene_(scene),
          library_(scene.textures, scene.notes) {
        for (const tinygltf::Material& m : model_.materials) add(m);
        note(beyond_lambert_,
             "go beyond Lambert (metal, specular lobe, transmission …) and show their diffuse base colour");
        note(blended_, "have alphaMode BLEND and are shown opaque");
        note(other_texcoords_,
             "look their emission up with other texture coordinates than their base colour, which is "
             "not supported: those of the base colour are taken");
    }

    /// The coordinates for primitives of material i (-1: none).
    GltfTexcoords texcoords(int i) const { return i < 0 ? GltfTexcoords() : texcoords_[std::size_t(i)]; }

    /// Index of glTF's default material, for primitives without one.
    std::uint32_t default_material() {
        if (default_ == no_texture) {
            default_ = std::int32_t(scene_.materials.size());
            Material& material = scene_.materials.emplace_back();
            material.base_color = Vec3f(1);
            material.name = "default";
        }
        return std::uint32_t(default_);
    }

private:
    void add(const tinygltf::Material& m) {
        Material out;
        out.name = m.name;
        const tinygltf::PbrMetallicRoughness& pbr = m.pbrMetallicRoughness;
        const std::vector<double>& base = pbr.baseColorFactor;
        tinygltf::TextureInfo base_texture = pbr.baseColorTexture;
        out.base_color = Vec3f(1);
        if (base.size() == 4) {
            out.base_color = {float(base[0]), float(base[1]), float(base[2])};
            out.alpha = float(base[3]);
        }
        out.base_color = clamp(out.base_color, Vec3f(0), Vec3f(1));
        if (m.emissiveFactor.size() == 3)
            out.emission = {float(m.emissiveFactor[0]), float(m.emissiveFactor[1]),
                            float(m.emissiveFactor[2])};
        const tinygltf::Value& strength = gltf_extension(m.extensions, "KHR_materials_emissive_strength");
        out.emission = max(out.emission * float(gltf_number(strength, "emissiveStrength", 1)), Vec3f(0));
        out.base_color_texture = texture(base_texture.index);
        if (out.emissive()) out.emission_texture = texture(m.emissiveTexture.index);
        out.alpha_cutoff = float(m.alphaCutoff);
        if (m.alphaMode == "MASK") out.alpha_mode = AlphaMode::mask;
        if (m.alphaMode == "BLEND") ++blended_;
        out.double_sided = m.doubleSided;

        GltfTexcoords coords =
            gltf_texcoords(out.base_color_texture != no_texture ? base_texture : m.emissiveTexture);
        if (out.base_color_texture != no_texture && out.emission_texture != no_texture &&
            !(gltf_texcoords(m.emissiveTexture) == coords))
            ++other_texcoords_;
        texcoords_.push_back(coords);
        if (!is_lambert(m)) ++beyond_lambert_;
        scene_.materials.push_back(std::move(out));
    }

    static bool is_lambert(const tinygltf::Material& m) {
        const tinygltf::Value& specular = gltf_extension(m.extensions, "KHR_materials_specular");
        if (m.pbrMetallicRoughness.metallicFactor > 0 || gltf_number(specular, "specularFactor", 1) > 0)
            return false;
        for (const auto& [extension, factor] : {std::pair("KHR_materials_transmission", "transmissionFactor"),
                                                std::pair("KHR_materials_clearcoat", "clearcoatFactor"),
                                                std::pair("KHR_materials_iridescence", "iridescenceFactor")})
            if (gltf_number(gltf_extension(m.extensions, extension), factor, 0) > 0) return false;
        return !m.extensions.contains("KHR_materials_unlit") && !m.extensions.contains("KHR_materials_sheen");
    }

    std::int32_t texture(int index) {
        if (index < 0) return no_texture;
        const tinygltf::Texture& t = model_.textures[std::size_t(index)];
        if (t.source < 0) {
            scene_.notes.push_back(path_ + ": /textures/" + std::to_string(index) +
                                   " has no PNG or JPEG image");
            return no_texture;
        }
        TextureSampling sampling;
        if (t.sampler >= 0) {
            const tinygltf::Sampler& s = model_.samplers[std::size_t(t.sampler)];
            sampling.wrap_u = wrap(s.wrapS);
            sampling.wrap_v = wrap(s.wrapT);
            if (s.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST) sampling.filter = TextureFilter::nearest;
        }
        const std::string name = path_ + ": /images/" + std::to_string(t.source);
        return library_.get(name, sampling, [&] { return decode(t.source, name); });
    }

    static Wrap wrap(int mode) {
        if (mode == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE) return Wrap::clamp;
        return mode == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ? Wrap::mirror : Wrap::repeat;
    }

    Texture decode(int index, const std::string& name) const {
        const tinygltf::Image& image = model_.images[std::size_t(index)];
        if (image.bufferView >= 0) {
            const tinygltf::BufferView& view = model_.bufferViews[std::size_t(image.bufferView)];
            const unsigned char* data =
                model_.buffers[std::size_t(view.buffer)].data.data() + view.byteOffset;
            return decode_texture({reinterpret_cast<const char*>(data), view.byteLength}, name,
                                  options_.max_pixels);
        }
        const bool data_uri = image.uri.empty() || image.uri.starts_with("data:");
        const std::string full = data_uri ? name : name + " (" + image.uri + ")";
        require(!image.image.empty(), [&] { return full + ": no such image"; });
        return decode_texture({reinterpret_cast<const char*>(image.image.data()), image.image.size()}, full,
                              options_.max_pixels);
    }

    void note(std::size_t count, const char* what) {
        if (count > 0)
            scene_.notes.push_back(path_ + ": " + std::to_string(count) + " of " +
                                   std::to_string(model_.materials.size()) + " materials " + what);
    }

    const tinygltf::Model& model_;
    const std::string& path_;
    const LoadOptions& options_;
    Scene<T>& scene_;
    TextureLibrary library_;
    std::vector<GltfTexcoords> texcoords_;
    std::int32_t default_ = no_texture;
    std::size_t beyond_lambert_ = 0, blended_ = 0, other_texcoords_ = 0;
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
