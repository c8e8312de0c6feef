#pragma once
#include <lambent/denoise/atrous.hpp>
#include <lambent/denoise/block_sums.hpp>
#include <lambent/denoise/box_mean.hpp>
#include <lambent/denoise/by_samples.hpp>
#include <lambent/denoise/cross_bilateral.hpp>
#include <lambent/denoise/denoise_options.hpp>
#include <lambent/denoise/despike.hpp>
#include <lambent/denoise/features.hpp>
#include <lambent/denoise/footprint.hpp>
#include <lambent/denoise/noise_level.hpp>
#include <lambent/denoise/pixel_albedo.hpp>
#include <lambent/film/window_of.hpp>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// What tells shadows and reflections from noise: the illumination through a small filter that heeds geometry
/// alone, and how much a single pixel's illumination varies about it. The noise comes from the frame's own
/// variance through the same filter; where there is none, as with one sample, from the spread of neighbours.
template <class T>
struct LightGuide {
    Plane<T, 3> image;
    Plane<T, 1> deviation;

    template <class Smooth> // smooth(image, out): the small filter, in place too
    LightGuide(const FrameView<T>& frame, const PixelView<const T, 3>& illumination, bool sampled, Smooth&& smooth)
        : image(illumination.width(), illumination.height()), deviation(image.width(), image.height()) {
        Plane<T, 3> noise(image.width(), image.height());
        smooth(illumination, image.view());
        for (int y = 0; y < image.height(); ++y)
            for (int x = 0; x < image.width(); ++x) {
                const Vec3<T> albedo = modulation(frame, x, y), d = illumination.load(x, y) - image.load(x, y);
                noise.store(x, y, sampled ? frame.variance.load(x, y) / (albedo * albedo) : d * d);
            }
        smooth(noise.view(), noise.view());
        for (int y = 0; y < image.height(); ++y)
            for (int x = 0; x < image.width(); ++x) {
                const Vec3<T> v = noise.load(x, y);
                deviation.store(x, y, std::sqrt(std::max(T(0), v.x + v.y + v.z)));
            }
    }
    /// In units of the power of two below the mean deviation: so exposure does not matter, nor a pixel far away. No
    /// deviation anywhere leaves `image` absent.
    void scale(double mean_deviation) {
        if (!(mean_deviation > 0)) {
            image = {};
            return;
        }
        const T factor = T(std::ldexp(1.0, -std::ilogb(mean_deviation)));
        for (T& d : deviation.values()) d *= factor;
        for (T& v : image.values()) v *= factor;
    }
};

/// How much sigmas grow in an image of so much noise, by a factor of 1 + noise: where samples seldom find light, a pixel
/// needs neighbours on other surfaces. Another material then weighs noise² / 2 at least.
struct Loosened {
    double noise;
    double sigma(double at_rest) const { return at_rest * (1 + noise); }
    double material(double at_rest) const {
        const double weight = std::min(0.5 * noise * noise, 0.9);
        return weight > 0 ? std::max(at_rest, std::sqrt(-0.5 / std::log(weight))) : at_rest;
    }
};

inline int atrous_levels(double samples) { return samples < 16 ? 5 : samples < 64 ? 4 : 3; }

