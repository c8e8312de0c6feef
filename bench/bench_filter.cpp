// The forms of the cross-bilateral filter, interleaved in one process: median CPU time and, as a check, the
// difference to what each has to equal.
#include "../examples/support/command_line.hpp"
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
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
    std::string input;
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
            f.illumination.view().store(x, y, Vec3f(x + y < width ? 1.0f : 0.3f) * (-std::log(1 - u)));
            f.normal.view().store(x, y, Vec3f(std::sin(tilt), 0, std::cos(tilt)));
            f.position.view().store(x, y, Vec3f(float(x), float(y), 10 * std::cos(0.05f * float(x))) * 0.02f);
            f.material.view().store(x, y, float((x / 90 + y / 70) % 3));
        }
    return f;
}

/// The form's weights a pixel, away from the borders.
double weights_of(BilateralForm form, double n) {
    switch (form) {
    case BilateralForm::naive_2d: return n * n - 1;
    case BilateralForm::reuse_2d: return (n * n - 1) / 2;
    case BilateralForm::separable: return 2 * (n - 1);
    case BilateralForm::separable_reuse: return n - 1;
    }
    return 0;
}

double largest_difference(const Plane<float, 3>& a, const Plane<float, 3>& b) {
    double largest = 0;
    for (std::size_t i = 0; i < a.values().size(); ++i)
        largest = std::max(largest, std::abs(double(a.values()[i]) - double(b.values()[i])));
    return largest;
}

double median(std::vector<double> v) {
    if (v.empty()) return 0;
    std::sort(v.begin(), v.end());
    return v[v.size() / 2];
}

struct Variant {
    std::string name;
    BilateralForm form = BilateralForm::naive_2d;
    int must_equal = -1; ///< index of the variant whose result it has to give
    std::vector<double> ms{};
    Plane<float, 3> result{};
};

int run(const Options& o) {
    Frame frame;
    if (o.input.empty()) {
        frame = synthetic(o.width, o.height);
    } else {
        PixelData<float> data = frame_from_exr(read_exr(o.input));
        demodulate(data);
        frame = {std::move(data.illumination), std::move(data.normal), std::move(data.position), std::move(data.material)};
    }
    const int width = frame.illumination.width(), height = frame.illumination.height();
    ThreadExecutor threads(o.threads);
    const DistanceFeature<float> position(frame.position.view(), 2);
    const NormalFeature<float> normal(frame.normal.view(), 0.5);
    const IdentityFeature<float> material(frame.material.view(), 0.5);

    std::vector<Variant> variants = {{"naive_2d", BilateralForm::naive_2d},
                                     {"reuse_2d", BilateralForm::reuse_2d, 0},
                                     {"separable", BilateralForm::separable},
                                     {"separable_reuse", BilateralForm::separable_reuse, 2}};
    // Naive windows take minutes: one round of them, the others as many as asked for.
    for (int round = 0; round < o.rounds; ++round)
        for (Variant& v : variants) {
            const bool window = v.form == BilateralForm::naive_2d || v.form == BilateralForm::reuse_2d;
            if (window && round > 0) continue;
            v.result.allocate(width, height);
            const std::clock_t start = std::clock();
            cross_bilateral<float>(frame.illumination.view(), v.result.view(),
                                   {.kernel = o.kernel, .sigma_spatial = 0, .sigma_illumination = 50,
                                    .second_pass_factor = 1.0 / 3, .form = v.form},
                                   threads, position, normal, material);
            v.ms.push_back(1000.0 * double(std::clock() - start) / CLOCKS_PER_SEC);
        }
#if defined(LAMBENT_BENCH_OPENCV)
    {
        Variant v{"opencv_joint"};
        v.result.allocate(width, height);
        cv::Mat source(height, width, CV_32FC3, frame.illumination.values().data());
        cv::Mat guide(height, width, CV_32FC3, frame.normal.values().data());
        cv::Mat out(height, width, CV_32FC3, v.result.values().data());
        cv::setNumThreads(int(o.threads));
        const std::clock_t start = std::clock();
        cv::ximgproc::jointBilateralFilter(guide, source, out, o.kernel, 0.5, gaussian_sigma(o.kernel));
        v.ms.push_back(1000.0 * double(std::clock() - start) / CLOCKS_PER_SEC);
        variants.push_back(v);
    }
#endif

    bool wrong = false;
    const double naive = median(variants[0].ms);
    for (const Variant& v : variants) {
        const double ms = median(v.ms), to_naive = largest_difference(v.result, variants[0].result);
        const bool ours = v.name != "opencv_joint";
        const double weights = ours ? weights_of(v.form, o.kernel) * width * height : 0;
        bool finite = true;
        for (const float x : v.result.values()) finite = finite && is_finite(x);
        const bool good = finite && (v.must_equal < 0 ||
                                     largest_difference(v.result, variants[std::size_t(v.must_equal)].result) < 1e-4);
        wrong = wrong || !good;
        if (o.json)
            std::printf("{\"bench\": \"filter\", \"variant\": \"%s\", \"width\": %d, \"height\": %d, \"kernel\": %d, "
                        "\"threads\": %u, \"ms\": %.6g, \"ratio_to_naive\": %.6g, \"weights_evaluated\": %.0f, "
                        "\"max_difference\": %.6g, \"wrong\": %s}\n",
                        v.name.c_str(), width, height, o.kernel, o.threads, ms, naive / ms, weights, to_naive,
                        good ? "false" : "true");
        else
            std::printf("%-16s %10.2f ms %9.2fx naive %14.0f weights   %.3g off naive%s\n", v.name.c_str(), ms,
                        naive / ms, weights, to_naive, good ? "" : "   WRONG");
    }
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
    line.add("--threads N", "(1); times are CPU times of all of them", [&](auto& v) { o.threads = unsigned(to_integer(v, 1, 4096)); });
    line.add("--rounds N", "of the separable forms; windows are filtered once (5)", [&](auto& v) { o.rounds = int(to_integer(v, 1, 1000)); });
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
