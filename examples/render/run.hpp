#pragma once
#include "options.hpp"

/// The whole program after its command line; returns the exit code: 0, or 130 after an interrupt.
/// throws lambent::Error, UsageError
int run(const Options& options);
