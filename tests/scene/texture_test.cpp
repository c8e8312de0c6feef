#include <lambent/scene/texture.hpp>
#include <doctest/doctest.h>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

using namespace lambent;

namespace {

/// An image with a way of looking it up.
struct Lookup : Texture {
    Image pixels;
    Vec4f operator()(float u, float v) const { return sample(pixels, {u, v}); }
};

Lookup noise(int width, int height, std::uint32_t seed) {
    std::mt19937 random(seed);
    Lookup lookup;
    lookup.pixels.width = width;
    lookup.pixels.height = height;
    for (int i = 0; i < 4 * width * height; ++i) lookup.pixels.rgba.push_back(std::uint8_t(random()));
    return lookup;
}

/// The lookup rules said again, in double, as a sum over every texel of the infinite pattern near (u, v).
class Oracle {
public:
    explicit Oracle(const Lookup& texture) : t_(texture) {}

    double value(int x, int y, int c) const {
        const double stored =
            t_.pixels.rgba[std::size_t(
                4 * (fold(y, t_.pixels.height, t_.wrap_v) * t_.pixels.width + fold(x, t_.pixels.width, t_.wrap_u)) + c)] /
            255.0;
        if (c == 3 || t_.color_space == ColorSpace::linear) return stored;
        return stored <= 0.04045 ? stored / 12.92 : std::pow((stored + 0.055) / 1.055, 2.4);
    }

    double sample(double u, double v, int c) const {
        if (t_.wrap_u == Wrap::clamp) u = std::min(1.0, std::max(0.0, u));
        if (t_.wrap_v == Wrap::clamp) v = std::min(1.0, std::max(0.0, v));
        const double x = u * t_.pixels.width, y = v * t_.pixels.height;
        if (t_.filter == TextureFilter::nearest) return value(int(std::floor(x)), int(std::floor(y)), c);
        double sum = 0;
        for (int j = int(std::floor(y)) - 2; j <= int(std::floor(y)) + 2; ++j)
            for (int i = int(std::floor(x)) - 2; i <= int(std::floor(x)) + 2; ++i) {
                const double wx = std::max(0.0, 1 - std::abs(x - (i + 0.5)));
                const double wy = std::max(0.0, 1 - std::abs(y - (j + 0.5)));
                if (wx * wy > 0) sum += wx * wy * value(i, j, c);
            }
        return sum;
    }

private:
    /// Walks to the pattern's texel one step at a time: slow, but nothing to get wrong.
    static int fold(int i, int size, Wrap mode) {
        int at = i < 0 ? -i - 1 : i, period = at / size;
        if (mode == Wrap::clamp) return i < 0 ? 0 : std::min(i, size - 1);
        at -= period * size;
        const bool backwards = mode == Wrap::repeat ? i < 0 : period % 2 == 1;
        return backwards ? size - 1 - at : at;
    }

    const Lookup& t_;
};

} // namespace

TEST_CASE("G5: texture lookups match uv to 1e-6") {
    const std::uint32_t seed = 11;
    INFO("seed " << seed);
    std::mt19937 random(seed);
    for (const Wrap wrap_u : {Wrap::repeat, Wrap::mirror, Wrap::clamp})
        for (const Wrap wrap_v : {Wrap::repeat, Wrap::mirror, Wrap::clamp})
            for (const TextureFilter filter : {TextureFilter::bilinear, TextureFilter::nearest})
                for (const ColorSpace space : {ColorSpace::srgb, ColorSpace::linear})
                    for (const auto& size : {std::pair(8, 4), std::pair(1, 1), std::pair(3, 5), std::pair(64, 2)}) {
                        const int width = size.first, height = size.second; // clang 14 captures no structured bindings
                        Lookup texture = noise(width, height, seed + std::uint32_t(width));
                        texture.wrap_u = wrap_u;
                        texture.wrap_v = wrap_v;
                        texture.filter = filter;
                        texture.color_space = space;
                        const Oracle oracle(texture);
                        for (int k = 0; k < 200; ++k) {
                            // Multiples of 2^-12 in [-3, 3): float arithmetic on them is exact up to the last
                            // sum, and odd ones never lie on a texel's edge.
                            const auto draw = [&] {
                                return float(int(random() % 12288) * 2 + 1 - 12288) / 4096.0f;
                            };
                            const float u = draw(), v = draw();
                            const Vec4f got = texture(u, v);
                            for (int c = 0; c < 4; ++c) {
                                const double expected = oracle.sample(double(u), double(v), c);
                                CAPTURE(width);
                                CAPTURE(u);
                                CAPTURE(v);
                                REQUIRE(std::abs(double(got[c]) - expected) < 1e-6);
                            }
                        }
                    }
}

TEST_CASE("G5: texel centres give their texel, row 0 is the top, colour is decoded before it is mixed") {
    Lookup texture = noise(5, 3, 2);
    for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 5; ++x) {
            const Vec4f got = texture((float(x) + 0.5f) / 5, (float(y) + 0.5f) / 3);
            const Vec4f texel = texture.texel(texture.pixels, x, y);
            for (int c = 0; c < 4; ++c) CHECK(std::abs(got[c] - texel[c]) < 1e-6f);
        }
    Lookup two;
    two.pixels.width = 1;
    two.pixels.height = 2;
    two.pixels.rgba = {255, 255, 255, 255, 0, 0, 0, 0};
    two.wrap_v = Wrap::clamp;
    CHECK(two(0.5f, 0) == Vec4f(1));
    CHECK(two(0.5f, 1) == Vec4f(0));
    CHECK(two(0.5f, 0.5f) == Vec4f(0.5f));
}

TEST_CASE("texture coordinates are turned, scaled and shifted before the lookup") {
    Lookup texture = noise(4, 4, 3);
    const Lookup plain = texture;
    texture.row_u = {0, 2};
    texture.row_v = {-1, 0};
    texture.shift = {0.25f, 0.5f};
    for (const Vec2f& uv : {Vec2f(0.3f, 0.1f), Vec2f(-1.4f, 0.7f)})
        CHECK(texture(uv.x, uv.y) == plain(2 * uv.y + 0.25f, 0.5f - uv.x));
}

TEST_CASE("texture coordinates of any size and kind stay inside the image") {
    Lookup texture = noise(7, 3, 5);
    for (const Wrap wrap : {Wrap::repeat, Wrap::mirror, Wrap::clamp})
        for (const TextureFilter filter : {TextureFilter::bilinear, TextureFilter::nearest}) {
            texture.wrap_u = texture.wrap_v = wrap;
            texture.filter = filter;
            for (const float u :
                 {0.0f, -0.0f, 1.0f, -1.0f, 2.0f, -1e-9f, 0.99999994f, 1e8f, -1e8f, 3e38f, 1e-40f,
                  std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()})
                for (const float v : {u, 0.3f}) {
                    const Vec4f got = texture(u, v);
                    for (int c = 0; c < 4; ++c) CHECK((got[c] >= 0 && got[c] <= 1));
                }
        }
    CHECK(Lookup()(0.2f, 0.4f) == Vec4f(1));
}

TEST_CASE("sRGB decoding and encoding are each other's inverse on all bytes") {
    for (int i = 0; i < 256; ++i) {
        const float s = float(i) / 255;
        CHECK(std::abs(linear_to_srgb(srgb_to_linear(s)) - s) < 1e-6f);
    }
    CHECK(srgb_to_linear(0.5f) == doctest::Approx(0.21404114));
}
