#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/executor.hpp>
#include <lambent/core/simd.hpp>
#include <lambent/denoise/light_weights.hpp>
#include <lambent/denoise/lit_blocks.hpp>
#include <lambent/denoise/phased_planes.hpp>
#include <lambent/film/pixel_data.hpp>
#include <lambent/film/region.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// How LightRegression weighs and fits.
struct LightRegressionOptions {
    int radius = 8;               ///< of the windows that models are fitted in, in pixels
    int stride = 2;               ///< one model for so many pixels a side, 1 or 2
    double feature_sigma = 1.5;   ///< in deviations of a feature, or steps to the neighbouring pixels
    double feature_floor = 1e-3;  ///< least variance of a feature
    double own_vote = 1e-9;       ///< weight of what a pixel says of itself, beside what windows say. With a stride it
                                  ///< speaks for those like it within 5 x 5 where windows say less than twice that much
    double ridge = 1e-3;          ///< on the slopes, relative to the sum of weights
    double dim = 0.5; ///< below this part of the image's mean light, or of what a pixel's samples vouch for, errors count
                      ///< as they are, above it as parts of the light
};

/// What LightRegression fits, and what it tests: all of the image's size and finite.
template <class T>
struct LightToFit {
    PixelView<const T, 3> color;
    PixelView<const T, 3> root;          ///< means of the samples' roots
    PixelView<const T, 1> root_variance; ///< summed over channels, above 0
    std::array<double, 2> test_softness{0.25, 0.25}; ///< by how much tests of patches of radius 1 and 3 may fail
    double mean = -1; ///< of the color's sum of channels, over the whole image; below 0: over what is there
};

/// First-order regression of light on features in overlapping windows, weighted by features and by a test on the
/// samples' own statistics whether two pixels could have the same light: smooth where light is, sharp where it is not, with an
/// error that falls to 0 with the noise. Each window's model says something about all its pixels; a pixel is the mean
/// of what is said, by weight, and by how little light it is: by 1 / (1 + light² / dim²), which makes the relative
/// error least. Where some say that a pixel belongs to a lamp's reflection and others that it lies beside it, the
/// mean alone would be many times too bright for a dark pixel, and only half of what a bright one has. A pixel's own
/// samples vouch for its light where they agree, and for none where one of them may have brought it all.
/// source  regression: Bitterli et al., Nonlinearly weighted first-order regression for denoising Monte Carlo
///         renderings, EGSR 2016; tests: Sakai et al., A statistical approach to Monte Carlo denoising, SIGGRAPH Asia
/// 2024
template <std::floating_point T>
class LightRegression {
    static constexpr int width = 8, features = detail::light_features, coefficients = features + 1, block = 4;
    using P = Pack<T, width>;
    using Phased = detail::PhasedPlanes<T>;

public:
    static constexpr int guide_channels = features; ///< albedo, normal and depth, say; those not set are all 0

    /// throws lambent::Error on an empty image or options out of their ranges
    LightRegression(int image_width, int image_height, const LightRegressionOptions& options)
        : w_(image_width), h_(image_height), o_(checked(image_width, image_height, options)),
          guides_(w_, h_, features, o_.stride), scales_(w_, h_, features, o_.stride), inside_(w_, 1, 1, o_.stride) {
        for (int x = 0; x < w_; ++x) inside_.channel(0)[inside_.at(x, 0)] = 1;
    }

