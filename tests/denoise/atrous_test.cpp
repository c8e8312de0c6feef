#include "lit_wall.hpp"
#include "support/random.hpp"
#include <cmath>
#include <doctest/doctest.h>
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise.hpp>
#include <limits>

using namespace lambent;
using lambent_test::LitWall;
using lambent_test::Random;

namespace {

struct Room { // two walls, noise
    static constexpr int width = 41, height = 27;
    Plane<float, 3> light{width, height}, normal{width, height};
    Plane<float, 1> variance{width, height}, depth{width, height};

    explicit Room(std::uint64_t seed) {
        Random random(seed);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                light.view().store(x, y, Vec3f(float(random.uniform()), 0.5f, float(x) / width));
                normal.view().store(x, y, x < 20 ? Vec3f(0, 0, 1) : normalize(Vec3f(1, 0, float(y) * 0.01f)));
                variance.view().store(x, y, 0.05f + 0.1f * float(random.uniform()));
                depth.view().store(x, y, 2 + 0.03f * float(x) + 0.1f * float(random.uniform()));
            }
    }
    template <class E>
    Plane<float, 3> filtered(const AtrousOptions& options, E& executor) const {
        Plane<float, 3> out(width, height);
        atrous<float>(light.view(), variance.view(), normal.view(), depth.view(), out.view(), options, executor);
        return out;
    }
};

/// The same from its description, one pixel after the other and in double.
Plane<double, 3> expected(const Room& room, const AtrousOptions& o) {
    constexpr int w = Room::width, h = Room::height;
    Plane<double, 3> light(w, h), next(w, h);
    Plane<double, 1> noise(w, h), less(w, h);
    const auto depth = [&](int x, int y) {
        return double(room.depth.load(std::clamp(x, 0, w - 1), std::clamp(y, 0, h - 1)));
    };
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) {
            light.view().store(x, y, Vec3d(room.light.load(x, y)));
            noise.view().store(x, y, double(room.variance.load(x, y)));
        }
    for (int level = 0; level < o.levels; ++level) {
        const int step = 1 << level;
        for (int y = 0; y < h; ++y)
            for (int x = 0; x < w; ++x) {
                double around = 0, count = 0;
                for (int v = std::max(0, y - 1); v <= std::min(h - 1, y + 1); ++v)
                    for (int u = std::max(0, x - 1); u <= std::min(w - 1, x + 1); ++u)
                        around += noise.load(u, v), ++count;
                const double d = depth(x, y);
                const auto least = [&](double a, double b) { return std::min(std::abs(a - d), std::abs(b - d)); };
                const double slope = least(depth(x - 1, y), depth(x + 1, y)) + least(depth(x, y - 1), depth(x, y + 1));
                const double sigma_depth = o.sigma_depth * slope + 2e-3 * d + 1e-6;
                Vec3d sum(0);
                double weights = 0, squares = 0;
                for (int v = -2; v <= 2; ++v)
                    for (int u = -2; u <= 2; ++u) {
                        const int px = x + u * step, py = y + v * step;
                        if (px < 0 || py < 0 || px >= w || py >= h) continue;
                        const double kernel[] = {3.0 / 8, 1.0 / 4, 1.0 / 16};
                        const Vec3d a = light.load(x, y), b = light.load(px, py);
                        const Vec3d turned = Vec3d(room.normal.load(px, py)) - Vec3d(room.normal.load(x, y));
                        const double deeper = depth(px, py) - d,
                                     far = step * std::sqrt(double(std::max(1, u * u + v * v)));
                        double e = std::abs(b.x + b.y + b.z - a.x - a.y - a.z) /
                                   (o.sigma_light * std::sqrt(around / count) + 1e-6);
                        e += dot(turned, turned) / (2 * o.sigma_normal * o.sigma_normal);
                        e += deeper * deeper / (2 * sigma_depth * sigma_depth * far * far);
                        const double weight = std::exp(-e) * kernel[std::abs(u)] * kernel[std::abs(v)];
                        sum += weight * b;
                        weights += weight;
                        squares += weight * weight * noise.load(px, py);
                    }
                next.view().store(x, y, sum / weights);
                less.view().store(x, y, squares / (weights * weights));
            }
        std::swap(light, next);
        std::swap(noise, less);
    }
    return light;
}

} // namespace

