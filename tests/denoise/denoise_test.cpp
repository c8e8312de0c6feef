#include "support/random.hpp"
#include <cmath>
#include <cstring>
#include <doctest/doctest.h>
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise.hpp>
#include <lambent/film/metrics.hpp>
#include <limits>
#include <string>
#include <support/statistics.hpp>

using namespace lambent;
using lambent_test::infinity;
using lambent_test::Random;

namespace {

constexpr const char* filtering_methods[] = {"best", "balanced", "fast", "naive_2d", "reuse_2d", "separable", "separable_reuse", "seed"};

/// A room's corner: a textured floor and a wall with a lamp in it, a shadow across both, sky above the wall.
/// `noise` is the standard deviation of the illumination in units of itself; 0 gives the truth.
template <class T>
PixelData<T> corner(int width, int height, double noise, std::uint64_t seed = 1) {
    Random random(seed);
    PixelData<T> f;
    f.width = width;
    f.height = height;
    for (auto* plane : {&f.radiance, &f.emission, &f.albedo, &f.normal, &f.position, &f.variance}) plane->allocate(width, height);
    for (auto* plane : {&f.depth, &f.material}) plane->allocate(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double u = (x + 0.5) / width, v = (y + 0.5) / height;
            if (v < 0.2) { // sky: a miss
                f.radiance.view().store(x, y, Vec3<T>(T(0.3), T(0.5), T(0.9)));
                f.emission.view().store(x, y, f.radiance.load(x, y));
                f.material.view().store(x, y, T(-1));
                continue;
            }
            const bool wall = v < 0.6, lamp = wall && std::hypot(u - 0.7, v - 0.35) < 0.05;
            const Vec3d position = wall ? Vec3d(2 * u, 2 - 2 * v, 0) : Vec3d(2 * u, 0.8, 4 * (v - 0.6));
            const Vec3d albedo = wall ? Vec3d(0.8, 0.2, 0.1) : Vec3d((x / 3 + y / 3) % 2 == 0 ? 0.9 : 0.05);
            const double truth = u + 0.3 * v < 0.5 ? 0.4 : 1 + 0.5 * u;
            const double light = std::max(0.0, truth * (1 + noise * (-std::log(1 - random.uniform()) - 1)));
            f.albedo.view().store(x, y, Vec3<T>(albedo));
            f.normal.view().store(x, y, wall ? Vec3<T>(0, 0, 1) : Vec3<T>(0, 1, 0));
            f.position.view().store(x, y, Vec3<T>(position));
            f.depth.view().store(x, y, T(1 + u));
            f.material.view().store(x, y, T(lamp ? 2 : wall ? 0 : 1));
            if (lamp) f.emission.view().store(x, y, Vec3<T>(40, 30, 20));
            f.radiance.view().store(x, y, f.emission.load(x, y) + Vec3<T>(albedo * light));
            f.variance.view().store(x, y, Vec3<T>(albedo * albedo * truth * truth * noise * noise));
        }
    demodulate(f);
    return f;
}

template <class T, class E>
Plane<T, 3> run(const PixelData<T>& frame, const DenoiseOptions& options, E& executor) {
    return denoise(frame, options, executor).radiance;
}
template <class T>
Plane<T, 3> run(const PixelData<T>& frame, const DenoiseOptions& options = {}) {
    SerialExecutor serial;
    return run(frame, options, serial);
}

template <class T>
double difference(const Plane<T, 3>& a, const Plane<T, 3>& b) {
    double largest = 0;
    for (std::size_t i = 0; i < a.values().size(); ++i) {
        if (!is_finite(a.values()[i])) return infinity;
        largest = std::max(largest, std::abs(double(a.values()[i]) - double(b.values()[i])) / std::max(0.01, std::abs(double(b.values()[i]))));
    }
    return largest;
}

template <class T>
bool same_bits(const Plane<T, 3>& a, const Plane<T, 3>& b) {
    return std::memcmp(a.values().data(), b.values().data(), a.values().size() * sizeof(T)) == 0;
}

bool all_finite(const Plane<float, 3>& plane) {
    for (const float v : plane.values())
        if (!is_finite(v)) return false;
    return true;
}

} // namespace

