#pragma once
#include <concepts>
#include <lambent/core/vec.hpp>

namespace lambent {
inline namespace LAMBENT_ABI {

/// A direction drawn from a BSDF. `pdf` = 0 means that there is none.
template <class T>
struct BsdfSample {
    Vec3<T> wi{0};     ///< unit, local space
    Vec3<T> weight{0}; ///< f(wo, wi) · |cos wi| / pdf
    T pdf = 0;         ///< per solid angle; of a delta lobe, which has one direction, the chance of its choice
    T eta_scale =
        1; ///< what refraction did to the radiance's scale, for roulette to undo: weight · eta_scale is energy
    bool delta = false;
};

/// What a BSDF is for a pair of directions.
template <class T>
struct BsdfValue {
    Vec3<T> f{0}; ///< without the cosine
    T pdf = 0;    ///< per solid angle
};

/// How a surface scatters radiance on its way to the viewer: light that comes out of a medium of index n is scaled by 1
/// / n². Directions are unit vectors in the local space of the shading normal, which is (0, 0, 1), and point away from
/// the surface; the viewer's side is up, and where wo is not, nothing is scattered. wi.z < 0 is transmission. `eval` is
/// the BSDF f without the cosine; `pdf` is the density per solid angle with which `sample` draws wi; delta lobes are in
/// neither. `sample` chooses a lobe by `pick` and a direction by `u`, all in [0, 1). Chances may sum to less than 1:
/// the rest draws nothing. A material is one struct that fits.
template <class B>
concept Bsdf = requires(const B& bsdf, const Vec3<typename B::Scalar>& w, const Vec2<typename B::Scalar>& u,
                        typename B::Scalar pick) {
    { bsdf.eval(w, w) } -> std::same_as<Vec3<typename B::Scalar>>;
    { bsdf.pdf(w, w) } -> std::same_as<typename B::Scalar>;
    { bsdf.sample(w, pick, u) } -> std::same_as<BsdfSample<typename B::Scalar>>;
};

/// eval and pdf at once: by the BSDF's own `evaluate` where it has one, which shares what both need.
template <Bsdf B>
BsdfValue<typename B::Scalar> evaluate(const B& bsdf, const Vec3<typename B::Scalar>& wo,
                                       const Vec3<typename B::Scalar>& wi) {
    if constexpr (requires { bsdf.evaluate(wo, wi); })
        return bsdf.evaluate(wo, wi);
    else
        return {bsdf.eval(wo, wi), bsdf.pdf(wo, wi)};
}

} // namespace LAMBENT_ABI
} // namespace lambent
