#include "support/random.hpp"
#include <lambent/light/environment_light.hpp>
#include <support/statistics.hpp>
#include <doctest/doctest.h>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

struct Map {
    std::string name;
    int width, height;
    std::vector<Vec3f> texels;
    double rotation = 0;

    template <class T>
    EnvironmentLight<T> light() const {
        return {texels, width, height, Vec3f(1), rotation};
    }
};

Map constant(int width, int height) {
    return {"constant map", width, height, std::vector<Vec3f>(std::size_t(width * height), Vec3f(1))};
}

Map one_hot(int width, int height, int x, int y) {
    Map m{"one texel", width, height, std::vector<Vec3f>(std::size_t(width * height), Vec3f(0))};
    m.texels[std::size_t(y * width + x)] = Vec3f(1, 2, 3);
    return m;
}

/// A dim sky with a sun of 2 degrees, 40 000 times as bright.
Map sunny(int width, int height) {
    Map m{"sun", width, height, {}};
    const Vec3d sun = normalize(Vec3d(0.5, 0.6, -0.3));
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double theta = (y + 0.5) / height * pi<double>, phi = ((x + 0.5) / width - 0.5) * 2 * pi<double>;
            const Vec3d d(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi));
            m.texels.push_back(Vec3f(0.3f, 0.4f, 0.6f) * float(1.2 + d.y) +
                               (dot(d, sun) > std::cos(pi<double> / 180) ? Vec3f(20000, 18000, 15000) : Vec3f(0)));
        }
    m.rotation = 70;
    return m;
}

Map noise(int width, int height) {
    Random random(31);
    Map m{"noise", width, height, {}};
    for (int i = 0; i < width * height; ++i)
        m.texels.push_back(random.uniform() < 0.5 ? Vec3f(0) : Vec3f(float(random.uniform()), float(random.uniform()), 1));
    m.rotation = -200;
    return m;
}

std::vector<Map> maps() {
    return {constant(8, 4), one_hot(16, 8, 5, 3), one_hot(16, 8, 15, 0), one_hot(16, 8, 0, 7), one_hot(1, 1, 0, 0),
            sunny(360, 180), noise(24, 12)};
}

Vec3d direction_of(double u, double v, double rotation_degrees) { // map place, turned about +y
    const double theta = v * pi<double>, phi = (u - 0.5) * 2 * pi<double>, a = rotation_degrees * pi<double> / 180;
    const Vec3d d(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi));
    return {std::cos(a) * d.x - std::sin(a) * d.z, d.y, std::sin(a) * d.x + std::cos(a) * d.z};
}

/// Mean over the sphere of f(direction), by midpoints of a grid fine enough for the map's cells.
template <class F>
auto sphere_mean(const Map& m, F&& f) {
    const int h = m.height * std::max(1, 720 / m.height), w = m.width * std::max(1, 1440 / m.width);
    auto sum = f(direction_of(0.3, 0.3, 0)) * 0.0;
    double total = 0;
    for (int y = 0; y < h; ++y) {
        const double v = (y + 0.5) / h, weight = std::sin(v * pi<double>);
        for (int x = 0; x < w; ++x) sum += f(direction_of((x + 0.5) / w, v, m.rotation)) * weight;
        total += weight * w;
    }
    return sum / total;
}

} // namespace

TEST_CASE("environment: the pdf integrates to 1, and is above 0 wherever there is light") {
    for (const Map& m : maps()) {
        CAPTURE(m.name);
        const auto light = m.light<double>();
        int unseen = 0;
        const double integral = 4 * pi<double> * sphere_mean(m, [&](const Vec3d& d) {
            unseen += !(light.pdf(d) > 0) && max_component(light.radiance(d)) > 0;
            return light.pdf(d);
        });
        CHECK(integral == doctest::Approx(1).epsilon(2e-3));
        CHECK(unseen == 0);
    }
}

