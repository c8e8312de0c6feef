/// The small things that a render does by the million: ns a call, by Google Benchmark.
#include <benchmark/benchmark.h>
#include <cmath>
#include <lambent/core/frame.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/sampling/alias.hpp>
#include <lambent/sampling/distribution.hpp>
#include <lambent/sampling/independent.hpp>
#include <lambent/sampling/mis.hpp>
#include <lambent/sampling/sobol.hpp>
#include <lambent/sampling/stratified.hpp>
#include <lambent/sampling/warp.hpp>
#include <string>
#include <vector>
#if __has_include(<lambent/core/exp.hpp>)
#include <lambent/core/exp.hpp>
#endif

namespace {

using namespace lambent;

/// 4096 inputs in the first cache, so that what is measured is the function and not where they come from.
struct Inputs {
    std::vector<Vec2f> u;
    Inputs() {
        for (std::uint32_t i = 0; i < 4096; ++i)
            u.push_back(IndependentSampler<float>(1).at(i, 0, 0).get_2d(0));
    }
};

const std::vector<Vec2f>& inputs() {
    static const Inputs value;
    return value.u;
}

/// Runs f(u) over the inputs, each call apart from the others.
template <class F>
void over_inputs(benchmark::State& state, F f) {
    const auto& u = inputs();
    std::size_t i = 0;
    for (auto _ : state) {
        auto result = f(u[i]);
        benchmark::DoNotOptimize(result);
        i = (i + 1) % u.size();
    }
}

/// One 1D and one 2D draw of each of 8 dimensions a sample; the time is that of a single draw.
template <class S>
void draws(benchmark::State& state, const S& sampler, std::string& check) {
    std::uint32_t index = 0;
    float last = 0;
    for (auto _ : state) {
        const auto stream = sampler.at(3, 4, index++ % 64);
        for (std::uint32_t d = 0; d < 16; d += 2) {
            benchmark::DoNotOptimize(stream.get_1d(d));
            const Vec2f u = stream.get_2d(d + 1);
            benchmark::DoNotOptimize(last = u.x + u.y);
        }
    }
    if (!(last >= 0 && last < 2)) check = "a draw is out of range";
    state.counters["ns_per_draw"] = benchmark::Counter(16e-9, benchmark::Counter::kIsIterationInvariantRate |
                                                                  benchmark::Counter::kInvert);
}

template <class S>
void bench_draws(benchmark::State& state, S sampler) {
    std::string wrong;
    draws(state, sampler, wrong);
    if (!wrong.empty()) state.SkipWithError(wrong.c_str());
}
BENCHMARK_CAPTURE(bench_draws, sobol, SobolSampler<float>(1));
BENCHMARK_CAPTURE(bench_draws, stratified_64, StratifiedSampler<float>(1, 64));
BENCHMARK_CAPTURE(bench_draws, stratified_61, StratifiedSampler<float>(1, 61));
BENCHMARK_CAPTURE(bench_draws, independent, IndependentSampler<float>(1));

/// Of f over the unit square, by a million midpoints. No lambda: gcc would try to run that when it compiles.
template <class F>
double integral(const F& f) {
    double sum = 0;
    for (int i = 0; i < 1000; ++i)
        for (int j = 0; j < 1000; ++j) sum += f(Vec2f((float(i) + 0.5f) / 1000, (float(j) + 0.5f) / 1000));
    return sum * 1e-6;
}

/// Variance of independent samples over that of `sampler`, mean of 2000 estimates; the row's time says
/// nothing.
template <class MakeSampler>
void variance_ratio(benchmark::State& state, MakeSampler make) {
    const auto n = std::uint32_t(state.range(0));
    const auto smooth = [](Vec2f u) {
        return 1 / (1 + 4 * (u.x - 0.3) * (u.x - 0.3) + 2 * (u.y - 0.6) * (u.y - 0.6));
    };
    const auto edge = [](Vec2f u) { return u.y < 0.3f + 0.37f * u.x ? 1.0 : 0.0; };
    const auto variance = [&](const auto& sampler, auto f) {
        const double exact = integral(f);
        double squares = 0;
        for (std::uint32_t run = 0; run < 2000; ++run) {
            double sum = 0;
            for (std::uint32_t i = 0; i < n; ++i) sum += f(sampler.at(run, 9, i).get_2d(1));
            squares += (sum / n - exact) * (sum / n - exact);
        }
        return squares;
    };
    double ratio_smooth = 0, ratio_edge = 0;
    for (auto _ : state) {
        const IndependentSampler<float> independent(7);
        ratio_smooth = variance(independent, smooth) / variance(make(n), smooth);
        ratio_edge = variance(independent, edge) / variance(make(n), edge);
    }
    state.counters["smooth"] = ratio_smooth;
    state.counters["edge"] = ratio_edge;
}
BENCHMARK_CAPTURE(variance_ratio, sobol, [](std::uint32_t) { return SobolSampler<float>(7); })
    ->RangeMultiplier(4)
    ->Range(4, 256)
    ->Iterations(1);
BENCHMARK_CAPTURE(variance_ratio, stratified, [](std::uint32_t n) { return StratifiedSampler<float>(7, n); })
    ->RangeMultiplier(4)
    ->Range(4, 256)
    ->Iterations(1);

void warp_disk(benchmark::State& s) {
    over_inputs(s, [](Vec2f u) { return square_to_disk(u); });
}
void warp_cosine(benchmark::State& s) {
    over_inputs(s, [](Vec2f u) { return square_to_cosine_hemisphere(u); });
}
void warp_hemisphere(benchmark::State& s) {
    over_inputs(s, [](Vec2f u) { return square_to_uniform_hemisphere(u); });
}
void warp_sphere(benchmark::State& s) {
    over_inputs(s, [](Vec2f u) { return square_to_uniform_sphere(u); });
}
void warp_cone(benchmark::State& s) {
    over_inputs(s, [](Vec2f u) { return square_to_uniform_cone(u, 0.01f); });
}
void warp_triangle(benchmark::State& s) {
    over_inputs(s, [](Vec2f u) { return square_to_triangle(u); });
}
void mis_power(benchmark::State& s) {
    over_inputs(s, [](Vec2f u) { return power_heuristic(u.x, u.y); });
}
void frame_of_normal(benchmark::State& s) {
    over_inputs(s, [](Vec2f u) { return Frame<float>(Vec3f(u.x, 0, u.y)); });
}
void kahan_product(benchmark::State& s) {
    over_inputs(s, [](Vec2f u) { return difference_of_products(u.x, u.y, u.y, u.x); });
}
void exp_std(benchmark::State& s) {
    over_inputs(s, [](Vec2f u) { return std::exp(-10 * u.x); });
}
BENCHMARK(warp_disk);
BENCHMARK(warp_cosine);
BENCHMARK(warp_hemisphere);
BENCHMARK(warp_sphere);
BENCHMARK(warp_cone);
BENCHMARK(warp_triangle);
BENCHMARK(mis_power);
BENCHMARK(frame_of_normal);
BENCHMARK(kahan_product);
BENCHMARK(exp_std);

std::vector<float> weights(std::size_t n) {
    std::vector<float> w(n);
    for (std::uint32_t i = 0; i < n; ++i) {
        const float u = IndependentSampler<float>(2).at(i, 0, 0).get_1d(0);
        w[i] = u * u * u;
    }
    return w;
}

void alias_table(benchmark::State& state) {
    const std::vector<float> w = weights(std::size_t(state.range(0)));
    const std::vector<double> wide(w.begin(), w.end());
    const AliasTable table{std::span<const double>(wide)};
    over_inputs(state, [&](Vec2f u) { return table.sample(u.x); });
}
BENCHMARK(alias_table)->Arg(16)->Arg(1024)->Arg(1 << 20);

void distribution_1d(benchmark::State& state) {
    const std::vector<float> w = weights(std::size_t(state.range(0)));
    const Distribution1D distribution{std::span<const float>(w)};
    over_inputs(state, [&](Vec2f u) { return distribution.sample(u.x); });
}
BENCHMARK(distribution_1d)->Arg(16)->Arg(1024)->Arg(1 << 20);

void distribution_2d(benchmark::State& state) {
    const auto height = std::uint32_t(state.range(0));
    const std::vector<float> w = weights(std::size_t(height) * height * 2);
    const Distribution2D distribution(std::span<const float>(w), 2 * height, height);
    over_inputs(state, [&](Vec2f u) { return distribution.sample(u); });
}
BENCHMARK(distribution_2d)->Arg(16)->Arg(256)->Arg(1024);

void distribution_2d_pdf(benchmark::State& state) {
    const std::vector<float> w = weights(512 * 256);
    const Distribution2D distribution(std::span<const float>(w), 512, 256);
    over_inputs(state, [&](Vec2f u) { return distribution.pdf(u); });
}
BENCHMARK(distribution_2d_pdf);

} // namespace

BENCHMARK_MAIN();
