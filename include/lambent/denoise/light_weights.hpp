#pragma once
#include <lambent/core/exp.hpp>
#include <lambent/core/simd.hpp>
#include <lambent/denoise/phased_planes.hpp>
#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

inline constexpr int light_features = 7; ///< that light is fitted to

/// What pixels are compared by, all of one image.
template <class T>
struct WeightInputs {
    const PhasedPlanes<T>& guides; ///< features
    const PhasedPlanes<T>& scales; ///< 1 over what squares of their differences are measured by
    const PhasedPlanes<T>& inside; ///< of a row: 1 in the image, 0 beside it
    const PhasedPlanes<T>& roots;  ///< means of the samples' roots, and their variance
    int height;                    ///< of the image

    int row(int y) const { return std::min(y, height + PhasedPlanes<T>::rim_y - 1); }
};

/// How much the pixels around say about the centers of a tile: by how alike their features are, and by whether patches
/// around them could have the same light, by a test on the samples' own statistics, of 3 x 3 pixels and of 7 x 7.
template <std::floating_point T>
class LightWeights {
    static constexpr int width = 8;
    using P = Pack<T, width>;
    using Phased = PhasedPlanes<T>;

public:
    static constexpr int tile_w = 64, tile_h = 16; ///< pixels of a tile; its width holds whole Packs of centers

    struct Tap {
        int dx, dy;
    };

    /// radius  of the windows around centers
    /// stride  one center for so many pixels a side, 1 or 2
    LightWeights(int radius, int stride, const std::array<double, 2>& test_softness)
        : stride_(stride), centers_w_(tile_w / stride), centers_h_(tile_h / stride),
          test_softness_(test_softness), taps_(taps_within(radius)),
          weights_(taps_.size() * std::size_t(centers_w_ * centers_h_)),
          test_(std::size_t(test_w * (tile_h + 2 * patch + radius))), small_(std::size_t(test_w)),
          large_(std::size_t(test_w)) {}

    /// For rows [first, last) of the centers of the tile that begins at (x0, y0).
    void find(const WeightInputs<T>& image, int x0, int y0, int first, int last) {
        for (std::size_t tap = taps_.size() / 2; tap < taps_.size(); ++tap) {
            if (stride_ == 1) compare<1>(image, x0, y0, tap, first, last);
            else compare<2>(image, x0, y0, tap, first, last);
        }
    }

    /// The pixels of a window, row by row: the last lies opposite of the first, and so on.
    const std::vector<Tap>& taps() const { return taps_; }

    /// Of eight centers side by side with the pixels at a place in their windows.
    P of(std::size_t tap, int row, int center) const { return P::load(&weights_[row_of(tap, row) + std::size_t(center)]); }

private:
    static constexpr int patch = 3;            ///< radius of the larger of the two that are compared
    static constexpr int test_w = tile_w + 32; ///< a tile's columns with those around, as whole Packs read them

    static std::vector<Tap> taps_within(int radius) {
        std::vector<Tap> taps;
        for (int dy = -radius; dy <= radius; ++dy)
            for (int dx = -radius; dx <= radius; ++dx) taps.push_back({dx, dy});
        return taps;
    }
    std::size_t row_of(std::size_t tap, int row) const {
        return (tap * std::size_t(centers_h_) + std::size_t(row)) * std::size_t(centers_w_);
    }

    /// For a tap, dy >= 0, and for the opposite one: the two pixels that the one compares with each other the other compares
    /// as well.
    template <int stride>
    void compare(const WeightInputs<T>& image, int x0, int y0, std::size_t tap, int first, int last) {
        const auto [dx, dy] = taps_[tap];
        const Phased& roots = image.roots;
        const int left = -patch - std::max(dx, 0), right = tile_w + patch - std::min(dx, 0);
        const int top = first * stride - patch - dy;
        for (int y = top; y < last * stride + patch; ++y) {
            T* const out = &test_[std::size_t((y - top) * test_w)];
            const std::size_t here = roots.at(x0, image.row(y0 + y)), there = roots.at(x0 + dx, image.row(y0 + y + dy));
            for (int x = left; x < right; x += width) {
                const auto difference2 = [&](int c) {
                    const P d = P::load(roots.channel(c) + here + x) - P::load(roots.channel(c) + there + x);
                    return d * d;
                };
                const P variance = P::load(roots.channel(3) + here + x) + P::load(roots.channel(3) + there + x);
                ((difference2(0) + difference2(1) + difference2(2)) / variance).store(out + x - left);
            }
        }
        const auto from = [&](int x, int y) { return &test_[std::size_t((y - top) * test_w + x - left)]; };
        weigh<stride>(image, from(-patch, first * stride - patch), x0, y0, tap, first, last);
        if (dx != 0 || dy != 0)
            weigh<stride>(image, from(-patch - dx, first * stride - patch - dy), x0, y0, taps_.size() - 1 - tap, first,
                          last);
    }

