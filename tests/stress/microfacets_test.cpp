// GGX facets from mirrors to chalk, down to grazing angles, and what they do with energy.
#include "material/scattered.hpp"
#include "stress/table.hpp"
#include "support/directions.hpp"
#include "support/random.hpp"
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <doctest/doctest.h>
#include <lambent/material/ggx.hpp>
#include <lambent/material/ggx_albedo.hpp>
#include <lambent/material/standard.hpp>

using namespace lambent;
using namespace lambent_test;

namespace {

/// As in most texts: cos²(alpha² - 1) + 1 from a unit half vector.
double textbook_distribution(float alpha, const Vec3f& h) {
    const float a2 = alpha * alpha, c = normalize(h).z, d = c * c * (a2 - 1) + 1;
    return double(a2 / (pi<float> * d * d));
}

StandardPoint<double> white_metal(double alpha) {
    StandardPoint<double> p;
    p.metallic = 1;
    p.roughness = std::sqrt(alpha);
    return p;
}

} // namespace

TEST_CASE("microfacets: alpha 1e-6 to 1, cosines down to 1e-7 -> float against double") {
    Random random(7);
    const std::uint64_t count = inputs(1e5, 2e7);
    double worst = 0, naive = 0;
    std::size_t bad = 0;
    for (std::uint64_t i = 0; i < count; ++i) {
        const float alpha = float(std::pow(10.0, random.uniform(-6, 0)));
        const Ggx<float> facets{alpha};
        const Ggx<double> exact{double(alpha)};
        const auto cosine = [&] {
            return random.below(2) == 0 ? std::pow(10.0, random.uniform(-7, 0)) : random.uniform();
        };
        const Vec3f wo(direction(cosine(), random.uniform(0, 6))), wi(direction(cosine(), random.uniform(0, 6)));
        const Vec3f h(Vec3d(random.uniform(-1, 1), random.uniform(-1, 1), 1) *
                      Vec3d(3.0 * double(alpha), 3.0 * double(alpha), 1));
        const auto compare = [&](float got, double expected) {
            bad += std::size_t(!is_finite(got));
            worst = std::max(worst, std::abs(double(got) / expected - 1));
        };
        const Vec3d o(wo), in(wi);
        compare(facets.distribution(h), exact.distribution(Vec3d(h)));
        compare(Ggx<float>::visibility(wo.z, facets.stretched(wo), wi.z, facets.stretched(wi)),
                Ggx<double>::visibility(o.z, exact.stretched(o), in.z, exact.stretched(in)));
        compare(facets.bounded_factor(wo, facets.stretched(wo)), exact.bounded_factor(o, exact.stretched(o)));
        const double text = textbook_distribution(alpha, h),
                     relative = std::abs(text / exact.distribution(Vec3d(h)) - 1);
        naive = std::max(naive, relative < 1e30 ? relative : 1e30);
    }
    record({"microfacets", "alpha 1e-6 to 1 -> relative error of D, V and pdf in float; naive: the textbook's D",
            double(count), double(bad), worst, 1e-4, naive});
}

TEST_CASE("microfacets: samples of any material -> weight equal to f cos / pdf") {
    Random random(8);
    const std::uint64_t count = inputs(4e4, 4e6);
    double worst = 0, naive = 0;
    std::size_t bad = 0, compared = 0;
    for (std::uint64_t i = 0; i < count; ++i) {
        StandardPoint<double> p = white_metal(std::pow(10.0, random.uniform(-3.9, 0)));
        p.metallic = random.below(3) == 0 ? random.uniform() : double(random.below(2));
        p.specular = random.uniform();
        p.transmission = random.below(2) == 0 ? 0 : random.uniform();
        p.thin = random.below(2) == 0;
        p.front = random.below(2) == 0;
        p.ior = random.below(4) == 0 ? 1 : random.uniform(1, 2.5);
        p.base_color = random.below(4) == 0 ? Vec3d(double(random.below(2))) : random.in_box<double>(0, 1);
        const StandardBsdf<double> bsdf(p);
        const Vec3d wo =
            direction(random.below(4) == 0 ? std::pow(10.0, random.uniform(-5, 0)) : random.uniform(0.05, 1));
        const double pick = random.uniform(), x = random.uniform();
        const auto s = bsdf.sample(wo, pick, {x, random.uniform()});
        if (!(s.pdf > 0)) continue;
        bad += std::size_t(!is_finite(s.weight) || min_component(s.weight) < 0 || !is_finite(s.wi));
        if (s.delta) continue;
        const auto value = evaluate(bsdf, wo, s.wi);
        const Vec3d weight = value.f * std::abs(s.wi.z) / value.pdf;
        ++compared;
        const double scale = std::max(1e-3, max_component(s.weight));
        worst = std::max({worst, max_component(abs(weight - s.weight)) / scale, std::abs(value.pdf / s.pdf - 1)});
        naive = std::max(naive, max_component(abs(value.f / value.pdf - s.weight)) / scale); // the cosine forgotten
    }
    record({"microfacets", "samples -> difference of weight and f cos / pdf, of pdf and pdf; naive: without the cosine",
            double(compared), double(bad), worst, 1e-4, naive});
}

