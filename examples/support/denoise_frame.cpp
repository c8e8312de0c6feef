#include "denoise_frame.hpp"

lambent::Denoised<float> denoise_frame(const lambent::PixelData<float>& frame, const lambent::DenoiseOptions& options,
                                       lambent::ThreadExecutor& threads) {
    return denoise(frame, options, threads);
}
