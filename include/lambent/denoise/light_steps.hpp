#pragma once
#include <lambent/denoise/blend_with_input.hpp>
#include <lambent/denoise/block_sums.hpp>
#include <lambent/denoise/denoised_error.hpp>
#include <lambent/denoise/energy_blocks.hpp>
#include <lambent/denoise/filter_steps.hpp>
#include <lambent/denoise/light_guides.hpp>
#include <lambent/denoise/light_part.hpp>
#include <lambent/denoise/light_regression.hpp>
#include <lambent/denoise/sparse_light.hpp>
#include <lambent/film/window_of.hpp>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <optional>
#include <utility>

namespace lambent {
inline namespace LAMBENT_ABI {

/// What denoise_light() met on its way.
struct LightDenoiseReport {
    std::size_t non_finite = 0; ///< pixels that came with light that is not finite
    std::size_t spikes = 0;     ///< pixels of direct, and again of indirect light that were clamped
    BilateralCounts bilateral{}; ///< of the filter where hardly any sample found light
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
        : w_(width), h_(height), o_(options), sums_(width, height), energy_(width, height), sparse_(width, height) {}

    /// What is read of a tile from clamp() to fit(): more once choose_filter() has found that it takes one there.
    PixelWindow around(const PixelWindow& tile) const {
        const PixelWindow models = around_models(tile), filtered = tile.common(filtered_);
        if (filtered.empty()) return models;
        const PixelWindow wide = filter_->around(filtered);
        return {std::min(models.x0, wide.x0), std::min(models.y0, wide.y0), std::max(models.x1, wide.x1),
                std::max(models.y1, wide.y1)};
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

    /// `planes` of around(tile), as of the steps that follow but finish().
    template <Executor E>
    void clamp(const PixelWindow& tile, const FrameView<T>& planes, E& executor) {
        const PixelWindow inside = tile.seen_from(around(tile));
        const auto add = [&](Sum which, const Plane<T, 3>& light, const PixelWindow& at) {
            for (int y = 0; y < tile.height(); ++y)
                for (int x = 0; x < tile.width(); ++x) {
                    const Vec3<T> v = light.load(at.x0 + x, at.y0 + y);
                    sums_.add(tile.x0 + x, tile.y0 + y, which, double(v.x) + double(v.y) + double(v.z));
                }
        };
        for (const bool direct : {true, false}) {
            const LightPart<T> source(planes, direct);
            const ClampedPart<T> part(planes, source, repaired(source.light), mean_samples(), executor);
            add(direct ? direct_light : indirect_light, part.light, inside);
            for (int y = 0; y < tile.height(); ++y)
                for (int x = 0; x < tile.width(); ++x) {
                    const int u = inside.x0 + x, v = inside.y0 + y;
                    sums_.add(tile.x0 + x, tile.y0 + y, direct ? direct_noise : indirect_noise,
                              double(part.variance.load(u, v)));
                    report_.spikes += part.factors.load(u, v) < 1;
                }
        }
        const PixelWindow seen =
            inside.grown(ClampedPart<T>::repair_reach, planes.radiance.width(), planes.radiance.height());
        add(seen_light, seen_lights(window_of(planes, seen)), inside.seen_from(seen));

        const PixelWindow near = inside.grown(1, planes.radiance.width(), planes.radiance.height());
        Plane<T, 3> illumination(near.width(), near.height());
        demodulate(window_of(planes, near), illumination.view());
        for (int y = 0; y < tile.height(); ++y)
            for (int x = 0; x < tile.width(); ++x)
                sparse_.add(tile.x0 + x, tile.y0 + y, std::as_const(illumination).view(), inside.x0 - near.x0 + x,
                            inside.y0 - near.y0 + y);
    }

    /// After clamp() of all tiles. Where it returns true, measure() comes before fit().
    bool choose_filter() {
        sparse_.find();
        filtered_ = sparse_.part();
        if (filtered_.empty()) return false;
        filter_.emplace(w_, h_, sparse_.filter(), false, filtered_);
        return true;
    }
    template <Executor E>
    void measure_noise(const PixelWindow& tile, const FrameView<T>& planes, E& executor) {
        const PixelWindow filtered = tile.common(filtered_);
        if (filtered.empty()) return;
        filter_->count(filtered, window_of(planes, filtered.seen_from(around(tile))));
        filter_->measure_noise(filtered, around_filtered(tile, planes), executor);
    }
    void choose_guide() { filter_->choose_guide(); }
    template <Executor E>
    void measure_light(const PixelWindow& tile, const FrameView<T>& planes, E& executor) {
        const PixelWindow filtered = tile.common(filtered_);
        if (filtered.empty()) return;
        filter_->measure_light(filtered, around_filtered(tile, planes), executor);
        filter_->forget(); // models take all the memory that there is to take
    }

    /// Writes the tile's light and its own share in it, which finish() takes.
    template <Executor E>
    void fit(const PixelWindow& tile, const FrameView<T>& all_planes, const PixelView<T, 4>& kept, E& executor) {
        const FrameView<T> planes = window_of(all_planes, around_models(tile).seen_from(around(tile)));
        const int width = planes.radiance.width(), height = planes.radiance.height();
        const PixelWindow inside = tile.seen_from(around_models(tile));
        const PixelWindow part = inside.grown(blend_reach, width, height); // what is blended with
        const PixelWindow in_part = inside.seen_from(part);
        const auto in_tile = [&](auto&& f) {
            for (int y = 0; y < tile.height(); ++y)
                for (int x = 0; x < tile.width(); ++x) f(x, y);
        };
        // Until the end `kept` has the input, made finite, and its noise.
        in_tile([&](int x, int y) { kept.store(x, y, Vec4<T>(0)); });
        const auto give = [&](const Plane<T, 3>& light, const PixelWindow& at) {
            in_tile([&](int x, int y) {
                kept.store(x, y, kept.load(x, y) + Vec4<T>(light.load(at.x0 + x, at.y0 + y), 0));
            });
        };
        Plane<T, 3> result(part.width(), part.height());
        Plane<T, 1> own(part.width(), part.height());
        {
            const LightRegression<T> models = regression(planes, executor);
            for (const bool direct : {true, false}) {
                const LightPart<T> source(planes, direct);
                Plane<T, 3> light = repaired(source.light);
                give(light, inside);
                in_tile([&](int x, int y) {
                    kept.store(x, y, kept.load(x, y) + Vec4<T>(0, 0, 0, source.noise(inside.x0 + x, inside.y0 + y)));
                });
                fit_part(planes, source, models, std::move(light), part, result, own, executor);
            }
        }
        const PixelWindow wide = part.grown(ClampedPart<T>::repair_reach, width, height), in_wide = part.seen_from(wide);
        const Plane<T, 3> seen = seen_lights(window_of(planes, wide));
        give(seen, inside.seen_from(wide));
        for (int y = 0; y < part.height(); ++y)
            for (int x = 0; x < part.width(); ++x)
                result.store(x, y, result.load(x, y) + seen.load(in_wide.x0 + x, in_wide.y0 + y));
        blend_with_input<T>(result.view(), window_of(planes.radiance, part), window_of(planes.variance, part),
                            mean_samples(), executor, mean_light());
        if (!tile.common(filtered_).empty())
            mix_filtered(tile, all_planes, window_of(result.view(), in_part), window_of(own.view(), in_part), executor);
        const PixelView<const T, 3> given(kept.data(), kept.width(), kept.height(), kept.strides());
        energy_.template add<T>(tile, window_of(std::as_const(result).view(), in_part), given, mean_light() / 3);
        in_tile([&](int x, int y) {
            const int u = in_part.x0 + x, v = in_part.y0 + y;
            const T noise = kept.load(x, y).w, share = noise > 0 ? std::min(T(1), own.load(u, v) / noise) : T(0);
            kept.store(x, y, Vec4<T>(result.load(u, v), share));
        });
    }

    /// After fit() of all tiles.
    void solve() { energy_.solve(); }

    /// `planes` and what fit() wrote, both of around_result(tile); the latter is changed. Writes the tile's radiance and,
    /// where there is one, its error.
    template <Executor E>
    void finish(const PixelWindow& tile, const FrameView<T>& planes, const PixelView<T, 4>& kept,
                const PixelView<T, 3>& out, const PixelView<T, 3>& error, E& executor) const {
        const PixelWindow window = around_result(tile), inside = tile.seen_from(window);
        const PixelView<T, 3> light(kept.data(), kept.width(), kept.height(), kept.strides());
        const PixelView<T, 1> own(kept.data() + 3 * kept.strides().channel, kept.width(), kept.height(),
                                  kept.strides());
        for (int y = 0; y < window.height(); ++y)
            for (int x = 0; x < window.width(); ++x)
                light.store(x, y, Vec3<T>(Vec3<double>(light.load(x, y)) *
                                          energy_.factor(window.x0 + x, window.y0 + y)));
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

    LightDenoiseReport report() const {
        LightDenoiseReport report = report_;
        if (filter_) report.bilateral = filter_->report().bilateral;
        return report;
    }

private:
    enum Sum : std::size_t {
        samples,
        counted,
        depth,
        depths,
        direct_light,
        indirect_light,
        seen_light,
        direct_noise,
        indirect_noise,
        sum_count
    };
    static constexpr int error_reach = 3 + spread_reach;

    /// What the regression reads. It begins at a tile, too, so that sums run in the same order.
    PixelWindow around_models(const PixelWindow& tile) const {
        const int models = blend_reach + 2 * o_.radius + 1; // the pixels that have a say in the tile's
        const int patches = 3;
        const int reach = models + std::max(patches + ClampedPart<T>::reach, 1 + guide_reach(o_.feature_radius));
        PixelWindow window = tile.grown(reach, w_, h_);
        window.x0 -= window.x0 % tile_x;
        window.y0 -= window.y0 % tile_y;
        return window;
    }

    double mean_samples() const { return sums_.total(samples) / std::max(1.0, sums_.total(counted)); }
    double per_pixel(double sum) const { return sum / (double(w_) * double(h_)); }
    double mean_light() const {
        return per_pixel(sums_.total(direct_light) + sums_.total(indirect_light) + sums_.total(seen_light));
    }

    template <class E>
    LightRegression<T> regression(const FrameView<T>& planes, E& executor) const {
        const double n = mean_samples();
        LightRegressionOptions options{.radius = o_.radius, .stride = o_.stride,
                                       // feature_noise() errs towards more
                                       .feature_sigma = o_.feature_sigma * (n < 2 ? 0.6 : 1),
                                       .feature_floor = 3e-4, .own_vote = o_.stride > 1 ? 0.1 : 1e-9,
                                       .ridge = n < 2 ? 0.1 : n < 16 ? 1e-3 : 1e-4};
        LightRegression<T> models(planes.radiance.width(), planes.radiance.height(), options);
        const double count = sums_.total(depths);
        GuideFacts facts{.mean_depth = count > 0 ? sums_.total(depth) / count : 1, .noisy = varies_};
        if (n < 2) facts.noisy = {true, true, true};
        set_light_guides(models, planes, facts, o_.feature_radius, n, executor);
        return models;
    }

    /// Adds direct or indirect light, and its own share of the noise, to those of the part of the window.
    template <class E>
    void fit_part(const FrameView<T>& planes, const LightPart<T>& source, const LightRegression<T>& models,
                  Plane<T, 3> given, const PixelWindow& part, Plane<T, 3>& result, Plane<T, 1>& own, E& executor) const {
        const int width = given.width(), height = given.height();
        ClampedPart<T> clamped(planes, source, std::move(given), mean_samples(), executor);
        Plane<T, 1> share;
        if (const double noise = per_pixel(sums_.total(source.direct ? direct_noise : indirect_noise)); noise > 0) {
            for (T& v : clamped.variance.values()) v += T(1e-4 * noise);
            const auto load = [&] {
                const Plane<T, 3> root = clamped.root(source);
                return models.load({std::as_const(clamped.light).view(), root.view(), std::as_const(clamped.variance).view(),
                                    test_softness(source.direct, mean_samples()),
                                    per_pixel(sums_.total(source.direct ? direct_light : indirect_light))});
            };
            const auto light = load();
            clamped.factors = clamped.variance = {};
            share.allocate(width, height, T(1));
            models.run(light, clamped.light.view(), executor, share.view(), part);
        }
        for (int y = 0; y < part.height(); ++y)
            for (int x = 0; x < part.width(); ++x) {
                const int u = part.x0 + x, v = part.y0 + y;
                result.store(x, y, result.load(x, y) + clamped.light.load(u, v));
                const T its = share.absent() ? T(1) : share.load(u, v);
                own.store(x, y, own.load(x, y) + its * source.noise(u, v));
            }
    }

    /// What the filter reads, of the planes of around(tile).
    FrameView<T> around_filtered(const PixelWindow& tile, const FrameView<T>& planes) const {
        return window_of(planes, filter_->around(tile.common(filtered_)).seen_from(around(tile)));
    }

    /// Puts what the filter makes of the light in the place of what models say, as far as light is sparse.
    template <class E>
    void mix_filtered(const PixelWindow& tile, const FrameView<T>& planes, const PixelView<T, 3>& result,
                      const PixelView<T, 1>& own, E& executor) {
        const PixelWindow part = tile.common(filtered_), inside = part.seen_from(tile);
        Plane<T, 3> filtered(part.width(), part.height());
        filter_->filter(part, around_filtered(tile, planes), filtered.view(), executor);
        for (int y = 0; y < part.height(); ++y)
            for (int x = 0; x < part.width(); ++x) {
                const T share = T(sparse_.share(part.x0 + x, part.y0 + y));
                if (!(share > 0)) continue;
                const int u = inside.x0 + x, v = inside.y0 + y;
                const Vec3<T> modelled = result.load(u, v);
                result.store(u, v, modelled + (filtered.load(x, y) - modelled) * share);
                own.store(u, v, own.load(u, v) * (1 - share));
            }
    }

    /// Lights that are seen directly.
    static Plane<T, 3> seen_lights(const FrameView<T>& planes) {
        Plane<T, 3> seen(planes.radiance.width(), planes.radiance.height());
        for (int y = 0; y < seen.height(); ++y)
            for (int x = 0; x < seen.width(); ++x) {
                const Vec3<T> directly =
                    planes.radiance.load(x, y) - planes.direct.load(x, y) - planes.indirect.load(x, y);
                seen.store(x, y, max(directly, Vec3<T>(0)));
            }
        repair_non_finite(seen.view(), ClampedPart<T>::repair_reach);
        return seen;
    }

    int w_, h_;
    LightDenoiseOptions o_;
    BlockSums<sum_count> sums_;
    EnergyBlocks energy_;
    SparseLight sparse_;
    std::optional<FilterSteps<T>> filter_; ///< where light is sparse anywhere,
    PixelWindow filtered_;                 ///< which is in this part of the image
    std::array<bool, 3> varies_{}; ///< albedo, normal, depth
    LightDenoiseReport report_;
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
