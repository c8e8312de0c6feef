#pragma once
#include "../timing.hpp"
#include "soup.hpp"
#include <cstddef>
#include <functional>
#include <limits>
#include <string>
#include <vector>

inline constexpr float no_hit = std::numeric_limits<float>::infinity();

/// What a library said to a class of rays.
struct Answers {
    std::vector<float> t;                 ///< of the nearest hit, 0 for any hit, no_hit for none
    std::vector<std::uint32_t> primitive; ///< the nearest one; lambent::no_primitive for none, and for any-hit rays

    void reset(std::size_t rays) {
        t.assign(rays, no_hit);
        primitive.assign(rays, lambent::no_primitive);
    }
    void miss(std::size_t i) { t[i] = no_hit, primitive[i] = lambent::no_primitive; }
};

/// A library in one of its modes, over one soup.
struct Contender {
    std::string library, variant;
    bool batch = false; ///< takes many rays a call
    double build_s = 0, bytes_per_triangle = 0;
    /// Makes room before a class is traced; not timed.
    std::function<void(const RayClass&)> prepare = [](const RayClass&) {};
    /// Answers rays [begin, end); timed. Disjoint ranges may run on different threads.
    std::function<void(const RayClass&, std::size_t begin, std::size_t end, Answers&)> trace;
    /// Brings the answers into their common form where `trace` left them in the library's; not timed.
    std::function<void(const RayClass&, Answers&)> finish = [](const RayClass&, Answers&) {};
};

/// What a build took, and what of it rays read.
struct BuildCost {
    double seconds = 0, bytes_per_triangle = 0;
};
