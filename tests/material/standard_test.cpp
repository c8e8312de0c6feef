#include "support/directions.hpp"
#include "support/random.hpp"
#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>
#include <lambent/material/lambert.hpp>
#include <lambent/material/standard.hpp>
#include <lambent/sampling/warp.hpp>
#include <string>
#include <support/statistics.hpp>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

/// chi² of what `sample` draws to one side of the surface against its pdf there.
void check_side(const StandardPoint<double>& point, const Vec3d& wo, const Vec3d& peak, double width,
                std::uint64_t seed) {
    const StandardBsdf<double> bsdf(point);
    Random random(seed);
    const auto here = [&](const Vec3d& wi) { return wi.z * peak.z > 0; };
    const auto draw = [&] {
        const auto s = bsdf.sample(wo, random.uniform(), {random.uniform(), random.uniform()});
        return s.pdf > 0 && here(s.wi) ? s.wi : Vec3d(0);
    };
    const DensityTest test = test_density(PeakBins(peak, width), 30000, draw,
                                          [&](const Vec3d& wi) { return here(wi) ? bsdf.pdf(wo, wi) : 0.0; });
    CHECK(test.integral < 1.005); // to what the quadrature resolves at the horizon
    CHECK(test.excess < 1);
    CHECK(test.p > 1e-5); // one of several hundred
}

StandardPoint<double> metal(double roughness) {
    StandardPoint<double> p;
    p.metallic = 1;
    p.roughness = roughness;
    return p;
}
StandardPoint<double> plastic(double roughness) {
    StandardPoint<double> p;
    p.base_color = Vec3d(0.5, 0.3, 0.8);
    p.specular = 1;
    p.roughness = roughness;
    return p;
}
StandardPoint<double> glass(double roughness, bool thin, bool front) {
    StandardPoint<double> p;
    p.specular = 1;
    p.roughness = roughness;
    p.transmission = 1;
    p.thin = thin;
    p.front = front;
    return p;
}

/// Share of the light from wo that is scattered, with its standard error.
Moments reflected_share(const StandardBsdf<double>& bsdf, const Vec3d& wo, int n, std::uint64_t seed) {
    Random random(seed);
    Moments m;
    for (int i = 0; i < n; ++i) {
        const auto s = bsdf.sample(wo, random.uniform(0, 1), {random.uniform(0, 1), random.uniform(0, 1)});
        m.add(s.pdf > 0 ? s.weight.x * s.eta_scale : 0.0);
    }
    return m;
}

} // namespace

TEST_CASE("standard material: directions are drawn by the pdf, lobe by lobe and together (chi-square)") {
    std::uint64_t seed = 1;
    for (const double alpha : {1e-3, 0.03, 0.2, 0.5, 1.0})
        for (const double cosine : {1.0, 0.9, 0.6, 0.3, 0.05}) {
            const Vec3d wo = direction(cosine), mirrored(-wo.x, -wo.y, wo.z);
            const double roughness = std::sqrt(alpha);
            const auto check = [&](const std::string& what, const StandardPoint<double>& p, const Vec3d& peak) {
                INFO(what << ", alpha " << alpha << ", cosine " << cosine << ", seed " << seed);
                check_side(p, wo, peak, alpha, ++seed);
            };
            check("metal", metal(roughness), mirrored);
            check("plastic", plastic(roughness), mirrored);
            StandardPoint<double> coated = plastic(1);
            coated.clearcoat = 1, coated.clearcoat_roughness = roughness;
            check("coat", coated, mirrored);
            StandardPoint<double> cloth = plastic(roughness);
            cloth.sheen_color = Vec3d(0.8, 0.5, 0.2);
            cloth.sheen_roughness = 0.3;
            cloth.compensated = true;
            check("sheen", cloth, mirrored);
            check("sheet, reflected", glass(roughness, true, true), mirrored);
            check("sheet, transmitted", glass(roughness, true, true), -wo);
            for (const bool front : {true, false}) {
                const double eta = front ? 1.5 : 1 / 1.5, cosine2 = 1 - (1 - cosine * cosine) / (eta * eta);
                const Vec3d refracted = normalize(Vec3d(-wo.x / eta, -wo.y / eta, -std::sqrt(std::max(0.01, cosine2))));
                StandardPoint<double> p = glass(roughness, false, front);
                check("glass, reflected", p, mirrored), check("glass, transmitted", p, refracted);
                p.compensated = true;
                check("it compensated, reflected", p, mirrored), check("it compensated, transmitted", p, refracted);
            }
        }
}

