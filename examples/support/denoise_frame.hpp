#pragma once
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise.hpp>

/// lambent::denoise() of a whole frame: compiled once for all programs and benchmarks.
lambent::Denoised<float> denoise_frame(const lambent::PixelData<float>& frame, const lambent::DenoiseOptions& options,
                                       lambent::ThreadExecutor& threads);
