#include "trace_with.hpp"
#include <lambent/core/parallel.hpp>
#include <lambent/sampling/independent.hpp>

lambent::RenderResult trace_independent(lambent::Film<float>& film, const lambent::PreparedScene<float>& scene,
                               const lambent::Camera& camera, const Options& o, const lambent::RenderOptions& options,
                               lambent::ThreadExecutor& threads, const std::function<bool()>& keep_going) {
    return trace_with(lambent::IndependentSampler<float>(o.seed), film, scene, camera, o, options, threads, keep_going);
}