TEST_CASE("standard material: glTF's formulas, evaluated again in double") {
    Random random(5);
    for (int i = 0; i < 40000; ++i) {
        StandardPoint<float> p;
        for (int c = 0; c < 3; ++c) p.base_color[c] = random.uniform_float();
        p.metallic = random.uniform_float();
        p.roughness = 0.1f + 0.9f * random.uniform_float();
        p.specular = 1;
        const bool extended = i % 2 == 1;
        if (extended) {
            p.ior = float(random.uniform(1, 2.5));
            p.specular = random.uniform_float();
            for (int c = 0; c < 3; ++c) p.specular_color[c] = 2 * random.uniform_float();
            p.clearcoat = i % 4 == 1 ? random.uniform_float() : 0;
            p.clearcoat_roughness = 0.2f + 0.8f * random.uniform_float();
        }
        const Vec3<float> wo = square_to_cosine_hemisphere(Vec2f(random.uniform_float(), random.uniform_float()));
        const Vec3<float> wi = square_to_cosine_hemisphere(Vec2f(random.uniform_float(), random.uniform_float()));
        if (wo.z < 0.01f || wi.z < 0.01f) continue;
        // Appendix B and the extensions, in their own words: alpha, D, V, the two fresnel mixes, their mix, and the
        // coat.
        const Vec3d v(wo), l(wi), h = normalize(v + l), base(p.base_color);
        const double nh = h.z, nl = l.z, nv = v.z, vh = dot(v, h), f = std::pow(1 - vh, 5);
        const auto specular_brdf = [&](double roughness) {
            const double a2 = std::pow(roughness, 4);
            const double d = a2 / (pi<double> * std::pow(nh * nh * (a2 - 1) + 1, 2));
            const double gl =
                2 * nl / (nl * std::sqrt(a2 + (1 - a2) * nv * nv) + nv * std::sqrt(a2 + (1 - a2) * nl * nl));
            return d * gl * nv / (4 * nl * nv);
        };
        const double specular = specular_brdf(double(p.roughness));
        const Vec3d metal_brdf = (base + (Vec3d(1) - base) * f) * specular;
        const Vec3d f0 =
            min(Vec3d(std::pow((double(p.ior) - 1) / (double(p.ior) + 1), 2)) * Vec3d(p.specular_color), Vec3d(1));
        const Vec3d fr = f0 + (Vec3d(1) - f0) * f;
        const double strength = double(p.specular);
        const Vec3d dielectric_brdf =
            base / pi<double> * (1 - strength * std::max({fr.x, fr.y, fr.z})) + strength * fr * specular;
        Vec3d expected = dielectric_brdf * (1 - double(p.metallic)) + metal_brdf * double(p.metallic);
        const double coat = double(p.clearcoat) * (0.04 + 0.96 * std::pow(1 - nv, 5));
        expected = expected * (1 - coat) + Vec3d(coat * specular_brdf(double(p.clearcoat_roughness)));
        const Vec3d got(StandardBsdf<float>(p).eval(wo, wi));
        for (int c = 0; c < 3; ++c) REQUIRE(std::abs(got[c] - expected[c]) < 1e-4 * (expected[c] + 1e-3));
    }
}

