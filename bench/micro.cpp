/// The small things that a render does by the million: ns a call, by Google Benchmark.
#include <benchmark/benchmark.h>
#include <algorithm>
#include <bit>
#include <cmath>
#include <lambent/bvh/bvh.hpp>
#include <lambent/core/exp.hpp>
#include <lambent/core/frame.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/denoise/cross_bilateral.hpp>
#include <lambent/sampling/alias.hpp>
#include <lambent/sampling/distribution.hpp>
#include <lambent/sampling/independent.hpp>
#include <lambent/sampling/mis.hpp>
#include <lambent/sampling/sobol.hpp>
#include <lambent/sampling/stratified.hpp>
#include <lambent/sampling/warp.hpp>
#include <string>
#include <vector>

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

/// A register of exponentials; ns_per_value is the figure to hold against exp_std.
void exp_pack(benchmark::State& state) {
    using P = FeaturePack<float>;
    float lanes[P::width];
    for (int i = 0; i < P::width; ++i) lanes[i] = -10 * inputs()[std::size_t(i)].x;
    P x = P::load(lanes);
    for (auto _ : state) {
        benchmark::DoNotOptimize(x);
        P result = exp_of_negative(x);
        benchmark::DoNotOptimize(result);
    }
    state.counters["ns_per_value"] = benchmark::Counter(P::width * 1e-9, benchmark::Counter::kIsIterationInvariantRate |
                                                                            benchmark::Counter::kInvert);
}
BENCHMARK(exp_pack);

