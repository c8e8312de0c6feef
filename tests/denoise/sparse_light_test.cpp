#include "lit_wall.hpp"
#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise.hpp>
#include <lambent/denoise/restore_energy.hpp>
#include <lambent/denoise/sparse_light.hpp>

using namespace lambent;
using lambent_test::energy;
using lambent_test::LitWall;
using lambent_test::Random;

namespace {

float brightest(const Plane<float, 3>& image) { return *std::max_element(image.values().begin(), image.values().end()); }

/// Illumination of which so many of 1000 pixels have any.
void add_light(Plane<float, 3>& illumination, const PixelWindow& window, int per_mille, std::uint64_t seed) {
    Random random(seed);
    for (int y = window.y0; y < window.y1; ++y)
        for (int x = window.x0; x < window.x1; ++x)
            illumination.view().store(x, y, Vec3f(random.uniform() * 1000 < per_mille ? 1.0f : 0.0f));
}

detail::SparseLight sparse_light(const Plane<float, 3>& illumination) {
    detail::SparseLight sparse(illumination.width(), illumination.height());
    for (int y = 0; y < illumination.height(); ++y)
        for (int x = 0; x < illumination.width(); ++x) sparse.add(x, y, illumination.view(), x, y);
    sparse.find();
    return sparse;
}

} // namespace

TEST_CASE("denoise: where one sample in 30 finds light, a picture all the same") {
    const LitWall wall{.width = 160, .height = 96, .chance = 1.0 / 30};
    ThreadExecutor threads(2);
    for (const char* method : {"best", "balanced"}) {
        CAPTURE(method);
        double last = 0.5;
        for (const int spp : {1, 4, 16}) {
            const std::uint64_t seed = std::uint64_t(60 + spp);
            const PixelData<float> frame = wall.frame(spp, seed);
            const Denoised<float> clean = denoise(frame, denoise_options(method), threads);
            const double raw = wall.error(frame.radiance), error = wall.error(clean.radiance);
            CAPTURE(spp);
            CAPTURE(seed);
            CAPTURE(raw);
            CHECK(error < last);
            CHECK(error < 0.05 * raw);
            CHECK(energy(clean.radiance) == doctest::Approx(energy(frame.radiance)).epsilon(spp == 1 ? 0.1 : 0.05));
            CHECK(brightest(clean.radiance) < 20); // the lamp has 9, the wall 1
            last = error;
        }
    }
}

TEST_CASE("restore_energy: squares with next to no light do not make those beside them bright") {
    Plane<float, 3> image(96, 48, 1.0f), noisy(96, 48, 1.0f);
    for (int y = 0; y < 48; ++y)
        for (int x = 48; x < 96; ++x) image.view().store(x, y, Vec3f(1e-7f));
    restore_energy(image.view(), std::as_const(noisy).view());
    CHECK(energy(image) == doctest::Approx(energy(noisy)).epsilon(0.01));
    CHECK(brightest(image) < 4);
}

TEST_CASE("SparseLight: the filter's where most pixels have no light, squares without any as those around them") {
    Plane<float, 3> illumination(160, 160, 1.0f);
    CHECK(sparse_light(illumination).part().empty());
    add_light(illumination, {0, 0, 160, 80}, 50, 1);
    const detail::SparseLight half = sparse_light(illumination);
    CHECK(half.part() == PixelWindow{0, 0, 160, 88});
    int elsewhere = 0, jumps = 0;
    for (int x = 0; x < 160; ++x)
        for (int y = 0; y < 160; ++y) {
            elsewhere += y < 72 ? half.share(x, y) != 1 : y >= 88 ? half.share(x, y) != 0 : 0;
            jumps += y > 0 && std::abs(half.share(x, y) - half.share(x, y - 1)) > 0.5;
        }
    CHECK(elsewhere == 0);
    CHECK(jumps == 0);
    add_light(illumination, {32, 16, 64, 48}, 0, 2);
    CHECK(sparse_light(illumination).share(40, 24) == 1);
    // Three times as wide, and without regard to outliers, where hardly any pixel has light, however bright others are.
    CHECK(half.filter().kernel == 97);
    CHECK_FALSE(is_finite(half.filter().despike));
    add_light(illumination, {0, 0, 160, 160}, 300, 3);
    CHECK(sparse_light(illumination).share(80, 80) > 0.5);
    CHECK(sparse_light(illumination).filter().kernel == 33);
    CHECK(sparse_light(illumination).filter().despike == DenoiseOptions{}.despike);
    // Nothing there at all.
    CHECK(sparse_light(Plane<float, 3>(20, 20)).part().empty());
}