TEST_CASE_TEMPLATE("F1: illumination times albedo and emission is the radiance, without albedo too", T, float, double) {
    PixelData<T> frame = corner<T>(40, 30, 0.7);
    for (const double albedo : {0.0, 1e-9, 1e-3, 1.0}) frame.albedo.view().store(int(albedo * 20), 15, Vec3<T>(T(albedo)));
    demodulate(frame);
    Plane<T, 3> back(40, 30);
    remodulate(frame.view(), frame.illumination.view(), back.view());
    CHECK(difference(back, frame.radiance) < (std::is_same_v<T, float> ? 1e-5 : 1e-13));
    frame.albedo = {};
    frame.emission = {};
    demodulate(frame);
    CHECK(frame.illumination.values() == frame.radiance.values());
}

TEST_CASE("F1: textures stay sharp: under even light every method leaves them as they are") {
    PixelData<float> frame = corner<float>(60, 50, 0);
    for (int y = 0; y < 50; ++y)
        for (int x = 0; x < 60; ++x)
            frame.radiance.view().store(x, y, frame.emission.load(x, y) + frame.albedo.load(x, y) * 0.7f);
    demodulate(frame);
    for (const char* method : filtering_methods) {
        INFO("method ", std::string(method));
        DenoiseOptions options = denoise_options(method);
        options.sigma_material = hard_stop; // a miss has no light, and the original's weight lets it in
        CHECK(difference(run(frame, options), frame.radiance) < 1e-5);
    }
}

TEST_CASE("F3: pixels that miss everything stay as they are and bring nothing that is not finite") {
    PixelData<float> frame = corner<float>(48, 40, 0.8);
    for (const float miss : {0.0f, float(infinity), std::numeric_limits<float>::quiet_NaN()}) {
        for (int y = 0; y < 8; ++y)
            for (int x = 0; x < 48; ++x) frame.position.view().store(x, y, Vec3f(miss));
        for (const char* method : filtering_methods) {
            INFO("method ", std::string(method));
            DenoiseOptions options = denoise_options(method);
            options.sigma_material = hard_stop;
            const Plane<float, 3> out = run(frame, options);
            CHECK(all_finite(out));
            for (int y = 0; y < 8; ++y)
                for (int x = 0; x < 48; ++x) REQUIRE(out.load(x, y) == frame.radiance.load(x, y));
        }
    }
}

TEST_CASE("F5: scaling the scene or the light changes nothing but the light") {
    const PixelData<float> frame = corner<float>(64, 48, 0.8);
    const Plane<float, 3> expected = run(frame);
    for (const float scale : {100.0f, 1e-4f}) {
        CAPTURE(scale);
        PixelData<float> scaled = frame;
        for (float& v : scaled.position.values()) v *= scale;
        for (float& v : scaled.depth.values()) v *= scale;
        CHECK(difference(run(scaled), expected) < 1e-4);
        scaled = frame;
        for (auto* plane : {&scaled.radiance, &scaled.emission})
            for (float& v : plane->values()) v *= scale;
        for (float& v : scaled.variance.values()) v *= scale * scale;
        Plane<float, 3> out = run(scaled);
        for (float& v : out.values()) v /= scale;
        CHECK(difference(out, expected) < 1e-4);
    }
}

TEST_CASE("F12: none and kernel 0 give the radiance back, every bit") {
    PixelData<float> frame = corner<float>(30, 20, 0.5);
    frame.radiance.values()[100] = std::numeric_limits<float>::quiet_NaN();
    CHECK(same_bits(run(frame, denoise_options("none")), frame.radiance));
    for (const char* method : filtering_methods) {
        DenoiseOptions options = denoise_options(method);
        options.kernel = 0;
        CHECK(same_bits(run(frame, options), frame.radiance));
    }
    CHECK(denoise_options("seed").kernel == 65);
}

