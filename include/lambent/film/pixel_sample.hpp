#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec.hpp>
#include <cstdint>

namespace lambent {
inline namespace LAMBENT_ABI {

/// What one sample of one pixel brings home. A miss leaves the features at 0 and `hit` false.
template <class T>
struct PixelSample {
    Vec3<T> radiance{0};  ///< linear Rec.709, emission included
    Vec3<T> emission{0};  ///< the part seen directly: the first hit's own light, or the background
    Vec3<T> direct{0};    ///< the part scattered once but for mirrors and smooth glass, and lights seen by way of those
    Vec3<T> indirect{0};  ///< the part scattered more often
    Vec3<T> albedo{0};    ///< reflectance at the first hit
    Vec3<T> normal{0};    ///< shading normal there, towards the viewer
    Vec3<T> position{0};  ///< of the first hit, relative to the scene's origin
    T depth = 0;          ///< distance to it
    std::uint32_t material = 0;
    bool hit = false;
};

/// Makes a sample fit to be summed, so that one bad number cannot spread over its pixel: light that is not finite
/// becomes black, a hit whose features are not finite becomes a miss. Gives false where it had to.
template <class T>
inline bool make_finite(PixelSample<T>& s) {
    const bool light = is_finite(s.radiance) && is_finite(s.emission) && is_finite(s.direct) && is_finite(s.indirect);
    if (!light) s.radiance = s.emission = s.direct = s.indirect = Vec3<T>(0);
    const bool features = is_finite(s.albedo) && is_finite(s.normal) && is_finite(s.position) && is_finite(s.depth);
    if (!features) {
        s.albedo = s.normal = s.position = Vec3<T>(0);
        s.depth = 0;
        s.hit = false;
    }
    return light && features;
}

/// Scales the reflected part of a sample's radiance down until its largest channel is `clamp`; monotone, and keeps
/// the hue. An infinite clamp changes no bit.
template <class T>
inline void clamp_reflected(PixelSample<T>& s, T clamp) {
    const Vec3<T> reflected = s.radiance - s.emission;
    const T peak = max_component(reflected);
    if (!(peak > clamp)) return;
    s.radiance = s.emission + reflected * (clamp / peak);
    s.direct *= clamp / peak;
    s.indirect *= clamp / peak;
}

} // namespace LAMBENT_ABI
} // namespace lambent
