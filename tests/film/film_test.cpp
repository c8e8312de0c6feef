#include "support/random.hpp"
#include <lambent/film/error_estimate.hpp>
#include <lambent/film/film.hpp>
#include <lambent/film/film_pass.hpp>
#include <support/statistics.hpp>
#include <doctest/doctest.h>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

using namespace lambent;
using lambent_test::Random;

namespace {

constexpr int width = 5, height = 3;
constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

/// What sample `index` of pixel (x, y) brings: light with a long tail, now and then a miss.
PixelSample<float> some_sample(int x, int y, std::uint64_t index) {
    Random random(std::uint64_t(y * width + x) * 1000003 + index);
    PixelSample<float> s;
    s.hit = random.uniform() < 0.9;
    for (int c = 0; c < 3; ++c) {
        s.emission[c] = random.uniform() < 0.1 ? 3.7f : 0.0f;
        s.radiance[c] = s.emission[c] + float(std::exp(6 * random.uniform() - 3));
        s.direct[c] = 0.3f * (s.radiance[c] - s.emission[c]);
        s.indirect[c] = 0.7f * (s.radiance[c] - s.emission[c]);
        if (!s.hit) continue;
        s.albedo[c] = random.uniform_float();
        s.normal[c] = 2 * random.uniform_float() - 1;
        s.position[c] = 20 * random.uniform_float() - 10;
    }
    if (s.hit) s.depth = 10 * random.uniform_float();
    s.material = random.below(7);
    return s;
}

/// Films the samples [begin, end) of every pixel, the pixels in an order of `order`'s choice.
template <class Sample>
Film<float> film_of(std::uint64_t begin, std::uint64_t end, Sample&& sample, FilmPlanes planes = FilmPlanes::features,
                    std::uint64_t order = 0) {
    FilmPass<float> pass(width, height, planes, begin, end);
    std::vector<int> pixels;
    for (int i = 0; i < width * height; ++i) pixels.push_back(i);
    Random random(order);
    for (std::uint32_t i = width * height; i-- > 1;) std::swap(pixels[i], pixels[random.below(i + 1)]);
    for (const int p : pixels) {
        FilmPass<float>::Pixel pixel(pass, p % width, p / width);
        for (std::uint64_t i = begin; i < end; ++i) pixel.add(sample(p % width, p / width, i));
    }
    return pass.finish();
}

/// One pixel, filmed in one pass.
template <class Radiance>
Film<float> one_pixel(std::uint64_t count, Radiance&& radiance) {
    FilmPass<float> pass(1, 1, FilmPlanes::radiance, 0, count);
    {
        FilmPass<float>::Pixel pixel(pass, 0, 0);
        for (std::uint64_t i = 0; i < count; ++i) {
            PixelSample<float> s;
            s.radiance = Vec3f(radiance(i));
            pixel.add(s);
        }
    }
    return pass.finish();
}

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
    return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0);
}

bool same_bits(const Film<float>& a, const Film<float>& b) {
    if (a.blocks().size() != b.blocks().size() || a.material() != b.material()) return false;
    for (std::size_t i = 0; i < a.blocks().size(); ++i)
        if (!(a.blocks()[i].samples == b.blocks()[i].samples) || !same_bits(a.blocks()[i].sums, b.blocks()[i].sums))
            return false;
    const PixelData<float> fa = a.resolve(), fb = b.resolve();
    return same_bits(fa.radiance.values(), fb.radiance.values()) &&
           same_bits(fa.variance.values(), fb.variance.values()) &&
           same_bits(fa.illumination.values(), fb.illumination.values()) &&
           same_bits(fa.position.values(), fb.position.values()) && same_bits(fa.normal.values(), fb.normal.values()) &&
           same_bits(fa.depth.values(), fb.depth.values()) && same_bits(fa.material.values(), fb.material.values());
}

template <int C>
bool all_finite(const Plane<float, C>& plane) {
    return std::all_of(plane.values().begin(), plane.values().end(), [](float v) { return is_finite(v); });
}

