#pragma once
#include <lambent/film/pixel_view.hpp>
#include <algorithm>
#include <cstddef>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Which squares of an image hold light.
class LitBlocks {
public:
    template <class T>
    explicit LitBlocks(const PixelView<const T, 3>& color)
        : across_((color.width() + side - 1) / side), down_((color.height() + side - 1) / side),
          lit_(std::size_t(across_) * std::size_t(down_)) {
        for (int y = 0; y < color.height(); ++y)
            for (int x = 0; x < color.width(); ++x)
                if (color.load(x, y) != Vec3<T>(0)) lit_[std::size_t(y / side * across_ + x / side)] = 1;
    }
    /// Any in a rectangle and as far around it.
    bool any(int x, int y, int across, int down, int around) const {
        for (int j = std::max(0, y - around) / side; j < down_ && j * side < y + down + around; ++j)
            for (int i = std::max(0, x - around) / side; i < across_ && i * side < x + across + around; ++i)
                if (lit_[std::size_t(j * across_ + i)] != 0) return true;
        return false;
    }

private:
    static constexpr int side = 8;
    int across_, down_;
    std::vector<char> lit_;
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
