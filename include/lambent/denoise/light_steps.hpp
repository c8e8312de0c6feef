#pragma once
#include <lambent/denoise/blend_with_input.hpp>
#include <lambent/denoise/block_sums.hpp>
#include <lambent/denoise/denoised_error.hpp>
#include <lambent/denoise/energy_blocks.hpp>
#include <lambent/denoise/light_guides.hpp>
#include <lambent/denoise/light_part.hpp>
#include <lambent/denoise/light_regression.hpp>
#include <lambent/film/window_of.hpp>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <utility>

namespace lambent {
inline namespace LAMBENT_ABI {

/// What denoise_light() met on its way.
struct LightDenoiseReport {
    std::size_t non_finite = 0; ///< pixels that came with light that is not finite
    std::size_t spikes = 0;     ///< pixels of direct, and again of indirect light that were clamped
};

/// Of denoise_light().
struct LightDenoiseOptions {
    int radius = 5;             ///< of the regression's windows, in pixels
    int stride = 1;             ///< one model for so many pixels a side: 2 is faster and worse
    double feature_sigma = 5;   ///< see LightRegressionOptions; after one sample 0.6 of it
    int feature_radius = 2;     ///< of the windows in which features are cleaned of their own noise: at most 1 from 8 samples
                                ///< on; 0: they are not
};

namespace detail {

/// The steps of denoise_light() on one tile of a frame after the other, each step on all tiles before the next, since it
/// needs what the one before has summed up. The result is the same to the bit however the frame is cut: tiles begin at
/// multiples of tile_x and tile_y, and planes are given as far around them as around() says.
template <std::floating_point T>
class LightSteps {
public:
    static constexpr int tile_x = 64, tile_y = 16; ///< the regression's own tiles

    LightSteps(int width, int height, const LightDenoiseOptions& options)
        : w_(width), h_(height), o_(options), sums_(width, height), energy_(width, height) {}

    /// What is read for clamp() and fit() of a tile. It begins at a tile, too, so that sums run in the same order.
    PixelWindow around(const PixelWindow& tile) const {
        const int models = blend_reach + 2 * o_.radius + 1; // the pixels that have a say in the tile's
        const int patches = 3;
        const int reach = models + std::max(patches + ClampedPart<T>::reach, 1 + guide_reach(o_.feature_radius));
        PixelWindow window = tile.grown(reach, w_, h_);
        window.x0 -= window.x0 % tile_x;
        window.y0 -= window.y0 % tile_y;
        return window;
    }
    /// What is read for finish().
    PixelWindow around_result(const PixelWindow& tile) const { return tile.grown(error_reach, w_, h_); }

    /// `planes` of the tile. Emissions, samples, depths: what is asked of the whole frame.
    void count(const PixelWindow& tile, const FrameView<T>& planes) {
        for (int y = 0; y < tile.height(); ++y)
            for (int x = 0; x < tile.width(); ++x) {
                const int u = tile.x0 + x, v = tile.y0 + y;
                const double n = double(planes.samples.load(x, y));
                sums_.add(u, v, samples, n);
                sums_.add(u, v, counted, n > 0 ? 1 : 0);
                report_.non_finite += !is_finite(planes.radiance.load(x, y)) || !is_finite(planes.direct.load(x, y)) ||
                                      !is_finite(planes.indirect.load(x, y));
                if (!planes.depth.absent()) {
                    const double d = double(planes.depth.load(x, y));
                    const bool there = d > 0 && is_finite(d);
                    sums_.add(u, v, depth, there ? d : 0);
                    sums_.add(u, v, depths, there ? 1 : 0);
                }
                const auto varies = [&](const auto& plane) {
                    if (plane.absent()) return false;
                    const auto value = plane.load(x, y);
                    if constexpr (std::floating_point<std::remove_cvref_t<decltype(value)>>) return value > 0;
                    else return value.x + value.y + value.z > 0;
                };
                varies_ = {varies_[0] || varies(planes.albedo_variance), varies_[1] || varies(planes.normal_variance),
                           varies_[2] || varies(planes.depth_variance)};
            }
    }

    /// `planes` of around(tile), as of fit().
    template <Executor E>
    void clamp(const PixelWindow& tile, const FrameView<T>& planes, E& executor) {
        const PixelWindow inside = tile.seen_from(around(tile));
        const auto each = [&](auto&& f) {
            for (int y = 0; y < tile.height(); ++y)
                for (int x = 0; x < tile.width(); ++x) f(x, y, inside.x0 + x, inside.y0 + y);
        };
        for (const bool direct : {true, false}) {
            const ClampedPart<T> part(planes, LightPart<T>(planes, direct), mean_samples(), executor);
            each([&](int x, int y, int u, int v) {
                const Vec3<T> light = part.light(u, v);
                sums_.add(tile.x0 + x, tile.y0 + y, direct ? direct_light : indirect_light,
                          double(light.x) + double(light.y) + double(light.z));
                sums_.add(tile.x0 + x, tile.y0 + y, direct ? direct_noise : indirect_noise, double(part.variance.load(u, v)));
                report_.spikes += part.factors.load(u, v) < 1;
            });
        }
        const Plane<T, 3> seen = seen_lights(window_of(planes, inside.grown(ClampedPart<T>::repair_reach, around(tile).width(), around(tile).height())));
        const PixelWindow in_seen = inside.seen_from(inside.grown(ClampedPart<T>::repair_reach, around(tile).width(), around(tile).height()));
        each([&](int x, int y, int, int) {
            const Vec3<T> light = seen.load(in_seen.x0 + x, in_seen.y0 + y);
            sums_.add(tile.x0 + x, tile.y0 + y, seen_light, double(light.x) + double(light.y) + double(light.z));
        });
    }

    /// Writes the tile's light and its own share in it, which finish() takes.
    template <Executor E>
    void fit(const PixelWindow& tile, const FrameView<T>& planes, const PixelView<T, 4>& kept, E& executor) {
        const PixelWindow window = around(tile), inside = tile.seen_from(window);
        const int width = window.width(), height = window.height();
        const PixelWindow part = inside.grown(blend_reach, width, height); // what is blended with
        Plane<T, 3> result(width, height), given(width, height);          // given: the input, finite
        Plane<T, 1> own(width, height), noise(width, height);
        const auto each = [&](auto&& f) {
            for (int y = part.y0; y < part.y1; ++y)
                for (int x = part.x0; x < part.x1; ++x) f(x, y);
        };
        {
            const LightRegression<T> models = regression(planes, executor);
            for (const bool direct : {true, false}) fit_part(planes, direct, models, part, result, given, own, noise, executor);
        }
        const Plane<T, 3> seen = seen_lights(planes);
        each([&](int x, int y) {
            result.view().store(x, y, result.load(x, y) + seen.load(x, y));
            given.view().store(x, y, given.load(x, y) + seen.load(x, y));
        });
        blend_with_input<T>(window_of(result.view(), part), window_of(planes.radiance, part), window_of(planes.variance, part),
                            mean_samples(), executor, mean_light());
        const auto in_tile = [&](auto& plane) { return window_of(std::as_const(plane).view(), inside); };
        energy_.template add<T>(tile, in_tile(result), in_tile(given), mean_light() / 3);
        for (int y = 0; y < tile.height(); ++y)
            for (int x = 0; x < tile.width(); ++x) {
                const T all = in_tile(noise).load(x, y);
                const T share = all > 0 ? std::min(T(1), in_tile(own).load(x, y) / all) : T(0);
                kept.store(x, y, Vec4<T>(in_tile(result).load(x, y), share));
            }
    }

    /// After fit() of all tiles.
    void solve() { energy_.solve(); }

    /// `planes` and what fit() wrote, both of around_result(tile); the latter is changed. Writes the tile's radiance and,
    /// where there is one, its error.
    template <Executor E>
    void finish(const PixelWindow& tile, const FrameView<T>& planes, const PixelView<T, 4>& kept, const PixelView<T, 3>& out,
                const PixelView<T, 3>& error, E& executor) const {
        const PixelWindow window = around_result(tile), inside = tile.seen_from(window);
        const PixelView<T, 3> light(kept.data(), kept.width(), kept.height(), kept.strides());
        const PixelView<T, 1> own(kept.data() + 3 * kept.strides().channel, kept.width(), kept.height(), kept.strides());
        for (int y = 0; y < window.height(); ++y)
            for (int x = 0; x < window.width(); ++x)
                light.store(x, y, Vec3<T>(Vec3<double>(light.load(x, y)) * energy_.factor(window.x0 + x, window.y0 + y)));
        const auto copy = [&](const auto& from, const auto& to) {
            for (int y = 0; y < tile.height(); ++y)
                for (int x = 0; x < tile.width(); ++x) to.store(x, y, from.load(inside.x0 + x, inside.y0 + y));
        };
        if (!error.absent()) {
            Plane<T, 3> around(window.width(), window.height());
            denoised_error<T>(light, planes.radiance, planes.variance, planes.halves, own, around.view(), executor);
            copy(around, error);
        }
        copy(light, out);
    }

    const LightDenoiseReport& report() const { return report_; }

private:
    enum Sum : std::size_t { samples, counted, depth, depths, direct_light, indirect_light, seen_light, direct_noise, indirect_noise, sum_count };
    static constexpr int error_reach = 3 + spread_reach;

    double mean_samples() const { return sums_.total(samples) / std::max(1.0, sums_.total(counted)); }
    double per_pixel(double sum) const { return sum / (double(w_) * double(h_)); }
    double mean_light() const {
        return per_pixel(sums_.total(direct_light) + sums_.total(indirect_light) + sums_.total(seen_light));
    }

    template <class E>
    LightRegression<T> regression(const FrameView<T>& planes, E& executor) const {
        const double n = mean_samples();
        LightRegressionOptions options{.radius = o_.radius, .stride = o_.stride,
                                       .feature_sigma = o_.feature_sigma * (n < 2 ? 0.6 : 1), // feature_noise() errs towards more
                                       .feature_floor = 3e-4, .own_vote = o_.stride > 1 ? 0.1 : 1e-9,
                                       .ridge = n < 2 ? 0.1 : n < 16 ? 1e-3 : 1e-4};
        LightRegression<T> models(planes.radiance.width(), planes.radiance.height(), options);
        const double count = sums_.total(depths);
        GuideFacts facts{.mean_depth = count > 0 ? sums_.total(depth) / count : 1, .noisy = varies_};
        if (n < 2) facts.noisy = {true, true, true};
        set_light_guides(models, planes, facts, o_.feature_radius, n, executor);
        return models;
    }

    /// Adds direct or indirect light, its own share of the noise, and what there was before.
    template <class E>
    void fit_part(const FrameView<T>& planes, bool direct, const LightRegression<T>& models, const PixelWindow& part,
                  Plane<T, 3>& result, Plane<T, 3>& given, Plane<T, 1>& own, Plane<T, 1>& noise, E& executor) const {
        const int width = result.width(), height = result.height();
        const LightPart<T> source(planes, direct);
        Plane<T, 3> light(width, height);
        Plane<T, 1> share(width, height, T(1));
        const double mean_noise = per_pixel(sums_.total(direct ? direct_noise : indirect_noise));
        {
            ClampedPart<T> clamped(planes, source, mean_samples(), executor);
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    light.view().store(x, y, clamped.light(x, y));
                    given.view().store(x, y, given.load(x, y) + clamped.given.load(x, y));
                }
            if (mean_noise > 0) {
                for (T& v : clamped.variance.values()) v += T(1e-4 * mean_noise);
                const Plane<T, 3> root = clamped.root(source);
                models.run({std::as_const(light).view(), root.view(), std::as_const(clamped.variance).view(),
                            test_softness(direct, mean_samples()),
                            per_pixel(sums_.total(direct ? direct_light : indirect_light))},
                           light.view(), executor, share.view(), part);
            }
        }
        for (int y = part.y0; y < part.y1; ++y)
            for (int x = part.x0; x < part.x1; ++x) {
                const T here = source.noise(x, y);
                result.view().store(x, y, result.load(x, y) + light.load(x, y));
                own.view().store(x, y, own.load(x, y) + share.load(x, y) * here);
                noise.view().store(x, y, noise.load(x, y) + here);
            }
    }

    /// Lights that are seen directly.
    static Plane<T, 3> seen_lights(const FrameView<T>& planes) {
        Plane<T, 3> seen(planes.radiance.width(), planes.radiance.height());
        for (int y = 0; y < seen.height(); ++y)
            for (int x = 0; x < seen.width(); ++x) {
                const Vec3<T> directly = planes.radiance.load(x, y) - planes.direct.load(x, y) - planes.indirect.load(x, y);
                seen.view().store(x, y, max(directly, Vec3<T>(0)));
            }
        repair_non_finite(seen.view(), ClampedPart<T>::repair_reach);
        return seen;
    }

    int w_, h_;
    LightDenoiseOptions o_;
    BlockSums<sum_count> sums_;
    EnergyBlocks energy_;
    std::array<bool, 3> varies_{}; ///< albedo, normal, depth
    LightDenoiseReport report_;
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