bool all_finite(const PixelData<float>& f) {
    return all_finite(f.radiance) && all_finite(f.emission) && all_finite(f.albedo) && all_finite(f.illumination) &&
           all_finite(f.normal) && all_finite(f.position) && all_finite(f.depth) && all_finite(f.variance);
}

} // namespace

TEST_CASE("dyadic blocks: aligned, without gaps, none that could be joined") {
    for (std::uint64_t begin = 0; begin < 70; ++begin)
        for (std::uint64_t end = begin; end < 140; ++end) {
            const std::vector<DyadicBlock> blocks = dyadic_blocks(begin, end);
            std::uint64_t next = begin;
            for (std::size_t i = 0; i < blocks.size(); ++i) {
                REQUIRE(blocks[i].first == next);
                REQUIRE(blocks[i].first % blocks[i].size() == 0);
                if (i > 0) REQUIRE(!blocks[i - 1].joins(blocks[i]));
                next = blocks[i].end();
            }
            REQUIRE(next == end);
        }
    CHECK(dyadic_blocks(0, 4096).size() == 1);
    CHECK(dyadic_blocks(1, (std::uint64_t(1) << 32) - 1).size() == 62);
    CHECK(dyadic_block_at(48, 1000, 64).size() == 16);
    CHECK(dyadic_block_at(64, 1000, 8).size() == 8);
    CHECK(dyadic_block_at(64, 67, 64).size() == 2);
}

TEST_CASE("F3: any split of the samples, merged in any order, pixels in any order: the same bits") {
    for (const std::uint64_t count : {1u, 2u, 7u, 16u, 37u, 64u}) {
        const Film<float> whole = film_of(0, count, some_sample);
        CHECK(whole.sample_count() == count);
        for (std::uint64_t seed = 0; seed < 40; ++seed) {
            INFO("count ", count, " seed ", seed);
            Random random(seed);
            std::vector<std::uint64_t> cuts = {0, count};
            for (std::uint32_t k = random.below(6); k > 0; --k) cuts.push_back(random.below(std::uint32_t(count) + 1));
            std::sort(cuts.begin(), cuts.end());
            cuts.erase(std::unique(cuts.begin(), cuts.end()), cuts.end());
            std::vector<Film<float>> parts;
            for (std::size_t i = 0; i + 1 < cuts.size(); ++i)
                parts.push_back(film_of(cuts[i], cuts[i + 1], some_sample, FilmPlanes::features, seed));
            while (parts.size() > 1) { // any two, in any order
                const std::size_t a = random.below(std::uint32_t(parts.size()));
                const std::size_t b = (a + 1 + random.below(std::uint32_t(parts.size()) - 1)) % parts.size();
                parts[a].merge(parts[b]);
                parts.erase(parts.begin() + std::ptrdiff_t(b));
            }
            REQUIRE(same_bits(whole, parts[0]));
        }
    }
}

TEST_CASE("a film knows what is in and what is missing") {
    Film<float> film = film_of(4, 9, some_sample);
    film.merge(film_of(9, 11, some_sample));
    film.merge(film_of(20, 21, some_sample));
    CHECK(film.ranges() == std::vector<SampleRange>{{4, 11}, {20, 21}});
    CHECK(film.missing({0, 30}) == std::vector<SampleRange>{{0, 4}, {11, 20}, {21, 30}});
    CHECK(film.missing({5, 10}).empty());
    CHECK(film.missing({10, 15}) == std::vector<SampleRange>{{11, 15}});
    CHECK(film.missing({0, 2}) == std::vector<SampleRange>{{0, 2}});
    CHECK(Film<float>(2, 2, FilmPlanes::radiance).missing({3, 5}) == std::vector<SampleRange>{{3, 5}});
    CHECK_THROWS_AS(film.merge(film_of(10, 12, some_sample)), Error);
    CHECK_THROWS_AS(film.merge(film_of(0, 2, some_sample, FilmPlanes::albedo)), Error);
    CHECK_THROWS_AS(film.merge(Film<float>(width, height + 1, FilmPlanes::features)), Error);
    CHECK(film.sample_count() == 8);
}

