#pragma once
#include "options.hpp"

/// `render --pixel x,y`: prints the path of each of the pixel's samples, and the pixel that they make. Returns the exit
/// code: 1 where that is not the image's pixel to the bit. throws lambent::Error, UsageError
int show_pixel(const Options& options);
