#include "support/random.hpp"
#include <lambent/film/film.hpp>
#include <lambent/film/film_pass.hpp>
#include <doctest/doctest.h>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

using namespace lambent;

namespace stops_test {
namespace {

constexpr int side = 6;
constexpr std::uint64_t never = 1000; // more than any test takes

PixelSample<float> sample_of(std::size_t pixel, std::uint64_t index) {
    lambent_test::Random random(pixel * 1000003 + index);
    PixelSample<float> s;
    s.hit = random.uniform() < 0.8;
    s.radiance = Vec3f(float(std::exp(6 * random.uniform() - 3)));
    s.albedo = s.normal = Vec3f(random.uniform_float());
    s.depth = random.uniform_float();
    s.material = random.below(5);
    return s;
}

/// Where each pixel stops: at 2, 4, 8, 16, or not.
std::uint64_t stop_of(std::size_t pixel) {
    const std::uint64_t stops[] = {4, never, 8, 2, 16};
    return stops[pixel * 7 % 5];
}

/// The samples [begin, end) of the pixels whose stop lies behind `begin`.
template <class Stop>
Film<float> pass_of(std::uint64_t begin, std::uint64_t end, Stop&& stop) {
    std::vector<std::uint8_t> active(side * side);
    for (std::size_t p = 0; p < active.size(); ++p) active[p] = stop(p) > begin;
    FilmPass<float> pass(side, side, FilmPlanes::statistics, begin, end, ActivePixels(active.data(), side, side));
    for (std::size_t p = 0; p < active.size(); ++p) {
        if (active[p] == 0) continue;
        FilmPass<float>::Pixel pixel(pass, int(p % side), int(p / side));
        for (std::uint64_t i = begin; i < end; ++i) pixel.add(sample_of(p, i));
    }
    return pass.finish();
}

/// Passes that end at `cuts`, the first from 0, merged by twos in an order of `seed`'s choice.
template <class Stop>
Film<float> film_of(const std::vector<std::uint64_t>& cuts, Stop&& stop, std::uint64_t seed = 0) {
    std::vector<Film<float>> parts;
    std::uint64_t begin = 0;
    for (const std::uint64_t end : cuts) {
        parts.push_back(pass_of(begin, end, stop));
        begin = end;
    }
    lambent_test::Random random(seed);
    while (parts.size() > 1) {
        const std::size_t a = random.below(std::uint32_t(parts.size()) - 1);
        const std::size_t b = seed % 2 == 0 ? a + 1 : parts.size() - 1;
        parts[a].merge(std::move(parts[b]));
        parts.erase(parts.begin() + std::ptrdiff_t(b));
    }
    return std::move(parts[0]);
}

template <int C>
bool same_pixel(const Plane<float, C>& a, const Plane<float, C>& b, std::size_t pixel) {
    return std::memcmp(&a.values()[pixel * C], &b.values()[pixel * C], C * sizeof(float)) == 0;
}

bool same_pixel(const PixelData<float>& a, const PixelData<float>& b, std::size_t p) {
    return same_pixel(a.radiance, b.radiance, p) && same_pixel(a.variance, b.variance, p) &&
           same_pixel(a.illumination, b.illumination, p) && same_pixel(a.normal, b.normal, p) &&
           same_pixel(a.depth, b.depth, p) && same_pixel(a.alpha, b.alpha, p) && same_pixel(a.samples, b.samples, p) &&
           same_pixel(a.material, b.material, p) && same_pixel(a.root_direct_variance, b.root_direct_variance, p) &&
           same_pixel(a.depth_variance, b.depth_variance, p) && same_pixel(a.halves, b.halves, p);
}

/// Whether every pixel is to the bit that of a film of its own number of samples.
void check_each_alone(const Film<float>& film, std::uint64_t end) {
    const PixelData<float> frame = film.resolve();
    for (std::size_t p = 0; p < side * side; ++p) {
        INFO("pixel ", p, " stops at ", stop_of(p));
        const std::uint64_t n = std::min(stop_of(p), end);
        REQUIRE(film.sample_count(p) == n);
        const auto alone = pass_of(0, n, [](std::size_t) { return never; }).resolve();
        REQUIRE(same_pixel(frame, alone, p));
    }
}

} // namespace

TEST_CASE("a pixel that stopped is to the bit that of a film of so many samples, whatever the others took") {
    for (const std::uint64_t end : {16u, 23u, 32u, 37u, 64u})
        for (std::uint64_t seed = 0; seed < 12; ++seed) {
            INFO("end ", end, " seed ", seed);
            std::vector<std::uint64_t> cuts = {2, 4, 8};
            if (seed % 3 == 1) cuts.insert(cuts.begin() + 1, 3);
            if (seed % 3 == 2) cuts.insert(cuts.end(), {10, 12});
            cuts.push_back(16);
            if (end > 23) cuts.push_back(23);
            if (end > 16) cuts.push_back(end);
            check_each_alone(film_of(cuts, stop_of, seed), end);
        }
    const Film<float> film = film_of({2, 4, 8, 16, 32}, stop_of);
    CHECK(film.blocks().size() == 1);
    std::uint64_t total = 0;
    for (std::size_t p = 0; p < side * side; ++p) total += std::min<std::uint64_t>(32, stop_of(p));
    CHECK(film.total_samples() == total);
    CHECK(film.sample_count() == 32);
}

TEST_CASE("where no pixel stops, stops take no memory; one that never began is black") {
    CHECK(film_of({2, 4, 16}, [](std::size_t) { return never; }).stops().empty());
    const Film<float> late = pass_of(8, 16, stop_of); // of itself: the pixels that stopped by 8 have nothing
    const PixelData<float> frame = late.resolve();
    for (std::size_t p = 0; p < side * side; ++p) {
        CHECK(frame.samples.values()[p] == (stop_of(p) > 8 ? 8.0f : 0.0f));
        if (stop_of(p) <= 8) CHECK(frame.radiance.values()[3 * p] == 0);
    }
}

TEST_CASE("stops that cannot be are refused, and the film stays as it was") {
    Film<float> film = film_of({2, 4}, stop_of);
    const PixelData<float> before = film.resolve();
    // All samples of all pixels: some of them have stopped.
    CHECK_THROWS_WITH_AS(film.merge(pass_of(4, 8, [](std::size_t) { return never; })),
                         doctest::Contains("stopped at sample 2 and has some of [4, 8)"), Error);
    CHECK(film.sample_count() == 4);
    for (std::size_t p = 0; p < side * side; ++p) CHECK(same_pixel(before, film.resolve(), p));
    // One that stopped before samples which the other film has of it.
    Film<float> late = pass_of(16, 32, [](std::size_t) { return never; });
    CHECK_THROWS_AS(late.merge(film_of({2, 4}, stop_of)), Error);
    // A pixel cannot stop in the midst of what it has.
    Film<float> half = film_of({8, 12}, [](std::size_t) { return never; });
    CHECK_THROWS_AS(half.merge(pass_of(12, 16, [](std::size_t p) { return p == 3 ? 12 : never; })), Error);
    CHECK_THROWS_AS(pass_of(0, 16, [](std::size_t p) { return p == 3 ? 0 : never; }), Error);
    const std::vector<std::uint8_t> one(1, 1);
    CHECK_THROWS_AS(FilmPass<float>(2, 2, FilmPlanes::radiance, 0, 1, ActivePixels(one.data(), 1, 1)), Error);
    using Stops = std::vector<Film<float>::Stop>;
    const auto restored = [&](const Stops& stops) {
        return Film<float>::restore(side, side, film.planes(), film.blocks(), film.material(), 0, stops);
    };
    CHECK(same_pixel(restored(film.stops()).resolve(), before, 3));
    CHECK_THROWS_AS(restored(Stops(5, 2)), Error);
    CHECK_THROWS_AS(restored(Stops(side * side, 32)), Error);
}

} // namespace stops_test