TEST_CASE("standard material: sheen by KHR_materials_sheen's formula over what it leaves") {
    Random random(15);
    for (int i = 0; i < 5000; ++i) {
        StandardPoint<double> p;
        p.sheen_color = random.in_box<double>(0, 1);
        p.sheen_roughness = random.uniform(0.1, 1);
        const Vec3d v = direction(random.uniform(0.05, 1)),
                    l = direction(random.uniform(0.05, 1), random.uniform(0, 6));
        const Vec3d h = normalize(v + l);
        const double alpha = p.sheen_roughness, inverse = 1 / alpha;
        const double d = (2 + inverse) * std::pow(1 - h.z * h.z, inverse / 2) / (2 * pi<double>);
        const auto fit = [&](double x) {
            const double t = (1 - alpha) * (1 - alpha);
            const auto mix = [&](double a, double b) { return a * (1 - t) + b * t; };
            return mix(21.5473, 25.3245) / (1 + mix(3.82987, 3.32435) * std::pow(x, mix(0.19823, 0.16801))) +
                   mix(-1.97760, -1.27393) * x + mix(-4.32054, -4.85967);
        };
        const auto lambda = [&](double x) { return std::exp(x < 0.5 ? fit(x) : 2 * fit(0.5) - fit(1 - x)); };
        const double visibility = 1 / ((1 + lambda(v.z) + lambda(l.z)) * 4 * v.z * l.z);
        const double most = std::max({p.sheen_color.x, p.sheen_color.y, p.sheen_color.z});
        const auto left = [&](double x) { return 1 - most * double(charlie_albedo(float(x), float(alpha))); };
        const Vec3d expected = p.sheen_color * d * visibility + Vec3d(1 / pi<double>) * std::min(left(v.z), left(l.z));
        REQUIRE(length(StandardBsdf<double>(p).eval(v, l) - expected) < 1e-5 * length(expected));
    }
}

TEST_CASE_TEMPLATE("standard material: reciprocal, through sheets and glass too", T, float, double) {
    Random random(6);
    for (int i = 0; i < 20000; ++i) {
        StandardPoint<T> p;
        p.base_color = random.template in_box<T>(0, 1);
        p.specular = 1;
        p.roughness = T(random.uniform(0.02, 1));
        p.metallic = T(i % 3 == 0 ? 0 : random.uniform());
        p.transmission = T(i % 3 == 1 ? 0 : random.uniform());
        p.thin = i % 2 == 0;
        if (i % 5 == 0) p.sheen_color = random.template in_box<T>(0, 1);
        p.sheen_roughness = T(random.uniform());
        const StandardBsdf<T> bsdf(p);
        const Vec3<T> a(direction(random.uniform(0.001, 1), random.uniform(0, 6)));
        const Vec3<T> b(direction(random.uniform(0.001, 1), random.uniform(0, 6)));
        const Vec3<T> there = bsdf.eval(a, b), back = bsdf.eval(b, a);
        for (int c = 0; c < 3; ++c) REQUIRE(std::abs(there[c] - back[c]) <= T(1e-5) * there[c]);
        // Light the other way through, seen from below: radiance is scaled by eta² on one way only.
        const auto below = [](const Vec3<T>& w) { return Vec3<T>(w.x, w.y, -w.z); };
        StandardPoint<T> inside = p;
        inside.front = false;
        const Vec3<T> in = bsdf.eval(a, below(b)), out = StandardBsdf<T>(inside).eval(b, below(a));
        const T scale = p.thin ? T(1) : p.ior * p.ior;
        for (int c = 0; c < 3; ++c)
            REQUIRE(std::abs(in[c] * scale - out[c]) <= T(sizeof(T) == 4 ? 1e-3 : 1e-9) * (out[c] + T(1e-3)));
    }
}

