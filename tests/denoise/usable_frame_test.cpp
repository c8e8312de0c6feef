#include <cstddef>
#include <doctest/doctest.h>
#include <lambent/core/numerics.hpp>
#include <lambent/denoise/usable_frame.hpp>
#include <limits>
#include <vector>

using namespace lambent;

TEST_CASE("UsableFrame: one number that sums cannot hold is found wherever it lies, in any layout, and nothing else changes") {
    constexpr int width = 13, height = 3;
    const PixelStrides layouts[] = {
        {}, {.pixel = 1, .row = width, .channel = width * height}, {.pixel = 4}, {.pixel = 4, .row = 4 * width + 3}};
    for (const PixelStrides& strides : layouts)
        for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -1e20f, 1e20f})
            for (int at = 0; at < 3 * width * height; ++at) {
                std::vector<float> light(std::size_t(5 * width * height)), features(light.size());
                const PixelView<float, 3> radiance(light.data(), width, height, strides);
                const PixelView<float, 3> albedo(features.data(), width, height, strides);
                const int x = at / 3 % width, y = at / 3 / width, c = at % 3;
                for (int v = 0; v < height; ++v)
                    for (int u = 0; u < width; ++u) {
                        radiance.store(u, v, Vec3f(float(u), float(v), 1));
                        albedo.store(u, v, Vec3f(0.5f, float(u), float(v)));
                    }
                const FrameView<float> plain{.radiance = radiance, .albedo = albedo};
                const detail::UsableFrame<float> same(plain);
                REQUIRE(same.view().radiance.data() == light.data()); // nothing to copy
                REQUIRE(same.view().albedo.data() == features.data());

                radiance.pixel(x, y)[c * radiance.strides().channel] = bad;
                albedo.pixel(x, y)[c * albedo.strides().channel] = bad;
                const detail::UsableFrame<float> usable(plain);
                int wrong = 0;
                for (int v = 0; v < height; ++v)
                    for (int u = 0; u < width; ++u)
                        for (int k = 0; k < 3; ++k) {
                            const float r = usable.view().radiance.load(u, v)[k], a = usable.view().albedo.load(u, v)[k];
                            if (u == x && v == y && k == c) wrong += !is_nan(r) || !(a == 0);
                            else wrong += r != radiance.load(u, v)[k] || a != albedo.load(u, v)[k];
                        }
                REQUIRE(wrong == 0);
            }
}
