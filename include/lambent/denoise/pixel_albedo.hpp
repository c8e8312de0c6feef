#pragma once
#include <lambent/denoise/cross_bilateral.hpp>
#include <lambent/film/pixel_data.hpp>

namespace lambent {
inline namespace LAMBENT_ABI {

/// The frame's albedo as it would be over the area of its pixels, where it is that of one point in each: a Gaussian of
/// half a pixel over 3 x 3 pixels. Pixels without a surface (albedo and normal 0) and those without a usable albedo keep
/// to themselves, as demodulate() has them: at the floor and at 1.
/// throws lambent::Error when the albedo is absent
/// threads the same bits for any executor
template <std::floating_point T, Executor E>
Plane<T, 3> pixel_albedo(const FrameView<T>& frame, E& executor) {
    require(!frame.albedo.absent(), "pixel_albedo: the frame has no albedo plane");
    const int width = frame.albedo.width(), height = frame.albedo.height();
    Plane<T, 3> albedo(width, height);
    Plane<T, 1> kind(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const Vec3<T> here = frame.albedo.load(x, y), used = detail::modulation(frame, x, y);
            albedo.store(x, y, used);
            const bool usable = used == max(here, Vec3<T>(T(albedo_floor)));
            const bool surface = here != Vec3<T>(0) || (!frame.normal.absent() && frame.normal.load(x, y) != Vec3<T>(0));
            kind.store(x, y, !usable ? T(0) : surface ? T(1) : T(2));
        }
    cross_bilateral<T>(albedo.view(), albedo.view(),
                       {.kernel = 3, .sigma_spatial = 0.5, .form = BilateralForm::naive_2d}, executor,
                       IdentityFeature<T>(kind.view(), hard_stop));
    return albedo;
}

} // namespace LAMBENT_ABI
} // namespace lambent
