#pragma once
#include <lambent/core/error.hpp>
#include <lambent/denoise/feature.hpp>
#include <cmath>
#include <string>

/// The features of the cross-bilateral filter. Each keeps a view of the caller's plane, which may be absent;
/// an infinite sigma drops the feature.
namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {
inline void require_sigma(const char* what, double sigma) {
    require(sigma > 0, [&] { return std::string(what) + ": sigma must be positive, not " + std::to_string(sigma); });
}

/// Whether the plane is absent or holds one value only; ends at the first that differs.
template <class T, int C>
bool tells_nothing(const PixelView<const T, C>& plane) {
    if (plane.absent()) return true;
    for (int y = 0; y < plane.height(); ++y)
        for (int x = 0; x < plane.width(); ++x)
            if (plane.load(x, y) != plane.load(0, 0)) return false;
    return true;
}

/// `count` pixels of a row, in lanes.
template <class T, int C>
[[gnu::always_inline]] inline auto load_lanes(const PixelView<const T, C>& plane, int x, int y, int count) {
    return load_pack<FeaturePack<T>::width>(plane, x, y, count);
}

template <class P>
std::array<P, 3> scaled(const std::array<P, 3>& v, P scale) {
    return {v[0] * scale, v[1] * scale, v[2] * scale};
}

template <class P>
P add_squared_distance(const P* a, const P* b, P sum) {
    const P x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return multiply_add(z, z, multiply_add(y, y, multiply_add(x, x, sum)));
}

template <class P>
P dot3(const P* a, const P* b) {
    return multiply_add(a[2], b[2], multiply_add(a[1], b[1], a[0] * b[0]));
}
} // namespace detail

/// Euclidean distance of three numbers: positions in the world, albedo, linear radiance. Sigma in their unit.
/// throws lambent::Error unless sigma is positive
template <std::floating_point T>
class DistanceFeature {
public:
    using Scalar = T;
    static constexpr int channels = 3;

    DistanceFeature(const PixelView<const T, 3>& plane, double sigma)
        : plane_(plane), scale_(T(1 / sigma)), active_(is_finite(sigma) && !detail::tells_nothing(plane)) {
        detail::require_sigma("DistanceFeature", sigma);
    }
    int width() const { return plane_.width(); }
    int height() const { return plane_.height(); }
    bool active() const { return active_; }
    [[gnu::always_inline]] void prefetch(int x, int y, int count) const { lambent::prefetch(plane_, x, y, count); }
    std::array<FeaturePack<T>, 3> prepare(int x, int y, int count) const {
        return detail::scaled(detail::load_lanes(plane_, x, y, count), FeaturePack<T>(scale_));
    }
    template <class P>
    P add_distance2(const P* a, const P* b, P sum) const {
        return detail::add_squared_distance(a, b, sum);
    }

private:
    PixelView<const T, 3> plane_;
    T scale_;
    bool active_;
};

/// Difference of one number, such as depth. Sigma in its unit.
/// throws lambent::Error unless sigma is positive
template <std::floating_point T>
class DifferenceFeature {
public:
    using Scalar = T;
    static constexpr int channels = 1;

    DifferenceFeature(const PixelView<const T, 1>& plane, double sigma)
        : plane_(plane), scale_(T(1 / sigma)), active_(is_finite(sigma) && !detail::tells_nothing(plane)) {
        detail::require_sigma("DifferenceFeature", sigma);
    }
    int width() const { return plane_.width(); }
    int height() const { return plane_.height(); }
    bool active() const { return active_; }
    [[gnu::always_inline]] void prefetch(int x, int y, int count) const { lambent::prefetch(plane_, x, y, count); }
    std::array<FeaturePack<T>, 1> prepare(int x, int y, int count) const {
        return {detail::load_lanes(plane_, x, y, count)[0] * FeaturePack<T>(scale_)};
    }
    template <class P>
    P add_distance2(const P* a, const P* b, P sum) const {
        const P d = a[0] - b[0];
        return multiply_add(d, d, sum);
    }

private:
    PixelView<const T, 1> plane_;
    T scale_;
    bool active_;
};

/// Euclidean distance in units of sigma · √(d(p) d(q)), with a positive deviation d for every pixel: the noise
/// of radiance, or the size of a pixel in the world. The geometric mean keeps a pixel that is far out, and so
/// thinks itself very uncertain, away from certain neighbours. Deviations of 0 or less count as `smallest`.
/// throws lambent::Error unless sigma and smallest are positive
template <std::floating_point T>
class RelativeDistanceFeature {
public:
    using Scalar = T;
    static constexpr int channels = 4;

