#pragma once
#include "same_bits.hpp"
#include <lambent/core/parallel.hpp>
#include <lambent/render/render.hpp>
#include <type_traits>

namespace lambent_test {

/// An integrator whose paths nobody else can drive, so that they go one by one, and that stands by what it makes of a miss.
template <class I>
struct OneByOne {
    I integrator;
    static constexpr bool miss_is_background = true;
    template <class S, class Stream>
    lambent::PixelSample<typename S::Scalar> sample(const S& scene, const lambent::Ray<typename S::Scalar>& ray,
                                                    const Stream& stream, lambent::RayCounts& counts) const {
        return integrator.sample(scene, ray, stream, counts);
    }
};
template <class I>
OneByOne(I) -> OneByOne<I>;

struct Pass {
    lambent::Film<float> film;
    lambent::RayCounts rays;
};

template <class S, class I, class P>
Pass pass_of(const S& scene, const lambent::Camera& camera, const I& integrator, const P& sampler,
             const lambent::RenderOptions& options) {
    Pass pass;
    lambent::ThreadExecutor threads(2);
    pass.rays = render(pass.film, scene, camera, integrator, sampler, options, threads, [] { return true; }).rays;
    return pass;
}

inline bool same(const Pass& a, const Pass& b) {
    return same_bits(a.film, b.film) && a.rays.closest == b.rays.closest && a.rays.shadow == b.rays.shadow &&
           a.rays.saved == b.rays.saved;
}

} // namespace lambent_test
