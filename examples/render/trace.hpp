#pragma once
#include "options.hpp"
#include <lambent/core/parallel.hpp>
#include <lambent/film/film.hpp>
#include <lambent/render/render.hpp>
#include <lambent/scene/prepared_scene.hpp>
#include <functional>

using Tracer = lambent::RenderResult (*)(lambent::Film<float>&, const lambent::PreparedScene<float>&,
                                         const lambent::Camera&, const Options&, const lambent::RenderOptions&,
                                         lambent::ThreadExecutor&, const std::function<bool()>& keep_going);

/// One a sampler, so that they compile side by side; each picks the prebuilt integrator by the options.
lambent::RenderResult trace_sobol(lambent::Film<float>&, const lambent::PreparedScene<float>&, const lambent::Camera&,
                                  const Options&, const lambent::RenderOptions&, lambent::ThreadExecutor&,
                                  const std::function<bool()>& keep_going);
lambent::RenderResult trace_stratified(lambent::Film<float>&, const lambent::PreparedScene<float>&,
                                       const lambent::Camera&, const Options&, const lambent::RenderOptions&,
                                       lambent::ThreadExecutor&, const std::function<bool()>& keep_going);
lambent::RenderResult trace_independent(lambent::Film<float>&, const lambent::PreparedScene<float>&,
                                        const lambent::Camera&, const Options&, const lambent::RenderOptions&,
                                        lambent::ThreadExecutor&, const std::function<bool()>& keep_going);

inline Tracer tracer_of(SamplerKind kind) {
    switch (kind) {
    case SamplerKind::sobol: return trace_sobol;
    case SamplerKind::stratified: return trace_stratified;
    case SamplerKind::independent: return trace_independent;
    }
    return trace_sobol;
}