TEST_CASE("the mean of 5 million samples: relative error at most 1e-6 against double") {
    constexpr std::uint64_t count = (std::uint64_t(1) << 22) + 1048577;
    Random random(11);
    double sum = 0;
    const Film<float> film = one_pixel(count, [&](std::uint64_t) {
        const auto value = float(-std::log(1 - random.uniform())); // exponential, mean 1
        sum += double(value);
        return value;
    });
    const double mean = double(film.resolve().radiance.load(0, 0).x);
    CHECK(std::abs(mean / (sum / double(count)) - 1) <= 1e-6);
}

TEST_CASE("variance of the mean: two-pass double, also where the mean is 10^4 deviations away") {
    for (const double offset : {0.0, 1.0, 100.0, 1e4})
        for (const std::uint64_t count : {2u, 3u, 64u, 1000u, 4096u, 100001u}) {
            INFO("offset ", offset, " count ", count);
            std::vector<double> values;
            Random random(count);
            for (std::uint64_t i = 0; i < count; ++i) values.push_back(double(float(offset + random.uniform(-1, 1))));
            double mean = 0, squares = 0;
            for (const double v : values) mean += v / double(count);
            for (const double v : values) squares += (v - mean) * (v - mean);
            const double expected = squares / double(count - 1) / double(count);
            const Film<float> film = one_pixel(count, [&](std::uint64_t i) { return float(values[i]); });
            CHECK(double(film.resolve().variance.load(0, 0).y) == doctest::Approx(expected).epsilon(1e-3));
        }
}

TEST_CASE("variance of the mean: uniform numbers give 1 / 12 n, equal ones exactly 0, never less") {
    constexpr std::uint64_t count = 1 << 18;
    Random random(5);
    const Film<float> uniform = one_pixel(count, [&](std::uint64_t) { return random.uniform_float(); });
    // The sample variance of n uniform numbers has a relative deviation of sqrt((9/5 - 1) / n) = 0.17 %.
    CHECK(double(uniform.resolve().variance.load(0, 0).x) * 12 * double(count) == doctest::Approx(1).epsilon(0.007));
    for (const float value : {0.0f, 1e-30f, 0.1f, 12345.678f, 1e15f}) {
        const Film<float> equal = one_pixel(4095, [&](std::uint64_t) { return value; });
        CHECK(double(equal.resolve().variance.load(0, 0).x) >= 0);
        CHECK(double(equal.resolve().variance.load(0, 0).x) <= 1e-13 * double(value) * double(value));
        const Film<float> power_of_two = one_pixel(4096, [&](std::uint64_t) { return value; });
        CHECK(power_of_two.resolve().variance.load(0, 0).x == 0);
    }
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
        Random r(seed);
        const float base = float(std::exp(r.uniform(-30, 30)));
        const Film<float> film = one_pixel(2 + r.below(50), [&](std::uint64_t) { return base * (1 + 1e-7f * r.uniform_float()); });
        CHECK(film.resolve().variance.load(0, 0).x >= 0);
    }
}

TEST_CASE("the estimated error of pure noise is its closed form") {
    // Every pixel has mean 1/2 and variance of the mean 1/12n: sqrt((1/12n) / (1/4 · 1.01)).
    constexpr std::uint64_t count = 4096;
    Random random(3);
    const Film<float> film = film_of(0, count, [&](int, int, std::uint64_t) {
        PixelSample<float> s;
        for (int c = 0; c < 3; ++c) s.radiance[c] = random.uniform_float();
        return s;
    });
    const double expected = std::sqrt(1.0 / 12 / double(count) / (0.25 * 1.01));
    CHECK(estimated_error(film.resolve()) == doctest::Approx(expected).epsilon(0.02));
    CHECK(estimated_error(film_of(0, 1, some_sample).resolve()) < 0);
}

