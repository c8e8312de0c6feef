#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/film/pixel_view.hpp>
#include <cstddef>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// One owned plane of a frame: width × height pixels of C interleaved channels, dense, row 0 at the top.
/// Absent (no memory) until allocated.
template <class T, int C>
class Plane {
public:
    using Value = typename PixelView<T, C>::Value;

    Plane() = default;
    Plane(int width, int height, T value = T(0)) { allocate(width, height, value); }

    void allocate(int width, int height, T value = T(0)) {
        require(width >= 0 && height >= 0, [&] {
            return "Plane: negative size " + std::to_string(width) + " x " + std::to_string(height);
        });
        width_ = width;
        height_ = height;
        values_.assign(std::size_t(width) * std::size_t(height) * C, value);
    }

    int width() const { return width_; }
    int height() const { return height_; }
    bool absent() const { return values_.empty(); }

    PixelView<T, C> view() { return absent() ? PixelView<T, C>() : PixelView<T, C>(values_.data(), width_, height_); }
    PixelView<const T, C> view() const {
        return absent() ? PixelView<const T, C>() : PixelView<const T, C>(values_.data(), width_, height_);
    }

    /// As those of view(): for loops over pixels.
    Value load(int x, int y) const {
        const T* const p = values_.data() + first_of(x, y);
        if constexpr (C == 1) {
            return *p;
        } else {
            Value value;
            for (int c = 0; c < C; ++c) value[c] = p[c];
            return value;
        }
    }
    void store(int x, int y, const Value& value) {
        T* const p = values_.data() + first_of(x, y);
        if constexpr (C == 1) {
            *p = value;
        } else {
            for (int c = 0; c < C; ++c) p[c] = value[c];
        }
    }
    std::vector<T>& values() { return values_; }
    const std::vector<T>& values() const { return values_; }

private:
    std::size_t first_of(int x, int y) const {
        return (std::size_t(y) * std::size_t(width_) + std::size_t(x)) * std::size_t(C);
    }

    std::vector<T> values_;
    int width_ = 0, height_ = 0;
};

/// The planes of one frame wherever they lie, as PixelData describes them; all but radiance may be absent, and
/// all that are there have one size. Never owns:
///   FrameView<float>{.radiance = rgb_view(color, w, h, {.pixel = 4}), .normal = rgb_view(normals, w, h)}
template <class T>
struct FrameView {
    PixelView<const T, 3> radiance{}, emission{}, albedo{}, normal{}, position{}, variance{};
    PixelView<const T, 1> depth{}, material{};
    PixelView<const T, 1> samples{};
    PixelView<const T, 3> direct{}, indirect{}, root_direct{}, root_direct_variance{}, root_indirect{}, root_indirect_variance{};
    PixelView<const T, 3> albedo_variance{}, normal_variance{};
    PixelView<const T, 1> depth_variance{};
    PixelView<const T, 3> halves{};
    PixelView<const T, 1> root_direct_halves{}, root_indirect_halves{};
};

/// The resolved planes of one frame: a structure of arrays, in which a plane that nobody asked for is absent.
/// "Mean" is the mean over the pixel's samples; features of position and depth are means over those samples
/// that hit a surface. All values are finite, also where every sample missed.
template <class T>
struct PixelData {
    int width = 0, height = 0;

    Plane<T, 3> radiance;     ///< mean linear Rec.709 radiance, emission included; >= 0. A miss: the background
    Plane<T, 3> emission;     ///< mean radiance of lights and background seen directly; a part of `radiance`
    Plane<T, 3> albedo;       ///< mean reflectance at the first hit, in [0, 1]. A miss: 0
    Plane<T, 3> illumination; ///< (radiance - emission) / max(albedo, albedo_floor), of the means. A miss: 0
    Plane<T, 3> normal;       ///< mean shading normal, world space, towards the viewer, length <= 1. A miss: 0
    Plane<T, 3> position;     ///< mean position of the hits, world space, metres. A miss: 0
    Plane<T, 1> depth;        ///< mean distance of the hits along the ray, metres. A miss: 0
    Plane<T, 1> material;     ///< material index of sample 0. A miss: -1
    Plane<T, 1> alpha;        ///< share of samples that hit a surface, in [0, 1]
    Plane<T, 1> samples;      ///< number of samples
    Plane<T, 3> variance;     ///< variance of the mean radiance, a channel each; 0 below two samples