/// atrous() of what despike() made of the noisy illumination, in place. Noise comes from the frame's variances or,
/// after one sample, from the spread of 7 x 7 pixels; how far light may differ goes with the number of samples.
template <class T, class E>
void atrous_of_illumination(const FrameView<T>& frame, const PixelView<T, 3>& noisy,
                            const PixelView<T, 3>& illumination, double samples, E& executor) {
    const int width = illumination.width(), height = illumination.height();
    const auto sum = [](const Vec3<T>& v) { return v.x + v.y + v.z; };
    Plane<T, 1> variance(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const Vec3<T> deviation = sqrt(max(frame.variance.load(x, y), Vec3<T>(0))) / modulation(frame, x, y);
            const T before = sum(noisy.load(x, y)), after = sum(illumination.load(x, y));
            variance.store(x, y, sum(deviation) * sum(deviation) * (before > after ? after / before : T(1)));
        }
    if (samples < 2) {
        const auto light = [&](int x, int y) { return sum(illumination.load(x, y)); };
        const Plane<T, 1> mean = box_mean<T>(width, height, 3, light, executor);
        variance = box_mean<T>(width, height, 3, [&](int x, int y) {
            const T d = light(x, y) - mean.load(x, y);
            return d * d;
        }, executor);
    }
    const AtrousOptions options{.levels = atrous_levels(samples),
                                .sigma_light = BySamples{{4, 3, 2, 2}}(samples),
                                .sigma_normal = BySamples{{.3, .3, .15, .1}}(samples)};
    atrous<T>(illumination, variance.view(), frame.normal, frame.depth, illumination, options, executor);
}

/// The steps of denoise() without statistics, on one tile of a frame after the other, each on all tiles before the next.
/// Tiles begin at multiples of 16, or where the part of the image begins that they make up; planes are given as far around
/// them as around() says.
template <std::floating_point T>
class FilterSteps {
public:
    /// For `part` of the image, or where that is empty for all of it. throws lambent::Error on a bad option
    FilterSteps(int width, int height, const DenoiseOptions& options, bool by_atrous, const PixelWindow& part = {})
        : w_(width), h_(height), part_(part.empty() ? PixelWindow{0, 0, width, height} : part), o_(options),
          by_atrous_(by_atrous), sums_(width, height) {
        filter_ = {.kernel = o_.kernel, .sigma_spatial = o_.sigma_spatial, .second_pass_factor = o_.second_pass_factor,
                   .form = o_.form};
        if (!relative()) filter_.sigma_illumination = o_.sigma_illumination;
        check(filter_);
        require_sigma("denoise: material", o_.sigma_material); // what noise loosens could hide it
        small_ = filter_;
        small_.kernel = 2 * widest_guide() + 1;
        small_.sigma_spatial = 0;
        if (by_atrous_) report_.used = NoiseUse::atrous;
    }

    /// What is read of a tile but for count(): less once choose_guide() was called.
    PixelWindow around(const PixelWindow& tile) const {
        if (o_.kernel == 0) return tile;
        const int clamp = 2, repair = o_.kernel / 2, first = clamp + repair;
        if (by_atrous_) {
            const int levels = atrous_levels(mean_samples()), spread = mean_samples() < 2 ? 6 : 0;
            return tile.grown(first + spread + 2 * ((1 << levels) - 1) + levels + 1, w_, h_);
        }
        const int guide = relative() ? 2 * (small_.kernel / 2) : 0, footprint = 1;
        return tile.grown(o_.kernel / 2 + std::max(guide + first, footprint), w_, h_);
    }

    /// `planes` of the tile.
    void count(const PixelWindow& tile, const FrameView<T>& planes) {
        for (int y = 0; y < tile.height(); ++y)
            for (int x = 0; x < tile.width(); ++x) {
                const double n = planes.samples.absent() ? std::numeric_limits<double>::infinity()
                                                         : double(planes.samples.load(x, y));
                sums_.add(tile.x0 + x, tile.y0 + y, samples, n);
                if (!by_atrous_ && !planes.variance.absent()) sampled_ = sampled_ || max_component(planes.variance.load(x, y)) > 0;
            }
    }

    /// Whether measure_noise() of each tile, choose_guide() and measure_light() of each tile come before filter().
    bool needs_measure() const { return o_.kernel != 0 && !by_atrous_ && relative(); }

    /// `planes` of around(tile), as of measure_light() and filter().
    template <Executor E>
    void measure_noise(const PixelWindow& tile, const FrameView<T>& planes, E& executor) {
        Prepared p = prepare(tile, planes, executor);
        const PixelWindow inside = tile.seen_from(around(tile));
        for (int y = 0; y < tile.height(); ++y)
            for (int x = 0; x < tile.width(); ++x) {
                NoisePairs pair;
                add_noise_pairs<T>(pair, std::as_const(p.illumination).view(), inside.x0 + x, inside.y0 + y);
                sums_.add(tile.x0 + x, tile.y0 + y, ratios, pair.ratios);
                sums_.add(tile.x0 + x, tile.y0 + y, pairs, pair.pairs);
            }
        keep_whole(tile, std::move(p));
    }