    /// One channel: guide(x, y) and its variance(x, y), in the guide's unit squared; both finite.
    template <class F, class V>
    void set_guide(int channel, F&& guide, V&& variance) {
        std::vector<T> values(std::size_t(w_) * std::size_t(h_));
        const auto row_of = [&](int y) { return values.data() + std::size_t(y) * std::size_t(w_); };
        guides_.fill_rows(channel, w_, h_, [&](int y, T* row) {
            for (int x = 0; x < w_; ++x) row[x] = guide(x, y);
            std::copy_n(row, w_, row_of(y));
        });
        const T floor = T(o_.feature_floor), factor = T(o_.feature_sigma * o_.feature_sigma);
        scales_.fill_rows(channel, w_, h_, [&](int y, T* row) {
            const T *const here = row_of(y), *const above = row_of(std::max(y - 1, 0)),
                    *const below = row_of(std::min(y + 1, h_ - 1));
            const auto scale = [&](int x, int before, int behind) { // from the variance that `row` has
                const auto least = [&](T a, T b) { return std::min(std::abs(a - here[x]), std::abs(b - here[x])); };
                const T across = least(here[before], here[behind]), down = least(above[x], below[x]);
                return 1 / (factor * std::max(std::max(floor, row[x]), across * across + down * down));
            };
            for (int x = 0; x < w_; ++x) row[x] = T(variance(x, y));
            row[0] = scale(0, 0, std::min(1, w_ - 1));
            for (int x = 1; x < w_ - 1; ++x) row[x] = scale(x, x - 1, x + 1);
            if (w_ > 1) row[w_ - 1] = scale(w_ - 1, w_ - 2, w_ - 1);
        });
    }

    /// A copy of light as run() takes it.
    struct Loaded {
        Phased colors, roots, brightness;
        detail::LitBlocks lit;
        std::array<double, 2> test_softness;
    };
    /// throws  lambent::Error on a softness that is not positive
    Loaded load(const LightToFit<T>& light) const {
        require(light.test_softness[0] > 0 && light.test_softness[1] > 0, "LightRegression: softness must be positive");
        Loaded to{Phased(w_, h_, 3, o_.stride), Phased(w_, h_, 4, 1), Phased(w_, h_, 1, o_.stride),
                  detail::LitBlocks(light.color), light.test_softness};
        for (int c = 0; c < 3; ++c) {
            to.colors.fill(c, w_, h_, [&](int x, int y) { return light.color.load(x, y)[c]; });
            to.roots.fill(c, w_, h_, [&](int x, int y) { return light.root.load(x, y)[c]; });
        }
        to.roots.fill(3, w_, h_, [&](int x, int y) { return light.root_variance.load(x, y); });
        fill_inverse_dim(light, to.brightness);
        return to;
    }

