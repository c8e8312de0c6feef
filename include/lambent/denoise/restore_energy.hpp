#pragma once
#include <lambent/denoise/energy_blocks.hpp>
#include <lambent/film/pixel_data.hpp>
#include <algorithm>
#include <concepts>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Gives back to `image` the light that it lacks, or takes what it has too much, against `noisy`, which is right in the
/// mean: by factors over ever smaller squares of pixels (144, 80, 48 and 16 a side), linear between their middles, then
/// over the whole image, each only as far as the difference stands out from its noise, and squares at most to twice what
/// they have. There a pixel counts by what it lacks relative to what it has and a third of the image's mean: what lamps
/// and their reflections lack does not brighten the dark pixels around them. The whole keeps its energy.
/// cost    2 passes; 1 byte a pixel
template <std::floating_point T>
void restore_energy(const PixelView<T, 3>& image, const PixelView<const T, 3>& noisy) {
    const int width = image.width(), height = image.height();
    double whole = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const Vec3<T> v = image.load(x, y);
            whole += std::max(0.0, double(v.x) + double(v.y) + double(v.z));
        }
    detail::EnergyBlocks blocks(width, height);
    blocks.add<T>({0, 0, width, height}, image, noisy, whole / (3.0 * width * height));
    blocks.solve();
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            image.store(x, y, Vec3<T>(Vec3<double>(image.load(x, y)) * blocks.factor(x, y)));
}

} // namespace LAMBENT_ABI
} // namespace lambent