    /// tests  of the pixels beginning with that which is `patch` to the left of the first center and above it
    template <int stride>
    void weigh(const WeightInputs<T>& image, const T* tests, int x0, int y0, std::size_t tap, int first, int last) {
        const auto [dx, dy] = taps_[tap];
        const T* const here_inside = image.inside.channel(0) + image.inside.at(x0, 0);
        const T* const there_inside = image.inside.channel(0) + image.inside.at(x0 + dx, 0);
        const T k1 = T(1 / test_softness_[0]), k3 = T(1 / test_softness_[1]);
        constexpr int centers_w = tile_w / stride;
        const auto column = [](int x) { return std::size_t(x % stride * (test_w / stride) + x / stride); };
        for (int j = first; j < last; ++j) {
            const int y = j * stride;
            T* out = &weights_[row_of(tap, j)];
            if (y0 + y + dy < 0 || y0 + y + dy >= image.height) {
                std::fill_n(out, centers_w, T(0));
                continue;
            }
            const T* const rows = tests + (j - first) * stride * test_w; // rows y - 3 to y + 3
            for (int x = 0; x < tile_w + 2 * patch; x += stride * width) {
                P small[std::size_t(stride)], large[std::size_t(stride)];
                for (int k = 0; k < stride; ++k) {
                    const auto row = [&](int v) { return P::load(rows + v * test_w + x + k * width); };
                    small[k] = row(2) + row(3) + row(4);
                    large[k] = small[k] + row(0) + row(1) + row(5) + row(6);
                }
                if constexpr (stride == 2) {
                    split(small);
                    split(large);
                }
                for (int k = 0; k < stride; ++k) {
                    small[k].store(&small_[column(x + k)]);
                    large[k].store(&large_[column(x + k)]);
                }
            }
            const std::size_t center = image.guides.at(x0, image.row(y0 + y));
            const std::size_t there = image.guides.at(x0 + dx, image.row(y0 + y + dy));
            for (int i = 0; i < centers_w; i += width) {
                const auto small = [&](int u) { return P::load(&small_[column(u) + std::size_t(i)]); };
                const auto large = [&](int u) { return P::load(&large_[column(u) + std::size_t(i)]); };
                const P d1 = (small(2) + small(3) + small(4)) * P(T(1.0 / 9));
                const P d3 = (large(0) + large(1) + large(2) + large(3) + large(4) + large(5) + large(6)) * P(T(1.0 / 49));
                P distance(T(0));
#pragma GCC unroll 8
                for (int c = 0; c < light_features; ++c) {
                    const P d = P::load(image.guides.channel(c) + center + i) - P::load(image.guides.channel(c) + there + i);
                    distance = multiply_add(d * d, P::load(image.scales.channel(c) + center + i), distance);
                }
                const P zero(T(0)), one(T(1));
                const P a = max(d1 - one, zero) * P(k1), b = max(d3 - one, zero) * P(k3);
                P e[2] = {-min(distance + a, P(T(80))), -min(distance + b, P(T(80)))};
                powers_of_two<2>(e, T(log2_e));
                const P counts = P::load(here_inside + i) * P::load(there_inside + i);
                ((e[0] + e[1]) * counts).store(out + i);
            }
        }
    }
    /// Sixteen numbers into those at even and those at odd places.
    [[gnu::always_inline]] static void split(P (&pair)[2]) {
        const auto a = pair[0].v, b = pair[1].v;
        pair[0] = P(__builtin_shufflevector(a, b, 0, 2, 4, 6, 8, 10, 12, 14));
        pair[1] = P(__builtin_shufflevector(a, b, 1, 3, 5, 7, 9, 11, 13, 15));
    }

    int stride_, centers_w_, centers_h_;
    std::array<double, 2> test_softness_;
    std::vector<Tap> taps_;
    std::vector<T> weights_;              ///< [tap][center]
    std::vector<T> test_, small_, large_; ///< of pixels; of columns of a row of patches, split like PhasedPlanes
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