TEST_CASE_TEMPLATE("environment: samples follow the pdf (chi-square) and give the mean radiance", T, float, double) {
    constexpr std::uint64_t seed = 32;
    INFO("seed " << seed);
    for (const Map& m : maps()) {
        CAPTURE(m.name);
        const auto light = m.light<T>();
        const auto exact = m.light<double>();
        constexpr int n = 400000, rows = 24, columns = 48;
        std::vector<double> observed(rows * columns), expected(rows * columns);
        const double turn = m.rotation * pi<double> / 180;
        const auto bin = [&](const Vec3d& d) { // of the map's own rows and columns
            const Vec3d w(std::cos(turn) * d.x + std::sin(turn) * d.z, d.y, std::cos(turn) * d.z - std::sin(turn) * d.x);
            const int y = std::clamp(int(std::atan2(std::hypot(w.x, w.z), w.y) / pi<double> * rows), 0, rows - 1);
            const int x = std::clamp(int((std::atan2(w.z, w.x) / (2 * pi<double>) + 0.5) * columns), 0, columns - 1);
            return std::size_t(y * columns + x);
        };
        sphere_mean(m, [&](const Vec3d& d) { // as many points as cells of the grid, weighed like them
            const double sine = std::hypot(d.x, d.z);
            expected[bin(d)] += exact.pdf(d) * sine;
            return 0.0;
        });
        double total = 0;
        for (const double e : expected) total += e;
        for (double& e : expected) e *= n / total;

        Random random(seed);
        Moments mean[3];
        int different = 0;
        bool unit = true;
        for (int i = 0; i < n; ++i) {
            const auto s = light.sample(Vec2<T>(T(random.uniform_float()), T(random.uniform_float())));
            REQUIRE(s.pdf > 0);
            different += !(std::abs(s.pdf / light.pdf(s.wi) - 1) < T(1e-5));
            different += length(s.radiance - light.radiance(s.wi)) > T(1e-3) * length(s.radiance);
            unit = unit && std::abs(length(Vec3d(s.wi)) - 1) < 1e-6;
            ++observed[bin(Vec3d(s.wi))];
            for (int c = 0; c < 3; ++c) mean[c].add(double(s.radiance[c]) / double(s.pdf));
        }
        CHECK(different <= n / 100000); // at the edge of two cells the last bit may decide
        CHECK(unit);
        if (m.width > 1) CHECK(chi_square_test(observed, expected) > min_p / 14); // seven maps, two scalars
        const Vec3d truth = sphere_mean(m, [&](const Vec3d& d) { return exact.radiance(d); }) * (4 * pi<double>);
        for (int c = 0; c < 3; ++c) {
            INFO("channel " << c << ": " << mean[c].mean() << " of " << truth[c] << " +- " << mean[c].standard_error());
            CHECK(std::abs(mean[c].mean() - truth[c]) < max_z * mean[c].standard_error() + 1e-3 * truth[c]);
            CHECK(mean[c].standard_error() < 0.01 * truth[c]);
        }
        CHECK(double(light.mean_luminance()) == doctest::Approx(luminance(truth) / (4 * pi<double>)).epsilon(m.height < 16 ? 0.2 : 0.01));
    }
}

TEST_CASE("environment beside BSDF samples: follows its pdf (chi-square), leaves a constant alone, and with an even strategy finds all light") {
    constexpr std::uint64_t seed = 33;
    INFO("seed " << seed);
    for (const Map& m : maps()) {
        CAPTURE(m.name);
        const auto light = m.light<double>();
        const double integral = 4 * pi<double> * sphere_mean(m, [&](const Vec3d& d) { return light.pdf(d, Companion::bsdf); });
        if (light.mean_luminance(Companion::bsdf) < 1e-6) { // a constant, rounded
            CHECK(m.name != "sun");
            continue;
        }
        CHECK(integral == doctest::Approx(1).epsilon(2e-3));
        constexpr int n = 200000, rows = 24, columns = 48; // bins that cells fit into
        std::vector<double> observed(rows * columns), expected(rows * columns);
        const auto bin = [&](const Vec3d& d) {
            const double turn = m.rotation * pi<double> / 180;
            const Vec3d w(std::cos(turn) * d.x + std::sin(turn) * d.z, d.y, std::cos(turn) * d.z - std::sin(turn) * d.x);
            const int y = std::clamp(int(std::atan2(std::hypot(w.x, w.z), w.y) / pi<double> * rows), 0, rows - 1);
            const int x = std::clamp(int((std::atan2(w.z, w.x) / (2 * pi<double>) + 0.5) * columns), 0, columns - 1);
            return std::size_t(y * columns + x);
        };
        double total = 0;
        sphere_mean(m, [&](const Vec3d& d) {
            const double e = light.pdf(d, Companion::bsdf) * std::hypot(d.x, d.z);
            expected[bin(d)] += e;
            total += e;
            return 0.0;
        });
        for (double& e : expected) e *= n / total;
        Random random(seed);
        Moments found; // balance heuristic, one sample each
        int different = 0;
        for (int i = 0; i < n; ++i) {
            const auto s = light.sample(Vec2d(random.uniform(), random.uniform()), Companion::bsdf);
            REQUIRE(s.pdf > 0);
            different += !(std::abs(s.pdf / light.pdf(s.wi, Companion::bsdf) - 1) < 1e-9);
            ++observed[bin(s.wi)];
            const double even = 1 / (4 * pi<double>);
            const Vec3d d = square_to_uniform_sphere(Vec2d(random.uniform(), random.uniform()));
            found.add(luminance(s.radiance) / (s.pdf + even) + luminance(light.radiance(d)) / (even + light.pdf(d, Companion::bsdf)));
        }
        CHECK(different == 0);
        if (m.width > 1) CHECK(chi_square_test(observed, expected) > min_p / 7);
        const double truth = 4 * pi<double> * luminance(sphere_mean(m, [&](const Vec3d& d) { return light.radiance(d); }));
        CHECK(std::abs(found.mean() - truth) < max_z * found.standard_error() + 1e-3 * truth);
    }
    const EnvironmentLight<float> sky({}, 0, 0, Vec3f(1, 2, 3), 30);
    CHECK(sky.pdf({0, 1, 0}, Companion::bsdf) == 0);
    CHECK(sky.sample({0.2f, 0.9f}, Companion::bsdf).pdf == 0);
}

