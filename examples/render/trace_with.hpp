#pragma once
#include "trace.hpp"
#include <lambent/core/parallel.hpp>
#include <lambent/render/ambient_occlusion.hpp>
#include <lambent/render/direct.hpp>
#include <lambent/render/first_hit.hpp>
#include <lambent/render/path.hpp>
#include <limits>

/// A tenth of the scene's diagonal: closed rooms would be black without an end.
inline double ao_distance(const lambent::Scene<float>& scene) {
    const lambent::Bounds3<double> bounds = scene.bounds();
    return bounds.empty() ? std::numeric_limits<double>::infinity() : length(bounds.size()) / 10;
}

/// Runs the integrator that the options name, with this sampler.
template <lambent::Sampler S>
lambent::RenderResult trace_with(const S& sampler, lambent::Film<float>& film, const lambent::PreparedScene<float>& scene,
                                 const lambent::Camera& camera, const Options& o, const lambent::RenderOptions& options,
                                 lambent::ThreadExecutor& threads, const std::function<bool()>& keep_going) {
    using namespace lambent;
    const auto go = [&](const auto& integrator) {
        return render(film, scene, camera, integrator, sampler, options, threads, keep_going);
    };
    switch (o.integrator) {
    case IntegratorKind::direct: return go(DirectIntegrator{});
    case IntegratorKind::ao: return go(AmbientOcclusionIntegrator{ao_distance(scene.scene())});
    case IntegratorKind::first_hit: return go(FirstHitIntegrator{});
    case IntegratorKind::path: break;
    }
    if (o.strategy == PathStrategy::light) return go(PathIntegrator<PathStrategy::light>{o.path});
    if (o.strategy == PathStrategy::bsdf) return go(PathIntegrator<PathStrategy::bsdf>{o.path});
    if (o.mis == MisHeuristic::balance) return go(PathIntegrator<PathStrategy::both, MisHeuristic::balance>{o.path});
    return go(PathIntegrator<>{o.path});
}
