#include "support/directions.hpp"
#include "support/random.hpp"
#include <lambent/material/standard.hpp>
#include <lambent/sampling/warp.hpp>
#include <support/statistics.hpp>
#include <doctest/doctest.h>
#include <cmath>
#include <string>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

/// chi² of what `sample` draws to one side of the surface against its pdf there.
void check_side(const StandardPoint<double>& point, const Vec3d& wo, const Vec3d& peak, double width, std::uint64_t seed) {
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
            coated.clearcoat = 1;
            coated.clearcoat_roughness = roughness;
            check("coat", coated, mirrored);
            check("sheet, reflected", glass(roughness, true, true), mirrored);
            check("sheet, transmitted", glass(roughness, true, true), -wo);
            for (const bool front : {true, false}) {
                const double eta = front ? 1.5 : 1 / 1.5, sine2 = (1 - cosine * cosine) / (eta * eta);
                check("glass, reflected", glass(roughness, false, front), mirrored);
                check("glass, transmitted", glass(roughness, false, front),
                      normalize(Vec3d(-wo.x / eta, -wo.y / eta, -std::sqrt(std::max(0.01, 1 - sine2)))));
            }
        }
}

TEST_CASE("standard material: the metallic-roughness formula of glTF 2.0, evaluated again in double") {
    Random random(5);
    for (int i = 0; i < 20000; ++i) {
        StandardPoint<float> p;
        for (int c = 0; c < 3; ++c) p.base_color[c] = random.uniform_float();
        p.metallic = random.uniform_float();
        p.roughness = 0.1f + 0.9f * random.uniform_float();
        p.specular = 1;
        const Vec3<float> wo = square_to_cosine_hemisphere(Vec2f(random.uniform_float(), random.uniform_float()));
        const Vec3<float> wi = square_to_cosine_hemisphere(Vec2f(random.uniform_float(), random.uniform_float()));
        if (wo.z < 0.01f || wi.z < 0.01f) continue;
        // Appendix B, in its own words: alpha, D, V, the two fresnel mixes, and their mix.
        const Vec3d v(wo), l(wi), h = normalize(v + l), base(p.base_color);
        const double alpha = double(p.roughness) * double(p.roughness), a2 = alpha * alpha;
        const double nh = h.z, nl = l.z, nv = v.z, vh = dot(v, h);
        const double d = a2 / (pi<double> * std::pow(nh * nh * (a2 - 1) + 1, 2));
        const double g = 2 * nl / (nl + std::sqrt(a2 + (1 - a2) * nl * nl)) * 2 * nv / (nv + std::sqrt(a2 + (1 - a2) * nv * nv));
        static_cast<void>(g); // the separable form; the text asks for the correlated one:
        const double vis = 0.5 / (nl * std::sqrt(nv * nv * (1 - a2) + a2) + nv * std::sqrt(nl * nl * (1 - a2) + a2));
        const double f = std::pow(1 - vh, 5);
        const Vec3d metal_brdf = (base + (Vec3d(1) - base) * f) * (vis * d);
        const double fr = 0.04 + (1 - 0.04) * f;
        const Vec3d dielectric_brdf = base / pi<double> * (1 - fr) + Vec3d(vis * d * fr);
        const Vec3d expected = dielectric_brdf * (1 - double(p.metallic)) + metal_brdf * double(p.metallic);
        const Vec3d got(StandardBsdf<float>(p).eval(wo, wi));
        for (int c = 0; c < 3; ++c) REQUIRE(std::abs(got[c] - expected[c]) < 1e-4 * (expected[c] + 1e-3));
    }
}