/// The cross-bilateral filter with all four weights in the cache; ns_per_tap counts every pair that is summed.
void filter_taps(benchmark::State& state, BilateralForm form) {
    constexpr int size = 64, kernel = 17;
    Plane<float, 3> image(size, size), normal(size, size), position(size, size), out(size, size);
    Plane<float, 1> material(size, size);
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
            const Vec2f u = inputs()[std::size_t(y * size + x)];
            image.store(x, y, {u.x, u.y, 1});
            normal.store(x, y, normalize(Vec3f(u.x, u.y, 1)));
            position.store(x, y, {float(x), float(y), u.x});
            material.store(x, y, float(x / 20));
        }
    SerialExecutor serial;
    for (auto _ : state)
        cross_bilateral<float>(image.view(), out.view(), {.kernel = kernel, .sigma_illumination = 1, .form = form}, serial,
                               DistanceFeature<float>(position.view(), 5), NormalFeature<float>(normal.view(), 0.5),
                               IdentityFeature<float>(material.view(), 0.5));
    for (const float v : out.values())
        if (!is_finite(v)) state.SkipWithError("a pixel is not finite");
    const bool window = form == BilateralForm::naive_2d || form == BilateralForm::reuse_2d;
    state.counters["ns_per_tap"] =
        benchmark::Counter(1e-9 * size * size * (window ? kernel * kernel : 2 * kernel),
                           benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK_CAPTURE(filter_taps, naive_2d, BilateralForm::naive_2d);
BENCHMARK_CAPTURE(filter_taps, reuse_2d, BilateralForm::reuse_2d);
BENCHMARK_CAPTURE(filter_taps, separable, BilateralForm::separable);
BENCHMARK_CAPTURE(filter_taps, separable_reuse, BilateralForm::separable_reuse);

/// A tree over scattered triangles, and rays from outside of it at points inside.
struct Target {
    std::vector<Vec3f> vertices;
    std::vector<UVec3> faces;
    std::vector<Rayf> rays;
    Bvh bvh;

    Target() {
        const auto point = [](std::uint32_t i) {
            const auto stream = IndependentSampler<float>(3).at(i, 0, 0);
            return Vec3f(stream.get_1d(0), stream.get_1d(1), stream.get_1d(2));
        };
        for (std::uint32_t i = 0; i < 256; ++i) {
            for (std::uint32_t k = 0; k < 3; ++k) vertices.push_back(point(4 * i) + 0.3f * point(4 * i + 1 + k));
            faces.push_back({3 * i, 3 * i + 1, 3 * i + 2});
        }
        for (std::uint32_t i = 0; i < 64; ++i) {
            const Vec3f from = point(9000 + i) + Vec3f(2, -1, 0.5f);
            rays.push_back({from, point(8000 + i) - from});
        }
        bvh = Bvh::build(triangles(vertices, faces));
    }
};

/// One ray against all the boxes of a node; the same test in double must agree.
void slab_test(benchmark::State& state) {
    const Target target;
    const auto& node = target.bvh.tree().nodes[0];
    using Slabs = detail::SlabRay<float>;
    std::vector<Slabs> slabs;
    for (const Rayf& ray : target.rays) slabs.emplace_back().start(ray, target.bvh.tree());
    const auto met = [&](std::size_t i) {
        Slabs::Lanes entry;
        return bits(slabs[i].meets(node, 1e30f, entry));
    };
    for (std::size_t i = 0; i < slabs.size(); ++i)
        for (std::size_t lane = 0; lane < std::size_t(Slabs::width); ++lane) {
            double from = 0, to = 1e30;
            for (int k = 0; k < 3; ++k) {
                const double o = double(target.rays[i].origin[k]), d = double(target.rays[i].direction[k]);
                const double a = (double(node.plane[2 * k][lane]) - o) / d;
                const double b = (double(node.plane[2 * k + 1][lane]) - o) / d;
                from = std::max(from, std::min(a, b));
                to = std::min(to, std::max(a, b));
            }
            if (std::abs(to - from) > 1e-4 && (from <= to) != ((met(i) >> lane & 1) != 0))
                return state.SkipWithError("a box is met that is not, or the other way round");
        }
    std::size_t i = 0;
    for (auto _ : state) {
        benchmark::DoNotOptimize(met(i));
        i = (i + 1) % slabs.size();
    }
}
BENCHMARK(slab_test);

/// One ray against a block of four triangles; where it hits, weights and depth must name the same point.
void triangle_test(benchmark::State& state) {
    const Target target;
    const auto& stored = target.bvh.tree().blocks;
    const std::vector<TriangleBlock<float>> blocks(stored.begin(), stored.begin() + 16);
    std::vector<ShearedRay<float>> sheared;
    for (const Rayf& ray : target.rays) sheared.emplace_back(ray);
    constexpr float t_min = 0, t_max = 1e30f;
    std::size_t hits = 0;
    for (std::size_t i = 0; i < sheared.size(); ++i)
        for (const auto& block : blocks) {
            const auto hit = intersect<HitRules{}, 4>(sheared[i], block, block, t_min, t_max);
            for (unsigned lanes = bits(hit.mask); lanes != 0; lanes &= lanes - 1, ++hits) {
                const int lane = std::countr_zero(lanes);
                const UVec3 face = target.faces[block.primitive[lane]];
                const Vec3f a = target.vertices[face.x], b = target.vertices[face.y], c = target.vertices[face.z];
                const Vec3f p = a + hit.u[lane] * (b - a) + hit.v[lane] * (c - a);
                if (!(length(p - target.rays[i].origin - hit.t[lane] * target.rays[i].direction) < 1e-5f))
                    return state.SkipWithError("a hit does not lie where its weights say");
            }
        }
    if (hits == 0) return state.SkipWithError("nothing was hit");
    std::size_t i = 0;
    for (auto _ : state) {
        auto hit = intersect<HitRules{}, 4>(sheared[i % 64], blocks[i % 16], blocks[i % 16], t_min, t_max);
        benchmark::DoNotOptimize(hit);
        i = (i + 1) % 1023;
    }
    state.counters["hit_rate"] = double(hits) / double(64 * 16);
}
BENCHMARK(triangle_test);

/// What a query does before its first box.
void ray_setup(benchmark::State& state) {
    const Target target;
    std::size_t i = 0;
    for (auto _ : state) {
        detail::SlabRay<float> slabs;
        slabs.start(target.rays[i], target.bvh.tree());
        ShearedRay<float> sheared(target.rays[i]);
        benchmark::DoNotOptimize(slabs);
        benchmark::DoNotOptimize(sheared);
        i = (i + 1) % target.rays.size();
    }
}
BENCHMARK(ray_setup);

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
