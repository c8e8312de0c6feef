// The same work in units for SSE2, AVX, AVX2 and AVX-512 within one program: which outputs have the same bits
// everywhere, and how far apart the others are. Between builds that both have fused products, or both have not,
// distances and filters along lines have the same bits too; filters over windows sum in another order for each width.
// What the machine cannot run is left out. The quick suite has SSE2 and AVX2 alone.
#include "stress/layouts/report.hpp"
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>

LayoutReport sse2_report();
LayoutReport avx_report();
LayoutReport avx2_report();
LayoutReport avx512_report();

namespace {

int failures = 0;

void line(const char* property, std::size_t inputs, std::size_t failed, double worst, double bound, double naive) {
    std::printf("STRESS %-13s | %-88s | %9.3g | %8zu | %9.2e | %8.1e | %9.2e\n", "bits", property, double(inputs),
                failed, worst, bound, naive);
    failures += failed > 0 || !(worst <= bound) ? 1 : 0;
}

template <class V>
std::size_t different(const std::vector<V>& a, const std::vector<V>& b) {
    if (a.size() != b.size()) return a.size() + b.size();
    std::size_t n = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        n += std::bit_cast<std::uint32_t>(a[i]) != std::bit_cast<std::uint32_t>(b[i]);
    return n;
}

double relative(const std::vector<float>& a, const std::vector<float>& b) {
    double worst = a.size() == b.size() ? 0 : 1e9;
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
        worst = std::max(worst, std::abs(double(a[i]) - double(b[i])) / std::max(1e-3, std::abs(double(b[i]))));
    return worst;
}

} // namespace

int main() {
    std::vector<LayoutReport> reports{sse2_report()};
#if defined(LAMBENT_ALL_LAYOUTS)
    if (__builtin_cpu_supports("avx")) reports.push_back(avx_report());
#endif
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) reports.push_back(avx2_report());
#if defined(LAMBENT_ALL_LAYOUTS)
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512bw"))
        reports.push_back(avx512_report());
#endif
    for (const LayoutReport& r : reports)
        std::printf("unit %s: %d lanes, fma %s\n", r.flags.c_str(), r.lanes, r.fma ? "yes" : "no");
    const auto compare = [](const LayoutReport& r, const LayoutReport& first) {
        std::printf("%s against %s\n", r.flags.c_str(), first.flags.c_str());
        // The naive figure of outputs equal by design: distances, whose rounding depends on the machine's products.
        const double share = double(different(first.t, r.t)) / double(r.t.size());
        const auto equal = [&](const char* property, const auto& a, const auto& b) {
            const std::size_t n = different(a, b);
            line(property, a.size(), n, double(n) / double(a.size()), 0, share);
        };
        equal("samplers' points -> share of different bits; naive: distances", first.points, r.points);
        equal("films' sums -> share of different bits; naive: distances", first.film, r.film);
        equal("729 slab cases, zeros of both signs -> share of different bits; naive: distances", first.slabs, r.slabs);
        equal("rays -> share that hits another triangle; naive: distances", first.primitives, r.primitives);
        if (r.fma == first.fma) {
            line("rays -> share of distances of different bits", r.t.size(), different(r.t, first.t), share, 0, 0);
            line("filters along lines -> values of different bits", r.lines.size(), different(r.lines, first.lines), 0,
                 0, 0);
        }
        // At grazing hits, where the last bits of the edge functions count.
        line("rays -> relative difference of distances", r.t.size(), 0, relative(r.t, first.t), 1e-4, share);
        line("filters along lines -> relative difference", r.lines.size(), 0, relative(r.lines, first.lines), 1e-5, 0);
        line("filters over windows -> relative difference", r.windows.size(), 0, relative(r.windows, first.windows),
             1e-5, 0);
        std::printf("different bits: distances %.3g, lines %.3g, windows %.3g\n", share,
                    double(different(first.lines, r.lines)) / double(r.lines.size()),
                    double(different(first.windows, r.windows)) / double(r.windows.size()));
    };
    for (std::size_t i = 1; i < reports.size(); ++i) compare(reports[i], reports[0]);
    for (std::size_t i = 1; i < reports.size(); ++i)
        for (std::size_t k = i + 1; k < reports.size(); ++k)
            if (reports[i].fma && reports[k].fma) compare(reports[k], reports[i]);
    if (reports.size() == 1) std::printf("SKIPPED: layouts, this machine has no AVX2\n");
    return failures == 0 ? 0 : 1;
}
