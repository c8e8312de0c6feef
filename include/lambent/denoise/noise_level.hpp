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
    struct Sum {
        double ratios = 0, pairs = 0;
    };
    std::vector<Sum> rows(std::size_t(image.height()));
    executor.parallel_for(rows.size(), 16, [&](std::size_t begin, std::size_t end) {
        const auto light = [&](int x, int y) {
            const auto v = image.load(x, y);
            return double(v.x) + double(v.y) + double(v.z);
        };
        for (int y = int(begin); y < int(end); ++y) {
            Sum& row = rows[std::size_t(y)];
            const auto add = [&](double a, double b) {
                if (!(a + b > 0)) return;
                row.ratios += std::min(1.0, std::abs(a - b) / (a + b));
                ++row.pairs;
            };
            for (int x = 0; x < image.width(); ++x) {
                const double here = light(x, y);
                if (x + 1 < image.width()) add(here, light(x + 1, y));
                if (y + 1 < image.height()) add(here, light(x, y + 1));
            }
        }
    });
    Sum sum;
    for (const Sum& row : rows) {
        sum.ratios += row.ratios;
        sum.pairs += row.pairs;
    }
    return sum.pairs > 0 ? sum.ratios / sum.pairs : 0;
}

} // namespace LAMBENT_ABI
} // namespace lambent