namespace {
/// Any material, of alpha down to 1e-6, in float.
StandardPoint<float> some_point(Random& random) {
    StandardPoint<float> p;
    const auto part = [&](double none, double all) {
        const double x = random.uniform();
        return x < none ? 0.0f : x > 1 - all ? 1.0f : random.uniform_float();
    };
    p.base_color = random.in_box<float>(0, 1);
    p.roughness = float(std::pow(10.0, random.uniform(-3, 0)));
    p.metallic = part(0.4, 0.3);
    p.specular = part(0.1, 0.6);
    p.transmission = part(0.5, 0.2);
    p.thin = random.index(2) == 0;
    p.ior = random.index(5) == 0 ? 1.0f : float(random.uniform(1, 2.5));
    p.front = random.index(2) == 0;
    p.clearcoat = part(0.7, 0.2);
    p.clearcoat_roughness = float(std::pow(10.0, random.uniform(-3, 0)));
    if (random.index(4) == 0) p.sheen_color = random.in_box<float>(0, 1);
    p.sheen_roughness = random.uniform_float();
    p.compensated = random.index(3) == 0;
    return p;
}
StandardPoint<double> in_double(const StandardPoint<float>& p) {
    return {Vec3d(p.base_color),
            p.metallic,
            p.roughness,
            p.ior,
            p.specular,
            Vec3d(p.specular_color),
            p.transmission,
            p.thin,
            p.front,
            p.clearcoat,
            p.clearcoat_roughness,
            Vec3d(p.sheen_color),
            p.sheen_roughness,
            p.compensated};
}
} // namespace

TEST_CASE("standard material: a sample's weight is f cos / pdf, at any roughness; delta lobes are in neither") {
    Random random(7);
    int checked = 0, delta = 0;
    for (int i = 0; i < 100000; ++i) {
        const StandardPoint<float> p = some_point(random);
        const StandardBsdf<float> bsdf(p);
        const double cosine = i % 3 == 0 ? std::pow(10.0, random.uniform(-7, 0)) : random.uniform();
        const Vec3f wo(direction(cosine, random.uniform(0, 6)));
        const auto s = bsdf.sample(wo, random.uniform_float(), {random.uniform_float(), random.uniform_float()});
        if (!(s.pdf > 0)) continue;
        REQUIRE(std::abs(length(s.wi) - 1) < 1e-5f);
        if (s.delta) {
            ++delta;
            REQUIRE(s.pdf <= 1.00001f);
            continue;
        }
        const Vec3f f = bsdf.eval(wo, s.wi);
        const float pdf = bsdf.pdf(wo, s.wi);
        REQUIRE(std::abs(pdf - s.pdf) <= 1e-4f * pdf);
        for (int c = 0; c < 3; ++c)
            REQUIRE(std::abs(s.weight[c] - f[c] * std::abs(s.wi.z) / pdf) <= 1e-4f * s.weight[c]);
        const BsdfValue<float> both = evaluate(bsdf, wo, s.wi);
        REQUIRE((both.f == f && both.pdf == pdf));
        ++checked;
    }
    CHECK(checked > 50000);
    CHECK(delta > 5000);
}

TEST_CASE("standard material: float does as double does") {
    Random random(8);
    double worst = 0;
    int compared = 0, off = 0;
    for (int i = 0; i < 100000; ++i) {
        StandardPoint<float> p = some_point(random);
        p.roughness = std::max(p.roughness, 0.1f); // smaller ones magnify how float rounds a direction
        p.clearcoat_roughness = std::max(p.clearcoat_roughness, 0.1f);
        const Vec3f wo(direction(random.uniform(0.01, 1), random.uniform(0, 6)));
        const StandardBsdf<float> bsdf(p);
        const StandardBsdf<double> exact(in_double(p));
        Vec3f wi(direction(random.uniform(-1, 1), random.uniform(0, 6)));
        if (i % 2 == 0) {
            const auto s = bsdf.sample(wo, random.uniform_float(), {random.uniform_float(), random.uniform_float()});
            if (s.pdf > 0 && !s.delta) wi = s.wi;
        }
        if (std::abs(wi.z) < 0.01f) continue;
        const BsdfValue<float> got = bsdf.evaluate(wo, wi);
        const BsdfValue<double> expected = exact.evaluate(Vec3d(wo), Vec3d(wi));
        double error = std::abs(double(got.pdf) - expected.pdf) / (expected.pdf + 1e-3);
        for (int c = 0; c < 3; ++c)
            error = std::max(error, std::abs(double(got.f[c]) - expected.f[c]) / (expected.f[c] + 1e-3));
        worst = std::max(worst, error);
        ++compared;
        off += error > 1e-4 ? 1 : 0;
    }
    CHECK(compared > 90000);
    CHECK(off < compared / 200); // near total reflection, and where glass of index 1.00… bends hardly at all
    CHECK(worst < 5e-3);
}