    RelativeDistanceFeature(const PixelView<const T, 3>& plane, const PixelView<const T, 1>& deviation, double sigma,
                            double smallest = 1e-6)
        : plane_(plane), deviation_(deviation), scale_(T(1 / sigma)), smallest_(T(smallest)),
          active_(is_finite(sigma) && !detail::tells_nothing(plane)) {
        detail::require_sigma("RelativeDistanceFeature", sigma);
        detail::require_sigma("RelativeDistanceFeature: smallest", smallest);
        if (active_) require_same_size("RelativeDistanceFeature: plane and deviation", plane, deviation);
    }
    int width() const { return plane_.width(); }
    int height() const { return plane_.height(); }
    bool active() const { return active_; }
    [[gnu::always_inline]] void prefetch(int x, int y, int count) const {
        lambent::prefetch(plane_, x, y, count);
        lambent::prefetch(deviation_, x, y, count);
    }
    std::array<FeaturePack<T>, 4> prepare(int x, int y, int count) const {
        using P = FeaturePack<T>;
        const auto v = detail::scaled(detail::load_lanes(plane_, x, y, count), P(scale_));
        return {v[0], v[1], v[2], P(T(1)) / max(detail::load_lanes(deviation_, x, y, count)[0], P(smallest_))};
    }
    template <class P>
    P add_distance2(const P* a, const P* b, P sum) const {
        return multiply_add(detail::add_squared_distance(a, b, P(T(0))), a[3] * b[3], sum);
    }

private:
    PixelView<const T, 3> plane_;
    PixelView<const T, 1> deviation_;
    T scale_, smallest_;
    bool active_;
};

/// How far each pixel's position is from the plane through the other, in units of sigma · √(f(p) f(q)) with
/// the pixel's footprint f in the world: points of one plane are at distance 0 however far apart, and scaling
/// the scene changes nothing. See pixel_footprint().
/// throws lambent::Error unless sigma is positive
template <std::floating_point T>
class PlaneDistanceFeature {
public:
    using Scalar = T;
    static constexpr int channels = 7;

    PlaneDistanceFeature(const PixelView<const T, 3>& position, const PixelView<const T, 3>& normal,
                         const PixelView<const T, 1>& footprint, double sigma)
        : position_(position), normal_(normal), footprint_(footprint), scale_(T(std::sqrt(0.5) / sigma)),
          active_(is_finite(sigma) && !detail::tells_nothing(position) && !normal.absent()) {
        detail::require_sigma("PlaneDistanceFeature", sigma);
        if (!active_) return;
        require_same_size("PlaneDistanceFeature: position and normal", position, normal);
        require_same_size("PlaneDistanceFeature: position and footprint", position, footprint);
    }
    int width() const { return position_.width(); }
    int height() const { return position_.height(); }
    bool active() const { return active_; }
    [[gnu::always_inline]] void prefetch(int x, int y, int count) const {
        lambent::prefetch(position_, x, y, count);
        lambent::prefetch(normal_, x, y, count);
        lambent::prefetch(footprint_, x, y, count);
    }
    std::array<FeaturePack<T>, 7> prepare(int x, int y, int count) const {
        using P = FeaturePack<T>;
        const auto p = detail::load_lanes(position_, x, y, count);
        const auto n = detail::scaled(detail::load_lanes(normal_, x, y, count), P(scale_));
        const P f = detail::load_lanes(footprint_, x, y, count)[0];
        return {p[0], p[1], p[2], n[0], n[1], n[2], select(f > P(T(0)), P(T(1)) / f, P(T(0)))};
    }
    template <class P>
    P add_distance2(const P* a, const P* b, P sum) const {
        const P d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
        const P from_a = detail::dot3(d, a + 3), from_b = detail::dot3(d, b + 3);
        return multiply_add(from_a * from_a + from_b * from_b, a[6] * b[6], sum);
    }

private:
    PixelView<const T, 3> position_, normal_;
    PixelView<const T, 1> footprint_;
    T scale_;
    bool active_;
};

/// 1 - dot of two normals, 0 to 2. Sigma in that unit.
/// throws lambent::Error unless sigma is positive
template <std::floating_point T>
class NormalFeature {
public:
    using Scalar = T;
    static constexpr int channels = 3;

    NormalFeature(const PixelView<const T, 3>& normal, double sigma)
        : normal_(normal), one_(T(1 / sigma)), scale_(T(std::sqrt(1 / sigma))),
          active_(is_finite(sigma) && !detail::tells_nothing(normal)) {
        detail::require_sigma("NormalFeature", sigma);
    }
    int width() const { return normal_.width(); }
    int height() const { return normal_.height(); }
    bool active() const { return active_; }
    [[gnu::always_inline]] void prefetch(int x, int y, int count) const { lambent::prefetch(normal_, x, y, count); }
    std::array<FeaturePack<T>, 3> prepare(int x, int y, int count) const {
        return detail::scaled(detail::load_lanes(normal_, x, y, count), FeaturePack<T>(scale_));
    }
    template <class P>
    P add_distance2(const P* a, const P* b, P sum) const {
        const P d = multiply_add(-a[2], b[2], multiply_add(-a[1], b[1], multiply_add(-a[0], b[0], P(one_))));
        return multiply_add(d, d, sum);
    }

private:
    PixelView<const T, 3> normal_;
    T one_, scale_;
    bool active_;
};