    void choose_guide() {
        // In steps, so that a pixel far away seldom matters.
        const int steps = int(std::lround(16 * NoisePairs{sums_.total(ratios), sums_.total(pairs)}.level()));
        noise_ = steps / 16.0;
        small_.kernel = 2 * std::clamp(int(20 * noise_), std::min(4, widest_guide()), widest_guide()) + 1;
    }

    template <Executor E>
    void measure_light(const PixelWindow& tile, const FrameView<T>& planes, E& executor) {
        Prepared p = prepare(tile, planes, executor);
        make_guide(p, planes, executor);
        const PixelWindow inside = tile.seen_from(around(tile));
        for (int y = 0; y < tile.height(); ++y)
            for (int x = 0; x < tile.width(); ++x) {
                const double d = double(p.guide->deviation.load(inside.x0 + x, inside.y0 + y));
                sums_.add(tile.x0 + x, tile.y0 + y, deviation, is_finite(d) ? d : 0);
            }
        keep_whole(tile, std::move(p));
    }

    /// Frees what is kept of a part that is one tile. The next step has to make it again.
    void forget() { whole_.reset(); }

    /// Writes the tile's radiance.
    template <Executor E>
    void filter(const PixelWindow& tile, const FrameView<T>& planes, const PixelView<T, 3>& out, E& executor) {
        const PixelWindow window = around(tile), inside = tile.seen_from(window);
        const auto copy = [&](const PixelView<const T, 3>& from) {
            for (int y = 0; y < tile.height(); ++y)
                for (int x = 0; x < tile.width(); ++x) out.store(x, y, from.load(inside.x0 + x, inside.y0 + y));
        };
        if (o_.kernel == 0) return copy(planes.radiance);
        Prepared p = prepare(tile, planes, executor);
        count_changes(p, inside);
        const PixelView<T, 3> view = p.illumination.view();
        if (by_atrous_) {
            atrous_of_illumination(planes, p.noisy.view(), view, mean_samples(), executor);
        } else {
            filter_.window = inside;
            if (relative()) {
                if (!p.guide) make_guide(p, planes, executor);
                p.guide->scale(per_pixel(deviation));
                const Geometry geometry(planes, o_, {noise_}, executor);
                const RelativeDistanceFeature<T> light(p.guide->image.view(), p.guide->deviation.view(),
                                                       Loosened{noise_}.sigma(o_.sigma_illumination), 1e-3);
                report_.bilateral += cross_bilateral<T>(view, view, filter_, executor, light, geometry.plane,
                                                        geometry.angle, geometry.material);
            } else {
                const DistanceFeature<T> position(planes.position, o_.sigma_position);
                const NormalFeature<T> normal(planes.normal, o_.sigma_normal);
                const IdentityFeature<T> material(planes.material, o_.sigma_material);
                report_.bilateral += cross_bilateral<T>(view, view, filter_, executor, position, normal, material);
            }
        }
        FrameView<T> shown = planes;
        Plane<T, 3> albedo;
        if (needs_measure() && !planes.albedo.absent() && mean_samples() < 2) {
            albedo = pixel_albedo(planes, executor);
            shown.albedo = std::as_const(albedo).view();
        }
        remodulate(window_of(shown, inside), window_of(std::as_const(p.illumination).view(), inside), out);
    }

    const DenoiseReport& report() const { return report_; }

private:
    enum Sum : std::size_t { samples, deviation, ratios, pairs, sum_count };

    struct Geometry {
        Plane<T, 1> footprint;
        PlaneDistanceFeature<T> plane;
        NormalAngleFeature<T> angle;
        MaterialFeature<T> material;

