// libFuzzer target: what `denoise` does with an EXR's channels, under any renderer's names and with any bits in them. Must
// give a finite image, the same for two threads, and errors that are not negative; or an Error.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise.hpp>
#include <lambent/io/exr_frame.hpp>

namespace {

void demand(bool holds) {
    if (!holds) std::abort();
}

constexpr std::array channels{
    "R", "G", "B", "A", "Z", "noisy.R", "noisy.G", "noisy.B", "emission.R", "emission.G", "emission.B", "albedo.R",
    "albedo.G", "albedo.B", "N.X", "N.Y", "N.Z", "P.X", "P.Y", "P.Z", "material.Y", "samples.Y", "variance.R",
    "variance.G", "variance.B", "ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B",
    "ViewLayer.Denoising Albedo.R", "ViewLayer.Denoising Albedo.G", "ViewLayer.Denoising Albedo.B",
    "ViewLayer.Denoising Normal.X", "ViewLayer.Denoising Normal.Y", "ViewLayer.Denoising Normal.Z",
    "ViewLayer.Depth.Z", "ViewLayer.Debug Sample Count.X", "aov.sh_normal.X", "aov.sh_normal.Y", "aov.sh_normal.Z",
    "position.X", "position.Y", "position.Z", "Albedo.R", "Albedo.G", "Albedo.B", "Ns.X", "Ns.Y", "Ns.Z",
    "Variance.R", "Variance.G", "Variance.B", "RelativeVariance.R"};

/// The data as numbers, over and over; 0 where there is none.
class Numbers {
public:
    Numbers(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
    std::uint8_t byte() { return size_ == 0 ? std::uint8_t(0) : data_[at_++ % size_]; }
    float any() {
        std::array<std::uint8_t, 4> bytes;
        for (std::uint8_t& b : bytes) b = byte();
        float x;
        std::memcpy(&x, bytes.data(), 4);
        return x;
    }
    /// mostly what images hold
    float value() {
        const std::uint8_t kind = byte();
        return kind == 255 ? any() : float(kind) / 64;
    }

private:
    const std::uint8_t* data_;
    std::size_t size_, at_ = 0;
};

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace lambent;
    Numbers in(data, size);
    constexpr std::array methods{"best", "balanced", "fast", "separable", "reuse_2d", "naive_2d", "seed", "none"};
    const char* const method = methods[in.byte() % methods.size()];
    ExrImage image;
    image.width = 1 + in.byte() % 6;
    image.height = 1 + in.byte() % 5;
    const bool statistics = in.byte() % 2 == 0;
    const auto add = [&](std::string name) {
        ExrChannel channel{std::move(name), ExrType::float32, {}};
        for (int i = image.width * image.height; i > 0; --i) channel.values.push_back(in.value());
        image.channels.push_back(std::move(channel));
    };
    for (int i = 4 + in.byte() % 40; i > 0; --i) add(channels[in.byte() % channels.size()]);
    for (const char* name : {"R", "G", "B"}) add(name);
    PixelData<float> named;
    if (statistics)
        detail::for_each_statistic(named, [&](const char* layer, std::string_view suffixes, auto&) {
            for (const char suffix : suffixes) add(std::string(layer) + "." + suffix);
        });
    try {
        const PixelData<float> frame = frame_from_exr(image);
        DenoiseOptions options = denoise_options(method);
        options.kernel = std::min(options.kernel, 7);
        SerialExecutor serial;
        // Most by the windows that take the least time: five times as many executions.
        const bool coarse = options.noise == NoiseUse::coarse_regression;
        const bool small = (coarse || options.noise == NoiseUse::regression) && has_light_statistics(frame.view()) &&
                           in.byte() % 16 != 0;
        const auto run = [&](auto& executor) {
            if (!small) return denoise(frame, options, executor);
            Denoised<float> out{Plane<float, 3>(frame.width, frame.height), Plane<float, 3>(frame.width, frame.height), {}};
            denoise_light<float>(frame.view(), out.radiance.view(), {.radius = 1, .stride = coarse ? 2 : 1}, executor,
                                 out.error.view());
            return out;
        };
        const Denoised<float> clean = run(serial);
        if (options.kernel > 0)
            for (const float v : clean.radiance.values()) demand(is_finite(v));
        if (!clean.error.absent())
            for (const float v : clean.error.values()) demand(v >= 0);
        static ThreadExecutor threads(2);
        if (in.byte() % 32 == 0) { // often enough
            const Denoised<float> again = run(threads);
            demand(std::memcmp(again.radiance.values().data(), clean.radiance.values().data(),
                               clean.radiance.values().size() * sizeof(float)) == 0);
        }
        const ExrImage out = to_exr(frame, {.denoised = clean.radiance.view(), .error = clean.error.view()});
        demand(out.width == image.width && out.height == image.height);
    } catch (const Error&) {
    }
    return 0;
}