TEST_CASE("samples that are not finite are counted and do not spread") {
    const auto broken = [](int x, int y, std::uint64_t index) {
        PixelSample<float> s = some_sample(x, y, index);
        if (x != 2 || y != 1) return s;
        switch (index) {
        case 0: s.radiance.y = not_a_number; break;
        case 1: s.radiance.x = infinity; break;
        case 2: s.emission.z = -infinity; break;
        case 3: s.position.x = not_a_number; break;
        case 4: s.depth = infinity; break;
        default: break;
        }
        return s;
    };
    // What should be left: black light, features of a miss.
    const auto mended = [&](int x, int y, std::uint64_t index) {
        PixelSample<float> s = some_sample(x, y, index);
        if (x != 2 || y != 1) return s;
        if (index < 3) s.radiance = s.emission = Vec3f(0);
        if (index == 3 || index == 4) {
            s.albedo = s.normal = s.position = Vec3f(0);
            s.depth = 0;
            s.hit = false;
        }
        return s;
    };
    Film<float> film = film_of(0, 8, broken);
    CHECK(film.rejected() == 5);
    CHECK(same_bits(film, film_of(0, 8, mended)));
    CHECK(all_finite(film.resolve()));
    film.merge(film_of(8, 16, some_sample));
    CHECK(film.rejected() == 5);
    CHECK(film_of(0, 8, some_sample).rejected() == 0);
}

TEST_CASE("sums that overflow resolve to finite numbers") {
    Film<float> film = one_pixel(37, [](std::uint64_t i) { return i % 3 == 0 ? 3e38f : 0.5f; });
    const PixelData<float> frame = film.resolve();
    CHECK(film.rejected() == 0);
    CHECK(all_finite(frame));
    CHECK(frame.radiance.load(0, 0).x > 1e36f);
    CHECK(all_finite(film_of(0, 3, some_sample).resolve(Vec3d(1e39, -1e300, 0)))); // positions that float cannot hold
    CHECK(frame.variance.load(0, 0).x >= 0);
}

TEST_CASE("F3: misses hold the documented values, all of them finite") {
    const auto sky = [](int x, int, std::uint64_t index) {
        PixelSample<float> s;
        s.radiance = s.emission = Vec3f(0.25f, 0.5f, 1.0f);
        if (x > 0 && index % 2 == 0) { // every other sample meets a wall
            s.hit = true;
            s.radiance = Vec3f(1);
            s.emission = Vec3f(0);
            s.albedo = Vec3f(0.5f);
            s.normal = Vec3f(0, 0, 1);
            s.position = Vec3f(float(x), 2, 3);
            s.depth = 4;
            s.material = 6;
        }
        return s;
    };
    const PixelData<float> frame = film_of(0, 8, sky).resolve(Vec3d(100, 0, 0));
    CHECK(all_finite(frame));
    CHECK(frame.radiance.load(0, 0) == Vec3f(0.25f, 0.5f, 1.0f));
    CHECK(frame.emission.load(0, 0) == frame.radiance.load(0, 0));
    for (const Plane<float, 3>* plane : {&frame.albedo, &frame.illumination, &frame.normal, &frame.position, &frame.variance})
        CHECK(plane->load(0, 1) == Vec3f(0));
    CHECK(frame.depth.load(0, 0) == 0);
    CHECK(frame.alpha.load(0, 0) == 0);
    CHECK(frame.material.load(0, 0) == -1);
    // Half a miss: positions and distances are of the hits alone, the rest of all samples.
    CHECK(frame.alpha.load(2, 0) == 0.5f);
    CHECK(frame.position.load(2, 0) == Vec3f(102, 2, 3));
    CHECK(frame.depth.load(2, 0) == 4);
    CHECK(frame.normal.load(2, 0) == Vec3f(0, 0, 0.5f));
    CHECK(frame.albedo.load(2, 0) == Vec3f(0.25f));
    CHECK(frame.material.load(2, 0) == 6);
    CHECK(frame.samples.load(2, 0) == 8);
}

TEST_CASE("F1: illumination times albedo plus emission gives the radiance back, also without albedo") {
    const auto dark = [](int x, int y, std::uint64_t index) {
        PixelSample<float> s = some_sample(x, y, index);
        if (x == 0) s.albedo = Vec3f(0);         // a black thing: light that nothing explains
        if (x == 1) s.albedo = Vec3f(0, 1, 0.5f);
        return s;
    };
    const PixelData<float> frame = film_of(0, 16, dark).resolve();
    CHECK(all_finite(frame.illumination));
    Plane<float, 3> back(width, height);
    remodulate(frame.view(), frame.illumination.view(), back.view());
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < 3; ++c)
                CHECK(double(back.load(x, y)[c]) == doctest::Approx(double(frame.radiance.load(x, y)[c])).epsilon(1e-5));
    CHECK(frame.illumination.load(0, 0).x <= frame.radiance.load(0, 0).x * 1001);
}

