// Numbers from bits, points of sequences, and what is drawn with them: never outside, never of another density.
#include "stress/table.hpp"
#include "support/directions.hpp"
#include "support/random.hpp"
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <doctest/doctest.h>
#include <lambent/light/environment_light.hpp>
#include <lambent/material/ggx.hpp>
#include <lambent/material/standard.hpp>
#include <lambent/sampling/alias.hpp>
#include <lambent/sampling/distribution.hpp>
#include <lambent/sampling/independent.hpp>
#include <lambent/sampling/mis.hpp>
#include <lambent/sampling/sobol.hpp>
#include <lambent/sampling/warp.hpp>
#include <numeric>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

/// Kolmogorov and Smirnov's statistic of values in [0, 1] against evenly spread ones, so scaled that a right program
/// exceeds 1.95 once in 1000 times and 2.23 once in 10 000, whatever their number.
/// source  Stephens, J. Royal Statistical Society B 32 (1970)
double kolmogorov_smirnov(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    const double n = double(values.size());
    double largest = 0;
    for (std::size_t i = 0; i < values.size(); ++i)
        largest = std::max({largest, values[i] - double(i) / n, double(i + 1) / n - values[i]});
    return largest * (std::sqrt(n) + 0.12 + 0.11 / std::sqrt(n));
}

/// The same of the p-values of chi-square's tests over many seeds. The bins' ring 10 ends at the horizon.
/// draw(random) gives a direction or 0 for none.
template <class Draw, class Pdf>
double spread_of_p(Draw&& draw, Pdf&& pdf) {
    const PeakBins bins({0, 0, 1}, 0.6 * 0.6 * 0.6);
    const std::vector<double> shares = bins.integrals(pdf, stress_in_full() ? 160 : 40);
    double share = 0;
    for (const double s : shares) share += s;
    std::vector<double> values;
    for (std::uint64_t seed = 0; seed < inputs(30, 200); ++seed) {
        Random random(seed);
        std::vector<double> observed(shares.size()), expected = shares;
        double drawn = 0;
        for (std::uint64_t i = 0; i < inputs(1e4, 1e6); ++i) {
            const Vec3d w = draw(random);
            if (w == Vec3d(0)) continue;
            ++observed[bins.bin(w)];
            ++drawn;
        }
        for (double& e : expected) e = std::max(0.01, e * drawn / share);
        values.push_back(chi_square_test(observed, expected));
    }
    return kolmogorov_smirnov(values);
}

struct SkyMap {
    int width, height;
    std::vector<Vec3f> texels;
};
SkyMap dark(int width, int height) {
    return {width, height, std::vector<Vec3f>(std::size_t(width * height), Vec3f(0))};
}

std::vector<SkyMap> awkward_skies() {
    std::vector<SkyMap> skies{dark(1, 1), dark(2, 1), dark(16, 8), dark(16, 8), dark(64, 32), dark(1, 7)};
    skies[0].texels[0] = Vec3f(2);
    skies[1].texels[1] = Vec3f(3, 1, 0);
    skies[2].texels[5] = Vec3f(4, 5, 6); // one texel of light, at the pole
    for (Vec3f& texel : skies[4].texels) texel = Vec3f(1);
    skies[4].texels[10 * 64 + 20] = Vec3f(1e6f); // and [3] is black
    skies[5].texels[6] = Vec3f(1);
    return skies;
}

} // namespace

TEST_CASE("samplers: generator outputs -> numbers from 0 to below 1") {
    const std::uint64_t step = inputs(61, 1), count = (std::uint64_t(1) << 32) / step;
    std::uint32_t outside = 0, naive_outside = 0;
    const auto beyond = [](float u) { return std::uint32_t(std::bit_cast<std::uint32_t>(u) >= 0x3f800000u); };
    const auto look = [&](std::uint32_t bits) {
        outside += beyond(to_unit<float>(bits)) + beyond(to_unit<float>(std::uint64_t(bits) << 32 | 0xffffffffu));
        outside += std::uint32_t(!(to_unit<double>(bits) < 1));
        naive_outside += beyond(float(bits) * 0x1p-32f);
    };
    for (std::uint64_t i = 0; i < count; ++i) look(std::uint32_t(i * step));
    for (std::uint32_t i = 0; i < 1000; ++i) look(0xffffffffu - i);
    record({"samplers", "outputs of 32 bits -> numbers of 1 or more; naive: float(bits) / 2^32", double(count),
            double(outside), double(outside), 0, double(naive_outside)});
}