    /// `out` may be the light's color. `own`, where there is one, gets a pixel's weight in its window's sum of weights:
    /// what part of the pixel's noise is left, about. Tiles far from any light (a sky's, say) stay black, as they would
    /// come out, and keep what `own` holds. Both are written in `part` alone, or everywhere where that is empty: to the
    /// bits that they have in a larger image, if this one begins there at multiples of 64 x 16 pixels and reaches
    /// 2 · radius + 3 pixels beyond the part.
    /// throws  lambent::Error on a softness that is not positive
    /// threads the same bits for any executor
    template <Executor E>
    void run(const LightToFit<T>& light, const PixelView<T, 3>& out, E& executor, const PixelView<T, 1>& own = {},
             const PixelWindow& part = {}) const {
        run(load(light), out, executor, own, part);
    }
    /// Likewise; what was loaded may be gone.
    template <Executor E>
    void run(const Loaded& light, const PixelView<T, 3>& out, E& executor, const PixelView<T, 1>& own = {},
             PixelWindow part = {}) const {
        if (part.empty()) part = {0, 0, w_, h_};
        const PixelWindow centers{std::max(0, part.x0 - o_.radius - 1), std::max(0, part.y0 - o_.radius - 1),
                                  std::min(w_, part.x1 + o_.radius), std::min(h_, part.y1 + o_.radius)};
        const int tiles_x = (w_ + tile_w - 1) / tile_w, last_row = (centers.y1 - 1) / tile_h;
        std::vector<std::vector<T>> said(std::size_t(tiles_x) * std::size_t(last_row + 1)); ///< empty: of a dark tile
        const int first_row = centers.y0 / tile_h; // many tiles at once keep threads busy, few take little memory
        const int rows_at_once = std::max(1, std::min(128 / tiles_x, (last_row - first_row + 1) / 3));
        int written = part.y0;
        for (int row = first_row; row <= last_row; row += rows_at_once) {
            const std::size_t first = std::size_t(row * tiles_x);
            const int end_row = std::min(row + rows_at_once, last_row + 1);
            executor.parallel_for(std::size_t(end_row * tiles_x) - first, 1, [&](std::size_t begin, std::size_t end) {
                Work work(o_, light.test_softness);
                for (std::size_t i = first + begin; i < first + end; ++i) {
                    const int x0 = int(i) % tiles_x * tile_w, y0 = int(i) / tiles_x * tile_h;
                    // Whatever its windows speak about has windows without light alone.
                    if (x0 >= centers.x1 || x0 + tile_w <= centers.x0) continue;
                    if (!light.lit.any(x0, y0, tile_w, tile_h, 3 * o_.radius)) continue;
                    said[i].assign(4 * said_channel(), T(0));
                    fit_tile(light, x0, y0, centers, work, said[i].data(), own);
                }
            });
            const int until =
                end_row > last_row ? part.y1 : std::clamp(end_row * tile_h - o_.radius - 1, written, part.y1);
            write(light, said, tiles_x, {part.x0, written, part.x1, until}, out, executor);
            written = until;
            // What the rows still to be written are spoken about by stays.
            for (int done = first_row; done < end_row && (done + 1) * tile_h + o_.radius <= written; ++done)
                for (int i = 0; i < tiles_x; ++i) std::vector<T>().swap(said[std::size_t(done * tiles_x + i)]);
        }
    }

private:
    static constexpr int tile_w = detail::LightWeights<T>::tile_w, tile_h = detail::LightWeights<T>::tile_h;

    static const LightRegressionOptions& checked(int w, int h, const LightRegressionOptions& o) {
        require(w > 0 && h > 0, "LightRegression: the image is empty");
        require(o.radius >= 1 && o.radius <= 8 && (o.stride == 1 || o.stride == 2),
                "LightRegression: radius must be 1 to 8, stride 1 or 2");
        require(o.feature_sigma > 0 && o.feature_floor > 0 && o.own_vote > 0 && o.ridge > 0 && o.dim > 0,
                "LightRegression: all of the options must be positive");
        return o;
    }

    /// 1 over the light, summed over channels, below which errors count as they are.
    void fill_inverse_dim(const LightToFit<T>& light, Phased& inverse) const {
        const auto total = [](const Vec3<T>& v) { return v.x + v.y + v.z; };
        double mean = light.mean;
        if (mean < 0) {
            double sum = 0;
            for (int y = 0; y < h_; ++y)
                for (int x = 0; x < w_; ++x) sum += double(total(light.color.load(x, y)));
            mean = sum / (double(w_) * h_);
        }
        inverse.fill(0, w_, h_, [&](int x, int y) {
            const T root = total(light.root.load(x, y)), variance = T(3) * light.root_variance.load(x, y);
            const T sure = variance < root * root ? T(1) - std::sqrt(variance) / root : T(0);
            const double vouched = double(sure * sure) * double(total(light.color.load(x, y)));
            return T(1 / std::max(o_.dim * std::max(mean, vouched), 1e-30));
        });
    }

