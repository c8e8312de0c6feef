#pragma once
#include <lambent/core/bounds.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/pyramid.hpp>
#include <lambent/core/ray.hpp>
#include <lambent/core/vec.hpp>
#include <cmath>
#include <string>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Camera in the scene's own coordinates: a pinhole, or a thin lens of some radius.
struct Camera {
    Vec3d eye{0, 0, 0};
    Vec3d target{0, 0, -1};
    Vec3d up{0, 1, 0};
    double vertical_fov = 45;  ///< degrees, the whole angle from the lower to the upper edge, in (0, 180)
    std::string name;
    double lens_radius = 0;    ///< metres; 0 = a pinhole, everything is sharp
    double focus_distance = 0; ///< of the plane that is sharp, along the view; 0 = through the target
};

/// The camera's axes for one image size: pixel positions to rays.
/// `origin` is the scene's origin (Scene::origin), taken off in double so that far-away scenes keep their bits.
template <class T>
class CameraRays {
public:
    CameraRays(const Camera& camera, int width, int height, const Vec3d& origin)
        : width_(width), height_(height), eye_(camera.eye - origin), has_lens_(camera.lens_radius > 0) {
        const Vec3d forward = normalize(camera.target - camera.eye);
        Vec3d right = cross(forward, camera.up);
        if (!(dot(right, right) > 1e-24)) // looking along `up`: any other up will do
            right = cross(forward, std::abs(forward.y) < 0.9 ? Vec3d(0, 1, 0) : Vec3d(0, 0, -1));
        right = normalize(right);
        const Vec3d up = cross(right, forward);
        const double half = std::tan(camera.vertical_fov * pi<double> / 360);
        const double focus = camera.focus_distance > 0 ? camera.focus_distance : length(camera.target - camera.eye);
        lens_right_ = Vec3<T>(right * (camera.lens_radius / focus));
        lens_up_ = Vec3<T>(up * (camera.lens_radius / focus));
        focus_ = T(focus);
        forward_ = Vec3<T>(forward);
        right_ = Vec3<T>(right * (half * double(width) / double(height)));
        up_ = Vec3<T>(up * half);
    }

    /// Unit-length ray through image position (x, y) in pixels: (0, 0) is the upper left corner of the image,
    /// a pixel's centre lies at + 0.5.
    Ray<T> ray(T x, T y) const {
        const T sx = 2 * x / T(width_) - 1, sy = 1 - 2 * y / T(height_);
        return {.origin = eye_, .direction = normalize(forward_ + sx * right_ + sy * up_)};
    }

    bool has_lens() const { return has_lens_; }

    /// What image positions from (x0, y0) to (x1, y1) see, without a lens.
    Pyramid<T> pyramid(T x0, T y0, T x1, T y1) const {
        return {eye_, {ray(x0, y0).direction, ray(x1, y0).direction, ray(x1, y1).direction, ray(x0, y1).direction}};
    }

    /// The same from a point of the lens, given on the unit disk: all of one image position meet in the sharp plane.
    Ray<T> ray(T x, T y, const Vec2<T>& lens) const {
        const T sx = 2 * x / T(width_) - 1, sy = 1 - 2 * y / T(height_);
        const Vec3<T> shift = lens.x * lens_right_ + lens.y * lens_up_;
        return {.origin = eye_ + focus_ * shift, .direction = normalize(forward_ + sx * right_ + sy * up_ - shift)};
    }

private:
    int width_, height_;
    Vec3<T> eye_, forward_, right_, up_, lens_right_, lens_up_;
    T focus_;
    bool has_lens_;
};

/// A camera that sees the whole box from in front and a little above, 45 degrees of view.
inline Camera framing_camera(const Bounds3<double>& bounds, double aspect = 16.0 / 9.0) {
    Camera camera;
    camera.name = "framing";
    if (bounds.empty()) {
        camera.eye = {0, 0, 1};
        camera.target = {0, 0, 0};
        return camera;
    }
    const double radius = std::max(1e-6, length(bounds.size()) / 2);
    const double half = std::atan(std::tan(camera.vertical_fov * pi<double> / 360) * std::min(1.0, aspect));
    camera.target = bounds.center();
    camera.eye = camera.target + normalize(Vec3d(0.25, 0.35, 1)) * (radius / std::sin(half));
    return camera;
}

} // namespace LAMBENT_ABI
} // namespace lambent