TEST_CASE("F13: bad options are refused before anything is written") {
    const PixelData<float> frame = corner<float>(12, 10, 0.5);
    Plane<float, 3> out(12, 10, 7);
    SerialExecutor serial;
    const auto refused = [&](auto set) {
        for (const char* method : {"balanced", "seed"}) {
            DenoiseOptions options = denoise_options(method);
            set(options);
            CHECK_THROWS_AS(denoise(frame.view(), out.view(), options, serial), Error);
        }
    };
    for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
        CAPTURE(bad);
        refused([&](DenoiseOptions& o) { o.sigma_illumination = bad; });
        refused([&](DenoiseOptions& o) { o.sigma_position = bad; });
        refused([&](DenoiseOptions& o) { o.sigma_normal = bad; });
        refused([&](DenoiseOptions& o) { o.sigma_material = bad; });
        refused([&](DenoiseOptions& o) { o.second_pass_factor = bad; });
        refused([&](DenoiseOptions& o) { o.despike = bad; });
        refused([&](DenoiseOptions& o) { o.firefly = bad; });
        if (bad != 0) refused([&](DenoiseOptions& o) { o.sigma_spatial = bad; });
    }
    for (const int kernel : {-1, 2, 64}) refused([&](DenoiseOptions& o) { o.kernel = kernel; });
    CHECK(out.values() == std::vector<float>(360, 7.0f));
    Plane<float, 3> small(12, 9);
    CHECK_THROWS_AS(denoise(frame.view(), small.view(), {}, serial), Error);
    for (const char* method : {"balanced", "fast", "best", "seed"}) { // planes that only some of them read, too
        Plane<float, 1> number(12, 9, 1);
        Plane<float, 3> vector(12, 9, 1);
        FrameView<float> odd = frame.view();
        const auto refuses = [&](auto& plane, const auto& other) {
            const auto before = plane;
            plane = other.view();
            CHECK_THROWS_AS(denoise(odd, out.view(), denoise_options(method), serial), Error);
            plane = before;
        };
        refuses(odd.samples, std::as_const(number));
        refuses(odd.material, std::as_const(number));
        refuses(odd.depth, std::as_const(number));
        refuses(odd.variance, std::as_const(vector));
        refuses(odd.position, std::as_const(vector));
        refuses(odd.root_direct, std::as_const(vector));
    }
    CHECK(out.values() == std::vector<float>(360, 7.0f));
    CHECK_THROWS_AS(denoise(FrameView<float>{}, out.view(), {}, serial), Error);
}

TEST_CASE("methods by name; an unknown one is answered with those that there are") {
    for (const char* method : filtering_methods)
        CHECK(std::string(denoise_methods).find(method) != std::string::npos);
    CHECK_THROWS_WITH_AS(denoise_options("oidn"), doctest::Contains("best|balanced|fast"), Error);
}

TEST_CASE("emission seen directly is not filtered") {
    const PixelData<float> frame = corner<float>(64, 48, 0);
    PixelData<float> lit = frame, dark = frame;
    for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 64; ++x) {
            const Vec3f pattern((x * 7 + y * 13) % 5 == 0 ? 8.0f : 0.0f);
            lit.emission.view().store(x, y, pattern);
            lit.radiance.view().store(x, y, frame.illumination.load(x, y) * frame.albedo.load(x, y) + pattern);
            dark.emission.view().store(x, y, pattern);
            dark.radiance.view().store(x, y, pattern);
        }
    for (const char* method : filtering_methods) {
        INFO("method ", std::string(method));
        CHECK(same_bits(run(dark, denoise_options(method)), dark.radiance));
    }
    PixelData<float> unlit = lit;
    unlit.emission = Plane<float, 3>(64, 48);
    for (std::size_t i = 0; i < unlit.radiance.values().size(); ++i) unlit.radiance.values()[i] -= lit.emission.values()[i];
    Plane<float, 3> out = run(lit);
    for (std::size_t i = 0; i < out.values().size(); ++i) out.values()[i] -= lit.emission.values()[i];
    CHECK(difference(out, run(unlit)) < 1e-4);
}

