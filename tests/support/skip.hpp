#pragma once
#include <cstdio>
#include <string>

namespace lambent_test {

/// Says loudly that a test did not run and why; tests/run.sh counts these lines. Return from the test after
/// it.
inline void skip(const std::string& what) {
    std::printf("SKIPPED: %s\n", what.c_str());
    std::fflush(stdout);
}

} // namespace lambent_test
