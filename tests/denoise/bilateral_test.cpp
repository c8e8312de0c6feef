#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <denoise/bilateral_cases.hpp>
#include <doctest/doctest.h>
#include <lambent/core/parallel.hpp>

using namespace lambent;
using namespace lambent_test;

namespace {

/// The filter written down as the formula says, in double: the oracle of the naive form.
Plane<double, 3> formula(const Planes<double>& planes, int kernel, double spatial, double illumination, double position,
                         double normal, double material) {
    Plane<double, 3> out(planes.width(), planes.height());
    const int radius = kernel / 2;
    const auto square = [](double x, double sigma) { return x * x / (2 * sigma * sigma); };
    for (int y = 0; y < out.height(); ++y)
        for (int x = 0; x < out.width(); ++x) {
            Vec3d sum(0);
            double weights = 0;
            for (int v = std::max(0, y - radius); v <= std::min(out.height() - 1, y + radius); ++v)
                for (int u = std::max(0, x - radius); u <= std::min(out.width() - 1, x + radius); ++u) {
                    const double weight = std::exp(
                        -square(std::hypot(u - x, v - y), spatial) -
                        square(length(planes.image.load(u, v) - planes.image.load(x, y)), illumination) -
                        square(length(planes.position.load(u, v) - planes.position.load(x, y)), position) -
                        square(1 - dot(planes.normal.load(u, v), planes.normal.load(x, y)), normal) -
                        square(planes.material.load(u, v) == planes.material.load(x, y) ? 0 : 1, material));
                    sum += weight * planes.image.load(u, v);
                    weights += weight;
                }
            out.view().store(x, y, sum / weights);
        }
    return out;
}

template <class T>
Planes<double> widened(const Planes<T>& planes) {
    Planes<double> out(planes.width(), planes.height());
    const auto copy = [](const auto& from, auto& to) { std::copy(from.values().begin(), from.values().end(), to.values().begin()); };
    copy(planes.image, out.image);
    copy(planes.normal, out.normal);
    copy(planes.position, out.position);
    copy(planes.material, out.material);
    return out;
}

template <class T>
void flip(Plane<T, 3>& plane, bool horizontal) {
    const Plane<T, 3> from = plane;
    for (int y = 0; y < plane.height(); ++y)
        for (int x = 0; x < plane.width(); ++x)
            plane.view().store(x, y, horizontal ? from.load(plane.width() - 1 - x, y) : from.load(x, plane.height() - 1 - y));
}

/// A feature that tells nothing apart and counts the weights in which one marked pixel takes part.
struct Counter {
    using Scalar = float;
    static constexpr int channels = 1;
    int size, mark;
    std::size_t* as_center;
    std::size_t* as_tap;
    int width() const { return size; }
    int height() const { return size; }
    bool active() const { return true; }
    std::array<float, 1> prepare(int x, int y) const { return {x == mark && y == mark ? 1.0f : 0.0f}; }
    template <class P>
    P add_distance2(const P* a, const P* b, P sum) const {
        for (int l = 0; l < P::width; ++l) {
            *as_center += a[0][l] == 1 ? 1u : 0u;
            *as_tap += b[0][l] == 1 ? 1u : 0u;
        }
        return sum;
    }
};

bool same_bits(const Plane<float, 3>& a, const Plane<float, 3>& b) {
    return a.values().size() == b.values().size() &&
           std::memcmp(a.values().data(), b.values().data(), a.values().size() * sizeof(float)) == 0;
}

} // namespace

TEST_CASE_TEMPLATE("the forms over the whole window are the formula", T, float, double) {
    for (const auto& size : {std::pair{23, 19}, {40, 7}, {1, 30}, {30, 1}, {3, 2}, {1, 1}}) {
        const int width = size.first, height = size.second;
        CAPTURE(width);
        CAPTURE(height);
        const Planes<T> planes = random_planes<T>(width, height, 7);
        for (const int kernel : {3, 15, 65}) {
            const auto expected = formula(widened(planes), kernel, 3, 2, 0.7, 0.4, 0.6);
            for (const auto form : {BilateralForm::naive_2d, BilateralForm::reuse_2d}) {
                const auto result = filter(planes, {.kernel = kernel, .sigma_spatial = 3, .sigma_illumination = 2, .form = form},
                                           0.7, 0.4, 0.6);
                CHECK(largest_relative_difference(result, expected) < (std::is_same_v<T, float> ? 1e-5 : 1e-12));
            }
        }
    }
}