TEST_CASE(
    "standard material: nothing gives back more than it gets; white GGX metal loses what single scattering loses") {
    std::uint64_t seed = 100;
    for (const double roughness : {0.0, 0.1, 0.3, 0.6, 1.0}) {
        for (const double cosine : {1.0, 0.7, 0.2, 0.02})
            for (const StandardPoint<double>& p : {metal(roughness), glass(roughness, true, true),
                                                   glass(roughness, false, true), glass(roughness, false, false)}) {
                const Moments m = reflected_share(StandardBsdf<double>(p), direction(cosine), 40000, ++seed);
                CAPTURE(roughness);
                CAPTURE(cosine);
                CAPTURE(p.transmission);
                CAPTURE(p.front);
                CHECK(m.mean() < 1 + 0.001 + 4 * m.standard_error());
            }
        // glTF's mix takes Fresnel's share for the half vector, not for the view, off what is scattered: white plastic
        // gives more than it gets at grazing angles, which is the formula's and not ours to mend. Not so a base of 0.8
        // in the mean.
        StandardPoint<double> light = plastic(roughness);
        light.base_color = Vec3d(0.8);
        Random random(++seed);
        Moments mean;
        for (int i = 0; i < 20000; ++i) {
            const Vec3d wo = square_to_cosine_hemisphere(Vec2d(random.uniform(0, 1), random.uniform(0, 1)));
            const auto s = StandardBsdf<double>(light).sample(wo, random.uniform(0, 1),
                                                              {random.uniform(0, 1), random.uniform(0, 1)});
            mean.add(s.pdf > 0 ? s.weight.x : 0.0);
        }
        CAPTURE(roughness);
        CHECK(mean.mean() < 0.9);
        CHECK(mean.mean() > 0.75);
    }
    // field/render.md §5: directional albedo at normal incidence.
    const std::pair<double, double> known[] = {{0.1, 0.9882}, {0.25, 0.9155}, {0.5, 0.6878}, {1, 0.3072}};
    for (const auto& [alpha, albedo] : known) {
        const Moments m = reflected_share(StandardBsdf<double>(metal(std::sqrt(alpha))), {0, 0, 1}, 400000, ++seed);
        CHECK(std::abs(m.mean() - albedo) < 5e-4 + 4 * m.standard_error());
    }
}

TEST_CASE("standard material: the pdf's mean weight is the integral of f cos") {
    std::uint64_t seed = 300;
    for (const double roughness : {0.3, 0.8})
        for (const double cosine : {0.95, 0.3})
            for (const StandardPoint<double>& p :
                 {metal(roughness), plastic(roughness), glass(roughness, true, true), glass(roughness, false, true)}) {
                const StandardBsdf<double> bsdf(p);
                const Vec3d wo = direction(cosine);
                double sum = 0;
                constexpr int side = 400;
                for (int i = 0; i < side; ++i)
                    for (int j = 0; j < side; ++j) {
                        const double z = 2 * (i + 0.5) / side - 1;
                        const Vec3d wi = direction(z, 2 * pi<double> * (j + 0.5) / side);
                        sum += bsdf.eval(wo, wi).x * std::abs(z) * (p.thin || z > 0 ? 1.0 : p.ior * p.ior);
                    }
                sum *= 4 * pi<double> / (side * side);
                const Moments m = reflected_share(bsdf, wo, 100000, ++seed);
                CAPTURE(roughness);
                CAPTURE(cosine);
                CHECK(std::abs(m.mean() - sum) < 2e-3 + 4 * m.standard_error());
            }
}

