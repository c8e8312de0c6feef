#pragma once
#include "options.hpp"

/// `render --validate`: prints what the scene file has, what of it is used, and everything suspicious. Returns the exit
/// code. throws lambent::Error, UsageError
int validate(const Options& options);