TEST_CASE("F8: with all sigmas infinite every form is the 2D Gaussian") {
    const Planes<float> planes = random_planes<float>(41, 33, 3);
    const auto expected = formula(widened(planes), 31, 4, infinity, infinity, infinity, infinity);
    for (const auto form : all_forms)
        CHECK(largest_relative_difference(
                  filter(planes, {.kernel = 31, .sigma_spatial = 4, .form = form}, infinity, infinity, infinity),
                  expected) < 1e-5);
}

TEST_CASE("F8, F9, F10: a pixel weighs 65 + 65 taps instead of 65 * 65, its own two free; re-use halves both") {
    constexpr int size = 96;
    Plane<float, 3> image(size, size, 1), out(size, size);
    image.view().store(0, 0, Vec3f(2)); // a constant image would not be filtered
    SerialExecutor serial;
    const auto counts = [&](BilateralForm form) {
        std::size_t as_center = 0, as_tap = 0;
        const Counter counter{size, size / 2, &as_center, &as_tap};
        cross_bilateral<float>(image.view(), out.view(), {.kernel = 65, .form = form}, serial, counter);
        return std::pair{as_center, as_tap};
    };
    const auto naive = counts(BilateralForm::naive_2d), separable = counts(BilateralForm::separable);
    CHECK(naive.first == 65 * 65 - 1);
    CHECK(naive.second == 65 * 65 - 1);
    CHECK(separable.first == 2 * (65 - 1));
    CHECK(separable.second == 2 * (65 - 1));
    const auto pairs = counts(BilateralForm::reuse_2d), line_pairs = counts(BilateralForm::separable_reuse);
    CHECK(2 * (pairs.first + pairs.second) == naive.first + naive.second);
    CHECK(2 * (line_pairs.first + line_pairs.second) == separable.first + separable.second);
}

TEST_CASE(
    "F9: along lines, re-used weights give the same bits; F10: over windows the same but for rounding") {
    for (const auto& size : {std::pair{97, 73}, {300, 5}, {5, 300}, {17, 1}, {1, 17}}) {
        const int width = size.first, height = size.second;
        CAPTURE(width);
        CAPTURE(height);
        const Planes<float> planes = random_planes<float>(width, height, 11);
        for (const auto guide : {SecondPassGuide::input, SecondPassGuide::first_pass})
            CHECK(same_bits(filter(planes, seed_options(BilateralForm::separable_reuse, guide)),
                            filter(planes, seed_options(BilateralForm::separable, guide))));
        CHECK(largest_relative_difference(filter(planes, seed_options(BilateralForm::reuse_2d)),
                                          filter(planes, seed_options(BilateralForm::naive_2d))) < 5e-6);
    }
}

TEST_CASE("float gives what double gives, to 1e-5") {
    const Planes<float> planes = random_planes<float>(150, 40, 21);
    for (const auto form : all_forms)
        CHECK(largest_relative_difference(filter(planes, seed_options(form)),
                                          filter(widened(planes), seed_options(form))) < 1e-5);
}

TEST_CASE("a window takes its taps from outside and leaves the rest alone") {
    const Planes<float> planes = random_planes<float>(90, 60, 13);
    for (const auto form : all_forms) {
        CrossBilateralOptions options = seed_options(form);
        options.kernel = 21;
        const auto whole = filter(planes, options);
        for (const PixelWindow& window :
             {PixelWindow{0, 0, 90, 60}, {30, 17, 63, 40}, {0, 50, 11, 60}, {89, 0, 90, 1}}) {
            CAPTURE(window.x0);
            CAPTURE(int(form));
            options.window = window;
            const auto part = filter(planes, options);
            // Lines give the same bits; windows sum in another order.
            const float tolerance =
                form == BilateralForm::naive_2d || form == BilateralForm::reuse_2d ? 1e-5f : 0.0f;
            int wrong = 0;
            for (int y = 0; y < 60; ++y)
                for (int x = 0; x < 90; ++x) {
                    const bool in = x >= window.x0 && x < window.x1 && y >= window.y0 && y < window.y1;
                    const Vec3f expected = in ? whole.load(x, y) : Vec3f(0);
                    wrong += length(part.load(x, y) - expected) > tolerance * length(expected) ? 1 : 0;
                }
            CHECK(wrong == 0);
        }
        for (const PixelWindow& window :
             {PixelWindow{-1, 0, 4, 4}, {0, 0, 91, 4}, {0, 0, 4, 61}, {4, 4, 4, 8}, {8, 8, 4, 9}}) {
            options.window = window;
            CHECK_THROWS_AS(filter(planes, options), Error);
        }
    }
}

