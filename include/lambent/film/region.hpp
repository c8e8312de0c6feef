#pragma once
#include <lambent/core/config.hpp>
#include <algorithm>

namespace lambent {
inline namespace LAMBENT_ABI {

/// A rectangle of pixels [x0, x1) × [y0, y1) of an image; row 0 is the top.
struct PixelWindow {
    int x0 = 0, y0 = 0, x1 = 0, y1 = 0;

    bool empty() const { return x0 >= x1 || y0 >= y1; }
    int width() const { return x1 - x0; }
    int height() const { return y1 - y0; }
    /// Whether it lies within an image of this size.
    bool inside(int image_width, int image_height) const {
        return x0 >= 0 && y0 >= 0 && x1 <= image_width && y1 <= image_height;
    }
    /// With so many pixels more on each side, as far as an image of this size has them.
    PixelWindow grown(int by, int image_width, int image_height) const {
        return {std::max(0, x0 - by), std::max(0, y0 - by), std::min(image_width, x1 + by),
                std::min(image_height, y1 + by)};
    }
    /// What it has in common with another; empty where that is nothing.
    PixelWindow common(const PixelWindow& other) const {
        return {std::max(x0, other.x0), std::max(y0, other.y0), std::min(x1, other.x1), std::min(y1, other.y1)};
    }
    /// The same pixels as another window counts them, from its corner on.
    PixelWindow seen_from(const PixelWindow& other) const {
        return {x0 - other.x0, y0 - other.y0, x1 - other.x0, y1 - other.y0};
    }
    friend bool operator==(const PixelWindow&, const PixelWindow&) = default;
};

} // namespace LAMBENT_ABI
} // namespace lambent
