#pragma once
#include <lambent/io/image.hpp>
#include <lambent/io/load_options.hpp>
#include <lambent/scene/texture.hpp>
#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// How a texture is looked up.
struct TextureSampling {
    ColorSpace color_space = ColorSpace::srgb;
    Wrap wrap_u = Wrap::repeat, wrap_v = Wrap::repeat;
    TextureFilter filter = TextureFilter::bilinear;
    auto operator<=>(const TextureSampling&) const = default;
};

/// A scene's textures while it is loaded: one for every image and way of looking it up. An image that cannot
/// be read is noted once and stands for no texture, so that the surface shows its factor alone.
class TextureLibrary {
public:
    TextureLibrary(std::vector<Texture>& textures, std::vector<std::string>& notes)
        : textures_(&textures), notes_(&notes) {}

    /// Index of the texture made by `decode()` (a Texture; may throw lambent::Error), or -1 when it can't be.
    template <class Decode>
    std::int32_t get(const std::string& image, const TextureSampling& sampling, Decode&& decode) {
        const auto key = std::make_pair(image, sampling);
        if (const auto known = known_.find(key); known != known_.end()) return known->second;
        std::int32_t index = -1;
        if (const Texture* twin = decoded(image)) {
            Texture texture = *twin;
            index = add(std::move(texture), sampling);
        } else if (!unreadable(image)) {
            try {
                index = add(decode(), sampling);
            } catch (const Error& error) {
                notes_->push_back("texture left out: " + std::string(error.what()));
            }
        }
        known_.emplace(key, index);
        return index;
    }

private:
    std::int32_t add(Texture texture, const TextureSampling& sampling) {
        texture.color_space = sampling.color_space;
        texture.wrap_u = sampling.wrap_u;
        texture.wrap_v = sampling.wrap_v;
        texture.filter = sampling.filter;
        textures_->push_back(std::move(texture));
        return std::int32_t(textures_->size() - 1);
    }

    const Texture* decoded(const std::string& image) const {
        const auto it = known_.lower_bound({image, TextureSampling{}});
        for (auto k = it; k != known_.end() && k->first.first == image; ++k)
            if (k->second >= 0) return &(*textures_)[std::size_t(k->second)];
        return nullptr;
    }

    bool unreadable(const std::string& image) const {
        const auto it = known_.lower_bound({image, TextureSampling{}});
        return it != known_.end() && it->first.first == image && it->second < 0;
    }

    std::map<std::pair<std::string, TextureSampling>, std::int32_t> known_;
    std::vector<Texture>* textures_;
    std::vector<std::string>* notes_;
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
