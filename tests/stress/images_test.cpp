// Numbers as files hold them: halves and sRGB bytes, every one.
#include "stress/table.hpp"
#include "support/random.hpp"
#include "support/temporary_folder.hpp"
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <doctest/doctest.h>
#include <lambent/film/film.hpp>
#include <lambent/film/film_pass.hpp>
#include <lambent/io/exr.hpp>
#include <lambent/io/exr_frame.hpp>
#include <lambent/io/exr_read.hpp>
#include <lambent/scene/texture.hpp>
#include <limits>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

/// By the format's definition (IEEE 754 binary16), without the library that reads files.
double value_of_half(std::uint32_t bits) {
    const int exponent = int(bits >> 10 & 31);
    const double fraction = double(bits & 1023) / 1024, sign = (bits >> 15) != 0 ? -1 : 1;
    if (exponent == 31) return fraction == 0 ? sign * HUGE_VAL : std::numeric_limits<double>::quiet_NaN();
    return sign * (exponent == 0 ? std::ldexp(fraction, -14) : std::ldexp(1 + fraction, exponent - 15));
}

ExrImage one_channel(std::vector<float> values) {
    ExrImage image;
    image.width = 256;
    image.height = int(values.size() / 256);
    image.channels.push_back({"Y", ExrType::half, std::move(values)});
    return image;
}

std::vector<float> through_a_file(std::vector<float> values) {
    const TemporaryFolder folder;
    write_exr(folder.file("a.exr"), one_channel(std::move(values)));
    return read_exr(folder.file("a.exr")).channels.at(0).values;
}

} // namespace

TEST_CASE("images: every half -> the same bits through a file") {
    std::vector<float> values(65536);
    for (std::uint32_t h = 0; h < 65536; ++h) values[h] = float(value_of_half(h));
    const std::vector<float> back = through_a_file(values);
    std::size_t wrong = 0, naive_wrong = 0;
    for (std::uint32_t h = 0; h < 65536; ++h) {
        const float v = values[h];
        const bool infinite =
            v == std::numeric_limits<float>::infinity() || v == -std::numeric_limits<float>::infinity();
        const float expected = infinite ? std::copysign(65504.0f, v) : v; // saturated
        wrong +=
            std::size_t(is_nan(v) ? !is_nan(back[h])
                                  : std::bit_cast<std::uint32_t>(back[h]) != std::bit_cast<std::uint32_t>(expected));
        // As many programs narrow: the bits moved, without denormals.
        const auto bits = std::bit_cast<std::uint32_t>(v);
        const std::uint32_t narrow =
            (bits >> 16 & 0x8000u) | (((bits >> 23 & 255) - 112) << 10 & 0x7c00u) | (bits >> 13 & 1023);
        naive_wrong += std::size_t(narrow != h);
    }
    record({"images", "every half -> wrong bits after a file; naive: exponents shifted", 65536, double(wrong),
            double(wrong) / 65536, 0, double(naive_wrong) / 65536});
}

