// The forms of the cross-bilateral filter, interleaved in one process with the naive program of the seed
// document and the processor's rate of arithmetic: medians of time, of ratios, and whether each gives what it
// has to.
#include "../examples/support/command_line.hpp"
#include "seed_naive.hpp"
#include "timing.hpp"
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/cross_bilateral.hpp>
#include <lambent/io/exr_frame.hpp>
#include <string>
#include <vector>
#if defined(LAMBENT_BENCH_OPENCV)
#include <opencv2/core.hpp>
#include <opencv2/ximgproc.hpp>
#endif

namespace {

using namespace lambent;

struct Options {
    std::string input, dump;
    int width = 1280, height = 720, kernel = 65, rounds = 5;
    unsigned threads = 1;
    bool json = false, quick = false;
};

/// What is filtered: an illumination and the original's features.
struct Frame {
    Plane<float, 3> illumination, normal, position;
    Plane<float, 1> material;
};

/// A folded surface of three materials under noisy light.
Frame synthetic(int width, int height) {
    Frame f;
    for (auto* plane : {&f.illumination, &f.normal, &f.position}) plane->allocate(width, height);
    f.material.allocate(width, height);
    unsigned random = 1;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            random = random * 1664525u + 1013904223u;
            const float u = float(random >> 8) / float(1 << 24), tilt = 0.5f * std::sin(0.05f * float(x));
            f.illumination.store(x, y, Vec3f(x + y < width ? 1.0f : 0.3f) * (-std::log(1 - u)));
            f.normal.store(x, y, Vec3f(std::sin(tilt), 0, std::cos(tilt)));
            f.position.store(x, y, Vec3f(float(x), float(y), 10 * std::cos(0.05f * float(x))) * 0.02f);
            f.material.store(x, y, float((x / 90 + y / 70) % 3));
        }
    return f;
}

/// A rendered image's, after the original's firefly rule. Pixels without a surface, whose position is
/// infinite, lie far away: the original has no guard.
Frame rendered(const std::string& file) {
    PixelData<float> data = frame_from_exr(read_exr(file));
    demodulate(data);
    suppress_fireflies_seed(data.illumination.view(), 25);
    for (auto* plane : {&data.illumination, &data.normal, &data.position})
        for (float& x : plane->values())
            if (!is_finite(x)) x = plane == &data.position ? 1e6f : 0.0f;
    return {std::move(data.illumination), std::move(data.normal), std::move(data.position),
            std::move(data.material)};
}

/// The planes as shared/seed/baseline.cpp reads them.
void dump(const Frame& f, const std::string& prefix) {
    const auto write = [&](const char* name, const std::vector<float>& values) {
        std::ofstream file(prefix + "_" + name + ".f32", std::ios::binary);
        file.write(reinterpret_cast<const char*>(values.data()),
                   std::streamsize(values.size() * sizeof(float)));
        require(bool(file), [&] { return "cannot write " + prefix + "_" + name + ".f32"; });
    };
    write("raw", f.illumination.values());
    write("normal", f.normal.values());
    write("position", f.position.values());
    write("material", f.material.values());
}

/// The weights that a form evaluates in an image.
double weights_of(BilateralForm form, int width, int height, int kernel) {
    return double(bilateral_counts(width, height, {.kernel = kernel, .form = form}).exponentials);
}

/// Operations of a lane a weight, an fma counted once, as the loops of feature.hpp, features.hpp, exp.hpp and
/// bilateral_weights.hpp have them. Position and illumination: 3 differences, 3 fma each; normal: 4 fma;
/// material: equal, and, +; exponential: min, fma, -, 6 fma, shift, *; and 4 fma for each pixel summed to.
double operations_of(BilateralForm form) {
    const bool twice = form == BilateralForm::reuse_2d || form == BilateralForm::separable_reuse;
    return 6 + 6 + 4 + 3 + 11 + (twice ? 8 : 4);
}

double seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Lane-fma a second of one core: chains enough that none waits. Inlined, they would share the registers.
[[gnu::noinline]] double peak_rate() {
    using P = FeaturePack<float>;
    P chains[10];
    for (int i = 0; i < 10; ++i) chains[i] = P(float(i));
    const P factor = P(0.999f), term = P(0.001f);
    constexpr int steps = 2000000;
    const double start = seconds();
    for (int step = 0; step < steps; ++step)
#pragma GCC unroll 10
        for (int i = 0; i < 10; ++i) chains[i] = multiply_add(chains[i], factor, term);
    const double took = seconds() - start;
    for (const P& chain : chains)
        if (!(chain[0] > 0)) std::puts(""); // they are needed
    return double(steps) * 10 * P::width / took;
}