TEST_CASE("planes that nobody asked for are absent and take no memory") {
    const Film<float> bare = film_of(0, 8, some_sample, FilmPlanes::radiance);
    CHECK(bare.channels() == 7);
    CHECK(bare.blocks()[0].sums.size() == 7 * width * height);
    CHECK(bare.material().empty());
    const PixelData<float> frame = bare.resolve();
    CHECK(!frame.radiance.absent());
    CHECK(!frame.variance.absent());
    CHECK((frame.emission.absent() && frame.albedo.absent() && frame.illumination.absent() && frame.normal.absent() &&
           frame.position.absent() && frame.depth.absent() && frame.material.absent()));

    const PixelData<float> some = film_of(0, 8, some_sample, FilmPlanes::normal | FilmPlanes::depth).resolve();
    CHECK(!some.normal.absent());
    CHECK(!some.depth.absent());
    CHECK((some.emission.absent() && some.albedo.absent() && some.position.absent() && some.material.absent()));

    const PixelData<float> all = film_of(0, 8, some_sample).resolve();
    CHECK(same_bits(all.radiance.values(), frame.radiance.values()));
    CHECK(same_bits(all.variance.values(), frame.variance.values()));
    CHECK(same_bits(all.normal.values(), some.normal.values()));
    CHECK(same_bits(all.depth.values(), some.depth.values()));
    const PixelData<float> lit = film_of(0, 8, some_sample, FilmPlanes::illumination).resolve();
    CHECK(same_bits(all.illumination.values(), lit.illumination.values()));
    CHECK(lit.normal.absent());
}

TEST_CASE("F14: the clamp of a sample is monotone, keeps its hue and the light seen directly, and is nothing when off") {
    float last = 0;
    for (float light = 0; light < 60; light += 0.37f) {
        PixelSample<float> s;
        s.emission = Vec3f(100, 0, 0);
        s.radiance = s.emission + Vec3f(light, light / 2, light / 4);
        const PixelSample<float> before = s;
        clamp_reflected(s, infinity);
        CHECK(std::memcmp(&s.radiance, &before.radiance, sizeof(Vec3f)) == 0);
        clamp_reflected(s, 25.0f);
        CHECK(s.radiance.y >= last * 0.99999f); // up to rounding
        CHECK(s.radiance.y <= 12.5001f);
        CHECK(double(s.radiance.y) == doctest::Approx(2 * double(s.radiance.z)));
        CHECK(s.radiance.x >= 100);
        last = s.radiance.y;
    }
}