TEST_CASE("images: floats between halves and beyond them -> the nearest, ties to even, never infinite") {
    std::vector<float> values;
    for (const float v : {65503.0f, 65504.0f, 65505.0f, 65519.99f, 65520.0f, 65536.0f, 1e38f, -65520.0f, -1e30f, -0.0f,
                          1e-40f, 2.9802322e-8f, 2.98023224e-8f, 5.9604645e-8f})
        values.push_back(v);
    for (std::uint32_t h = 0; h < 0x7bffu; h += 7) { // ties: up, down and their neighbours
        const double tie = (value_of_half(h) + value_of_half(h + 1)) / 2;
        for (const float v : {float(tie), next_up(float(tie)), next_down(float(tie)), -float(tie)}) values.push_back(v);
    }
    Random random(1);
    while (values.size() % 256 != 0 || values.size() < inputs(1e5, 1e7))
        values.push_back(float(std::ldexp(random.uniform(-1, 1), int(random.below(48)) - 28)));
    const std::vector<float> back = through_a_file(values);
    std::size_t wrong = 0, naive_wrong = 0;
    double worst = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
        // In units of the spacing of halves there, away from zero in double, which is exact.
        const double x = std::abs(double(values[i])),
                     unit = std::ldexp(1.0, std::max(-24, std::ilogb(std::max(x, 1e-30)) - 10));
        const double nearest = std::min(std::nearbyint(x / unit) * unit, 65504.0);
        const double got = std::abs(double(back[i]));
        wrong += std::size_t(got != nearest || std::signbit(back[i]) != std::signbit(values[i]));
        if (x <= 65504) worst = std::max(worst, std::abs(got - x) / unit);
        naive_wrong += std::size_t(std::floor(x / unit) * unit != nearest || x >= 65536);
    }
    record({"images", "floats -> distance of the stored half in its spacings; naive: cut off, share wrong",
            double(values.size()), double(wrong), worst, 0.5, double(naive_wrong) / double(values.size()) + 0.5});
}

TEST_CASE("images: bad samples -> no NaN or infinity in a written frame") {
    FilmPass<float> pass(16, 16, FilmPlanes::features, 0, 8);
    Random random(2);
    float naive_sum = 0;
    std::size_t given = 0;
    for (int p = 0; p < 256; ++p) {
        FilmPass<float>::Pixel pixel(pass, p % 16, p / 16);
        for (int i = 0; i < 8; ++i) {
            PixelSample<float> s;
            s.hit = true;
            for (Vec3f* v : {&s.radiance, &s.emission, &s.albedo, &s.normal, &s.position})
                for (int c = 0; c < 3; ++c) (*v)[c] = std::bit_cast<float>(random.bits32());
            s.depth = std::bit_cast<float>(random.bits32());
            naive_sum += s.radiance.x;
            pixel.add(s);
            ++given;
        }
    }
    const PixelData<float> frame = pass.finish().resolve();
    const TemporaryFolder folder;
    std::size_t bad = 0;
    for (const ExrPrecision precision : {ExrPrecision::compact, ExrPrecision::full}) {
        ExrFrameOptions<float> options;
        options.precision = precision;
        write_exr(folder.file("a.exr"), frame, options);
        for (const ExrChannel& channel : read_exr(folder.file("a.exr")).channels)
            for (const float v : channel.values) bad += std::size_t(!is_finite(v));
    }
    record({"images", "frames of samples of random bits -> values not finite; naive: a sum of them", double(given),
            double(bad), double(bad), 0, is_finite(naive_sum) ? 0.0 : 1.0});
}

TEST_CASE("images: every byte of sRGB -> itself through linear light, monotone") {
    std::size_t wrong = 0, naive_wrong = 0, falls = 0;
    double worst = 0;
    for (int i = 0; i < 256; ++i) {
        const float linear = srgb_to_linear(float(i) / 255);
        const double exact = i <= 10 ? i / 255.0 / 12.92 : std::pow((i / 255.0 + 0.055) / 1.055, 2.4);
        worst = std::max(worst, i == 0 ? double(linear) : std::abs(double(linear) / exact - 1));
        wrong += std::size_t(int(std::lround(255 * linear_to_srgb(linear))) != i);
        naive_wrong += std::size_t(int(std::lround(255 * std::pow(linear, 1 / 2.2f))) != i);
    }
    float before = -1;
    const auto step = std::uint32_t(inputs(997, 1)), last = std::bit_cast<std::uint32_t>(1.0f);
    for (std::uint32_t bits = 0; bits <= last; bits += step) {
        const float s = linear_to_srgb(std::bit_cast<float>(bits));
        falls += std::size_t(s < before - 6e-8f); // an ulp of pow's
        before = s;
    }
    record({"images", "bytes of sRGB -> wrong after decoding and encoding; naive: encoded by a power of 2.2", 256,
            double(wrong + falls), worst, 1e-6, double(naive_wrong)});
}
