#pragma once
#include <lambent/core/vec.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// The sRGB decoding of IEC 61966-2-1: encoded value in [0, 1] to linear.
inline float srgb_to_linear(float s) { return s <= 0.04045f ? s / 12.92f : std::pow((s + 0.055f) / 1.055f, 2.4f); }

/// Its inverse: linear value in [0, 1] to encoded.
inline float linear_to_srgb(float v) {
    return v <= 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1.0f / 2.4f) - 0.055f;
}

/// What lies beyond [0, 1]: the texture again, mirrored each time, or its edge.
enum class Wrap : std::uint8_t { repeat, mirror, clamp };
/// How a texture is looked up between texels.
enum class TextureFilter : std::uint8_t { bilinear, nearest };
/// What texels hold: sRGB is decoded before interpolation, alpha never.
enum class ColorSpace : std::uint8_t { srgb, linear };

/// An 8-bit RGBA image. Row 0 is the top.
struct Image {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgba; ///< width · height · 4 bytes
    std::string name;               ///< where it came from, for messages
};

/// The image of a texture that has none.
inline constexpr std::int32_t no_image = -1;

/// How a material looks an image up: with which of the scene's texture coordinates, changed how, and what its bytes
/// mean. Coordinate (0, 0) is the image's upper left corner, v grows downwards (glTF's rule; the OBJ reader flips v).
/// Colour is decoded to linear light before it is interpolated; alpha is linear as stored.
struct Texture {
    std::int32_t image = no_image; ///< index into the scene's images
    ColorSpace color_space = ColorSpace::srgb;
    Wrap wrap_u = Wrap::repeat, wrap_v = Wrap::repeat;
    TextureFilter filter = TextureFilter::bilinear;
    std::uint8_t set = 0;                  ///< 0: Scene::texcoords, 1: Scene::texcoords1
    Vec2f row_u{1, 0}, row_v{0, 1}, shift{0}; ///< (u, v) is looked up at (row_u · (u, v), row_v · (u, v)) + shift

    /// Whether there is an image.
    explicit operator bool() const { return image != no_image; }

    Vec2f transformed(const Vec2f& uv) const { return Vec2f(dot(row_u, uv), dot(row_v, uv)) + shift; }

    /// Linear RGBA of `pixels` at coordinates as the scene holds them; opaque white where the image is empty.
    Vec4f sample(const Image& pixels, const Vec2f& texcoord) const {
        const int width = pixels.width, height = pixels.height;
        if (width <= 0 || height <= 0) return Vec4f(1.0f);
        const Vec2f uv = transformed(texcoord);
        const float x = place(uv.x, width, wrap_u), y = place(uv.y, height, wrap_v);
        if (filter == TextureFilter::nearest)
            return texel(pixels, wrap(int(std::floor(x)), width, wrap_u), wrap(int(std::floor(y)), height, wrap_v));
        const float fx = std::floor(x - 0.5f), fy = std::floor(y - 0.5f);
        const float ax = x - 0.5f - fx, ay = y - 0.5f - fy;
        const int x0 = wrap(int(fx), width, wrap_u), x1 = wrap(int(fx) + 1, width, wrap_u);
        const int y0 = wrap(int(fy), height, wrap_v), y1 = wrap(int(fy) + 1, height, wrap_v);
        const Tables& t = tables();
        return (texel(pixels, x0, y0, t) * (1 - ax) + texel(pixels, x1, y0, t) * ax) * (1 - ay) +
               (texel(pixels, x0, y1, t) * (1 - ax) + texel(pixels, x1, y1, t) * ax) * ay;
    }

    /// Linear value of one texel; x in [0, width), y in [0, height).
    Vec4f texel(const Image& pixels, int x, int y) const { return texel(pixels, x, y, tables()); }

private:
    /// What bytes mean, by color space and for alpha.
    struct Tables {
        std::array<float, 256> srgb, linear;
    };
    static const Tables& tables() {
        static const Tables both = [] {
            Tables t;
            for (std::size_t i = 0; i < 256; ++i) {
                t.linear[i] = float(i) / 255.0f;
                t.srgb[i] = srgb_to_linear(t.linear[i]);
            }
            return t;
        }();
        return both;
    }

    Vec4f texel(const Image& pixels, int x, int y, const Tables& t) const {
        const std::uint8_t* p = &pixels.rgba[4 * (std::size_t(y) * std::size_t(pixels.width) + std::size_t(x))];
        const auto& decode = color_space == ColorSpace::srgb ? t.srgb : t.linear;
        return {decode[p[0]], decode[p[1]], decode[p[2]], t.linear[p[3]]};
    }

    /// Pixel coordinate of texture coordinate u, brought near [0, size) first so that huge and non-finite
    /// coordinates cannot overflow an int.
    static float place(float u, int size, Wrap mode) {
        if (!(std::abs(u) < 1e9f)) u = 0;
        switch (mode) {
        case Wrap::repeat: u -= std::floor(u); break;
        case Wrap::mirror: u -= 2 * std::floor(u / 2); break;
        case Wrap::clamp: u = std::clamp(u, 0.0f, 1.0f); break;
        }
        return u * float(size);
    }

    /// The texel that stands at i, at most one beyond what place() gives.
    static int wrap(int i, int size, Wrap mode) {
        if (mode == Wrap::clamp) return std::clamp(i, 0, size - 1);
        const int period = mode == Wrap::repeat ? size : 2 * size;
        if (i < 0) i += period;
        else if (i >= period) i -= period;
        return i < size ? i : period - 1 - i;
    }
};

} // namespace LAMBENT_ABI
} // namespace lambent