TEST_CASE("statistics: moments of the roots of light and of features against two passes in double; any split, same bits") {
    constexpr std::uint64_t count = 37;
    const Film<float> film = film_of(0, count, some_sample, FilmPlanes::statistics);
    Film<float> parts = film_of(8, count, some_sample, FilmPlanes::statistics, 3);
    parts.merge(film_of(0, 8, some_sample, FilmPlanes::statistics, 5));
    const PixelData<float> frame = film.resolve(), merged = parts.resolve();
    CHECK(frame.root_indirect_variance.values() == merged.root_indirect_variance.values());
    CHECK(frame.depth_variance.values() == merged.depth_variance.values());
    const auto check = [&](int x, int y, auto&& of, double mean_found, double variance_found) {
        double mean = 0, squares = 0;
        for (std::uint64_t i = 0; i < count; ++i) mean += of(some_sample(x, y, i)) / double(count);
        for (std::uint64_t i = 0; i < count; ++i) squares += std::pow(of(some_sample(x, y, i)) - mean, 2);
        if (mean_found >= 0) CHECK(mean_found == doctest::Approx(mean).epsilon(1e-5));
        CHECK(variance_found == doctest::Approx(squares / double(count * (count - 1))).epsilon(1e-4));
    };
    using S = PixelSample<float>;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < 3; ++c) {
                check(x, y, [&](const S& s) { return std::sqrt(double(s.direct[c])); }, double(frame.root_direct.load(x, y)[c]),
                      double(frame.root_direct_variance.load(x, y)[c]));
                check(x, y, [&](const S& s) { return std::sqrt(double(s.indirect[c])); },
                      double(frame.root_indirect.load(x, y)[c]), double(frame.root_indirect_variance.load(x, y)[c]));
                check(x, y, [&](const S& s) { return double(s.albedo[c]); }, double(frame.albedo.load(x, y)[c]),
                      double(frame.albedo_variance.load(x, y)[c]));
                check(x, y, [&](const S& s) { return double(s.normal[c]); }, -1, double(frame.normal_variance.load(x, y)[c]));
                check(x, y, [&](const S& s) { return double(s.depth); }, -1, double(frame.depth_variance.load(x, y)));
                CHECK(frame.direct.load(x, y)[c] + frame.indirect.load(x, y)[c] + frame.emission.load(x, y)[c] ==
                      doctest::Approx(frame.radiance.load(x, y)[c]).epsilon(1e-5));
            }
    // Halves of the largest block, of the first 32 samples.
    CHECK(frame.halves.values() == merged.halves.values());
    CHECK(frame.root_direct_halves.values() == merged.root_direct_halves.values());
    const auto between = [&](int x, int y, auto&& of) {
        double sum = 0;
        for (int c = 0; c < 3; ++c) {
            double halves[2] = {0, 0};
            for (std::uint64_t i = 0; i < 32; ++i) halves[i / 16] += of(some_sample(x, y, i), c) / 16;
            sum += std::pow(halves[0] - halves[1], 2) / 4;
        }
        return sum * 32 / double(count);
    };
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const auto summed = between(x, y, [](const S& s, int c) { return double(s.radiance[c]); });
            const Vec3d found(frame.halves.load(x, y));
            CHECK(found.x + found.y + found.z == doctest::Approx(summed).epsilon(1e-3));
            const auto direct = between(x, y, [](const S& s, int c) { return std::sqrt(double(s.direct[c])); });
            CHECK(double(frame.root_direct_halves.load(x, y)) == doctest::Approx(direct).epsilon(1e-3));
            const auto indirect = between(x, y, [](const S& s, int c) { return std::sqrt(double(s.indirect[c])); });
            CHECK(double(frame.root_indirect_halves.load(x, y)) == doctest::Approx(indirect).epsilon(1e-3));
        }
    CHECK(film_of(0, 4, some_sample).resolve().root_direct.view().absent());
    CHECK(film_of(0, 4, some_sample).channels() == 20);
}

TEST_CASE("a film put together from its parts is the same; from wrong parts it is refused") {
    const Film<float> film = film_of(0, 13, some_sample);
    const auto restored = [&](auto&& change) {
        std::vector<Film<float>::Block> blocks = film.blocks();
        std::vector<std::int32_t> material = film.material();
        change(blocks, material);
        return Film<float>::restore(width, height, film.planes(), blocks, material, 0);
    };
    CHECK(same_bits(film, restored([](auto&, auto&) {})));
    CHECK_THROWS_AS(restored([](auto& b, auto&) { std::swap(b[0], b[1]); }), Error);
    CHECK_THROWS_AS(restored([](auto& b, auto&) { b[1].samples.first += 1; }), Error);
    CHECK_THROWS_AS(restored([](auto& b, auto&) { b[1].samples.level = 60; }), Error);
    CHECK_THROWS_AS(restored([](auto& b, auto&) { b[0].sums.pop_back(); }), Error);
    CHECK_THROWS_AS(restored([](auto& b, auto&) { b[1].samples = {8, 3}, b.pop_back(); }), Error); // joins the first
    CHECK_THROWS_AS(restored([](auto&, auto& m) { m.pop_back(); }), Error);
    CHECK_THROWS_AS(Film<float>(0, 3, FilmPlanes::radiance), Error);
    CHECK_THROWS_AS(Film<float>(3, -1, FilmPlanes::radiance), Error);
}
