#pragma once
#include <lambent/render/path.hpp>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Light that was scattered at most once: emission, and direct light by both strategies.
struct DirectIntegrator {
    static constexpr bool miss_is_background = true;

    template <RenderScene S, SampleStream Stream, class L = NoListener>
    PixelSample<typename S::Scalar> sample(const S& scene, const Ray<typename S::Scalar>& ray, const Stream& stream,
                                           RayCounts& counts, const L& listener = {}) const {
        return PathIntegrator<>{{.max_depth = 1}}.sample(scene, ray, stream, counts, listener);
    }
};

} // namespace LAMBENT_ABI
} // namespace lambent
