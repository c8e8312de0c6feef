#pragma once
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <lambent/core/error.hpp>
#include <string>
#include <vector>

/// A folder that is gone afterwards.
struct TemporaryFolder {
    std::filesystem::path path;
    TemporaryFolder() {
        std::string name = (std::filesystem::temp_directory_path() / "lambent_peers_XXXXXX").string();
        lambent::require(mkdtemp(name.data()) != nullptr, [&] { return name + ": cannot be made"; });
        path = name;
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    ~TemporaryFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path, ignored);
    }
};

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

/// One object of the output: its members in order, the texts among them first.
class Line {
public:
    explicit Line(bool json) : json_(json) {}
    ~Line() {
        std::puts(json_ ? (text_ + "}").c_str() : text_.c_str());
        std::fflush(stdout);
    }
    Line(const Line&) = delete;
    Line& operator=(const Line&) = delete;

    Line& add(const char* key, const std::string& value) { return add(key, "\"" + value + "\"", value, -26); }
    Line& add(const char* key, double value) {
        char number[32];
        std::snprintf(number, sizeof number, json_ ? "%.6g" : "%.4g", value);
        return add(key, number, (in_words_ ? std::string(key) + " " : "") + number, 10);
    }
    /// From here on numbers stand behind their names in the table too.
    Line& words() { return in_words_ = true, *this; }

private:
    Line& add(const char* key, const std::string& value, const std::string& cell, int width) {
        char padded[128];
        std::snprintf(padded, sizeof padded, "%*s", width, cell.c_str());
        if (json_) text_ += (text_.empty() ? "{\"" : ", \"") + std::string(key) + "\": " + value;
        else text_ += (text_.empty() ? "" : " ") + std::string(padded);
        return *this;
    }
    bool json_, in_words_ = false;
    std::string text_;
};