/// What the naive filter takes for the whole image, in ms, by the time of its taps at places all over.
double naive_ms(SeedNaive& naive) {
    std::size_t taps = 0;
    const double start = seconds();
    for (int place = 0; place < 12; ++place)
        for (int i = 0; i < 48; ++i) {
            const int x = (naive.width - 48) * (place % 4) / 3 + i;
            taps += naive.filter(std::clamp(x, 0, naive.width - 1), (naive.height - 1) * (place / 4 + 1) / 4);
        }
    const double a_tap = (seconds() - start) / double(taps);
    return 1e3 * a_tap *
           (weights_of(BilateralForm::naive_2d, naive.width, naive.height, 2 * naive.radius + 1) +
            double(naive.width) * naive.height);
}

double largest_difference(const Plane<float, 3>& a, const Plane<float, 3>& b) {
    double largest = 0;
    for (std::size_t i = 0; i < a.values().size(); ++i)
        largest = std::max(largest, std::abs(double(a.values()[i]) - double(b.values()[i])) /
                                        std::max(1.0, std::abs(double(b.values()[i]))));
    return largest;
}

struct Variant {
    std::string name;
    BilateralForm form = BilateralForm::naive_2d;
    std::string must_equal{}; ///< the variant whose result it has to give
    double tolerance = 0;
    int every = 1; ///< rounds from one run to the next
    std::vector<double> ms{}, to_naive{};
    Plane<float, 3> result{};
};

int run(const Options& o) {
    Frame frame = o.input.empty() ? synthetic(o.width, o.height) : rendered(o.input);
    const int width = frame.illumination.width(), height = frame.illumination.height();
    if (!o.dump.empty()) {
        dump(frame, o.dump);
        return 0;
    }
    const double sigma_illumination = 50;
    SeedNaive naive{width, height, o.kernel / 2, float(sigma_illumination), {}, {}};
    for (int i = 0; i <= naive.radius; ++i)
        naive.spatial.push_back(float(std::exp(-0.5 * std::pow(i / gaussian_sigma(o.kernel), 2))));
    for (std::size_t i = 0; i < frame.material.values().size(); ++i) {
        SeedNaive::Pixel p{};
        for (std::size_t c = 0; c < 3; ++c) {
            p.normal[c] = frame.normal.values()[3 * i + c];
            p.position[c] = frame.position.values()[3 * i + c];
            p.illumination[c] = frame.illumination.values()[3 * i + c];
        }
        p.material = int(frame.material.values()[i]);
        naive.pixels.push_back(p);
    }

    ThreadExecutor threads(o.threads);
    const DistanceFeature<float> position(frame.position.view(), 2);
    const NormalFeature<float> normal(frame.normal.view(), 0.5);
    const IdentityFeature<float> material(frame.material.view(), 0.5);
    std::vector<Variant> variants = {{"separable", BilateralForm::separable},
                                     {"separable_reuse", BilateralForm::separable_reuse, "separable", 5e-6},
                                     {"reuse_2d", BilateralForm::reuse_2d, "", 0, 5},
                                     {"naive_2d", BilateralForm::naive_2d, "reuse_2d", 1e-5, 1000}};
    std::vector<double> naives, peaks;
    for (int round = 0; round < o.rounds; ++round) {
        naives.push_back(naive_ms(naive));
        peaks.push_back(peak_rate());
        for (Variant& v : variants) {
            if (round % v.every != 0) continue;
            v.result.allocate(width, height);
            const double start = seconds();
            cross_bilateral<float>(frame.illumination.view(), v.result.view(),
                                   {.kernel = o.kernel,
                                    .sigma_spatial = 0,
                                    .sigma_illumination = sigma_illumination,
                                    .second_pass_factor = 1.0 / 3,
                                    .form = v.form},
                                   threads, position, normal, material);
            v.ms.push_back(1e3 * (seconds() - start));
            v.to_naive.push_back(naives.back() / v.ms.back());
        }
    }
    bool wrong = false;
    const auto print = [&](const std::string& name, double ms, double ratio, double weights, double share,
                           bool good) {
        wrong = wrong || !good;
        if (o.json)
            std::printf(
                "{\"bench\": \"filter\", \"variant\": \"%s\", \"width\": %d, \"height\": %d, \"kernel\": %d, "
                "\"threads\": %u, \"ms\": %.6g, \"ratio_to_naive\": %.6g, \"weights_evaluated\": %.0f, "
                "\"share_of_floor\": %.3g, \"wrong\": %s}\n",
                name.c_str(), width, height, o.kernel, o.threads, ms, ratio, weights, share,
                good ? "false" : "true");
        else
            std::printf("%-22s %10.2f ms %9.1fx %14.0f weights  %5.1f %% of the floor%s\n", name.c_str(), ms,
                        ratio, weights, 100 * share, good ? "" : "   WRONG");
    };
    if (!o.json) std::printf("peak %.1f G lane-fma/s a core\n", median(peaks) / 1e9);
    const double naive_weights = weights_of(BilateralForm::naive_2d, width, height, o.kernel);
    print("seed_naive_extrapolated", median(naives), 1, naive_weights, 0, true);
    for (const Variant& v : variants) {
        const double weights = weights_of(v.form, width, height, o.kernel);
        const double share =
            weights * operations_of(v.form) / (median(peaks) * o.threads) / (median(v.ms) / 1e3);
        bool good = true;
        for (const float x : v.result.values()) good = good && is_finite(x);
        for (const Variant& other : variants)
            if (other.name == v.must_equal)
                good = good && largest_difference(v.result, other.result) <= v.tolerance;
        if (v.form == BilateralForm::naive_2d) // and the baseline did the same work
            for (int i = 0; i < 48; ++i) {
                const std::size_t at = std::size_t((height - 1) / 4 * width + i);
                for (std::size_t c = 0; c < 3; ++c)
                    good = good && std::abs(naive.pixels[at].sums[c] - v.result.values()[3 * at + c]) <=
                                       1e-4f * std::max(1.0f, std::abs(v.result.values()[3 * at + c]));
            }
        print(v.name, median(v.ms), median(v.to_naive), weights, share, good);
    }
#if defined(LAMBENT_BENCH_OPENCV)
    cv::setNumThreads(int(o.threads));
    cv::Mat source(height, width, CV_32FC3, frame.illumination.values().data()), out;
    cv::Mat guide(height, width, CV_32FC3, frame.normal.values().data());
    const double start = seconds();
    cv::ximgproc::jointBilateralFilter(guide, source, out, o.kernel, 0.5, gaussian_sigma(o.kernel));
    const double ms = 1e3 * (seconds() - start);
    print("opencv_joint", ms, median(naives) / ms, naive_weights, 0, true);
#endif
    return wrong ? 1 : 0;
}

} // namespace

