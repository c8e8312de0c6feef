#pragma once
#include "process.hpp"
#include <filesystem>
#include <fstream>
#include <lambent/core/error.hpp>
#include <string>
#include <vector>
#if __has_include(<valgrind/callgrind.h>)
#include <valgrind/callgrind.h>
#endif

/// Instructions counted by valgrind's callgrind, which executes a program's instructions one by one: exact and the same
/// each time, but for a processor without AVX-512. A program that is to count starts itself again with count_instructions();
/// what runs then is_counting() and asks instructions_of().
#if defined(CALLGRIND_START_INSTRUMENTATION)
inline bool is_counting() { return RUNNING_ON_VALGRIND > 0; }

/// What callgrind wrote last: it goes from file to file, counts.1 and so on.
inline double last_count() {
    static int number = 0;
    const std::string name = "counts." + std::to_string(++number);
    std::ifstream file(name);
    for (std::string line; std::getline(file, line);)
        if (line.starts_with("summary: ")) return std::stod(line.substr(9));
    lambent::fail(name + ": callgrind wrote no summary");
}

/// The instructions that f() takes, in a program that is_counting().
template <class F>
double instructions_of(F&& f) {
    CALLGRIND_START_INSTRUMENTATION;
    CALLGRIND_ZERO_STATS;
    f();
    CALLGRIND_DUMP_STATS;
    CALLGRIND_STOP_INSTRUMENTATION;
    return last_count();
}
#else
inline bool is_counting() { return false; }
template <class F>
double instructions_of(F&&) {
    lambent::fail("built without valgrind's headers");
}
#endif

/// Runs this program with these arguments again, under callgrind; what it prints is printed. What it lacks is said.
/// throws lambent::Error where it can't be run, or does not end with 0
inline void count_instructions([[maybe_unused]] const std::vector<std::string>& arguments) {
#if !defined(CALLGRIND_START_INSTRUMENTATION)
    lambent::fail("counting instructions takes valgrind (Debian: valgrind) when the benchmarks are configured and built");
#elif defined(__AVX512F__)
    lambent::fail("built for AVX-512, which valgrind does not know: bench_instructions is the same without");
#else
    const TemporaryFolder folder; // callgrind's files are named relative to it
    std::vector<std::string> words = {"valgrind", "-q", "--tool=callgrind", "--instr-atstart=no", "--callgrind-out-file=counts",
                                      std::filesystem::read_symlink("/proc/self/exe").string()};
    words.insert(words.end(), arguments.begin(), arguments.end());
    const std::filesystem::path here = std::filesystem::current_path();
    std::filesystem::current_path(folder.path);
    run_process(words, Output::kept);
    std::filesystem::current_path(here);
#endif
}
