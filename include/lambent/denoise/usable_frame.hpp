#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/film/pixel_data.hpp>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <list>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// The planes that denoise_light() and atrous() read, without numbers that its sums of squares could not hold. A plane that has
/// some is copied; light and roots are NaN there, to be repaired, features and variances are 0.
template <std::floating_point T>
class UsableFrame {
public:
    explicit UsableFrame(const FrameView<T>& frame) : view_(frame) {
        constexpr T absent = std::numeric_limits<T>::quiet_NaN();
        const T light = std::ldexp(T(1), std::numeric_limits<T>::max_exponent * 7 / 16); // 7e16 in float
        const T root = std::sqrt(light), square = light * light, feature = T(1e4);
        hold(view_.radiance, -light, light, absent), hold(view_.direct, -light, light, absent);
        hold(view_.emission, -light, light, T(0));
        hold(view_.indirect, -light, light, absent);
        hold(view_.root_direct, T(0), root, absent), hold(view_.root_indirect, T(0), root, absent);
        hold(view_.variance, T(0), square, T(0)), hold(view_.halves, T(0), square, T(0));
        hold(view_.root_direct_variance, T(0), light, T(0)), hold(view_.root_indirect_variance, T(0), light, T(0));
        hold(view_.root_direct_halves, T(0), light, T(0)), hold(view_.root_indirect_halves, T(0), light, T(0));
        hold(view_.albedo, -feature, feature, T(0)), hold(view_.albedo_variance, T(0), feature * feature, T(0));
        hold(view_.normal, -feature, feature, T(0)), hold(view_.normal_variance, T(0), feature * feature, T(0));
        hold(view_.depth, -light, light, T(0)), hold(view_.depth_variance, T(0), square, T(0));
        hold(view_.samples, T(0), light, T(0));
    }
    UsableFrame(const UsableFrame&) = delete;
    UsableFrame& operator=(const UsableFrame&) = delete;

    const FrameView<T>& view() const { return view_; }

private:
    template <int C>
    void hold(PixelView<const T, C>& plane, T least, T largest, T otherwise) {
        const auto fits = [&](T v) { return is_finite(v) & (v >= least) & (v <= largest); }; // fast-math has no NaN
        const int width = plane.width(), height = plane.height();
        const PixelStrides strides = plane.strides();
        const auto stride = strides.channel;
        const auto all_fit = [&](const T* first, int count, std::ptrdiff_t step) {
            unsigned misfits = 0; // without branches: several at once
            if (step == 1) for (int i = 0; i < count; ++i) misfits |= unsigned(!fits(first[i]));
            else for (int i = 0; i < count; ++i) misfits |= unsigned(!fits(first[i * step]));
            return misfits == 0;
        };
        bool all = true;
        for (int y = 0; y < height && all; ++y) {
            if (stride == 1 && strides.pixel == C) all = all_fit(plane.pixel(0, y), width * C, 1);
            else for (int c = 0; c < C; ++c) all = all && all_fit(plane.pixel(0, y) + c * stride, width, strides.pixel);
        }
        if (all) return;
        std::vector<T>& copy = copies_.emplace_back();
        copy.reserve(std::size_t(width) * std::size_t(height) * std::size_t(C));
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                for (int c = 0; c < C; ++c) {
                    const T v = plane.pixel(x, y)[c * stride];
                    copy.push_back(fits(v) ? v : otherwise);
                }
        plane = PixelView<const T, C>(copy.data(), width, height);
    }

    FrameView<T> view_;
    std::list<std::vector<T>> copies_;
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
