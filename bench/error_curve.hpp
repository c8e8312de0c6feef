#pragma once
#include <cmath>
#include <cstdint>
#include <vector>

struct Point {
    std::uint64_t spp;
    double seconds, rel_mse;
    double efficiency() const { return 1 / (rel_mse * seconds); }
};

/// Time to a relative error: along the straight line, in logarithms, through the two points that hold it between
/// them; beyond the points as 1 / error.
inline double seconds_to(double target, const std::vector<Point>& points) {
    for (std::size_t i = 1; i < points.size(); ++i) {
        const Point &a = points[i - 1], &b = points[i];
        if (!(a.rel_mse >= target && b.rel_mse < target)) continue;
        const double t = std::log(target / a.rel_mse) / std::log(b.rel_mse / a.rel_mse);
        return a.seconds * std::pow(b.seconds / a.seconds, t);
    }
    const Point& nearest = points.front().rel_mse < target ? points.front() : points.back();
    return nearest.seconds * nearest.rel_mse / target;
}

/// The relative error after a time, likewise.
inline double error_after(double seconds, const std::vector<Point>& points) {
    for (std::size_t i = 1; i < points.size(); ++i) {
        const Point &a = points[i - 1], &b = points[i];
        if (!(a.seconds <= seconds && b.seconds > seconds)) continue;
        const double t = std::log(seconds / a.seconds) / std::log(b.seconds / a.seconds);
        return a.rel_mse * std::pow(b.rel_mse / a.rel_mse, t);
    }
    const Point& nearest = points.front().seconds > seconds ? points.front() : points.back();
    return nearest.rel_mse * nearest.seconds / seconds;
}
