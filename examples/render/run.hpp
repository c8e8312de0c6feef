#pragma once
#include "job.hpp"
#include "options.hpp"
#include "passes.hpp"
#include <string>

/// The whole program after its command line; returns the exit code: 0, or 130 after an interrupt.
/// throws lambent::Error, UsageError
int run(const Options& options);

/// Fails unless all files that the options name can be made. throws lambent::Error
void check_files(const Options& options);

/// What was rendered, for write_results().
struct Work {
    lambent::RayCounts rays{};
    std::uint64_t background_samples = 0; ///< of `samples`, that were not traced
    double rendering_s = 0, saving_s = 0;
    std::uint64_t samples = 0; ///< of all pixels
    unsigned threads = 1;
};

/// Writes the image, its state where `keep_state`, the statistics, and prints the report; `since_start` is of the whole run.
/// throws lambent::Error
void write_results(Job& job, const lambent::FilmState<float>& state, Work work, bool keep_state,
                   const Stopwatch& since_start);

/// The command line that goes on from the state that these options save, for a shell.
std::string how_to_go_on(const Options& options);