TEST_CASE("microfacets: white furnace -> 1 with compensation, the table's loss without") {
    const int samples = int(inputs(20000, 1000000));
    double worst = 0, worst_table = 0, loss = 0, cases = 0, table_naive = 0;
    for (const double alpha : {0.05, 0.1, 0.25, 0.5, 0.75, 1.0})
        for (const double cosine : {1.0, 0.8, 0.6, 0.4, 0.2}) {
            StandardPoint<double> metal = white_metal(alpha);
            const double raw = scattered(metal, direction(cosine), samples).x;
            metal.compensated = true;
            worst = std::max(worst, std::abs(scattered(metal, direction(cosine), samples).x - 1));
            const Vec2f table = ggx_albedo(float(cosine), float(std::sqrt(alpha)));
            worst_table = std::max(worst_table, std::abs(double(table.x) + double(table.y) - raw));
            table_naive = std::max(table_naive, std::abs(raw - 1)); // no table: nothing is lost
            loss = std::max(loss, 1 - raw);
            ++cases;
        }
    record({"microfacets", "white furnace, compensated -> |1 - light back|; naive: single scattering", cases,
            double(worst > 0.005), worst, 0.005, loss});
    record({"microfacets", "white furnace, raw -> difference to the table's loss; naive: no loss", cases,
            double(worst_table > 0.002), worst_table, 0.002, table_naive});
}

TEST_CASE("microfacets: eta 1, albedo 0 and grazing angles -> light straight through, none, finite") {
    // What does not bend light lets all of it pass on, whatever the facets; black reflects nothing.
    Random random(9);
    double worst = 0, naive = 0, cases = 0;
    std::size_t bad = 0;
    for (std::uint64_t i = 0; i < inputs(4000, 400000); ++i) {
        StandardPoint<double> p;
        p.specular = p.transmission = p.ior = 1;
        p.thin = false;
        p.front = random.below(2) == 0;
        p.roughness = i % 3 == 0 ? 0 : std::sqrt(random.uniform());
        const Vec3d wo = direction(std::pow(10.0, random.uniform(-6, 0)), random.uniform(0, 6));
        const double x = random.uniform(), y = random.uniform(), pick = random.uniform();
        const auto clear = StandardBsdf<double>(p).sample(wo, pick, {x, y});
        if (clear.pdf > 0) {
            const double weight = clear.weight.x;
            bad += std::size_t(!is_finite(clear.weight) || clear.wi.z > 1e-9);
            worst = std::max({worst, clear.delta ? length(clear.wi + wo) : 0.0, std::max(weight - 1, 0.0)});
            // Half vectors of transmission in one medium have no length: the usual normalization.
            const Vec3d between = wo + p.eta() * clear.wi;
            if (clear.delta) naive += is_finite(normalize(between)) && length(between) > 1e-3 ? 0 : 1;
        }
        p = white_metal(std::max(1e-3, random.uniform()));
        p.base_color = Vec3d(0);
        p.metallic = 0;
        p.specular = 0;
        const auto black = StandardBsdf<double>(p).sample(wo, pick, {x, y});
        bad += std::size_t(black.pdf > 0 && max_component(black.weight) > 0);
        ++cases;
    }
    record({"microfacets", "eta 1 -> turn of smooth light, weight above 1; naive: half vectors without direction",
            cases, double(bad), worst, 1e-6, naive});
}
