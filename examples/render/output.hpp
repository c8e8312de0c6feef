#pragma once
#include "options.hpp"
#include <csignal>

/// Set by Ctrl-C; the pass under way is dropped and what there is saved.
extern volatile std::sig_atomic_t interrupted;

/// The whole program after its command line; returns the exit code. throws lambent::Error, UsageError
int run(const Options& options);
