#pragma once
#include <lambent/core/vec.hpp>
#include <cstdint>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Who else looks for light beside light samples: nobody, or bounces drawn from the BSDF, so that what is bright
/// everywhere may be left to them.
enum class Companion : std::uint8_t { none, bsdf };

/// Light that reaches a point from one direction, before any shadow. `pdf` = 0 means that there is none.
template <class T>
struct LightSample {
    Vec3<T> wi{0};       ///< unit, from the point to the light
    Vec3<T> radiance{0}; ///< radiance along wi; for a delta light the irradiance per unit cosine
    T pdf = 0;           ///< per solid angle; for a delta light the chance of having picked it
    bool delta = false;  ///< cannot be met by chance: a point or a single direction
    bool infinite = false;
    Vec3<T> target{0};        ///< where the shadow ray ends, unless infinite
    Vec3<T> target_error{0};  ///< bound on the rounding error of target, an axis each
    Vec3<T> target_normal{0}; ///< of the light's surface at target; 0 for a point
};

} // namespace LAMBENT_ABI
} // namespace lambent
