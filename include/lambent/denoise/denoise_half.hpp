#pragma once
#include <lambent/denoise/denoise_tiles.hpp>
#include <lambent/film/half.hpp>
#include <lambent/film/window_of.hpp>
#include <list>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Windows of a frame of halves as floats, until the next is made.
class WidenedWindows {
public:
    explicit WidenedWindows(const FrameView<Half>& frame) : frame_(frame) {}

    FrameView<float> operator()(const PixelWindow& window) {
        planes_.clear();
        FrameView<float> out;
        const auto widen = [&]<int C>(const PixelView<const Half, C>& from, PixelView<const float, C>& to) {
            if (from.absent()) return;
            const PixelView<const Half, C> part = window_of(from, window);
            std::vector<float>& plane = planes_.emplace_back();
            plane.reserve(std::size_t(window.width()) * std::size_t(window.height()) * std::size_t(C));
            for (int y = 0; y < window.height(); ++y)
                for (int x = 0; x < window.width(); ++x)
                    for (int c = 0; c < C; ++c) plane.push_back(float(part.pixel(x, y)[c * part.strides().channel]));
            to = PixelView<const float, C>(plane.data(), window.width(), window.height());
        };
        for_each_plane(widen, frame_, out);
        return out;
    }

private:
    FrameView<Half> frame_;
    std::list<std::vector<float>> planes_;
};

} // namespace detail

/// denoise() of a frame whose planes are 16-bit floats, into 16-bit floats: what the same numbers in float give, rounded.
/// Halves end at 65504 and have steps of a thousandth: moments of bright light, positions and counts of samples beyond
/// 2048 are better kept in float. `out` may be the frame's radiance. `error` as in denoise().
/// threads the same bits for any executor
/// throws  lambent::Error as denoise(), before anything is written
/// memory  six bytes a pixel, and planes of a tile of 512 x 512 as floats
template <Executor E>
DenoiseReport denoise(const FrameView<Half>& frame, const PixelView<Half, 3>& out, const DenoiseOptions& options,
                      E& executor, const PixelView<Half, 3>& error = {}) {
    require(!frame.radiance.absent(), "denoise: the frame has no radiance plane");
    require_same_size("denoise: radiance and output", frame.radiance, out);
    if (!error.absent()) require_same_size("denoise: radiance and error", frame.radiance, error);
    const int width = out.width(), height = out.height();
    require_equal_sizes("denoise: radiance and another plane", frame);
    std::vector<Half> result(3 * std::size_t(width) * std::size_t(height));
    const PixelView<Half, 3> kept(result.data(), width, height);
    const auto copy = [](const auto& from, const PixelView<Half, 3>& to) {
        for (int y = 0; y < to.height(); ++y)
            for (int x = 0; x < to.width(); ++x)
                for (int c = 0; c < 3; ++c)
                    to.pixel(x, y)[c * to.strides().channel] = Half(from.pixel(x, y)[c * from.strides().channel]);
    };
    const DenoiseReport report = denoise_tiles<float>(
        width, height, {}, detail::WidenedWindows(frame),
        [&](const PixelWindow& tile, const PixelView<const float, 3>& radiance, const PixelView<const float, 3>& e) {
            copy(radiance, window_of(kept, tile));
            if (!error.absent() && !e.absent()) copy(e, window_of(error, tile));
        },
        options, executor);
    copy(kept, out);
    return report;
}

} // namespace LAMBENT_ABI
} // namespace lambent
