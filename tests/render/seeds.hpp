#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <lambent/core/parallel.hpp>
#include <lambent/sampling/independent.hpp>
#include <lambent/sampling/stratified.hpp>
#include <render/transport.hpp>
#include <string>
#include <vector>

/// Image means whose error is taken from the spread over seeds alone: pixels of one seed may depend on each other, as
/// Sobol's do, which share their tile's points.
namespace lambent_test {

enum class SamplerName : std::uint8_t { sobol, stratified, independent };
inline constexpr SamplerName all_samplers[] = {SamplerName::sobol, SamplerName::stratified, SamplerName::independent};
inline constexpr PathStrategy all_strategies[] = {PathStrategy::both, PathStrategy::light, PathStrategy::bsdf};

/// One way to render.
struct Way {
    SamplerName sampler = SamplerName::sobol;
    PathStrategy strategy = PathStrategy::both;
    PathOptions options{};
    bool reflected_only = false; ///< without the light that is seen directly

    std::string name() const {
        const char* const samplers[] = {"sobol", "stratified", "independent"};
        const char* const strategies[] = {"both", "light", "bsdf"};
        return std::string(samplers[std::size_t(sampler)]) + ", " + strategies[std::size_t(strategy)];
    }
};

/// One image of one seed, by any way: all combinations are made here and nowhere else, which compilers thank for.
inline Estimate image_of_seed(const PreparedScene<float>& scene, const Camera& camera, ImageSize size, const Way& way,
                              int spp, std::uint32_t seed) {
    const auto by_sampler = [&](const auto& sampler) {
        const auto by_strategy = [&](const auto& integrator) {
            return image_mean(scene, camera, size, integrator, spp, 1, [&](std::uint32_t) { return sampler; });
        };
        const auto seen = [&](const auto& integrator) {
            return way.reflected_only ? by_strategy(Reflected{integrator}) : by_strategy(integrator);
        };
        switch (way.strategy) {
        case PathStrategy::light:
            return seen(PathIntegrator<PathStrategy::light>{way.options});
        case PathStrategy::bsdf:
            return seen(PathIntegrator<PathStrategy::bsdf>{way.options});
        case PathStrategy::both:
            break;
        }
        return seen(PathIntegrator<>{way.options});
    };
    switch (way.sampler) {
    case SamplerName::stratified:
        return by_sampler(StratifiedSampler<float>(seed, std::uint32_t(spp)));
    case SamplerName::independent:
        return by_sampler(IndependentSampler<float>(seed));
    case SamplerName::sobol:
        break;
    }
    return by_sampler(SobolSampler<float>(seed));
}

/// The mean of red, green, blue and grey, and its standard error.
inline Estimate estimate_of(const std::array<Moments, 4>& moments) {
    Estimate e;
    for (int c = 0; c < 3; ++c) {
        e.mean[c] = moments[std::size_t(c)].mean();
        e.error[c] = moments[std::size_t(c)].standard_error();
    }
    e.grey = moments[3].mean();
    e.grey_error = moments[3].standard_error();
    return e;
}

/// The mean of the images of seeds [first, first + count).
inline Estimate mean_over_seeds(const PreparedScene<float>& scene, const Camera& camera, ImageSize size, const Way& way,
                                int spp, int first, int count) {
    std::vector<Estimate> images(std::size_t(std::max(count, 0)));
    ThreadExecutor threads;
    threads.parallel_for(images.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            images[i] = image_of_seed(scene, camera, size, way, spp, std::uint32_t(first) + std::uint32_t(i));
    });
    std::array<Moments, 4> moments;
    for (const Estimate& image : images) {
        for (int c = 0; c < 3; ++c) moments[std::size_t(c)].add(image.mean[c]);
        moments[3].add(image.grey);
    }
    Estimate e = estimate_of(moments);
    for (const Estimate& image : images) {
        e.rays += image.rays;
        e.finite &= image.finite;
    }
    return e;
}

/// The same of as many seeds as a relative standard error takes, 32 at least and `most` at most. How many, other seeds
/// tell beforehand, and again where rare bright samples made them promise too much: a mean that decides itself when it
/// is good enough is no longer unbiased.
inline Estimate mean_to_precision(const PreparedScene<float>& scene, const Camera& camera, ImageSize size,
                                  const Way& way, int spp, double precision, int most) {
    constexpr int pilot = 16, least = 32;
    if (most <= least) return mean_over_seeds(scene, camera, size, way, spp, 0, least);
    int first = 0, count = pilot;
    Estimate e = mean_over_seeds(scene, camera, size, way, spp, first, count);
    for (int round = 0; round < 3; ++round) {
        const double deviation = e.grey_error * std::sqrt(double(count)), aim = 0.8 * precision * e.grey;
        const double enough = std::ceil(deviation * deviation / (aim * aim));
        first += count;
        count = int(std::clamp(enough, double(least), double(most)));
        e = mean_over_seeds(scene, camera, size, way, spp, first, count);
        if (e.grey_error <= precision * e.grey || count >= most) break;
    }
    return e;
}

} // namespace lambent_test