TEST_CASE("standard material: reflection is reciprocal") {
    Random random(6);
    for (int i = 0; i < 5000; ++i) {
        StandardPoint<double> p = plastic(random.uniform(0.02, 1));
        p.metallic = random.uniform(0, 1);
        const StandardBsdf<double> bsdf(p);
        const Vec3d a = square_to_cosine_hemisphere(Vec2d(random.uniform(0, 1), random.uniform(0, 1)));
        const Vec3d b = square_to_cosine_hemisphere(Vec2d(random.uniform(0, 1), random.uniform(0, 1)));
        const Vec3d there = bsdf.eval(a, b), back = bsdf.eval(b, a);
        for (int c = 0; c < 3; ++c) REQUIRE(std::abs(there[c] - back[c]) <= 1e-5 * there[c]);
    }
}

TEST_CASE("standard material: nothing gives back more than it gets; white GGX metal loses what single scattering loses") {
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
        // glTF's mix takes Fresnel's share for the half vector, not for the view, off what is scattered: white plastic gives
        // more than it gets at grazing angles, which is the formula's and not ours to mend. Not so a base of 0.8 in the mean.
        StandardPoint<double> light = plastic(roughness);
        light.base_color = Vec3d(0.8);
        Random random(++seed);
        Moments mean;
        for (int i = 0; i < 20000; ++i) {
            const Vec3d wo = square_to_cosine_hemisphere(Vec2d(random.uniform(0, 1), random.uniform(0, 1)));
            const auto s = StandardBsdf<double>(light).sample(wo, random.uniform(0, 1), {random.uniform(0, 1), random.uniform(0, 1)});
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
                constexpr int side = 700;
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
                if (s.wi.z > 0) CHECK(s.wi == Vec3d(-wo.x, -wo.y, wo.z));
                else CHECK(length(s.wi - Vec3d(-wo.x / eta, -wo.y / eta, -std::sqrt(1 - sine * sine))) < 1e-12);
                shares += s.weight.x * s.pdf * s.eta_scale;
                if (sine >= 1) {
                    CHECK(s.wi.z > 0);
                    shares = s.weight.x * s.pdf;
                }
            }
            CHECK(shares == doctest::Approx(1));
        }
}

TEST_CASE_TEMPLATE("standard material: finite at every roughness and angle", T, float, double) {
    Random random(9);
    int drawn = 0;
    for (int i = 0; i < 200000; ++i) {
        StandardPoint<T> p;
        p.roughness = T(std::sqrt(std::pow(10.0, random.uniform(-6, 0))));
        p.metallic = random.uniform(0, 1) < 0.3 ? T(1) : T(random.uniform(0, 1) < 0.5 ? 0 : random.uniform(0, 1));
        p.specular = T(1);
        p.transmission = random.uniform(0, 1) < 0.5 ? T(0) : T(random.uniform(0, 1));
        p.thin = random.uniform(0, 1) < 0.5;
        p.ior = random.uniform(0, 1) < 0.2 ? T(1) : T(random.uniform(1, 2.5));
        p.front = random.uniform(0, 1) < 0.5;
        p.clearcoat = random.uniform(0, 1) < 0.7 ? T(0) : T(1);
        p.clearcoat_roughness = T(random.uniform(0, 1));
        const double cosine = random.uniform(0, 1) < 0.3 ? std::pow(10.0, random.uniform(-7, 0)) : random.uniform(0, 1);
        const StandardBsdf<T> bsdf(p);
        const Vec3<T> wo(direction(cosine, random.uniform(0, 6)));
        const auto s = bsdf.sample(wo, T(random.uniform_float()), {T(random.uniform_float()), T(random.uniform_float())});
        REQUIRE(is_finite(s.pdf));
        REQUIRE(s.pdf >= 0);
        REQUIRE(is_finite(s.weight));
        REQUIRE(min_component(s.weight) >= 0);
        drawn += s.pdf > 0 ? 1 : 0;
        const Vec3<T> other(direction(random.uniform(-1, 1), random.uniform(0, 6)));
        for (const Vec3<T>& wi : {s.wi, other}) {
            REQUIRE(is_finite(bsdf.eval(wo, wi)));
            REQUIRE(is_finite(bsdf.pdf(wo, wi)));
            REQUIRE(bsdf.pdf(wo, wi) >= 0);
        }
    }
    CHECK(drawn > 150000);
}