TEST_CASE("planar, interleaved and padded buffers give the same bits") {
    const Planes<float> planes = random_planes<float>(61, 43, 17);
    const auto expected = filter(planes, seed_options(BilateralForm::separable_reuse));
    struct Pixel {
        float color[3], normal[3], position[3], material, out[3], padding;
    };
    std::vector<Pixel> pixels(64 * 43);
    std::vector<float> planar(3 * 61 * 43);
    for (int y = 0; y < 43; ++y)
        for (int x = 0; x < 61; ++x)
            for (int c = 0; c < 3; ++c) {
                Pixel& p = pixels[std::size_t(64 * y + x)];
                p.color[c] = planar[std::size_t((c * 43 + y) * 61 + x)] = planes.image.load(x, y)[c];
                p.normal[c] = planes.normal.load(x, y)[c];
                p.position[c] = planes.position.load(x, y)[c];
                p.material = planes.material.load(x, y);
            }
    constexpr std::ptrdiff_t pixel = sizeof(Pixel) / sizeof(float);
    const auto view = [&](float* first) {
        return rgb_view(first, 61, 43, {.pixel = pixel, .row = 64 * pixel});
    };
    SerialExecutor serial;
    for (const auto& color : {view(pixels[0].color),
                              rgb_view(planar.data(), 61, 43, {.pixel = 1, .row = 61, .channel = 61 * 43})}) {
        cross_bilateral<float>(
            color, view(pixels[0].out), seed_options(BilateralForm::separable_reuse), serial,
            DistanceFeature<float>(view(pixels[0].position), 2),
            NormalFeature<float>(view(pixels[0].normal), 0.5),
            IdentityFeature<float>(
                scalar_view(&pixels[0].material, 61, 43, {.pixel = pixel, .row = 64 * pixel}), 0.5));
        for (int y = 0; y < 43; ++y)
            for (int x = 0; x < 61; ++x) REQUIRE(view(pixels[0].out).load(x, y) == expected.load(x, y));
    }
}

TEST_CASE_TEMPLATE("Gaussians of squared distances, one or four packs at a time", T, float, double) {
    using P = FeaturePack<T>;
    // Without fma the product of exponent and scale is rounded once more.
    const double bound = sizeof(T) == 4 ? 2e-7 : 1e-15;
    const double slope = (LAMBENT_HAS_FMA ? 1 : 3) * (sizeof(T) == 4 ? 3e-8 : 1e-16);
    for (double d = 0; d < 170; d += 0.371) {
        P four[4] = {P(T(d)), P(T(2 * d)), P(T(0)), P(T(infinity))}, one = four[0];
        const double x = 0.5 * double(four[0][0]);
        gaussians<4>(four);
        gaussians<1>(&one);
        REQUIRE(std::abs(double(one[0]) / std::exp(-x) - 1) < bound + slope * x);
        REQUIRE(one[0] == four[0][0]);
        REQUIRE(four[2][0] == 1);
        REQUIRE(four[3][P::width - 1] == 0);
    }
}

TEST_CASE("F11: a constant image is a fixed point, whatever its features") {
    Planes<float> planes = random_planes<float>(50, 37, 5);
    for (std::size_t i = 0; i < planes.image.values().size(); ++i) planes.image.values()[i] = i % 3 == 0 ? 3.7f : 0.01f;
    for (const auto form : all_forms) CHECK(same_bits(filter(planes, seed_options(form)), planes.image));
    // Nor is the last pixel forgotten, and what is filtered keeps a constant within its rounding.
    for (const auto form : all_forms) {
        Planes<float> other = planes;
        other.image.view().store(49, 36, Vec3f(4, 0.01f, 0.01f));
        const auto result = filter(other, seed_options(form));
        CHECK(result.load(49, 36).x < 4);
        double largest = 0;
        for (int y = 0; y < 37; ++y)
            for (int x = 0; x < 50 - 33; ++x)
                largest = std::max(largest, std::abs(double(result.load(x, y).x) / 3.7f - 1));
        CHECK(largest < 1e-6);
    }
}

