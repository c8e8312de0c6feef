#pragma once
#include <lambent/core/error.hpp>
#include <lambent/film/pixel_data.hpp>
#include <lambent/film/pixel_view.hpp>
#include <lambent/film/region.hpp>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Calls f with each plane of a frame, absent ones too, and the same one of each other: references to their views.
template <class F, class... Frames> // FrameView<T>, const or not
void for_each_plane(F&& f, Frames&... frames) {
    f(frames.radiance...), f(frames.emission...), f(frames.albedo...), f(frames.normal...), f(frames.position...);
    f(frames.variance...), f(frames.depth...), f(frames.material...), f(frames.samples...);
    f(frames.direct...), f(frames.indirect...);
    f(frames.root_direct...), f(frames.root_direct_variance...);
    f(frames.root_indirect...), f(frames.root_indirect_variance...);
    f(frames.albedo_variance...), f(frames.normal_variance...), f(frames.depth_variance...);
    f(frames.halves...), f(frames.root_direct_halves...), f(frames.root_indirect_halves...);
}

/// throws lambent::Error when a plane has another size than the radiance
template <class T>
void require_equal_sizes(const char* what, const FrameView<T>& frame) {
    const auto check = [&](const auto& plane) {
        if (!plane.absent()) require_same_size(what, frame.radiance, plane);
    };
    for_each_plane(check, frame);
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
    for_each_plane([&](auto& plane) { plane = window_of(plane, window); }, frame);
    return frame;
}

} // namespace LAMBENT_ABI
} // namespace lambent
