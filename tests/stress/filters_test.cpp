// Filters of images with bad pixels, of any range, size and orientation.
#include "denoise/bilateral_cases.hpp"
#include "stress/table.hpp"
#include "support/random.hpp"
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <doctest/doctest.h>
#include <lambent/denoise/cross_bilateral.hpp>
#include <lambent/denoise/denoise.hpp>
#include <lambent/denoise/restore_energy.hpp>
#include <limits>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

/// Sigmas by their features.
constexpr struct {
    double spatial = 3, illumination = 2, position = 2, normal = 0.5, material = 0.5;
} sigmas;

/// The formula as it stands in papers: nothing is looked at before it is added.
/// quarter  only the pairs to the right and below, as re-use is sometimes described
enum class Pairs { all, quarter };
template <class T>
Plane<T, 3> textbook(const Planes<T>& p, int radius, Pairs pairs = Pairs::all, double sigma_light = sigmas.illumination) {
    Plane<T, 3> sum(p.width(), p.height()), out(p.width(), p.height());
    std::vector<T> weights(std::size_t(p.width() * p.height()));
    const auto add = [&](int x, int y, int u, int v) {
        const auto square = [](T d, double by) { return d * d / T(2 * by * by); };
        const T d2 = T((u - x) * (u - x) + (v - y) * (v - y));
        const T w = std::exp(-d2 / T(2 * sigmas.spatial * sigmas.spatial) -
                             square(length(p.image.load(u, v) - p.image.load(x, y)), sigma_light) -
                             square(length(p.position.load(u, v) - p.position.load(x, y)), sigmas.position) -
                             square(1 - dot(p.normal.load(u, v), p.normal.load(x, y)), sigmas.normal) -
                             square(p.material.load(u, v) == p.material.load(x, y) ? T(0) : T(1), sigmas.material));
        sum.view().store(x, y, sum.load(x, y) + w * p.image.load(u, v));
        weights[std::size_t(y * p.width() + x)] += w;
    };
    for (int y = 0; y < p.height(); ++y)
        for (int x = 0; x < p.width(); ++x)
            for (int v = std::max(0, y - radius); v <= std::min(p.height() - 1, y + radius); ++v)
                for (int u = std::max(0, x - radius); u <= std::min(p.width() - 1, x + radius); ++u)
                    if (pairs == Pairs::all || (u >= x && v >= y) || (u <= x && v <= y)) add(x, y, u, v);
    for (int y = 0; y < p.height(); ++y)
        for (int x = 0; x < p.width(); ++x)
            out.view().store(x, y, sum.load(x, y) / weights[std::size_t(y * p.width() + x)]);
    return out;
}

template <class T>
Plane<T, 3> run(const Planes<T>& planes, BilateralForm form, int radius, double sigma_light = sigmas.illumination) {
    return filter(planes,
                  {.kernel = 2 * radius + 1,
                   .sigma_spatial = sigmas.spatial,
                   .sigma_illumination = sigma_light,
                   .second_pass_factor = 1,
                   .form = form},
                  sigmas.position, sigmas.normal, sigmas.material);
}

bool whole_window(BilateralForm form) { return form == BilateralForm::naive_2d || form == BilateralForm::reuse_2d; }

/// How many pixels of `out` are not finite.
template <class T>
std::size_t count_bad(const Plane<T, 3>& out) {
    std::size_t bad = 0;
    for (int y = 0; y < out.height(); ++y)
        for (int x = 0; x < out.width(); ++x) bad += std::size_t(!is_finite(out.load(x, y)));
    return bad;
}

/// The planes turned by 90 degrees.
template <class P>
P turned(const P& from) {
    P to(from.height(), from.width());
    for (int y = 0; y < from.height(); ++y)
        for (int x = 0; x < from.width(); ++x) to.view().store(from.height() - 1 - y, x, from.load(x, y));
    return to;
}

} // namespace