        template <class E>
        Geometry(const FrameView<T>& planes, const DenoiseOptions& o, const Loosened& loosened, E& executor)
            : footprint(pixel_footprint(planes.position, executor)),
              plane(planes.position, planes.normal, std::as_const(footprint).view(), loosened.sigma(o.sigma_position)),
              angle(planes.normal, loosened.sigma(o.sigma_normal)),
              material(planes.material, loosened.material(o.sigma_material)) {}
    };
    struct Prepared {
        PixelWindow window;
        Plane<T, 3> raw, noisy, illumination; ///< illumination as it came, mended, clamped
        std::optional<LightGuide<T>> guide;
    };

    bool relative() const { return o_.units == SigmaUnits::relative; }
    /// Infinite where the frame does not tell.
    double mean_samples() const { return per_pixel(samples); }
    double per_pixel(Sum which) const { return sums_.total(which) / (double(part_.width()) * double(part_.height())); }
    /// Of the guide's filter, in pixels: half of the filter's own.
    int widest_guide() const { return std::max(1, o_.kernel / 4); }

    template <class E>
    Prepared prepare(const PixelWindow& tile, const FrameView<T>& planes, E& executor) {
        if (whole_ && tile == part_ && whole_->window == around(tile)) { // less is around once the guide is chosen
            Prepared p = std::move(*whole_);
            whole_.reset();
            return p;
        }
        const int width = planes.radiance.width(), height = planes.radiance.height();
        Prepared p{around(tile), Plane<T, 3>(width, height), {}, Plane<T, 3>(width, height), {}};
        demodulate(planes, p.raw.view());
        p.noisy = p.raw;
        repair_non_finite(p.noisy.view(), o_.kernel / 2);
        suppress_fireflies_seed(p.noisy.view(), o_.firefly);
        despike<T>(std::as_const(p.noisy).view(), p.illumination.view(), o_.despike, executor);
        return p;
    }

    /// A guide only tells light from noise: geometry's sigmas grow twice as much for it.
    template <class E>
    void make_guide(Prepared& p, const FrameView<T>& planes, E& executor) {
        const Geometry geometry(planes, o_, {2 * noise_}, executor);
        p.guide.emplace(planes, std::as_const(p.illumination).view(), sampled_,
                        [&](const PixelView<const T, 3>& from, const PixelView<T, 3>& to) {
            report_.bilateral += cross_bilateral<T>(from, to, small_, executor, geometry.plane, geometry.angle,
                                                    geometry.material);
        });
    }

    void keep_whole(const PixelWindow& tile, Prepared&& p) {
        if (tile == part_) whole_ = std::move(p);
    }

    void count_changes(const Prepared& p, const PixelWindow& inside) {
        for (int y = inside.y0; y < inside.y1; ++y)
            for (int x = inside.x0; x < inside.x1; ++x) {
                const bool sound = is_summable(p.raw.load(x, y));
                report_.non_finite += !sound;
                report_.spikes += sound && p.raw.load(x, y) != p.illumination.load(x, y);
            }
    }

    int w_, h_;
    PixelWindow part_;
    DenoiseOptions o_;
    CrossBilateralOptions filter_, small_;
    bool by_atrous_, sampled_ = false;
    double noise_ = 0; ///< of the image: see noise_level()
    BlockSums<sum_count> sums_;
    std::optional<Prepared> whole_; ///< of a part that is one tile, from one step to the next
    DenoiseReport report_;
};

/// What a filter has to know of all tiles before it works on the first. on_each(step) calls step(tile, planes), of around()
/// each tile.
template <class Steps, class OnEach, Executor E>
void measure(Steps& steps, OnEach&& on_each, E& executor) {
    on_each([&](const PixelWindow& tile, const auto& planes) { steps.measure_noise(tile, planes, executor); });
    steps.choose_guide();
    on_each([&](const PixelWindow& tile, const auto& planes) { steps.measure_light(tile, planes, executor); });
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
