#include "lit_wall.hpp"
#include "support/random.hpp"
#include <cmath>
#include <doctest/doctest.h>
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise.hpp>
#include <limits>

using namespace lambent;
using lambent_test::energy;
using lambent_test::LitWall;
using lambent_test::Random;

namespace {

/// The wall's samples, a tenth of whose indirect light comes in one of 3000, each 300 times as bright as the others.
PixelData<float> with_fireflies(const LitWall& wall, int spp, std::uint64_t seed) {
    constexpr double chance = 1.0 / 3000;
    Random random(seed);
    FilmPass<float> pass(wall.width, wall.height, FilmPlanes::statistics, 0, std::uint64_t(spp));
    for (int y = 0; y < wall.height; ++y)
        for (int x = 0; x < wall.width; ++x) {
            FilmPass<float>::Pixel pixel(pass, x, y);
            for (int i = 0; i < spp; ++i) {
                const auto factor = [&] { return -std::log(1 - random.uniform()); };
                PixelSample<float> s;
                s.hit = true;
                s.albedo = Vec3f(wall.albedo(x, y));
                s.normal = Vec3f(wall.normal(x));
                s.depth = float(3 + 0.01 * y);
                s.direct = Vec3f(wall.direct(x, y) * factor());
                s.indirect = Vec3f(wall.indirect(x, y) * factor() * (random.uniform() < chance ? 0.1 / chance : 0.9));
                s.emission = Vec3f(wall.seen(x, y));
                s.radiance = s.emission + s.direct + s.indirect;
                pixel.add(s);
            }
        }
    return pass.finish().resolve();
}

} // namespace

TEST_CASE("denoise: fireflies go, their energy stays, and the error falls with the samples") {
    const LitWall wall{.width = 128, .height = 80};
    ThreadExecutor threads(2);
    double last = std::numeric_limits<double>::infinity();
    for (const int spp : {4, 16, 64, 256}) {
        const std::uint64_t seed = std::uint64_t(30 + spp);
        const PixelData<float> frame = with_fireflies(wall, spp, seed);
        const Plane<float, 3> clean = denoise(frame, denoise_options("best"), threads).radiance;
        const double raw = wall.error(frame.radiance), error = wall.error(clean);
        const double plain = wall.error(denoise(wall.frame(spp, seed), denoise_options("best"), threads).radiance);
        CAPTURE(spp);
        CAPTURE(seed);
        CAPTURE(raw);
        CAPTURE(plain);
        CHECK(error < raw * (spp <= 64 ? 0.05 : 0.1));
        CHECK(error < plain * (spp <= 16 ? 1.5 : 3)); // without fireflies; later the samples know of them
        CHECK(error < last);
        CHECK(energy(clean) == doctest::Approx(energy(frame.radiance)).epsilon(0.02));
        last = error;
    }
}