TEST_CASE("atrous: as its description says, in double; the same bits for any executor, and in place") {
    const Room room(3);
    SerialExecutor serial;
    for (const AtrousOptions& options :
         {AtrousOptions{}, AtrousOptions{.levels = 2, .sigma_light = 1, .sigma_depth = 3}}) {
        const Plane<float, 3> out = room.filtered(options, serial);
        const Plane<double, 3> truth = expected(room, options);
        double worst = 0;
        for (std::size_t i = 0; i < out.values().size(); ++i)
            worst = std::max(worst, std::abs(double(out.values()[i]) - truth.values()[i]));
        CHECK(worst < 2e-5);
        ThreadExecutor threads(3);
        CHECK(room.filtered(options, threads).values() == out.values());
        Plane<float, 3> same = room.light;
        atrous<float>(same.view(), room.variance.view(), room.normal.view(), room.depth.view(), same.view(), options,
                      threads);
        CHECK(same.values() == out.values());
    }
    CHECK(room.filtered({.levels = 0}, serial).values() == room.light.values());
}

TEST_CASE("atrous: constant images stay, sizes that are no multiple of anything, bad options") {
    SerialExecutor serial;
    for (const auto& [w, h] : {std::pair(1, 1), std::pair(3, 70), std::pair(9, 2)}) {
        Plane<float, 3> image(w, h, 0.7f);
        const Plane<float, 1> variance(w, h, 0.01f), none(w, h);
        atrous<float>(image.view(), variance.view(), {}, {}, image.view(), {}, serial);
        for (const float v : image.values()) CHECK(v == doctest::Approx(0.7).epsilon(1e-6));
        image.view().store(0, 0, Vec3f(5)); // no noise: nothing to take away
        atrous<float>(image.view(), none.view(), {}, {}, image.view(), {}, serial);
        CHECK(image.load(0, 0).x == doctest::Approx(5));
    }
    Plane<float, 3> image(4, 4), other(3, 4);
    const Plane<float, 1> variance(4, 4);
    CHECK_THROWS_AS(atrous<float>(image.view(), variance.view(), {}, {}, image.view(), {.levels = 11}, serial), Error);
    CHECK_THROWS_AS(atrous<float>(image.view(), variance.view(), {}, {}, image.view(), {.sigma_light = 0}, serial),
                    Error);
    CHECK_THROWS_AS(atrous<float>(image.view(), variance.view(), {}, {}, other.view(), {}, serial), Error);
}

TEST_CASE("fast: takes noise away at every number of samples; without variances it is the filter") {
    const LitWall wall;
    SerialExecutor serial;
    for (const int spp : {1, 4, 16, 64}) {
        CAPTURE(spp);
        const PixelData<float> frame = wall.frame(spp, 17, 1, FilmPlanes::features);
        const Denoised<float> clean = denoise(frame, denoise_options("fast"), serial);
        CHECK(clean.report.used == NoiseUse::atrous);
        CHECK(wall.error(clean.radiance) < 0.35 * wall.error(frame.radiance));
    }
    PixelData<float> bare = wall.frame(16, 17, 1, FilmPlanes::features);
    bare.variance = {};
    CHECK(denoise(bare, denoise_options("fast"), serial).report.used == NoiseUse::filter);
    bare = wall.frame(16, 17, 1, FilmPlanes::features);
    bare.variance.view().store(9, 9, Vec3f(std::numeric_limits<float>::infinity()));
    bare.radiance.view().store(30, 9, Vec3f(std::numeric_limits<float>::quiet_NaN()));
    const Denoised<float> clean = denoise(bare, denoise_options("fast"), serial);
    for (const float v : clean.radiance.values()) CHECK(is_finite(v));
}
