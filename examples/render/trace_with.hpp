#pragma once
#include "trace.hpp"
#include <lambent/core/parallel.hpp>
#include <lambent/render/ambient_occlusion.hpp>
#include <lambent/render/direct.hpp>
#include <lambent/render/first_hit.hpp>
#include <lambent/render/path.hpp>
#include <lambent/sampling/stratified.hpp>
#include <lambent/scene/specialised_scene.hpp>
#include <algorithm>
#include <concepts>
#include <limits>

/// A tenth of the scene's diagonal: closed rooms would be black without an end.
inline double ao_distance(const lambent::Scene<float>& scene) {
    const lambent::Bounds3<double> bounds = scene.bounds();
    return bounds.empty() ? std::numeric_limits<double>::infinity() : length(bounds.size()) / 10;
}

inline lambent::StratifiedSampler<float> stratified_sampler(const Options& o) {
    return {o.seed, std::uint32_t(std::min<std::uint64_t>(o.spp, 1u << 24))};
}

/// Calls f with the integrator that the options name.
template <class F>
auto with_integrator(const Options& o, const lambent::Scene<float>& scene, F&& f) {
    using namespace lambent;
    switch (o.integrator) {
    case IntegratorKind::direct: return f(DirectIntegrator{});
    case IntegratorKind::ao: return f(AmbientOcclusionIntegrator{ao_distance(scene)});
    case IntegratorKind::first_hit: return f(FirstHitIntegrator{});
    case IntegratorKind::path: break;
    }
    if (o.strategy == PathStrategy::light) return f(PathIntegrator<PathStrategy::light>{o.path});
    if (o.strategy == PathStrategy::bsdf) return f(PathIntegrator<PathStrategy::bsdf>{o.path});
    if (o.mis == MisHeuristic::balance) return f(PathIntegrator<PathStrategy::both, MisHeuristic::balance>{o.path});
    return f(PathIntegrator<>{o.path});
}

/// Renders with it and this sampler.
template <lambent::Sampler S>
lambent::RenderResult trace_with(const S& sampler, lambent::Film<float>& film, const lambent::PreparedScene<float>& scene,
                                 const lambent::Camera& camera, const Options& o, const lambent::RenderOptions& options,
                                 lambent::ThreadExecutor& threads, const std::function<bool()>& keep_going) {
    return with_integrator(o, scene.scene(), [&](const auto& integrator) {
        const auto trace = [&](const auto& seen) {
            return lambent::render(film, seen, camera, integrator, sampler, options, threads, keep_going);
        };
        // The default one has code of its own for plain scenes; see is_specialised().
        if constexpr (std::same_as<decltype(integrator), const lambent::PathIntegrator<>&>)
            return lambent::with_specialised<lambent::plain_features>(scene, trace);
        else return trace(scene);
    });
}
