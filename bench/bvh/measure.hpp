#pragma once
#include "contender.hpp"
#include "embree.hpp"
#include "results.hpp"
#include <vector>

/// How a measurement is made.
struct Measuring {
    int rounds = 7;
    unsigned threads = 1; ///< 1: CPU time; more: rays in parts to a pool of threads, by the clock on the wall
};

/// Answers the rays by every contender in turn, round after round, after one that isn't timed; checks every answer
/// against the reference's. Speeds are from medians; ratios are medians of the rounds' ratios to the contender
/// "high" of each Embree.
std::vector<Result> measure_rays(const RayClass& rays, const std::vector<Contender>& contenders,
                                 const Contender& reference, double diagonal, const Measuring& measuring);

/// Builds each library's tree in each quality in turn, on this thread. Ratios: fast and medium, best and high.
std::vector<Result> measure_builds(const Soup& soup, const std::vector<EmbreeLibrary>& libraries, int rounds);
