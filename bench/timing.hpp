#pragma once
#include <algorithm>
#include <ctime>
#include <vector>

/// Spent by this process, all threads together.
inline double cpu_seconds() { return double(std::clock()) / CLOCKS_PER_SEC; }

/// Of an even number of values, the mean of the middle two; 0 of none.
inline double median(std::vector<double> v) {
    if (v.empty()) return 0;
    std::sort(v.begin(), v.end());
    const std::size_t middle = v.size() / 2;
    return v.size() % 2 == 1 ? v[middle] : (v[middle - 1] + v[middle]) / 2;
}
