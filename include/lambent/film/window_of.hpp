#pragma once
#include <lambent/core/error.hpp>
#include <lambent/film/pixel_data.hpp>
#include <lambent/film/pixel_view.hpp>
#include <lambent/film/region.hpp>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Calls f with each plane of a frame, a reference to its view; absent ones too.
template <class Frame, class F> // FrameView<T>, const or not
void for_each_plane(Frame& frame, F&& f) {
    f(frame.radiance), f(frame.emission), f(frame.albedo), f(frame.normal), f(frame.position), f(frame.variance);
    f(frame.depth), f(frame.material), f(frame.samples);
    f(frame.direct), f(frame.indirect), f(frame.root_direct), f(frame.root_direct_variance);
    f(frame.root_indirect), f(frame.root_indirect_variance);
    f(frame.albedo_variance), f(frame.normal_variance), f(frame.depth_variance);
    f(frame.halves), f(frame.root_direct_halves), f(frame.root_indirect_halves);
}

/// A window of a view, where it lies; absent stays absent.
/// throws lambent::Error when the window does not lie within it
template <class T, int C>
PixelView<T, C> window_of(const PixelView<T, C>& view, const PixelWindow& window) {
    if (view.absent()) return {};
    require(window.inside(view.width(), view.height()), "window_of: the window does not lie within the view");
    return {view.pixel(window.x0, window.y0), window.width(), window.height(), view.strides()};
}

/// A window of all planes of a frame.
template <class T>
FrameView<T> window_of(FrameView<T> frame, const PixelWindow& window) {
    for_each_plane(frame, [&](auto& plane) { plane = window_of(plane, window); });
    return frame;
}

} // namespace LAMBENT_ABI
} // namespace lambent