TEST_CASE("every plane but radiance may be absent") {
    const PixelData<float> full = corner<float>(48, 40, 0.8);
    const Plane<float, 3> truth = corner<float>(48, 40, 0).radiance;
    for (unsigned absent = 0; absent < 128; ++absent) {
        CAPTURE(absent);
        PixelData<float> frame = full;
        if ((absent & 1) != 0) frame.emission = {};
        if ((absent & 2) != 0) frame.albedo = {};
        if ((absent & 4) != 0) frame.normal = {};
        if ((absent & 8) != 0) frame.position = {};
        if ((absent & 16) != 0) frame.variance = {};
        if ((absent & 32) != 0) frame.material = {};
        if ((absent & 64) != 0) frame.depth = {};
        const Plane<float, 3> out = run(frame, denoise_options("fast"));
        CHECK(all_finite(out));
        if ((absent & 3) == 0) CHECK(rel_mse(out.view(), truth.view()) < 0.5 * rel_mse(frame.radiance.view(), truth.view()));
    }
}

TEST_CASE("1, 2 and 7 threads give the same bits, into the frame's own radiance too") {
    const PixelData<float> frame = corner<float>(90, 70, 0.8);
    ThreadExecutor two(2), seven(7);
    for (const char* method : filtering_methods) {
        INFO("method ", std::string(method));
        const DenoiseOptions options = denoise_options(method);
        const Plane<float, 3> expected = run(frame, options);
        CHECK(same_bits(run(frame, options, two), expected));
        PixelData<float> own = frame;
        denoise(std::as_const(own).view(), own.radiance.view(), options, seven);
        CHECK(same_bits(own.radiance, expected));
    }
}

TEST_CASE("a pixel that is not finite is mended, counted, and felt no further than a kernel away") {
    const PixelData<float> clean = corner<float>(120, 90, 0.8);
    constexpr int x = 60, y = 60;
    for (const char* method : filtering_methods) {
        INFO("method ", std::string(method));
        const DenoiseOptions options = denoise_options(method);
        const Plane<float, 3> expected = run(clean, options);
        PixelData<float> lit = clean; // nor does one that is very bright and uncertain
        lit.radiance.view().store(x, y, Vec3f(30));
        lit.variance.view().store(x, y, Vec3f(9));
        const Plane<float, 3> bright = run(lit, options);
        for (int v = 0; v < 90; ++v)
            for (int u = 0; u < 120; ++u)
                if (std::max(std::abs(u - x), std::abs(v - y)) > options.kernel) REQUIRE(bright.load(u, v) == expected.load(u, v));
        for (const float bad : {std::numeric_limits<float>::quiet_NaN(), float(infinity)}) {
            PixelData<float> frame = clean;
            for (auto* plane : {&frame.radiance, &frame.variance}) plane->view().store(x, y, Vec3f(bad));
            SerialExecutor serial;
            const Denoised<float> result = denoise(frame, options, serial);
            CHECK(result.report.non_finite == 1);
            CHECK(all_finite(result.radiance));
            for (auto* plane : {&frame.normal, &frame.position, &frame.albedo, &frame.emission}) plane->view().store(x, y, Vec3f(bad));
            const Plane<float, 3> worse = run(frame, options);
            CHECK(all_finite(worse));
            for (int v = 0; v < 90; ++v)
                for (int u = 0; u < 120; ++u)
                    if (std::max(std::abs(u - x), std::abs(v - y)) > options.kernel) {
                        REQUIRE(result.radiance.load(u, v) == expected.load(u, v));
                        REQUIRE(worse.load(u, v) == expected.load(u, v));
                    }
        }
    }
}

TEST_CASE("E3: no light leaks over the edges of surfaces and materials") {
    PixelData<float> frame = corner<float>(64, 60, 0);
    for (int y = 0; y < 60; ++y)
        for (int x = 0; x < 64; ++x) {
            const float light = frame.material.load(x, y) == 0 ? 1.0f : 0.0f;
            frame.radiance.view().store(x, y, frame.albedo.load(x, y) * light);
        }
    frame.emission = {};
    const auto worst = [&](const PixelData<float>& f) {
        const Plane<float, 3> out = run(f, {.sigma_illumination = infinity, .despike = infinity});
        double largest = 0;
        for (std::size_t i = 0; i < out.values().size(); ++i)
            largest = std::max(largest, std::abs(double(out.values()[i]) - double(f.radiance.values()[i])));
        return largest;
    };
    CHECK(worst(frame) < 0.01);
    frame.material = {};
    for (int y = 12; y < 36; ++y) // no lamp: it is on the wall's plane, only its material tells
        for (int x = 0; x < 64; ++x) frame.radiance.view().store(x, y, frame.albedo.load(x, y));
    CHECK(worst(frame) < 0.01);
}