TEST_CASE("F11: the mirrored image gives the mirrored result") {
    const Planes<float> planes = random_planes<float>(45, 38, 9);
    for (const auto form : all_forms)
        for (const bool horizontal : {false, true}) {
            Planes<float> mirrored = planes;
            for (auto* plane : {&mirrored.image, &mirrored.normal, &mirrored.position}) flip(*plane, horizontal);
            for (int y = 0; y < planes.height(); ++y)
                for (int x = 0; x < planes.width(); ++x)
                    mirrored.material.view().store(x, y, horizontal ? planes.material.load(planes.width() - 1 - x, y)
                                                                    : planes.material.load(x, planes.height() - 1 - y));
            Plane<float, 3> result = filter(mirrored, seed_options(form));
            flip(result, horizontal);
            CHECK(largest_relative_difference(result, filter(planes, seed_options(form))) < 1e-5);
        }
}

TEST_CASE("F12: kernel 0 gives every bit back, NaNs too; other sizes that are not odd are refused") {
    Planes<float> planes = random_planes<float>(21, 13, 2);
    planes.image.values()[40] = std::numeric_limits<float>::quiet_NaN();
    planes.image.values()[41] = -infinity;
    planes.image.values()[42] = -0.0f;
    for (const auto form : all_forms) {
        CrossBilateralOptions options = seed_options(form);
        options.kernel = 0;
        CHECK(same_bits(filter(planes, options), planes.image));
        for (const int kernel : {2, 64, -1, -65}) {
            options.kernel = kernel;
            CHECK_THROWS_AS(filter(planes, options), Error);
        }
    }
}

TEST_CASE("F13: the illumination sigma steers the filter at run time") {
    const Planes<float> planes = random_planes<float>(40, 40, 6);
    const auto with = [&](double sigma) { return filter(planes, seed_options(BilateralForm::separable_reuse, {}, sigma)); };
    CHECK(largest_difference(with(25), with(50)) > 1e-3);
    CHECK(largest_difference(with(1e-6), planes.image) < 1e-6);
}

TEST_CASE("1, 2 and 7 threads give the same bits, in place too") {
    const Planes<float> planes = random_planes<float>(133, 71, 4);
    ThreadExecutor two(2), seven(7);
    for (const auto form : all_forms) {
        const auto expected = filter(planes, seed_options(form));
        CHECK(same_bits(filter(planes, seed_options(form), two), expected));
        CHECK(same_bits(filter(planes, seed_options(form), seven), expected));
        Plane<float, 3> image = planes.image;
        cross_bilateral<float>(image.view(), image.view(), seed_options(form), seven,
                               DistanceFeature<float>(planes.position.view(), 2),
                               NormalFeature<float>(planes.normal.view(), 0.5),
                               IdentityFeature<float>(planes.material.view(), 0.5));
        CHECK(same_bits(image, expected));
    }
}

TEST_CASE("what is not finite stays within the kernel's radius, and no output is") {
    const Planes<float> clean = random_planes<float>(80, 60, 8);
    constexpr int x = 37, y = 29, radius = 8;
    CrossBilateralOptions options = seed_options(BilateralForm::naive_2d);
    options.kernel = 2 * radius + 1;
    for (const auto form : all_forms) {
        options.form = form;
        const auto expected = filter(clean, options);
        const auto check = [&](const Planes<float>& broken) {
            const auto result = filter(broken, options);
            for (int v = 0; v < clean.height(); ++v)
                for (int u = 0; u < clean.width(); ++u) {
                    REQUIRE(is_finite(result.load(u, v)));
                    if (std::max(std::abs(u - x), std::abs(v - y)) > radius) REQUIRE(result.load(u, v) == expected.load(u, v));
                }
        };
        for (const float bad : {std::numeric_limits<float>::quiet_NaN(), float(infinity), -float(infinity)}) {
            Planes<float> broken = clean;
            broken.image.view().store(x, y, Vec3f(1, bad, 1));
            check(broken);
            broken = clean;
            broken.position.view().store(x, y, Vec3f(bad));
            check(broken);
            broken = clean;
            broken.normal.view().store(x, y, Vec3f(bad, 0, 0));
            check(broken);
        }
    }
}