int main(int argc, char** argv) {
    Options o;
    CommandLine line("bench_filter [IN.exr] [options]");
    bool help = false;
    line.add("--size WxH", "of the synthetic image, without IN.exr (1280x720)", [&](auto& v) {
        const std::size_t x = v.find('x');
        if (x == std::string::npos) throw UsageError("must be WxH, as in 1280x720");
        o.width = int(to_integer(v.substr(0, x), 1, 1 << 14));
        o.height = int(to_integer(v.substr(x + 1), 1, 1 << 14));
    });
    line.add("--kernel N", "taps along a side, odd (65)", [&](auto& v) {
        o.kernel = int(to_integer(v, 1, 1023));
        if (o.kernel % 2 == 0) throw UsageError("must be odd");
    });
    line.add("--dump PREFIX", "writes the planes for shared/seed/baseline.cpp, and measures nothing",
             [&](auto& v) { o.dump = v; });
    line.add("--threads N", "of the forms; the naive program has one (1)",
             [&](auto& v) { o.threads = unsigned(to_integer(v, 1, 4096)); });
    line.add("--rounds N", "of the separable forms; reuse_2d runs in every fifth, naive_2d once (5)",
             [&](auto& v) { o.rounds = int(to_integer(v, 1, 1000)); });
    line.add("--quick", "320x180, 3 rounds", [&](auto&) { o.quick = true; });
    line.add("--json", "one object a line", [&](auto&) { o.json = true; });
    line.add("--help", "this text", [&](auto&) { help = true; });
    try {
        const std::vector<std::string> files = line.parse(argc, argv);
        if (help) {
            line.print_help();
            return 0;
        }
        if (files.size() > 1) throw UsageError("more than one image");
        if (!files.empty()) o.input = files[0];
        if (o.quick) {
            o.width = 320;
            o.height = 180;
            o.rounds = 3;
        }
        return run(o);
    } catch (const UsageError& e) {
        std::fprintf(stderr, "bench_filter: %s\nbench_filter --help lists the options\n", e.what());
        return 2;
    } catch (const std::exception& e) {
        std::fprintf(stderr, "bench_filter: %s\n", e.what());
        return 1;
    }
}
