#pragma once
#include <lambent/core/executor.hpp>
#include <lambent/film/pixel_view.hpp>
#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {
/// How far neighbours are apart that have light: |a - b| / (a + b), at most 1 each, and their number.
struct NoisePairs {
    double ratios = 0, pairs = 0;

    void add(double a, double b) {
        if (!(a + b > 0)) return;
        ratios += std::min(1.0, std::abs(a - b) / (a + b));
        ++pairs;
    }
    void add(const NoisePairs& others) { ratios += others.ratios, pairs += others.pairs; }
    double level() const { return pairs > 0 ? ratios / pairs : 0; }
};

/// A pixel with its right and its lower neighbour.
template <class T>
void add_noise_pairs(NoisePairs& sum, const PixelView<const T, 3>& image, int x, int y) {
    const auto light = [&](int i, int j) {
        const auto v = image.load(i, j);
        return double(v.x) + double(v.y) + double(v.z);
    };
    const double here = light(x, y);
    if (x + 1 < image.width()) sum.add(here, light(x + 1, y));
    if (y + 1 < image.height()) sum.add(here, light(x, y + 1));
}
} // namespace detail

/// How noisy an image is, from 0 to 1: the mean of |a - b| / (a + b) over the pairs of neighbours along rows and columns
/// of which one has light, in the sum of the channels. Independent exponential noise gives 1/2, and 1 is where most
/// samples found no light; edges and slopes add little, since few pixels have them. Neither exposure nor single bright
/// pixels matter, as each pair counts at most once.
/// image   finite; illumination rather than radiance, whose textures would count
/// returns 0 where no pixel has light
/// cost    a pass over the image
/// threads the same bits for any executor
template <std::floating_point T, Executor E>
double noise_level(const PixelView<const T, 3>& image, E& executor) {
    std::vector<detail::NoisePairs> rows(std::size_t(image.height()));
    executor.parallel_for(rows.size(), 16, [&](std::size_t begin, std::size_t end) {
        for (int y = int(begin); y < int(end); ++y)
            for (int x = 0; x < image.width(); ++x) detail::add_noise_pairs(rows[std::size_t(y)], image, x, y);
    });
    detail::NoisePairs sum;
    for (const detail::NoisePairs& row : rows) sum.add(row);
    return sum.level();
}

} // namespace LAMBENT_ABI
} // namespace lambent
