#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/executor.hpp>
#include <lambent/film/error_estimate.hpp>
#include <lambent/film/film.hpp>
#include <lambent/film/film_pass.hpp>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

namespace lambent {
inline namespace LAMBENT_ABI {

/// When sampling may stop.
struct AdaptiveOptions {
    double error_target = 0.05;       ///< √rel_mse of the image that is enough; > 0
    std::uint64_t first_samples = 8;  ///< of every pixel, before the first of them may stop; a power of two >= 4
};

/// What comes after the samples that are in.
struct AdaptiveRound {
    double estimated_error = 0;          ///< of the film as it is
    std::size_t count = 0;               ///< pixels that go on; 0 = the target is met
    Plane<std::uint8_t, 1> active;       ///< which; see FilmPass
};

/// The pixels that have not stopped.
template <class T>
Plane<std::uint8_t, 1> going_on(const Film<T>& film) {
    Plane<std::uint8_t, 1> active(film.width(), film.height(), 1);
    for (std::size_t p = 0; p < film.stops().size(); ++p) active.values()[p] = film.stops()[p] == Film<T>::goes_on;
    return active;
}

namespace detail {

/// How many times the pixels that go on should double their samples. With s the variance of one sample, doubling n
/// takes s / 2n off the error at a cost of n, so all pixels for which s / 2n² is above one threshold double, and the
/// error at the end says where it lies: so many samples of a pixel as √s asks for. Pixels are sorted into bins of s /
/// 2n² by what their neighbours say, and each bin's error is what its pixels say: it does not look small because it was
/// picked so.
class SampleDemand {
public:
    /// A pixel that may go on, and the variance of its mean now; 0 where the image's error leaves it out.
    void add(double gain, double variance) { errors_[bin_of(gain)] += variance; }

    /// The gain below which pixels stop so that the errors add up to `rest` at the end.
    double threshold(double rest) const {
        std::size_t bin = bins;
        while (bin > 0 && error_at(bin) > rest) --bin;
        return std::exp2((double(bin) - double(origin)) / steps);
    }

private:
    static constexpr std::size_t steps = 32, origin = 120 * steps, bins = 180 * steps; ///< a factor of 2; of gain 1

    static std::size_t bin_of(double gain) {
        return std::size_t(std::clamp(std::log2(gain) * double(steps) + double(origin), 0.0, double(bins - 1)));
    }
    /// Of all pixels when each has doubled until its gain is below the bin's. A doubling is two factors of 2.
    double error_at(std::size_t threshold) const {
        double sum = 0;
        for (std::size_t bin = 0; bin < bins; ++bin)
            if (errors_[bin] > 0)
                sum += bin < threshold ? errors_[bin]
                                       : std::ldexp(errors_[bin], -int((bin - threshold) / (2 * steps) + 1));
        return sum;
    }

    std::array<double, bins> errors_{};
};

} // namespace detail

/// Which pixels of a film of the samples [0, 2^k) go on for the next 2^k so that it takes the fewest samples until the
/// image's √rel_mse is the target. Whether a pixel does depends on its neighbours' samples, never on its own: it is not
/// more likely to stop where they came out low, and its mean stays unbiased. A function of the film alone.
/// throws lambent::Error on options out of range, a film without `halves` or of other samples
/// cost    some 50 operations for each neighbour within RelativeVariance::reach
template <class T, Executor E>
AdaptiveRound next_round(const Film<T>& film, const AdaptiveOptions& options, E& executor) {
    require(options.error_target > 0 && options.first_samples >= 4 && std::has_single_bit(options.first_samples), [&] {
        return "next_round: error target " + std::to_string(options.error_target) + ", first samples " +
               std::to_string(options.first_samples);
    });
    require(contains(film.planes(), FilmPlanes::halves), "next_round: the film has no halves");
    require(film.blocks().size() == 1 && film.blocks()[0].samples.first == 0 &&
                film.sample_count() >= options.first_samples,
            [&] { return "next_round: " + std::to_string(film.sample_count()) + " samples are no round"; });

    const PixelData<T> frame = film.resolve();
    const RelativeVariance<T> relative(frame);
    const double n = double(film.sample_count());
    AdaptiveRound round;
    round.active = going_on(film);
    if (relative.counted() == 0) { // nothing that could be wrong
        round.active.allocate(frame.width, frame.height, 0);
        return round;
    }

    // Of one sample: of each pixel by itself, and around it.
    Plane<T, 1> own(frame.width, frame.height), around(frame.width, frame.height);
    executor.parallel_for(std::size_t(frame.height), 4, [&](std::size_t begin, std::size_t end) {
        for (int y = int(begin); y < int(end); ++y)
            for (int x = 0; x < frame.width; ++x) {
                const Vec3<T> light = relative.light_around(x, y);
                own.store(x, y, relative.under(light, x, y) * frame.samples.load(x, y));
                T sum = 0;
                int count = 0;
                constexpr int reach = RelativeVariance<T>::reach;
                for (int j = std::max(0, y - reach); j <= std::min(frame.height - 1, y + reach); ++j)
                    for (int i = std::max(0, x - reach); i <= std::min(frame.width - 1, x + reach); ++i) {
                        if (i == x && j == y) continue;
                        sum += relative.under(light, i, j) * frame.samples.load(i, j);
                        ++count;
                    }
                around.store(x, y, count > 0 ? sum / T(count) : T(0));
            }
    });

    double stopped = 0, active = 0, prior = 0;
    for (int y = 0; y < frame.height; ++y)
        for (int x = 0; x < frame.width; ++x) {
            if (relative.sees_emitter(x, y)) continue;
            const double error = double(own.load(x, y)) / double(frame.samples.load(x, y));
            (round.active.load(x, y) != 0 ? active : stopped) += error;
            prior += double(own.load(x, y)) / double(relative.counted());
        }
    const double wanted = options.error_target * options.error_target * double(relative.counted());
    round.estimated_error = std::sqrt((stopped + active) / double(relative.counted()));
    if (stopped + active <= wanted) {
        round.active.allocate(frame.width, frame.height, 0);
        return round;
    }

    // A window without a hit of a rare light is not free of noise: it gets some of the whole image's.
    constexpr double of_image = 0.04;
    const auto gain_of = [&](int x, int y) {
        return (double(around.load(x, y)) * (1 - of_image) + prior * of_image) / (2 * n * n);
    };
    detail::SampleDemand demand;
    for (int y = 0; y < frame.height; ++y)
        for (int x = 0; x < frame.width; ++x)
            if (round.active.load(x, y) != 0)
                demand.add(gain_of(x, y), relative.sees_emitter(x, y) ? 0.0 : double(own.load(x, y)) / n);
    // A little better than asked for, or the last round would fall short half of the time. Where those that stopped
    // turn out to leave nothing, the others end where more samples of theirs would not help.
    constexpr double aim = 0.92, least = 0.05;
    const double threshold = demand.threshold(std::max(aim * wanted - stopped, least * wanted));
    for (int y = 0; y < frame.height; ++y)
        for (int x = 0; x < frame.width; ++x) {
            std::uint8_t& goes = *round.active.view().pixel(x, y);
            if (goes != 0 && !(gain_of(x, y) >= threshold)) goes = 0;
            round.count += goes;
        }
    return round;
}

} // namespace LAMBENT_ABI
} // namespace lambent
