#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/vec.hpp>
#include <cstddef>
#include <string>
#include <type_traits>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Steps between neighbours, in elements (not bytes); 0 asks for the dense default.
struct PixelStrides {
    std::ptrdiff_t pixel = 0;   ///< to the pixel on the right; default: the number of channels
    std::ptrdiff_t row = 0;     ///< to the row below; default: width · pixel
    std::ptrdiff_t channel = 0; ///< to the pixel's next channel; default: 1
};

/// A rectangle of pixels in the caller's memory, C channels of T each; never owns. `T` may be const.
/// Row 0 is the top. `load` gives a T for C = 1, else a Vec2, Vec3 or Vec4 of T.
template <class T, int C>
class PixelView {
public:
    static_assert(C >= 1 && C <= 4);
    using Scalar = std::remove_const_t<T>;
    using Value = std::conditional_t<C == 1, Scalar, glm::vec<C, Scalar>>;
    static constexpr int channels = C;

    PixelView() = default; ///< an absent plane: 0 × 0

    /// throws lambent::Error on a negative size or a null pointer with pixels behind it
    PixelView(T* data, int width, int height, PixelStrides strides = {})
        : data_(data), width_(width), height_(height), strides_(strides) {
        require(width >= 0 && height >= 0 && (data != nullptr || std::size_t(width) * std::size_t(height) == 0),
                [&] {
                    return "PixelView: no pixels behind " + std::to_string(width) + " x " + std::to_string(height);
                });
        if (strides_.channel == 0) strides_.channel = 1;
        if (strides_.pixel == 0) strides_.pixel = C;
        if (strides_.row == 0) strides_.row = strides_.pixel * width;
    }

    operator PixelView<const T, C>() const
        requires(!std::is_const_v<T>)
    {
        return absent() ? PixelView<const T, C>() : PixelView<const T, C>(data_, width_, height_, strides_);
    }

    int width() const { return width_; }
    int height() const { return height_; }
    bool absent() const { return data_ == nullptr; }
    T* data() const { return data_; }
    PixelStrides strides() const { return strides_; }

    T* pixel(int x, int y) const { return data_ + y * strides_.row + x * strides_.pixel; }

    Value load(int x, int y) const {
        const T* p = pixel(x, y);
        if constexpr (C == 1) {
            return *p;
        } else {
            Value value;
            for (int c = 0; c < C; ++c) value[c] = p[c * strides_.channel];
            return value;
        }
    }

    void store(int x, int y, const Value& value) const
        requires(!std::is_const_v<T>)
    {
        T* p = pixel(x, y);
        if constexpr (C == 1) {
            *p = value;
        } else {
            for (int c = 0; c < C; ++c) p[c * strides_.channel] = value[c];
        }
    }

private:
    T* data_ = nullptr;
    int width_ = 0, height_ = 0;
    PixelStrides strides_{};
};

/// A view of three channels over the caller's array, RGB or the first three of more: `{.pixel = 4}` for RGBA.
template <class T>
PixelView<T, 3> rgb_view(T* data, int width, int height, PixelStrides strides = {}) {
    return {data, width, height, strides};
}

/// A view of one channel over the caller's array.
template <class T>
PixelView<T, 1> scalar_view(T* data, int width, int height, PixelStrides strides = {}) {
    return {data, width, height, strides};
}

/// Fails with both sizes in the message unless they are equal.
template <class A, class B>
void require_same_size(const char* what, const A& a, const B& b) {
    require(a.width() == b.width() && a.height() == b.height(), [&] {
        const auto size = [](int w, int h) { return std::to_string(w) + " x " + std::to_string(h); };
        return std::string(what) + ": sizes differ, " + size(a.width(), a.height()) + " and " +
               size(b.width(), b.height());
    });
}

} // namespace LAMBENT_ABI
} // namespace lambent
