#include "measure.hpp"
#include "lambent_trees.hpp"
#include <lambent/core/parallel.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>

namespace {

/// How many times as fast as `base`; 0 without one.
double ratio_to(const std::vector<double>* base, const std::vector<double>& seconds) {
    if (base == nullptr) return 0;
    std::vector<double> ratios;
    for (std::size_t i = 0; i < seconds.size(); ++i) ratios.push_back((*base)[i] / seconds[i]);
    return median(std::move(ratios));
}

struct Timed {
    const Contender* contender;
    Answers answers;
    std::vector<double> seconds{};
};

const std::vector<double>* seconds_of(const std::vector<Timed>& all, const std::string& library) {
    for (const Timed& t : all)
        if (t.contender->library == library && t.contender->variant == "high") return &t.seconds;
    return nullptr;
}

double wall_seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double timed_trace(const RayClass& rays, Timed& t, lambent::ThreadExecutor& threads) {
    const std::size_t n = rays.rays.size();
    double (*const now)() = threads.concurrency() == 1 ? cpu_seconds : wall_seconds;
    const double start = now();
    if (threads.concurrency() == 1) {
        t.contender->trace(rays, 0, n, t.answers);
    } else {
        const std::size_t part = std::clamp<std::size_t>(n / (16 * threads.concurrency()), 256, 16384);
        threads.parallel_for(n, part, [&](std::size_t begin, std::size_t end) {
            t.contender->trace(rays, begin, end, t.answers);
        });
    }
    return std::max(now() - start, 1e-6);
}

/// Not the reference's: a hit for a miss, or a distance that is off by more than 1e-4 of itself and of the scene.
bool is_wrong(float t, float reference, double diagonal) {
    const bool hit = t < no_hit, should = reference < no_hit;
    return hit != should || (hit && std::abs(double(t) - reference) > 1e-4 * (double(reference) + diagonal));
}

bool differs(const Answers& a, const Answers& b, std::size_t i) {
    return (a.t[i] < no_hit) != (b.t[i] < no_hit) || a.primitive[i] != b.primitive[i];
}

} // namespace

std::vector<Result> measure_rays(const RayClass& rays, const std::vector<Contender>& contenders,
                                 const Contender& reference, double diagonal, const Measuring& measuring) {
    const std::size_t n = rays.rays.size();
    Answers expected;
    expected.reset(n);
    reference.prepare(rays);
    reference.trace(rays, 0, n, expected);
    reference.finish(rays, expected);

    lambent::ThreadExecutor threads(measuring.threads);
    std::vector<Timed> all;
    for (const Contender& c : contenders) {
        Timed& t = all.emplace_back(Timed{&c, {}});
        t.answers.reset(n);
        c.prepare(rays);
        timed_trace(rays, t, threads); // warm
    }
    for (int round = 0; round < measuring.rounds; ++round)
        for (Timed& t : all) t.seconds.push_back(timed_trace(rays, t, threads));

    std::vector<Result> results;
    const std::vector<double>*embree = seconds_of(all, "embree"), *embree4 = seconds_of(all, "embree4");
    for (Timed& t : all) {
        const Contender& c = *t.contender;
        c.finish(rays, t.answers);
        Result r;
        r.ray_class = rays.name;
        r.library = c.library;
        r.variant = c.variant;
        r.batch = c.batch;
        r.threads = measuring.threads;
        r.rays = n;
        r.build_s = c.build_s;
        r.bytes_per_triangle = c.bytes_per_triangle;
        r.rate = double(n) / median(t.seconds) * 1e-6;
        r.ratio_to_embree = ratio_to(embree, t.seconds);
        r.ratio_to_embree4 = ratio_to(embree4, t.seconds);
        for (std::size_t i = 0; i < n; ++i) {
            if (is_wrong(t.answers.t[i], expected.t[i], diagonal)) ++r.wrong;
            if (differs(t.answers, expected, i)) ++r.differing;
        }
        results.push_back(r);
    }
    return results;
}

std::vector<Result> measure_builds(const Soup& soup, const std::vector<EmbreeLibrary>& libraries, int rounds) {
    struct Builder {
        std::string library, variant, peer; ///< peer: the quality of Embree's with which this one is compared
        std::function<BuildCost()> build;
        BuildCost cost{};
        std::vector<double> seconds{};
    };
    std::vector<Builder> builders;
    const auto add_ours = [&](const char* name, lambent::BuildQuality quality, const char* peer) {
        builders.push_back({"lambent", name, peer, [&soup, quality] { return build_lambent(soup, quality); }});
    };
    add_ours("fast", lambent::BuildQuality::fast, "medium");
    add_ours("balanced", lambent::BuildQuality::balanced, "");
    add_ours("best", lambent::BuildQuality::best, "high");
    const std::pair<const char*, EmbreeQuality> theirs[] = {
        {"low", EmbreeQuality::low}, {"medium", EmbreeQuality::medium}, {"high", EmbreeQuality::high}};
    for (const EmbreeLibrary& library : libraries)
        for (const auto& [name, quality] : theirs)
            builders.push_back({library.name(), name, name,
                                [&soup, &library, q = quality] { return build_embree(library, soup, q); }});

    for (int round = 0; round < rounds; ++round)
        for (Builder& b : builders) {
            b.cost = b.build();
            b.seconds.push_back(std::max(b.cost.seconds, 1e-6));
        }
    const auto seconds = [&](const std::string& library, const std::string& variant) -> const std::vector<double>* {
        for (const Builder& b : builders)
            if (b.library == library && b.variant == variant) return &b.seconds;
        return nullptr;
    };
    std::vector<Result> results;
    for (const Builder& b : builders) {
        Result r;
        r.ray_class = "build";
        r.library = b.library;
        r.variant = b.variant;
        r.build_s = median(b.seconds);
        r.bytes_per_triangle = b.cost.bytes_per_triangle;
        r.rate = double(soup.faces.size()) / r.build_s * 1e-6;
        r.ratio_to_embree = ratio_to(seconds("embree", b.peer), b.seconds);
        r.ratio_to_embree4 = ratio_to(seconds("embree4", b.peer), b.seconds);
        results.push_back(r);
    }
    return results;
}
