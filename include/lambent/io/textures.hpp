#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/executor.hpp>
#include <lambent/io/image.hpp>
#include <lambent/io/load_options.hpp>
#include <lambent/scene/scene.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Makes materials opaque whose alpha is full everywhere: exporters write "BLEND" on much that has no holes, and rays
/// would ask at every hit.
template <class T>
void drop_full_alpha(Scene<T>& scene) {
    const auto full = [&](const Texture& texture) {
        const std::vector<std::uint8_t>& rgba = scene.images[std::size_t(texture.image)].rgba;
        for (std::size_t k = 3; k < rgba.size(); k += 4)
            if (rgba[k] != 255) return false;
        return true;
    };
    for (const Vec4f& c : scene.colors)
        if (!(c.w >= 1)) return;
    for (Material& m : scene.materials) {
        if (m.alpha_mode == AlphaMode::opaque || m.alpha_texture) continue;
        const float least = m.alpha_mode == AlphaMode::mask ? m.alpha_cutoff : 1.0f;
        if (m.alpha >= least && (!m.base_color_texture || full(m.base_color_texture))) m.alpha_mode = AlphaMode::opaque;
    }
}

/// The images that a scene's materials refer to while it is loaded: each once, whoever names it, and decoded only when
/// all of the scene is known, in parallel, where a surface uses it.
class ImageLibrary {
public:
    using Decode = std::function<Image()>; ///< may throw lambent::Error

    /// Index of the image with this name; `decode` is kept for later where it is new.
    std::int32_t get(const std::string& name, Decode decode) {
        const auto [it, added] = known_.emplace(name, std::int32_t(sources_.size()));
        if (added) sources_.push_back(std::move(decode));
        return it->second;
    }

    /// Fills scene.images with what `loading` asks for and turns the materials' indices to it. An image that is not
    /// loaded stands for no texture, so that the surface shows its factor alone; one that can't be is noted.
    template <class T, class E>
    void store(Scene<T>& scene, ImageLoading loading, E& executor) {
        std::vector<char> wanted(sources_.size(), loading == ImageLoading::all ? 1 : 0);
        if (loading == ImageLoading::used) {
            std::vector<char> material(scene.materials.size(), 0);
            for (const std::uint32_t m : scene.triangle_materials) material[m] = 1;
            for (std::size_t m = 0; m < material.size(); ++m)
                if (material[m] != 0)
                    Material::for_each_texture(scene.materials[m], [&](const Texture& t) {
                        if (t) wanted[std::size_t(t.image)] = 1;
                    });
        }
        std::vector<Image> images(sources_.size());
        std::vector<std::string> errors(sources_.size());
        executor.parallel_for(sources_.size(), 1, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                if (wanted[i] == 0) continue;
                try {
                    images[i] = sources_[i]();
                } catch (const Error& error) {
                    wanted[i] = 0;
                    errors[i] = error.what();
                }
            }
        });
        std::vector<std::int32_t> place(sources_.size(), no_image);
        for (std::size_t i = 0; i < images.size(); ++i) {
            if (wanted[i] == 0) continue;
            place[i] = std::int32_t(scene.images.size());
            scene.images.push_back(std::move(images[i]));
        }
        for (Material& m : scene.materials)
            Material::for_each_texture(m, [&](Texture& t) {
                if (t) t.image = place[std::size_t(t.image)];
            });
        drop_full_alpha(scene);
        note(errors, scene.notes);
    }

private:
    /// The first few that could not be read, and how many more.
    static void note(const std::vector<std::string>& errors, std::vector<std::string>& notes) {
        constexpr std::size_t most = 10;
        std::size_t failed = 0;
        for (const std::string& error : errors)
            if (!error.empty() && ++failed <= most) notes.push_back("texture left out: " + error);
        if (failed > most) notes.push_back("textures left out: " + std::to_string(failed - most) + " more");
    }

    std::map<std::string, std::int32_t> known_;
    std::vector<Decode> sources_;
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