TEST_CASE("smooth glass: mirror and Snell's refraction share all light; beyond the critical angle it reflects") {
    for (const bool front : {true, false})
        for (const double cosine : {1.0, 0.8, 0.5, 0.1}) {
            const StandardBsdf<double> bsdf(glass(0, false, front));
            CHECK(bsdf.only_delta());
            const Vec3d wo = direction(cosine);
            const double eta = front ? 1.5 : 1 / 1.5, sine = std::sqrt(1 - cosine * cosine) / eta;
            double shares = 0;
            for (const double pick : {0.0, 0.999999}) {
                const auto s = bsdf.sample(wo, pick, {0.3, 0.6});
                CHECK(s.delta);
                CHECK(length(s.wi) == doctest::Approx(1));
                if (s.wi.z > 0)
                    CHECK(s.wi == Vec3d(-wo.x, -wo.y, wo.z));
                else
                    CHECK(length(s.wi - Vec3d(-wo.x / eta, -wo.y / eta, -std::sqrt(1 - sine * sine))) < 1e-12);
                shares += s.weight.x * s.pdf * s.eta_scale;
                if (sine >= 1) {
                    CHECK(s.wi.z > 0);
                    shares = s.weight.x * s.pdf;
                }
            }
            CHECK(shares == doctest::Approx(1));
        }
}

TEST_CASE_TEMPLATE("standard material: finite at every roughness, and at cosines down to 1e-7", T, float, double) {
    Random random(9);
    int drawn = 0;
    for (int i = 0; i < 200000; ++i) {
        const StandardPoint<float> point = some_point(random);
        StandardPoint<T> p;
        if constexpr (sizeof(T) == 4)
            p = point;
        else
            p = in_double(point);
        const auto grazing = [&] {
            return random.index(3) == 0 ? std::pow(10.0, random.uniform(-7, 0)) : random.uniform();
        };
        const StandardBsdf<T> bsdf(p);
        const Vec3<T> wo(direction(grazing(), random.uniform(0, 6)));
        const float edge[] = {0.0f, 0x1.fffffep-1f, random.uniform_float()};
        const auto number = [&] { return T(edge[random.index(10) == 0 ? random.index(2) : 2]); };
        const T pick = number();
        const Vec2<T> u(number(), T(random.index(10) == 0 ? edge[random.index(2)] : random.uniform_float()));
        const auto s = bsdf.sample(wo, pick, u);
        REQUIRE(is_finite(s.pdf));
        REQUIRE(s.pdf >= 0);
        REQUIRE(is_finite(s.weight));
        REQUIRE(min_component(s.weight) >= 0);
        REQUIRE(max_component(s.weight) * s.eta_scale < T(1e3));
        drawn += s.pdf > 0 ? 1 : 0;
        const Vec3<T> other(direction(random.index(2) == 0 ? grazing() : -grazing(), random.uniform(0, 6)));
        const Vec3<T> opposite(-wo.x, -wo.y, random.index(2) == 0 ? wo.z : -wo.z);
        for (const Vec3<T>& wi : {s.wi, other, opposite}) {
            const BsdfValue<T> v = bsdf.evaluate(wo, wi);
            REQUIRE(is_finite(v.f));
            REQUIRE(is_finite(v.pdf));
            REQUIRE(min_component(v.f) >= 0);
            REQUIRE(v.pdf >= 0);
        }
        REQUIRE(bsdf.sample(-wo, pick, u).pdf == 0);
        REQUIRE(bsdf.evaluate(-wo, wo).f == Vec3<T>(0));
    }
    CHECK(drawn > 150000);
}

TEST_CASE("standard material: what is only diffuse is Lambert's") {
    StandardPoint<float> p;
    p.base_color = Vec3f(0.2f, 0.5f, 0.9f);
    CHECK(p.diffuse());
    const Lambert<float> lambert{p.base_color};
    const StandardBsdf<float> bsdf(p);
    CHECK_FALSE(bsdf.only_delta());
    CHECK_FALSE(bsdf.transmits());
    Random random(10);
    for (int i = 0; i < 1000; ++i) {
        const Vec3f wo(direction(random.uniform(), 1)), wi(direction(random.uniform(-1, 1), 2));
        CHECK(length(bsdf.eval(wo, wi) - lambert.eval(wo, wi)) < 1e-6f);
        CHECK(bsdf.pdf(wo, wi) == doctest::Approx(lambert.pdf(wo, wi)));
        CHECK(bsdf.sample(wo, random.uniform_float(), {0.3f, 0.6f}).wi == lambert.sample(wo, 0, {0.3f, 0.6f}).wi);
    }
}