    Plane<T, 3> direct, indirect; ///< means of PixelSample's; radiance is their sum and the light seen directly
    Plane<T, 3> root_direct, root_direct_variance;     ///< mean over samples of √direct, and the variance of that mean
    Plane<T, 3> root_indirect, root_indirect_variance; ///< the same of indirect light
    Plane<T, 3> albedo_variance, normal_variance;      ///< variances of the means
    Plane<T, 1> depth_variance;
    /// A quarter of the squared distance between the mean radiances of the first and the second half of the samples:
    /// the variance of the mean as samples that know of each other have it, by one degree of freedom.
    Plane<T, 3> halves;
    /// The same of the roots of direct and indirect light, summed over channels. For means over many pixels.
    Plane<T, 1> root_direct_halves, root_indirect_halves;

    FrameView<T> view() const& {
        return {radiance.view(),
                emission.view(),
                albedo.view(),
                normal.view(),
                position.view(),
                variance.view(),
                depth.view(),
                material.view(),
                samples.view(),
                direct.view(),
                indirect.view(),
                root_direct.view(),
                root_direct_variance.view(),
                root_indirect.view(),
                root_indirect_variance.view(),
                albedo_variance.view(),
                normal_variance.view(),
                depth_variance.view(),
                halves.view(),
                root_direct_halves.view(),
                root_indirect_halves.view()};
    }
    FrameView<T> view() const&& = delete;
};

/// Below this albedo, illumination is radiance over the floor instead: no division by zero, and the product
/// gives the radiance back all the same.
inline constexpr double albedo_floor = 1e-3;

namespace detail {
/// radiance = illumination · modulation + emission. What is absent, not finite, or no albedo at all (1e4 and above)
/// changes nothing: 1 and 0.
template <class T>
Vec3<T> modulation(const FrameView<T>& frame, int x, int y) {
    if (frame.albedo.absent()) return Vec3<T>(1);
    const Vec3<T> albedo = frame.albedo.load(x, y);
    return is_finite(albedo) && max_component(albedo) < T(1e4) ? max(albedo, Vec3<T>(T(albedo_floor))) : Vec3<T>(1);
}
template <class T>
Vec3<T> emission(const FrameView<T>& frame, int x, int y) {
    if (frame.emission.absent()) return Vec3<T>(0);
    const Vec3<T> emission = frame.emission.load(x, y);
    return is_finite(emission) ? emission : Vec3<T>(0);
}
template <class T, class Plane>
void require_planes(const char* what, const FrameView<T>& frame, const Plane& plane) {
    require_same_size(what, frame.radiance, plane);
    if (!frame.emission.absent()) require_same_size(what, frame.radiance, frame.emission);
    if (!frame.albedo.absent()) require_same_size(what, frame.radiance, frame.albedo);
}
} // namespace detail

/// Writes (radiance - emission) / max(albedo, albedo_floor) to `out`; an absent emission counts as 0, an absent
/// albedo as 1, and so do values of theirs that are not finite.
/// throws lambent::Error when radiance is absent or sizes differ
template <class T>
void demodulate(const FrameView<T>& frame, const std::type_identity_t<PixelView<T, 3>>& out) {
    require(!frame.radiance.absent(), "demodulate: the frame has no radiance plane");
    detail::require_planes("demodulate", frame, out);
    for (int y = 0; y < out.height(); ++y)
        for (int x = 0; x < out.width(); ++x)
            out.store(x, y, (frame.radiance.load(x, y) - detail::emission(frame, x, y)) / detail::modulation(frame, x, y));
}

/// Fills the frame's own `illumination`.
template <class T>
void demodulate(PixelData<T>& frame) {
    frame.illumination.allocate(frame.width, frame.height);
    demodulate(std::as_const(frame).view(), frame.illumination.view());
}

/// Writes illumination · max(albedo, albedo_floor) + emission, the inverse of demodulate(), to `out`, which may be
/// the very view of `illumination`.
/// throws lambent::Error when sizes differ
template <class T>
void remodulate(const FrameView<T>& frame, const std::type_identity_t<PixelView<const T, 3>>& illumination,
                const std::type_identity_t<PixelView<T, 3>>& out) {
    require_same_size("remodulate: illumination and output", illumination, out);
    detail::require_planes("remodulate", frame, out);
    for (int y = 0; y < out.height(); ++y)
        for (int x = 0; x < out.width(); ++x)
            out.store(x, y, illumination.load(x, y) * detail::modulation(frame, x, y) + detail::emission(frame, x, y));
}

} // namespace LAMBENT_ABI
} // namespace lambent
