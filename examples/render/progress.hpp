#pragma once
#include "../support/stopwatch.hpp"
#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>

/// How far a render is, on stderr: a bar on a terminal, elsewhere a line now and then. Samples are those of all pixels.
class Progress {
public:
    enum class Style : std::uint8_t { none, lines, bar };

    /// A bar where stderr is a terminal.
    static Style style(bool quiet);

    Progress(Style style, double time_limit) : style_(style), time_limit_(time_limit) {}
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    /// How many samples the render takes, as far as is known; 0 = unknown.
    void expect(double samples) { expected_ = samples; }
    /// Words beside the numbers.
    void note(const std::string& text) { note_ = text; }
    /// So many samples are done. Called by any thread, often; takes a look at the clock.
    void at(double samples);

private:
    void show(double samples, double seconds);

    const Style style_;
    const double time_limit_;
    const Stopwatch watch_;
    std::atomic<double> due_ = 0; ///< seconds, when to show the next
    std::mutex showing_;
    double expected_ = 0;
    bool shown_ = false;
    std::string note_;
};
