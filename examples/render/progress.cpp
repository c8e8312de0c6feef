#include "progress.hpp"
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <unistd.h>

namespace {

/// 1234567 as "1.23 M".
std::string with_unit(double count) {
    const char* units[] = {"", " k", " M", " G", " T"};
    std::size_t unit = 0;
    for (; count >= 1000 && unit + 1 < std::size(units); ++unit) count /= 1000;
    char text[32];
    std::snprintf(text, sizeof text, "%.3g%s", count, units[unit]);
    return text;
}

/// h:mm:ss or m:ss
std::string clock_time(double seconds) {
    const auto s = static_cast<unsigned long long>(std::clamp(std::ceil(seconds), 0.0, 1e12));
    char text[48];
    if (s >= 3600) std::snprintf(text, sizeof text, "%llu:%02llu:%02llu", s / 3600, s / 60 % 60, s % 60);
    else std::snprintf(text, sizeof text, "%llu:%02llu", s / 60, s % 60);
    return text;
}

constexpr double bar_every_s = 0.1, first_line_s = 2, line_every_s = 60;

} // namespace

Progress::Style Progress::style(bool quiet) {
    return quiet ? Style::none : isatty(STDERR_FILENO) != 0 ? Style::bar : Style::lines;
}

Progress::~Progress() {
    if (style_ == Style::bar && shown_) std::fprintf(stderr, "\n");
}

void Progress::at(double samples) {
    if (style_ == Style::none) return;
    const double seconds = watch_.seconds();
    if (style_ == Style::lines && seconds < first_line_s) return;
    const bool done = expected_ > 0 && samples >= expected_; // a bar shows its end
    if (seconds < due_.load(std::memory_order_relaxed) && !(done && style_ == Style::bar)) return;
    const std::unique_lock lock(showing_, std::try_to_lock);
    if (!lock) return;
    due_ = seconds + (style_ == Style::bar ? bar_every_s : std::min(line_every_s, seconds)); // 2, 4, 8 … s, then minutes
    show(samples, seconds);
}

void Progress::show(double samples, double seconds) {
    const double rate = samples / std::max(1e-9, seconds);
    double left = time_limit_ - seconds;
    std::string line;
    if (expected_ > 0) {
        const double part = std::clamp(samples / expected_, 0.0, 1.0);
        left = std::min(left, (expected_ - samples) / std::max(1e-9, rate));
        if (style_ == Style::bar) {
            constexpr int width = 24;
            const int filled = int(std::floor(part * width));
            line.append("[").append(std::size_t(filled), '#').append(std::size_t(width - filled), '.').append("] ");
        }
        char text[16];
        std::snprintf(text, sizeof text, "%.*f %%, ", style_ == Style::bar ? 0 : 1, std::floor(1000 * part) / 10);
        line += text;
    }
    line += with_unit(samples) + " samples, " + with_unit(rate) + "/s";
    if (samples > 0 && std::isfinite(left)) line += ", " + clock_time(left) + " left";
    if (!note_.empty()) line += ", " + note_;
    std::fprintf(stderr, style_ == Style::bar ? "\r%s\033[K" : "%s\n", line.c_str());
    shown_ = true;
}