    /// The means of what was said, in a part of the image.
    template <class E>
    void write(const Loaded& light, const std::vector<std::vector<T>>& said, int tiles_x, const PixelWindow& part,
               const PixelView<T, 3>& out, E& executor) const {
        const int tiles_y = int(said.size()) / tiles_x;
        executor.parallel_for(std::size_t(part.height()), 16, [&](std::size_t begin, std::size_t end) {
            for (int y = part.y0 + int(begin); y < part.y0 + int(end); ++y)
                for (int x = part.x0; x < part.x1; ++x) {
                    T sum[4] = {0, 0, 0, 0};
                    const auto first = [&](int at, int tile) { return std::max(0, (at - o_.radius - 1) / tile); };
                    const auto last = [&](int at, int tile, int n) { return std::min(n - 1, (at + o_.radius) / tile); };
                    for (int ty = first(y, tile_h); ty <= last(y, tile_h, tiles_y); ++ty)
                        for (int tx = first(x, tile_w); tx <= last(x, tile_w, tiles_x); ++tx) {
                            const int u = x - tx * tile_w + o_.radius, v = y - ty * tile_h + o_.radius;
                            if (u < 0 || v < 0 || u >= tile_w + 2 * o_.radius || v >= tile_h + 2 * o_.radius) continue;
                            const std::vector<T>& tile = said[std::size_t(ty * tiles_x + tx)];
                            if (tile.empty()) continue;
                            for (int c = 0; c < 4; ++c) sum[c] += tile[said_index(c, u, v)];
                        }
                    const std::size_t i = light.colors.at(x, y);
                    const auto color = [&](int c) { return light.colors.channel(c)[i]; };
                    const Vec3<T> here(color(0), color(1), color(2));
                    const T level = (here.x + here.y + here.z) * light.brightness.channel(0)[i];
                    const T vote = T(o_.own_vote) / (1 + level * level);
                    // No window may know a pixel that is no center, on an edge say: there its own noise would stay.
                    const bool alone = o_.stride > 1 && vote > sum[3] / 2 && level > 0;
                    const Vec3<T> its = alone ? mean_of_alike(light, x, y) : here;
                    const Vec3<T> value = (Vec3<T>(sum[0], sum[1], sum[2]) + vote * its) / (sum[3] + vote);
                    out.store(x, y, max(value, Vec3<T>(0)));
                }
        });
    }

    /// The mean of what lies within 5 x 5 pixels, by the weights of windows but that patches are 3 x 3 alone.
    Vec3<T> mean_of_alike(const Loaded& light, int x, int y) const {
        constexpr int radius = 2;
        constexpr T negligible = 12; // of exponents
        const std::size_t here = guides_.at(x, y);
        Vec3<T> sum(0);
        T weights = 0;
        for (int v = std::max(0, y - radius); v <= std::min(h_ - 1, y + radius); ++v)
            for (int u = std::max(0, x - radius); u <= std::min(w_ - 1, x + radius); ++u) {
                const std::size_t there = guides_.at(u, v);
                T distance = 0;
                for (int c = 0; c < features; ++c) {
                    const T d = guides_.channel(c)[there] - guides_.channel(c)[here];
                    distance += d * d * scales_.channel(c)[here];
                }
                if (distance > negligible) continue;
                T test = 0;
                for (int row = -1; row <= 1; ++row) {
                    const std::size_t a = light.roots.at(x, y + row), b = light.roots.at(u, v + row);
                    for (std::size_t k = 0; k < 3; ++k) {
                        T square = 0;
                        for (int c = 0; c < 3; ++c) {
                            const T d = light.roots.channel(c)[a + k - 1] - light.roots.channel(c)[b + k - 1];
                            square += d * d;
                        }
                        test += square / (light.roots.channel(3)[a + k - 1] + light.roots.channel(3)[b + k - 1]);
                    }
                }
                distance += std::max(T(0), test / 9 - 1) / T(light.test_softness[0]);
                if (distance > negligible) continue;
                const std::size_t i = light.colors.at(u, v);
                const auto color = [&](int c) { return light.colors.channel(c)[i]; };
                const Vec3<T> value(color(0), color(1), color(2));
                const T level = (value.x + value.y + value.z) * light.brightness.channel(0)[i];
                const T weight = std::exp(-distance) / (1 + level * level);
                sum += weight * value;
                weights += weight;
            }
        return sum / weights; // its own is above 0
    }