TEST_CASE("K1: a firefly leaves no stripe and little of its energy") {
    for (const char* method : {"best", "balanced", "fast"})
        for (const float dot : {20.0f, 1000.0f, 4235.0f}) {
            INFO("method ", std::string(method));
            CAPTURE(dot);
            for (const double clamp : {4.0, infinity}) {
                DenoiseOptions options = denoise_options(method);
                options.despike = clamp;
                double across = 0, down = 0, energy = 0;
                CAPTURE(clamp);
                for (std::uint64_t seed = 0; seed < 3; ++seed) {
                    Random random(seed);
                    PixelData<float> frame;
                    frame.width = frame.height = 97;
                    frame.radiance.allocate(97, 97);
                    for (float& v : frame.radiance.values()) v = float(0.28 * (0.5 + random.uniform()));
                    const Plane<float, 3> without = run(frame, options);
                    frame.radiance.view().store(48, 48, Vec3f(dot));
                    const Plane<float, 3> out = run(frame, options);
                    for (int y = 0; y < 97; ++y)
                        for (int x = 0; x < 97; ++x) {
                            const double excess = double(out.load(x, y).x) - double(without.load(x, y).x);
                            across += std::abs(excess) * std::abs(x - 48);
                            down += std::abs(excess) * std::abs(y - 48);
                            energy += excess / 3;
                        }
                }
                CHECK(across == doctest::Approx(down).epsilon(clamp == 4.0 ? 0.1 : 0.15));
                if (clamp == 4.0) CHECK(energy < 3);
            }
        }
}

TEST_CASE("K3: light near a lamp keeps its energy") {
    Random random(3);
    PixelData<float> frame;
    frame.width = 96;
    frame.height = 64;
    frame.radiance.allocate(96, 64);
    const auto truth = [](int x, int y) { return 60 / (1 + 0.02 * (y * y + (x - 48) * (x - 48))); };
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 96; ++x) frame.radiance.view().store(x, y, Vec3f(float(truth(x, y) * (0.4 + 1.2 * random.uniform()))));
    const auto kept = [&](const char* method) {
        const Plane<float, 3> out = run(frame, denoise_options(method));
        double light = 0, expected = 0;
        for (int y = 0; y < 6; ++y)
            for (int x = 40; x < 56; ++x) {
                light += double(out.load(x, y).x);
                expected += truth(x, y);
            }
        return light / expected;
    };
    for (const char* method : {"best", "balanced", "fast"}) {
        INFO("method ", std::string(method));
        CHECK(kept(method) == doctest::Approx(1).epsilon(0.02));
    }
    CHECK(kept("seed") < 0.9); // its firefly rule takes lit surfaces for fireflies
}

TEST_CASE("the default chain cuts the error of a noisy frame, and does not spoil a clean one") {
    const Plane<float, 3> truth = corner<float>(96, 80, 0).radiance;
    const auto mask = emitter_mask(corner<float>(96, 80, 0).emission.view());
    for (const auto& step : {std::pair{1.0, 10.0}, {0.5, 10.0}, {0.1, 5.0}}) {
        const double noise = step.first, gain = step.second;
        const PixelData<float> frame = corner<float>(96, 80, noise);
        for (const char* method : {"best", "balanced", "fast"}) {
            CAPTURE(noise);
            INFO("method ", std::string(method));
            CHECK(rel_mse(run(frame, denoise_options(method)).view(), truth.view(), mask.view()) * gain <
                  rel_mse(frame.radiance.view(), truth.view(), mask.view()));
        }
    }
}
