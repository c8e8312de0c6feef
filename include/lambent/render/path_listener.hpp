#pragma once
#include <lambent/light/light_sample.hpp>
#include <lambent/material/bsdf.hpp>
#include <lambent/scene/surface.hpp>

namespace lambent {
inline namespace LAMBENT_ABI {

/// What a path tells whoever listens, in the order in which it happens; `path` is the state at that moment. This one
/// hears nothing, takes no room and costs nothing; one that hears is a struct with the same members that is given to
/// PathIntegrator::sample(), and gets a path of its own type. Listening changes no sample.
struct NoListener {
    /// A ray met a surface.
    static void hit(const auto& /*path*/, const auto& /*hit*/, const auto& /*surface*/) {}
    /// A ray left the scene.
    static void miss(const auto& /*path*/) {}
    /// The path met light by chance. `light_pdf` is per solid angle, that of a light sample in this direction: 0 where
    /// none competes with path.bsdf_pdf. `radiance` will be added: throughput times emission times weight.
    template <class T>
    static void emission(const auto& /*path*/, const Vec3<T>& /*emission*/, T /*light_pdf*/, T /*weight*/,
                         const Vec3<T>& /*radiance*/) {}
    /// A light was picked, which may be none: its pdf is 0 then.
    static void light(const auto& /*path*/, const auto& /*light*/) {}
    /// It may arrive; `weight` is of multiple importance sampling, `path.shadow_radiance` what will be added.
    template <class T>
    static void aim(const auto& /*path*/, const BsdfValue<T>& /*scattered*/, T /*weight*/) {}
    /// Whether something was in its way; of what `path.shadow_radiance` was, panes have taken their part.
    static void shadow(const auto& /*path*/, bool /*occluded*/) {}
    /// A direction was drawn, which may be none: its pdf is 0 then. `wi` is it in the scene's space.
    template <class T>
    static void bounce(const auto& /*path*/, const BsdfSample<T>& /*bounce*/, const Vec3<T>& /*wi*/) {}
    /// Russian roulette was played.
    template <class T>
    static void roulette(const auto& /*path*/, T /*survival*/, bool /*survived*/) {}
};

} // namespace LAMBENT_ABI
} // namespace lambent
