// The same bits whatever the threads, the order of tiles and the split of the samples. Other instruction sets:
// layouts/.
#include "denoise/bilateral_cases.hpp"
#include "stress/table.hpp"
#include "support/random.hpp"
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <doctest/doctest.h>
#include <lambent/core/content_hash.hpp>
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise.hpp>
#include <lambent/render/path.hpp>
#include <lambent/render/render.hpp>
#include <lambent/sampling/independent.hpp>
#include <lambent/scene/builtin.hpp>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

/// Runs the ranges of a loop one after the other, in an order of its own.
struct ShuffledExecutor {
    std::uint64_t seed;
    unsigned concurrency() const { return 3; }
    template <class F>
    void parallel_for(std::size_t n, std::size_t grain, F&& f) {
        grain = std::max<std::size_t>(grain, 1);
        std::vector<std::size_t> begins;
        for (std::size_t begin = 0; begin < n; begin += grain) begins.push_back(begin);
        Random random(seed++);
        for (std::uint32_t i = std::uint32_t(begins.size()); i-- > 1;)
            std::swap(begins[i], begins[random.below(i + 1)]);
        for (const std::size_t begin : begins) f(begin, std::min(n, begin + grain));
    }
};

std::uint64_t hash_of(const PixelData<float>& frame) {
    ContentHash hash;
    for (const auto* plane :
         {&frame.radiance, &frame.variance, &frame.albedo, &frame.normal, &frame.position, &frame.illumination})
        hash.add(plane->values());
    hash.add(frame.depth.values());
    hash.add(frame.material.values());
    return hash.value();
}
std::uint64_t hash_of(const Plane<float, 3>& plane) {
    ContentHash hash;
    hash.add(plane.values());
    return hash.value();
}

/// All numbers of threads up to 64, or a few of them.
std::vector<unsigned> thread_counts() {
    if (!stress_in_full()) return {1, 2, 3, 7, 16, 64};
    std::vector<unsigned> counts;
    for (unsigned i = 1; i <= 64; ++i) counts.push_back(i);
    return counts;
}

/// Sums of one pixel's samples that arrive in some order, as threads that share a pixel would add them: how many of
/// `orders` differ from the first.
double share_of_arrivals(int orders) {
    std::vector<float> samples;
    Random random(3);
    for (int i = 0; i < 64; ++i) samples.push_back(random.uniform_float());
    float first = 0;
    for (const float s : samples) first += s;
    int different = 0;
    for (int k = 0; k < orders; ++k) {
        for (std::uint32_t i = 64; i-- > 1;) std::swap(samples[i], samples[random.below(i + 1)]);
        float sum = 0;
        for (const float s : samples) sum += s;
        different += sum != first ? 1 : 0;
    }
    return different / double(orders);
}

} // namespace

TEST_CASE("bits: renders by 1 to 64 threads, any order of tiles, samples split anyhow -> one hash") {
    const Scene<float> scene = cornell_scene<float>();
    ThreadExecutor threads;
    const PreparedScene<float> prepared(scene, threads);
    const int width = 37, height = 23;
    const std::uint64_t samples = 13;
    std::vector<std::uint64_t> hashes;
    const auto pass = [&](Film<float>& film, std::uint64_t begin, std::uint64_t end, int tile, auto& executor) {
        RenderOptions options{.width = width, .height = height, .first_sample = begin, .end_sample = end, .tile = tile};
        render(film, prepared, scene.cameras[0], PathIntegrator<PathStrategy::bsdf>{}, IndependentSampler<float>(1),
               options, executor, [] { return true; });
    };
    for (const unsigned count : thread_counts()) {
        ThreadExecutor executor(count);
        Film<float> film;
        pass(film, 0, samples, count % 3 == 0 ? 5 : 16, executor);
        hashes.push_back(hash_of(film.resolve()));
    }
    for (std::uint64_t seed = 0; seed < inputs(6, 300); ++seed) {
        ShuffledExecutor executor{seed};
        Random random(seed);
        Film<float> whole;
        std::vector<std::uint64_t> cuts{0, samples};
        for (int k = 0; k < 3; ++k) cuts.push_back(random.below(samples + 1));
        std::sort(cuts.begin(), cuts.end());
        std::vector<Film<float>> parts;
        for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
            if (cuts[k] == cuts[k + 1]) continue;
            parts.emplace_back();
            pass(parts.back(), cuts[k], cuts[k + 1], 1 + int(random.below(40)), executor);
        }
        while (!parts.empty()) {
            const std::size_t i = random.index(parts.size());
            if (whole.width() == 0)
                whole = std::move(parts[i]);
            else
                whole.merge(std::move(parts[i]));
            parts.erase(parts.begin() + std::ptrdiff_t(i));
        }
        hashes.push_back(hash_of(whole.resolve()));
    }
    const double different =
        double(std::count_if(hashes.begin(), hashes.end(), [&](std::uint64_t h) { return h != hashes[0]; }));
    record({"bits", "renders: threads, tiles, splits -> share of other hashes; naive: samples as they arrive",
            double(hashes.size()), different, different / double(hashes.size()), 0, share_of_arrivals(100)});
}

TEST_CASE("bits: filters by 1 to 64 threads, any order of strips -> one hash a filter") {
    const Planes<float> planes = random_planes<float>(133, 71, 4);
    PixelData<float> frame;
    frame.width = planes.width();
    frame.height = planes.height();
    frame.radiance = planes.image;
    frame.normal = planes.normal;
    frame.position = planes.position;
    frame.material = planes.material;
    double runs = 0, different = 0;
    const auto compare = [&](auto&& filtered) { // by every executor
        SerialExecutor serial;
        const std::uint64_t expected = filtered(serial);
        for (const unsigned count : thread_counts()) {
            ThreadExecutor executor(count);
            different += filtered(executor) != expected ? 1 : 0;
            ++runs;
        }
        for (std::uint64_t seed = 0; seed < inputs(3, 100); ++seed) {
            ShuffledExecutor executor{seed};
            different += filtered(executor) != expected ? 1 : 0;
            ++runs;
        }
    };
    for (const auto form : all_forms)
        compare([&](auto& executor) {
            CrossBilateralOptions options = seed_options(form);
            options.kernel = 33;
            return hash_of(filter(planes, options, executor));
        });
    compare(
        [&](auto& executor) { return hash_of(denoise(frame, denoise_options("separable_reuse"), executor).radiance); });
    record({"bits", "filters: threads, strips -> share of other hashes; naive: taps as they arrive", runs, different,
            different / runs, 0, share_of_arrivals(100)});
}