    int reach_h() const { return tile_h + 2 * o_.radius; }
    std::size_t said_channel() const {
        return std::size_t(o_.stride * reach_h() * ((tile_w + 2 * o_.radius) / o_.stride + width));
    }
    std::size_t said_index(int channel, int u, int v) const {
        const int phase = u % o_.stride, row = (tile_w + 2 * o_.radius) / o_.stride + width;
        return std::size_t(((channel * o_.stride + phase) * reach_h() + v) * row + u / o_.stride);
    }

    struct Work {
        Work(const LightRegressionOptions& o, const std::array<double, 2>& softness)
            : weights(o.radius, o.stride, softness), offsets(weights.taps().size()), said_offsets(offsets.size()) {}

        detail::LightWeights<T> weights;
        std::vector<std::size_t> offsets, said_offsets; ///< of the taps of one row of centers
    };

    /// Those of the tile's centers that lie in `centers`.
    void fit_tile(const Loaded& light, int x0, int y0, const PixelWindow& centers, Work& work, T* said,
                  const PixelView<T, 1>& own) const {
        const int centers_w = tile_w / o_.stride, centers_h = tile_h / o_.stride;
        const int first = std::max(0, centers.y0 - y0) / o_.stride;
        const int last = std::min(centers_h, (std::min(h_, centers.y1) - y0 + o_.stride - 1) / o_.stride);
        work.weights.find({guides_, scales_, inside_, light.roots, h_}, x0, y0, first, last);
        for (int j = first; j < last; ++j) {
            for (std::size_t t = 0; t < work.offsets.size(); ++t) {
                const auto [dx, dy] = work.weights.taps()[t];
                work.offsets[t] = guides_.at(x0 + dx, std::min(y0 + j * o_.stride + dy, h_ + Phased::rim_y - 1));
                work.said_offsets[t] = said_index(0, dx + o_.radius, j * o_.stride + dy + o_.radius);
            }
            const int from = std::max(0, centers.x0 - x0) / (o_.stride * width) * width;
            for (int i = from; i < centers_w && x0 + i * o_.stride < centers.x1; i += width)
                fit(light, x0, y0, i, j, work, said, own);
        }
    }

