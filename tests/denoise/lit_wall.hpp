#pragma once
#include "support/random.hpp"
#include <cmath>
#include <cstdint>
#include <lambent/film/film.hpp>
#include <lambent/film/film_pass.hpp>

namespace lambent_test {
using namespace lambent;

/// All light of an image.
inline double energy(const Plane<float, 3>& image) {
    double sum = 0;
    for (const float v : image.values()) sum += double(v);
    return sum;
}

/// Two textured walls under a light with a shadow that no feature tells of, and dimmer light from all around.
struct LitWall {
    int width = 72, height = 40;
    double chance = 1; ///< with which a sample finds light, and then so much more of it

    Vec3d albedo(int x, int y) const { return (x / 5 + y / 5) % 2 == 0 ? Vec3d(0.8, 0.4, 0.2) : Vec3d(0.2, 0.5, 0.6); }
    Vec3d normal(int x) const { return x < 30 ? Vec3d(0, 0, 1) : Vec3d(1, 0, 0); }
    Vec3d direct(int x, int y) const { return albedo(x, y) * (2 * x + y < 70 ? 0.05 : 1.0); }
    Vec3d indirect(int x, int y) const { return albedo(x, y) * (0.2 + 0.002 * x); }
    Vec3d seen(int x, int y) const { return x == 50 && y == 20 ? Vec3d(9) : Vec3d(0); }
    Vec3d truth(int x, int y) const { return direct(x, y) + indirect(x, y) + seen(x, y); }

    /// Samples whose light is exponentially distributed, as unlike the normal distribution as a renderer's.
    template <class T = float>
    PixelData<T> frame(int spp, std::uint64_t seed, double noise = 1,
                       FilmPlanes planes = FilmPlanes::statistics) const {
        FilmPass<T> pass(width, height, planes, 0, std::uint64_t(spp));
        Random random(seed);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                typename FilmPass<T>::Pixel pixel(pass, x, y);
                for (int i = 0; i < spp; ++i) {
                    const auto factor = [&] {
                        const double found = chance == 1 ? 1.0 : random.uniform() < chance ? 1 / chance : 0.0;
                        return found * (1 + noise * (-std::log(1 - random.uniform()) - 1));
                    };
                    PixelSample<T> s;
                    s.hit = true;
                    s.albedo = Vec3<T>(albedo(x, y));
                    s.normal = Vec3<T>(normal(x));
                    s.depth = T(3 + 0.01 * y);
                    s.direct = Vec3<T>(direct(x, y) * factor());
                    s.indirect = Vec3<T>(indirect(x, y) * factor());
                    s.emission = Vec3<T>(seen(x, y));
                    s.radiance = s.emission + s.direct + s.indirect;
                    pixel.add(s);
                }
            }
        return pass.finish().resolve();
    }

    template <class T>
    double error(const Plane<T, 3>& image) const {
        double sum = 0;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const Vec3d d = Vec3d(image.load(x, y)) - truth(x, y), t = truth(x, y);
                for (int c = 0; c < 3; ++c) sum += d[c] * d[c] / (t[c] * t[c] + 0.01);
            }
        return sum / (3.0 * width * height);
    }
};

} // namespace lambent_test