TEST_CASE("E3: a large kernel with hard stops leaks nothing over an edge") {
    Planes<float> planes(64, 40);
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 64; ++x) planes.image.view().store(x, y, Vec3f(x < 32 ? 1.0f : 0.0f));
    const auto leak = [&](const Planes<float>& p, BilateralForm form, double position, double normal, double material) {
        const auto out = filter(p, {.kernel = 65, .sigma_spatial = 10, .form = form}, position, normal, material);
        double worst = 0;
        for (int y = 0; y < 40; ++y)
            for (int x = 0; x < 64; ++x) worst = std::max(worst, std::abs(double(out.load(x, y).x) - (x < 32 ? 1 : 0)));
        return worst;
    };
    for (const auto form : all_forms) {
        Planes<float> edge = planes;
        for (int y = 0; y < 40; ++y)
            for (int x = 0; x < 64; ++x) edge.material.view().store(x, y, x < 32 ? 1.0f : 2.0f);
        CHECK(leak(edge, form, infinity, infinity, hard_stop) < 1e-6);
        CHECK(leak(edge, form, infinity, infinity, 0.5) > 0.01); // the original's, for comparison
        edge = planes;
        for (int y = 0; y < 40; ++y)
            for (int x = 0; x < 64; ++x) edge.normal.view().store(x, y, x < 32 ? Vec3f(1, 0, 0) : Vec3f(0, 0, 1));
        CHECK(leak(edge, form, infinity, 0.2, infinity) < 0.01);
        edge = planes;
        for (int y = 0; y < 40; ++y)
            for (int x = 0; x < 64; ++x) edge.position.view().store(x, y, Vec3f(0, 0, x < 32 ? 0.0f : 1.0f));
        CHECK(leak(edge, form, 0.2, infinity, infinity) < 0.01);
    }
}

TEST_CASE("K1: a firefly leaves no stripe: the separable forms spread it down as far as across") {
    // A first pass that has spread it changes what the second weighs by; the input as guide does not.
    for (const auto guide : {SecondPassGuide::input, SecondPassGuide::first_pass})
        for (const double dot : {20.0, 1000.0, 4235.0})
            for (const auto form : all_forms) {
                Planes<double> planes(97, 97);
                for (double& v : planes.image.values()) v = 0.28;
                planes.image.view().store(48, 48, Vec3d(dot));
                suppress_fireflies_seed(planes.image.view(), 25);
                CrossBilateralOptions options = seed_options(form, guide);
                options.second_pass_factor = 1;
                const auto out = filter(planes, options);
                double across = 0, down = 0, energy = 0;
                for (int y = 0; y < 97; ++y)
                    for (int x = 0; x < 97; ++x) {
                        const double excess = out.load(x, y).x - 0.28;
                        across += excess * (x - 48) * (x - 48);
                        down += excess * (y - 48) * (y - 48);
                        energy += excess;
                    }
                CAPTURE(dot);
                CAPTURE(int(form));
                CAPTURE(int(guide));
                CAPTURE(energy);
                const double tolerance = guide == SecondPassGuide::input ? 0.1 : 0.25;
                if (energy > 1e-6) CHECK(across == doctest::Approx(down).epsilon(tolerance));
            }
}

TEST_CASE("sizes that differ are refused before anything is written") {
    Plane<float, 3> image(8, 6, 1), small(8, 5, 7), out(8, 6, 5);
    const Plane<float, 3> normal = random_planes<float>(8, 5, 1).normal;
    SerialExecutor serial;
    CHECK_THROWS_AS((cross_bilateral<float>(image.view(), small.view(), {}, serial)), Error);
    CHECK_THROWS_AS((cross_bilateral<float>(image.view(), out.view(), {}, serial, NormalFeature<float>(normal.view(), 1))), Error);
    CHECK(small.values()[0] == 7);
    CHECK(out.values()[0] == 5);
}
