#pragma once
#include <lambent/core/config.hpp>
#include <algorithm>
#include <cstddef>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {

/// Planes with a rim that repeats the border, split by columns modulo the stride, so that every stride-th pixel of a
/// row lies beside the next in memory, whichever pixel it starts from.
template <class T>
class PhasedPlanes {
public:
    static constexpr int rim = 16, rim_y = 11; ///< pixels left and right, above and below
    static constexpr int tile = 64;            ///< as wide as the widest reads, which begin at its multiples

    PhasedPlanes(int width, int height, int channels, int stride)
        : stride_(stride), row_(((width + tile - 1) / tile * tile + 2 * rim) / stride), rows_(height + 2 * rim_y),
          // not at a multiple of 4096 bytes from each other, where they would compete for the same places of caches
          channel_((std::size_t(stride) * std::size_t(rows_) * std::size_t(row_) + 1023) / 1024 * 1024 + 80),
          values_(std::size_t(channels) * channel_) {}

    /// Where pixel (x, y) lies in each channel, x from -rim on and y from -rim_y; pixels (x + stride · i, y) lie behind it.
    std::size_t at(int x, int y) const {
        const int column = x + rim, phase = column % stride_;
        return (std::size_t(phase) * std::size_t(rows_) + std::size_t(y + rim_y)) * std::size_t(row_) +
               std::size_t(column / stride_);
    }
    T* channel(int c) { return values_.data() + std::size_t(c) * channel_; }
    const T* channel(int c) const { return values_.data() + std::size_t(c) * channel_; }

    template <class F> // f(x, y) of a pixel inside
    void fill(int c, int width, int height, F&& f) {
        fill_rows(c, width, height, [&](int y, T* row) {
            for (int x = 0; x < width; ++x) row[x] = f(x, y);
        });
    }
    template <class F> // f(y, row): writes the row's pixels
    void fill_rows(int c, int width, int height, F&& f) {
        std::vector<T> row(std::size_t(width + 2 * rim));
        for (int y = 0; y < height; ++y) {
            f(y, row.data() + rim);
            std::fill_n(row.begin(), rim, row[std::size_t(rim)]);
            std::fill_n(row.end() - rim, rim, row[std::size_t(width + rim - 1)]);
            for (int at = y == 0 ? -rim_y : y; at < (y == height - 1 ? height + rim_y : y + 1); ++at)
                for (int phase = 0; phase < stride_; ++phase) {
                    T* const out = channel(c) + (std::size_t(phase) * std::size_t(rows_) + std::size_t(at + rim_y)) *
                                                    std::size_t(row_);
                    const T* const from = row.data() + phase;
                    const int count = (width + 2 * rim - phase + stride_ - 1) / stride_;
                    if (stride_ == 1) std::copy_n(from, count, out);
                    else if (stride_ == 2) for (int i = 0; i < count; ++i) out[i] = from[2 * i]; // as packs
                    else for (int i = 0; i < count; ++i) out[i] = from[stride_ * i];
                }
        }
    }

private:
    int stride_, row_, rows_;
    std::size_t channel_;
    std::vector<T> values_;
};

} // namespace detail

} // namespace LAMBENT_ABI
} // namespace lambent