/// The angle between two normals, in radians. Sigma in radians. A pixel without a normal is at 90° to all.
/// throws lambent::Error unless sigma is positive
/// source  Abramowitz and Stegun 4.4.46 for the arc cosine, error below 2e-8
template <std::floating_point T>
class NormalAngleFeature {
public:
    using Scalar = T;
    static constexpr int channels = 3;

    NormalAngleFeature(const PixelView<const T, 3>& normal, double sigma)
        : normal_(normal), scale_(T(1 / (sigma * sigma))), active_(is_finite(sigma) && !detail::tells_nothing(normal)) {
        detail::require_sigma("NormalAngleFeature", sigma);
    }
    int width() const { return normal_.width(); }
    int height() const { return normal_.height(); }
    bool active() const { return active_; }
    [[gnu::always_inline]] void prefetch(int x, int y, int count) const { lambent::prefetch(normal_, x, y, count); }
    std::array<FeaturePack<T>, 3> prepare(int x, int y, int count) const {
        using P = FeaturePack<T>;
        const auto n = detail::load_lanes(normal_, x, y, count);
        const P length2 = detail::dot3(n.data(), n.data());
        return detail::scaled(n, select(length2 > P(T(0)), P(T(1)) / sqrt(length2), P(T(1))));
    }
    template <class P>
    P add_distance2(const P* a, const P* b, P sum) const {
        constexpr std::array<double, 8> series = {-0.0012624911, 0.0066700901, -0.0170881256, 0.0308918810,
                                                  -0.0501743046, 0.0889789874, -0.2145988016, 1.5707963050};
        const P cosine = max(P(T(-1)), min(P(T(1)), detail::dot3(a, b)));
        const P x = max(cosine, -cosine);
        P r = P(T(series[0]));
        for (std::size_t i = 1; i < series.size(); ++i) r = multiply_add(r, x, P(T(series[i])));
        P acute = (P(T(1)) - x) * r * r; // the squared angle up to 90°
        if (any(cosine < P(T(0)))) {
            P obtuse = acute;
            for (int i = 0; i < P::width; ++i) {
                const T angle = pi<T> - std::sqrt(acute[i]);
                obtuse.set(i, angle * angle);
            }
            acute = select(cosine < P(T(0)), obtuse, acute);
        }
        return multiply_add(acute, P(scale_), sum);
    }

private:
    PixelView<const T, 3> normal_;
    T scale_;
    bool active_;
};

/// 0 for equal numbers, else 1: material and object indices. A small sigma is a hard stop; see hard_stop.
/// throws lambent::Error unless sigma is positive
template <std::floating_point T>
class IdentityFeature {
public:
    using Scalar = T;
    static constexpr int channels = 1;

    IdentityFeature(const PixelView<const T, 1>& plane, double sigma)
        : plane_(plane), penalty_(T(1 / (sigma * sigma))), active_(is_finite(sigma) && !detail::tells_nothing(plane)) {
        detail::require_sigma("IdentityFeature", sigma);
    }
    int width() const { return plane_.width(); }
    int height() const { return plane_.height(); }
    bool active() const { return active_; }
    [[gnu::always_inline]] void prefetch(int x, int y, int count) const { lambent::prefetch(plane_, x, y, count); }
    std::array<FeaturePack<T>, 1> prepare(int x, int y, int count) const {
        return detail::load_lanes(plane_, x, y, count);
    }
    template <class P>
    P add_distance2(const P* a, const P* b, P sum) const {
        return sum + select(a[0] == b[0], P(T(0)), P(penalty_));
    }

private:
    PixelView<const T, 1> plane_;
    T penalty_;
    bool active_;
};

/// An IdentityFeature in which negative numbers stand for no surface: such a pixel is like none that has another number,
/// whatever sigma. Material indices as PixelData has them.
/// throws lambent::Error unless sigma is positive
template <std::floating_point T>
class MaterialFeature {
public:
    using Scalar = T;
    static constexpr int channels = 1;

    MaterialFeature(const PixelView<const T, 1>& plane, double sigma) : identity_(plane, sigma), penalty_(T(1 / (sigma * sigma))) {}
    int width() const { return identity_.width(); }
    int height() const { return identity_.height(); }
    bool active() const { return identity_.active(); }
    [[gnu::always_inline]] void prefetch(int x, int y, int count) const { identity_.prefetch(x, y, count); }
    std::array<FeaturePack<T>, 1> prepare(int x, int y, int count) const { return identity_.prepare(x, y, count); }
    template <class P>
    P add_distance2(const P* a, const P* b, P sum) const {
        const P other = select(min(a[0], b[0]) < P(T(0)), P(T(1e18)), P(penalty_));
        return sum + select(a[0] == b[0], P(T(0)), other);
    }

private:
    IdentityFeature<T> identity_;
    T penalty_;
};

/// The sigma that makes an IdentityFeature a hard stop: other materials get the weight 0.
inline constexpr double hard_stop = 1e-9;

} // namespace LAMBENT_ABI
} // namespace lambent
