#include "same_bits.hpp"
#include "support/random.hpp"
#include <lambent/core/parallel.hpp>
#include <lambent/film/film.hpp>
#include <lambent/render/path.hpp>
#include <lambent/render/render.hpp>
#include <lambent/sampling/independent.hpp>
#include <lambent/sampling/sobol.hpp>
#include <lambent/sampling/stratified.hpp>
#include <lambent/scene/builtin.hpp>
#include <support/statistics.hpp>
#include <doctest/doctest.h>
#include <algorithm>
#include <vector>

using namespace lambent;
using lambent_test::same_bits;

namespace {

/// Runs the ranges of a loop in a shuffled order.
struct ShuffledExecutor {
    std::uint64_t seed = 0;
    unsigned concurrency() const { return 1; }

    template <class F>
    void parallel_for(std::size_t n, std::size_t grain, F&& f) {
        std::vector<std::size_t> ranges;
        for (std::size_t begin = 0; begin < n; begin += grain) ranges.push_back(begin);
        lambent_test::Random random(seed);
        for (std::size_t i = ranges.size(); i-- > 1;) std::swap(ranges[i], ranges[random.below(std::uint32_t(i) + 1)]);
        for (const std::size_t begin : ranges) f(begin, std::min(n, begin + grain));
    }
};

struct Room {
    Scene<float> scene = room_scene<float>(2);
    SerialExecutor serial;
    PreparedScene<float> prepared{scene, serial};

    template <class S, class E>
    Film<float> film(const S& sampler, std::uint64_t begin, std::uint64_t end, E& executor, RenderOptions options = {}) const {
        if (options.window.empty()) options.width = options.height = 21;
        options.first_sample = begin;
        options.end_sample = end;
        Film<float> film;
        render(film, prepared, scene.cameras[0], PathIntegrator<>{}, sampler, options, executor, [] { return true; });
        return film;
    }
};

template <class S>
void check_same_bits(const S& sampler) {
    const Room room;
    SerialExecutor serial;
    const Film<float> whole = room.film(sampler, 0, 11, serial);
    for (const unsigned threads : {1u, 2u, 7u}) {
        INFO("threads ", threads);
        ThreadExecutor executor(threads);
        CHECK(same_bits(whole, room.film(sampler, 0, 11, executor)));
        CHECK(same_bits(whole, room.film(sampler, 0, 11, executor, {.tile = 5})));
    }
    for (std::uint64_t seed = 0; seed < 4; ++seed) {
        INFO("seed ", seed);
        ShuffledExecutor shuffled{seed};
        CHECK(same_bits(whole, room.film(sampler, 0, 11, shuffled, {.tile = 4})));
        const std::uint64_t a = 1 + seed, b = 8 + seed % 3;
        Film<float> last = room.film(sampler, b, 11, shuffled);
        last.merge(room.film(sampler, 0, a, serial));
        last.merge(room.film(sampler, a, b, shuffled));
        CHECK(same_bits(whole, last));
    }
    Film<float> other;
    CHECK(!same_bits(whole, room.film(sampler, 0, 10, serial)));
}

} // namespace

TEST_CASE("G3: Sobol: threads, tiles and splits of the samples give the same bits") {
    check_same_bits(SobolSampler<float>(3));
}
TEST_CASE("G3: stratified: threads, tiles and splits of the samples give the same bits") {
    check_same_bits(StratifiedSampler<float>(3, 11));
}
TEST_CASE("G3: independent: threads, tiles and splits of the samples give the same bits") {
    check_same_bits(IndependentSampler<float>(3));
}

TEST_CASE("a window holds the bits of the whole image") {
    const Room room;
    SerialExecutor serial;
    const SobolSampler<float> sampler(1);
    const PixelData<float> whole = room.film(sampler, 0, 4, serial).resolve();
    const PixelData<float> part =
        room.film(sampler, 0, 4, serial, {.width = 21, .height = 21, .window = {3, 7, 19, 12}}).resolve();
    REQUIRE(part.width == 16);
    REQUIRE(part.height == 5);
    for (int y = 0; y < part.height; ++y)
        for (int x = 0; x < part.width; ++x) {
            CHECK(part.radiance.load(x, y) == whole.radiance.load(x + 3, y + 7));
            CHECK(part.position.load(x, y) == whole.position.load(x + 3, y + 7));
        }
}

TEST_CASE("planes that a render was not asked for do not change the others") {
    const Room room;
    SerialExecutor serial;
    const SobolSampler<float> sampler(1);
    const PixelData<float> all = room.film(sampler, 0, 4, serial).resolve();
    const PixelData<float> few = room.film(sampler, 0, 4, serial, {.planes = FilmPlanes::albedo}).resolve();
    CHECK(all.radiance.values() == few.radiance.values());
    CHECK(all.albedo.values() == few.albedo.values());
    CHECK((few.normal.absent() && few.emission.absent() && few.illumination.absent() && few.material.absent()));
}

TEST_CASE("a pass that is stopped leaves the film as it was; a wrong range is refused") {
    const Room room;
    SerialExecutor serial;
    const SobolSampler<float> sampler(1);
    Film<float> film = room.film(sampler, 0, 2, serial);
    const Film<float> before = film;
    RenderOptions options;
    options.width = options.height = 21;
    options.first_sample = 2;
    options.end_sample = 4;
    int tiles = 0;
    const RenderResult result = render(film, room.prepared, room.scene.cameras[0], PathIntegrator<>{}, sampler, options,
                                       serial, [&] { return ++tiles < 3; });
    CHECK(result.stopped);
    CHECK(same_bits(before, film));
    for (const auto& [begin, end] : {std::pair<std::uint64_t, std::uint64_t>{4, 4}, {5, 4}, {0, max_samples + 1}}) {
        options.first_sample = begin;
        options.end_sample = end;
        CHECK_THROWS_AS(render(film, room.prepared, room.scene.cameras[0], PathIntegrator<>{}, sampler, options, serial,
                               [] { return true; }),
                        Error);
    }
    options = {};
    options.window = {0, 0, 4000, 2};
    CHECK_THROWS_AS(render(film, room.prepared, room.scene.cameras[0], PathIntegrator<>{}, sampler, options, serial,
                           [] { return true; }),
                    Error);
}

TEST_CASE("F14: a clamp of each sample keeps 99 % of the room's light, in 64 images of 1 sample a pixel as in one of 64") {
    const Room room;
    ThreadExecutor threads;
    const auto light = [&](std::uint32_t seed, std::uint64_t count, double clamp) {
        const PixelData<float> frame = room.film(SobolSampler<float>(seed), 0, count, threads,
                                                 {.width = 48, .height = 48, .window = {0, 0, 48, 48}, .firefly_clamp = clamp})
                                           .resolve();
        double sum = 0;
        for (std::size_t i = 0; i < frame.radiance.values().size(); ++i)
            sum += double(frame.radiance.values()[i] - frame.emission.values()[i]);
        return sum;
    };
    constexpr double off = std::numeric_limits<double>::infinity(), clamp = 25; // about 20 times the mean
    const auto check = [](double kept) {
        INFO("kept ", kept);
        CHECK(kept <= 1);
        CHECK(kept >= 0.99);
    };
    check(light(7, 64, clamp) / light(7, 64, off));
    double all = 0, kept = 0;
    for (std::uint32_t seed = 0; seed < 64; ++seed) {
        all += light(seed, 1, off);
        kept += light(seed, 1, clamp);
    }
    check(kept / all);
}
