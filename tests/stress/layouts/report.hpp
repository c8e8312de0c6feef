#pragma once
#include <cstdint>
#include <string>
#include <vector>

/// What one unit of the program, compiled for one set of instructions, works out from the same inputs.
struct LayoutReport {
    std::string flags;
    int lanes = 0;
    bool fma = false;
    std::vector<std::uint32_t> points, slabs,
        primitives;                             ///< of samplers, of 729 slab cases in whole numbers, of rays hit
    std::vector<float> film, t, lines, windows; ///< sums of samples, rays' distances, images filtered
};