TEST_CASE("samplers: tables and the last u below 1 -> an index in the table, of a weight above 0") {
    Random random(1);
    std::size_t tries = 0, wrong = 0, naive_wrong = 0;
    for (std::uint64_t round = 0; round < inputs(1000, 100000); ++round) {
        const std::size_t n = 1 + random.index(round % 10 == 0 ? 70000 : 40);
        std::vector<double> weights(n);
        for (double& w : weights) w = random.below(3) == 0 ? 0 : std::exp(random.uniform(-60, 60));
        weights[0] = 1;
        if (n > 1 && round % 2 == 0) weights[n - 1] = 0;
        const AliasTable table(weights);
        const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
        const Distribution1D cdf{std::span<const double>(weights)};
        for (const float u :
             {0.0f, one_minus_epsilon<float>, next_down(one_minus_epsilon<float>), 0x1p-24f, random.uniform_float()}) {
            const std::size_t i = table.sample(u).index, j = cdf.sample(u).index;
            wrong += std::size_t(i >= n || j >= n || !(weights[i] > 0) || !(weights[j] > 0));
            std::size_t k = 0; // searched for in sums of floats, up to and with the last item
            for (float running = 0; k + 1 < n && (running += float(weights[k])) < u * float(sum); ++k) {
            }
            naive_wrong += std::size_t(!(weights[k] > 0));
            ++tries;
        }
    }
    record({"samplers", "u at the ends of alias and CDF tables -> index beyond or of weight 0; naive: float sums",
            double(tries), double(wrong), double(wrong) / double(tries), 0, double(naive_wrong) / double(tries)});
}

TEST_CASE("samplers: Sobol's points -> one in each elementary interval") {
    std::size_t boxes = 0, wrong = 0, naive_wrong = 0;
    const auto largest = std::uint32_t(inputs(8, 16));
    for (const std::uint32_t seed : {3u, 4u}) {
        const SobolSampler<float> sobol(seed);
        const IndependentSampler<float> independent(seed);
        for (std::uint32_t k = 0; k <= largest; ++k)
            for (const std::uint32_t block : {0u, 7u, 0xffffffffu >> k}) {
                const std::uint32_t n = 1u << k;
                const auto count_wrong = [&](const auto& sampler) {
                    std::size_t bad = 0;
                    std::vector<Vec2f> points;
                    for (std::uint32_t i = 0; i < n; ++i)
                        points.push_back(sampler.at(5, 9, (block << k) + i).get_2d(seed));
                    for (std::uint32_t a = 0; a <= k; ++a) {
                        std::vector<int> hits(n);
                        for (const Vec2f& p : points)
                            ++hits[(std::size_t(p.x * float(1u << a)) << (k - a)) +
                                   std::size_t(p.y * float(1u << (k - a)))];
                        bad += std::size_t(std::count_if(hits.begin(), hits.end(), [](int c) { return c != 1; }));
                    }
                    return bad;
                };
                boxes += n * (k + 1);
                wrong += count_wrong(sobol);
                naive_wrong += count_wrong(independent);
            }
    }
    record({"samplers", "elementary intervals -> share with other than one of Sobol's points; naive: random points",
            double(boxes), double(wrong), double(wrong) / double(boxes), 0, double(naive_wrong) / double(boxes)});
}

TEST_CASE("samplers: directions of every sampler over many seeds -> p-values evenly spread") {
    const Vec3d wo = direction(0.6);
    const auto uniform2 = [](Random& r) {
        const double x = r.uniform();
        return Vec2d(x, r.uniform());
    };
    const auto uniform2f = [](Random& r) {
        const float x = r.uniform_float();
        return Vec2f(x, r.uniform_float());
    };
    std::vector<double> scores;
    scores.push_back(spread_of_p([&](Random& r) { return Vec3d(square_to_cosine_hemisphere(uniform2f(r))); },
                                 [](const Vec3d& w) { return w.z > 0 ? cosine_hemisphere_pdf(w.z) : 0.0; }));
    scores.push_back(spread_of_p([&](Random& r) { return Vec3d(square_to_uniform_hemisphere(uniform2f(r))); },
                                 [](const Vec3d& w) { return w.z > 0 ? uniform_hemisphere_pdf<double>() : 0.0; }));
    scores.push_back(spread_of_p([&](Random& r) { return Vec3d(square_to_uniform_sphere(uniform2f(r))); },
                                 [](const Vec3d&) { return uniform_sphere_pdf<double>(); }));
    const Ggx<double> facets{0.5};
    const double stretched = facets.stretched(wo);
    scores.push_back(spread_of_p([&](Random& r) { return facets.sample_visible(wo, uniform2(r)); },
                                 [&](const Vec3d& m) {
                                     const double facing = dot(wo, m);
                                     return facing > 0 && m.z > 0 ? facets.distribution(m) * facing *
                                                                        Ggx<double>::visible_factor(wo, stretched)
                                                                  : 0.0;
                                 }));
    StandardPoint<double> plastic;
    plastic.specular = 1;
    plastic.roughness = 0.7;
    StandardPoint<double> metal = plastic;
    metal.metallic = 1;
    for (const StandardPoint<double>& point : {plastic, metal}) {
        const StandardBsdf<double> bsdf(point);
        scores.push_back(spread_of_p(
            [&](Random& r) {
                const double pick = r.uniform();
                const auto s = bsdf.sample(wo, pick, uniform2(r));
                return s.pdf > 0 ? s.wi : Vec3d(0);
            },
            [&](const Vec3d& wi) { return wi.z > 0 ? bsdf.pdf(wo, wi) : 0.0; }));
    }
    // The cosine's density, but its radius not taken from a root.
    const double naive = spread_of_p(
        [&](Random& r) {
            const Vec2d u = uniform2(r);
            return direction(std::sqrt(1 - u.x * u.x), 6.283185307179586 * u.y);
        },
        [](const Vec3d& w) { return w.z > 0 ? cosine_hemisphere_pdf(w.z) : 0.0; });
    const double worst = *std::max_element(scores.begin(), scores.end()), bound = 2.4; // 1e-4 for all six together
    record({"samplers", "seeds of six samplers -> Kolmogorov-Smirnov of chi-square's p; naive: disk without its root",
            double(inputs(30, 200)) * double(scores.size()), double(worst > bound), worst, bound, naive});
}

