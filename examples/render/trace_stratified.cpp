#include "trace_with.hpp"
#include <lambent/core/parallel.hpp>
#include <lambent/sampling/stratified.hpp>
#include <algorithm>

lambent::RenderResult trace_stratified(lambent::Film<float>& film, const lambent::PreparedScene<float>& scene,
                                       const lambent::Camera& camera, const Options& o,
                                       const lambent::RenderOptions& options, lambent::ThreadExecutor& threads,
                                       const std::function<bool()>& keep_going) {
    const auto strata = std::uint32_t(std::min<std::uint64_t>(o.spp, 1u << 24));
    return trace_with(lambent::StratifiedSampler<float>(o.seed, strata), film, scene, camera, o, options, threads,
                      keep_going);
}