    /// Fits the models of eight centers side by side, and lets each speak about its window.
    void fit(const Loaded& light, int x0, int y0, int i, int j, const Work& work, T* said,
             const PixelView<T, 1>& own) const {
        const Phased &colors = light.colors, &brightness = light.brightness;
        const int y = y0 + j * o_.stride;
        P here[features];
        for (int c = 0; c < features; ++c) here[c] = P::load(guides_.channel(c) + guides_.at(x0, y) + i);
        P a[coefficients * (coefficients + 1) / 2], b[coefficients * 3];
        for (P& v : a) v = P(T(0));
        for (P& v : b) v = P(T(0));
        const std::size_t taps = work.offsets.size();
        const auto weights = [&](std::size_t t) { return work.weights.of(t, j, i); };
        for (std::size_t t0 = 0; t0 < taps; t0 += block) {
            P phi[coefficients][block], weighted[coefficients][block], value[3][block];
#pragma GCC unroll 4
            for (std::size_t k = 0; k < block; ++k) {
                const std::size_t t = std::min(t0 + k, taps - 1), there = work.offsets[t] + std::size_t(i);
                const P w = t0 + k < taps ? weights(t) : P(T(0));
                phi[0][k] = P(T(1));
                weighted[0][k] = w;
#pragma GCC unroll 8
                for (int c = 0; c < features; ++c) {
                    phi[c + 1][k] = P::load(guides_.channel(c) + there) - here[c];
                    weighted[c + 1][k] = w * phi[c + 1][k];
                }
#pragma GCC unroll 3
                for (int c = 0; c < 3; ++c) value[c][k] = P::load(colors.channel(c) + there);
            }
            P* entry = a;
#pragma GCC unroll 8
            for (int r = 0; r < coefficients; ++r) {
#pragma GCC unroll 8
                for (int c = 0; c <= r; ++c, ++entry)
#pragma GCC unroll 4
                    for (int k = 0; k < block; ++k)
                        *entry = c == 0 ? *entry + weighted[r][k] : multiply_add(weighted[r][k], phi[c][k], *entry);
#pragma GCC unroll 3
                for (int c = 0; c < 3; ++c)
#pragma GCC unroll 4
                    for (int k = 0; k < block; ++k) b[3 * r + c] = multiply_add(weighted[r][k], value[c][k], b[3 * r + c]);
            }
        }
        if (!own.absent()) {
            T share[width];
            (P(T(2)) / max(a[0], P(T(2)))).store(share); // a pixel's weight with itself is 1 by each of two tests
            for (int k = 0; k < width; ++k)
                for (int v = y; v < std::min(h_, y + o_.stride); ++v)
                    for (int u = 0; u < o_.stride && x0 + (i + k) * o_.stride + u < w_; ++u)
                        own.store(x0 + (i + k) * o_.stride + u, v, share[k]);
        }
        solve(a, b);
        for (std::size_t t = 0; t < taps; ++t) {
            const std::size_t there = work.offsets[t] + std::size_t(i);
            T* const to = said + work.said_offsets[t] + i;
            P sum[3] = {b[0], b[1], b[2]};
#pragma GCC unroll 8
            for (int c = 0; c < features; ++c) {
                const P d = P::load(guides_.channel(c) + there) - here[c];
#pragma GCC unroll 3
                for (int channel = 0; channel < 3; ++channel)
                    sum[channel] = multiply_add(b[3 * (c + 1) + channel], d, sum[channel]);
            }
            // A model that says less than nothing is as far off as one that says as much too much.
            const P level = (sum[0] + sum[1] + sum[2]) * P::load(brightness.channel(0) + there);
            const P vote = weights(t) / multiply_add(level, level, P(T(1)));
#pragma GCC unroll 4
            for (int channel = 0; channel < 4; ++channel) {
                T* const place = to + std::size_t(channel) * said_channel();
                (P::load(place) + (channel < 3 ? vote * max(sum[channel], P(T(0))) : vote)).store(place);
            }
        }
    }

    /// Solves (a + ridge) x = b by Cholesky's way; x takes the place of b.
    void solve(P* a, P* b) const {
        const P ridge = a[0] * P(T(o_.ridge)) + P(T(1e-12)), tiny = a[0] * P(T(1e-6)) + P(T(1e-12));
        const auto at = [&](int r, int c) -> P& { return a[r * (r + 1) / 2 + c]; };
        for (int r = 0; r < coefficients; ++r) {
            at(r, r) += r == 0 ? P(T(1e-12)) : ridge;
            for (int c = 0; c <= r; ++c) {
                P v = at(r, c);
                for (int k = 0; k < c; ++k) v -= at(r, k) * at(c, k);
                at(r, c) = r == c ? P(T(1)) / sqrt(max(v, tiny)) : v * at(c, c); // the diagonal holds reciprocals
            }
        }
        for (int channel = 0; channel < 3; ++channel) {
            for (int r = 0; r < coefficients; ++r) {
                P v = b[3 * r + channel];
                for (int k = 0; k < r; ++k) v -= at(r, k) * b[3 * k + channel];
                b[3 * r + channel] = v * at(r, r);
            }
            for (int r = coefficients - 1; r >= 0; --r) {
                P v = b[3 * r + channel];
                for (int k = r + 1; k < coefficients; ++k) v -= at(k, r) * b[3 * k + channel];
                b[3 * r + channel] = v * at(r, r);
            }
        }
    }

    int w_, h_;
    LightRegressionOptions o_;
    Phased guides_, scales_;
    Phased inside_; ///< of a row: 1 in the image, 0 beside it
};

} // namespace LAMBENT_ABI
} // namespace lambent