TEST_CASE("environments: awkward maps -> the integral of the pdf, and MIS against the BSDF alone") {
    double worst = 0, naive = 0, cells = 0, worst_z = 0, naive_z = 0, pairs = 0;
    for (const SkyMap& sky : awkward_skies()) {
        const EnvironmentLight<double> light(sky.texels, sky.width, sky.height, Vec3f(1), 40);
        const int height = sky.height * (1440 / sky.height), width = sky.width * std::max(1, 256 / sky.width);
        const double cell = pi<double> / height * 2 * pi<double> / width;
        for (const Companion companion : {Companion::none, Companion::bsdf}) {
            double integral = 0, by_row = 0;
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    const double theta = (y + 0.5) / height * pi<double>, phi = (x + 0.5) / width * 2 * pi<double>;
                    // turned as the light is: midpoints of the map's own cells
                    const double turned = phi + 40 * pi<double> / 180;
                    const Vec3d d(std::sin(theta) * std::cos(turned), std::cos(theta),
                                  std::sin(theta) * std::sin(turned));
                    const double pdf = light.pdf(d, companion);
                    integral += pdf * std::sin(theta) * cell;
                    // by the sine at the middle of the map's row instead of the direction's own
                    const double middle = (std::floor((y + 0.5) * sky.height / height) + 0.5) / sky.height * pi<double>;
                    by_row += pdf * std::sin(theta) / std::sin(middle) * std::sin(theta) * cell;
                }
            cells += width * height;
            const double expected = light.mean_luminance(companion) > 0 ? 1 : 0;
            worst = std::max(worst, std::abs(integral - expected));
            naive = std::max(naive, std::abs(by_row - expected));
        }
        // Irradiance of a floor that looks up.
        Random random(11);
        Moments both, alone, unweighted;
        const auto samples = inputs(1e5, 1e7);
        for (std::uint64_t i = 0; i < samples; ++i) {
            const Vec3d local = square_to_cosine_hemisphere(Vec2d(random.uniform(), random.uniform()));
            const Vec3d wi(local.x, local.z, local.y);
            const double by_chance = light.radiance(wi).x * pi<double>, pdf = cosine_hemisphere_pdf(local.z);
            const LightSample<double> s = light.sample({random.uniform(), random.uniform()}, Companion::bsdf);
            double by_light = 0, weight = 0;
            if (s.pdf > 0 && s.wi.y > 0) {
                by_light = s.radiance.x * s.wi.y / s.pdf;
                weight = power_heuristic(s.pdf, cosine_hemisphere_pdf(s.wi.y));
            }
            alone.add(by_chance);
            both.add(by_light * weight + by_chance * power_heuristic(pdf, light.pdf(wi, Companion::bsdf)));
            unweighted.add(by_light + by_chance);
        }
        pairs += double(samples);
        worst_z = std::max(worst_z, std::abs(both.z(alone)));
        naive_z = std::max(naive_z, std::abs(unweighted.z(alone)));
    }
    record({"environments", "directions of awkward maps -> |integral of pdf - 1|; naive: the sine of the row's middle",
            cells, double(worst > 1e-4), worst, 1e-4, naive});
    record({"environments", "samples of awkward maps -> z of MIS against the BSDF alone; naive: both without weights",
            pairs, double(worst_z > max_z), worst_z, max_z, naive_z});
}
