#pragma once
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <doctest/doctest.h>
#include <string_view>

/// What the stress suite has in common: two sizes, and the table of what was found.
namespace lambent_test {

/// Whether the long suite runs (tests/stress.sh): the environment variable LAMBENT_STRESS is "full".
inline bool stress_in_full() {
    const char* const size = std::getenv("LAMBENT_STRESS");
    return size != nullptr && std::string_view(size) == "full";
}

/// The number of inputs of this run's size.
inline std::uint64_t inputs(double quick, double full) { return std::uint64_t(stress_in_full() ? full : quick); }

/// What a property was tried on and what came out. `worst` and `naive` are one figure, such as a relative error or a
/// share of wrong answers, of the library and of the textbook's way on the same inputs.
struct StressRow {
    const char* subject;
    const char* property;
    double inputs;
    double failures; ///< inputs that broke the property
    double worst;    ///< figure
    double bound;    ///< of the figure
    double naive;    ///< exceeds the bound, or the test would see no fault
};

/// Prints a line of the table, and checks it: no failures, a figure within its bound, a naive one beyond it.
inline void record(const StressRow& row) {
    std::printf("STRESS %-13s | %-88s | %9.3g | %8.0f | %9.2e | %8.1e | %9.2e\n", row.subject, row.property, row.inputs,
                row.failures, row.worst, row.bound, row.naive);
    std::fflush(stdout);
    CAPTURE(row.property);
    CHECK(row.inputs > 0);
    CHECK(row.failures == 0);
    CHECK(row.worst <= row.bound);
    CHECK(row.naive > row.bound);
}

} // namespace lambent_test