// Compiled with -ffast-math too, where only bits tell a NaN.
TEST_CASE("filters: 1 to 100 bad pixels -> none comes out, and all beyond the radius are as without them") {
    constexpr int width = 90, height = 60, radius = 5;
    const Planes<float> clean = random_planes<float>(width, height, 8);
    Random random(1);
    const float bad_values[] = {std::bit_cast<float>(0x7fc00000u), std::bit_cast<float>(0x7f800000u),
                                std::bit_cast<float>(0xff800000u), 3e38f};
    std::size_t images = 0, bad = 0, naive_bad = 0, moved = 0;
    for (const auto form : all_forms) {
        const Plane<float, 3> expected = run(clean, form, radius);
        for (const int count : {1, 10, 100})
            for (std::uint64_t round = 0; round < inputs(1, 40); ++round) {
                Planes<float> planes = clean;
                std::vector<bool> near(width * height);
                for (int k = 0; k < count; ++k) {
                    const int x = int(random.below(width)), y = int(random.below(height));
                    const Vec3f value(bad_values[random.below(4)]);
                    planes.image.view().store(x, y, value);
                    if (random.below(2) == 0) planes.normal.view().store(x, y, value);
                    if (random.below(2) == 0) planes.position.view().store(x, y, value);
                    if (random.below(2) == 0) planes.material.view().store(x, y, value.x);
                    // Two passes reach twice as far, and rows after columns no farther.
                    const int reach = whole_window(form) ? radius : 2 * radius;
                    for (int v = std::max(0, y - reach); v <= std::min(height - 1, y + reach); ++v)
                        for (int u = std::max(0, x - reach); u <= std::min(width - 1, x + reach); ++u)
                            near[std::size_t(v * width + u)] = true;
                }
                const Plane<float, 3> out = run(planes, form, radius);
                bad += count_bad(out);
                for (int y = 0; y < height; ++y)
                    for (int x = 0; x < width; ++x) {
                        const Vec3f a = out.load(x, y), b = expected.load(x, y);
                        moved += std::size_t(!near[std::size_t(y * width + x)] && std::memcmp(&a, &b, sizeof a) != 0);
                    }
                if (form == BilateralForm::naive_2d && count == 1 && round == 0) {
                    planes.image.view().store(45, 30, Vec3f(bad_values[0]));
                    naive_bad = count_bad(textbook(planes, radius));
                }
                ++images;
            }
    }
    record({"filters", "images with bad pixels -> bad or moved pixels; naive: poisoned by the textbook's, 11 x 11 each",
            double(images), double(bad + moved), double(bad + moved), 0, double(naive_bad)});
}

#if !defined(__FAST_MATH__)
TEST_CASE("filters: constant images of 1e-30 to 1e30 -> themselves; values of that range -> within their taps'") {
    double worst = 0, naive = 0, images = 0;
    std::size_t outside = 0;
    for (const double size : {1e-30, 1e-20, 1e-7, 1.0, 3.7, 1e7, 1e15, 1e30}) {
        Planes<float> planes = random_planes<float>(40, 23, 5);
        for (float& v : planes.image.values()) v = float(size);
        const auto difference = [&](const Plane<float, 3>& out) {
            double largest = 0;
            for (const float v : out.values())
                largest = std::max(largest, is_finite(v) ? std::abs(double(v) / double(float(size)) - 1) : 1e9);
            return largest;
        };
        for (const auto form : all_forms) worst = std::max(worst, difference(run(planes, form, 8)));
        // and as wide a range within one image
        Random random(6);
        float low = 1e38f, high = 0;
        for (float& v : planes.image.values()) {
            v = float(size * std::exp(random.uniform(-5, 5)));
            low = std::min(low, v);
            high = std::max(high, v);
        }
        const auto count_outside = [&](const Plane<float, 3>& out) {
            return std::count_if(out.values().begin(), out.values().end(), [&](float v) {
                return !(v >= low * (1 - 1e-5f) && v <= high * (1 + 1e-5f)); // NaN too
            });
        };
        for (const auto form : all_forms)
            for (const double light : {sigmas.illumination, infinity})
                outside += std::size_t(count_outside(run(planes, form, 8, light)));
        // A feature that is off by an infinite sigma, and squares beyond 3e38: infinity over infinity.
        naive += double(count_outside(textbook(planes, 8, Pairs::all, infinity)));
        images += 8;
    }
    record({"filters", "images of 1e-30 to 1e30 -> change of constants, taps' range left; naive: the textbook's",
            images, double(outside), worst, 1e-6, naive});
}