TEST_CASE("environment: with a normal, what is above its horizon comes as without one, the rest not at all") {
    for (const Map& m : {sunny(256, 128), noise(16, 8)})
        for (const Companion companion : {Companion::none, Companion::bsdf}) {
            const auto light = m.light<float>();
            Random random(9);
            int below = 0;
            for (int i = 0; i < 20'000; ++i) {
                const Vec2f u(random.uniform_float(), random.uniform_float());
                const Vec3f normal = normalize(random.in_box<float>(-1, 1));
                const auto whole = light.sample(u, companion), half = light.sample(u, companion, normal);
                const bool above = dot(whole.wi, normal) >= 0;
                below += !above;
                REQUIRE(half.pdf == (above ? whole.pdf : 0.0f));
                if (above) REQUIRE((half.wi == whole.wi && half.radiance == whole.radiance));
            }
            CHECK(std::abs(below - 10'000) < 5 * 71);
        }
}

TEST_CASE("environment: a constant without a map, and black ones") {
    const EnvironmentLight<float> sky({}, 0, 0, Vec3f(1, 2, 3), 30);
    CHECK(sky.radiance({0, 0, 1}) == Vec3f(1, 2, 3));
    CHECK(sky.pdf({0, 1, 0}) == doctest::Approx(1 / (4 * pi<double>)));
    const auto s = sky.sample({0.2f, 0.9f});
    CHECK(s.infinite);
    CHECK_FALSE(s.delta);
    CHECK(s.radiance == Vec3f(1, 2, 3));
    const std::vector<Vec3f> dark(8, Vec3f(0)), white(8, Vec3f(1));
    for (const EnvironmentLight<float>& none :
         {EnvironmentLight<float>(), EnvironmentLight<float>({}, 0, 0, Vec3f(0), 0),
          EnvironmentLight<float>(dark, 4, 2, Vec3f(1), 0), EnvironmentLight<float>(white, 4, 2, Vec3f(0), 0)}) {
        CHECK(none.black());
        CHECK(none.pdf({0, 1, 0}) == 0);
        CHECK(none.sample({0.5f, 0.5f}).pdf == 0);
    }
}

TEST_CASE("environment: where a direction looks, and which way rotation turns") {
    Map m = one_hot(8, 4, 6, 1); // centre at u = 6.5/8, v = 1.5/4
    const double u = 6.5 / 8, v = 1.5 / 4;
    for (const double rotation : {0.0, 90.0, -30.0}) {
        m.rotation = rotation;
        const auto light = m.light<double>();
        const Vec3d d = direction_of(u, v, rotation);
        CHECK(light.radiance(d).y == doctest::Approx(2));
        CHECK(light.radiance(direction_of(u, v, rotation + 45)).y == doctest::Approx(0)); // one texel on
        CHECK(light.radiance(direction_of(u + 0.5 / 8, v, rotation)).y == doctest::Approx(1)); // bilinear half way
    }
    m.rotation = 90; // +x turns to +z
    Map ahead = one_hot(4, 1, 2, 0);
    ahead.texels[1] = ahead.texels[2]; // both around u = 0.5: +x
    CHECK(ahead.light<double>().radiance({1, 0, 0}).y == doctest::Approx(2));
    ahead.rotation = 90;
    CHECK(ahead.light<double>().radiance({0, 0, 1}).y == doctest::Approx(2));
}