TEST_CASE("filters: the seed's re-use of windows -> as without re-use; naive: the lower right quarter") {
    double worst = 0, worst_double = 0, quarter = 0, images = 0;
    for (std::uint64_t seed = 0; seed < inputs(2, 40); ++seed) {
        const Planes<float> planes = random_planes<float>(80 + int(seed), 61, 11 + seed);
        const Plane<float, 3> gather = run(planes, BilateralForm::naive_2d, 10);
        worst = std::max(worst, largest_relative_difference(run(planes, BilateralForm::reuse_2d, 10), gather));
        Planes<double> wide(planes.width(), planes.height());
        const auto copy = [](const auto& from, auto& to) {
            std::copy(from.values().begin(), from.values().end(), to.values().begin());
        };
        copy(planes.image, wide.image);
        copy(planes.normal, wide.normal);
        copy(planes.position, wide.position);
        copy(planes.material, wide.material);
        const Plane<double, 3> exact = textbook(wide, 10);
        worst_double = std::max(worst_double, largest_relative_difference(gather, exact));
        quarter = std::max(quarter, largest_relative_difference(textbook(wide, 10, Pairs::quarter), exact));
        ++images;
    }
    record({"filters", "images -> scatter against gather, relative; naive: a quarter of the pairs", images,
            double(worst > 5e-6), worst, 5e-6, quarter});
    record({"filters", "images -> float against the formula in double, relative; naive: a quarter of the pairs", images,
            double(worst_double > 1e-5), worst_double, 1e-5, quarter});
}

TEST_CASE("filters: images turned by 90 degrees -> the result turned, but for rows before columns") {
    double worst = 0, asymmetry = 0, images = 0;
    for (std::uint64_t seed = 0; seed < inputs(2, 60); ++seed) {
        const Planes<float> planes = random_planes<float>(61, 44 + int(seed), seed);
        Planes<float> around(planes.height(), planes.width());
        around.image = turned(planes.image);
        around.normal = turned(planes.normal);
        around.position = turned(planes.position);
        around.material = turned(planes.material);
        for (const auto form : all_forms) {
            const double d = largest_relative_difference(run(around, form, 8), turned(run(planes, form, 8)));
            (whole_window(form) ? worst : asymmetry) = std::max(whole_window(form) ? worst : asymmetry, d);
        }
        ++images;
    }
    record({"filters", "images turned -> relative difference of windows; naive: of lines, rows first", images,
            double(worst > 1e-5), worst, 1e-5, asymmetry});
}

TEST_CASE("filters: light that lacks by twice its noise -> half of it comes back") {
    // A lack of 0.01 a pixel under noise of 0.08, of both signs by turns: over 256 pixels four times its variance.
    constexpr int side = 16;
    constexpr double lack = 0.01, noise = 0.08;
    Plane<double, 3> image(side, side, 1.0), noisy(side, side);
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) noisy.view().store(x, y, Vec3d(1 + lack + ((x + y) % 2 == 0 ? noise : -noise)));
    restore_energy<double>(image.view(), noisy.view());
    double mean = 0;
    for (const double v : image.values()) mean += v / double(image.values().size());
    const double off = std::abs((mean - 1) / lack - 0.5);
    record({"filters", "light lacking by two deviations -> share given back, off a half; naive: all of it", side * side,
            double(off > 0.01), off, 0.01, 0.5});
}

TEST_CASE("filters: frames of every awkward size -> finite, and the chain's bad pixels stay near") {
    SerialExecutor serial;
    double frames = 0;
    std::size_t bad = 0, naive = 0;
    Random random(3);
    for (const auto& [width, height] : {std::pair{1, 1}, {1, 9}, {9, 1}, {2, 2}, {3, 64}, {64, 3}, {31, 17}})
        for (const char* method : {"best", "fast", "seed"}) {
            PixelData<float> frame;
            frame.width = width;
            frame.height = height;
            for (auto* plane : {&frame.radiance, &frame.albedo, &frame.normal, &frame.position, &frame.variance}) {
                plane->allocate(width, height);
                for (float& v : plane->values()) v = random.uniform_float();
            }
            frame.material.allocate(width, height);
            for (int k = 0; k < 3; ++k) {
                const int x = int(random.below(std::uint32_t(width))), y = int(random.below(std::uint32_t(height)));
                const float values[] = {std::bit_cast<float>(0x7fc00000u), std::bit_cast<float>(0x7f800000u), 1e30f};
                (k == 0   ? frame.radiance
                 : k == 1 ? frame.variance
                          : frame.position)
                    .view()
                    .store(x, y, Vec3f(values[random.below(3)]));
            }
            naive += count_bad(frame.radiance);
            bad += count_bad(denoise(frame, denoise_options(method), serial).radiance);
            ++frames;
        }
    record({"filters", "frames of 1 x 1 to 64 x 3, smaller than the kernel -> bad pixels; naive: left as they came",
            frames, double(bad), double(bad), 0, double(naive)});
}
#endif
