#include "trace_with.hpp"

lambent::RenderResult trace_stratified(lambent::Film<float>& film, const lambent::PreparedScene<float>& scene,
                                       const lambent::Camera& camera, const Options& o,
                                       const lambent::RenderOptions& options, lambent::ThreadExecutor& threads,
                                       const std::function<bool()>& keep_going) {
    return trace_with(stratified_sampler(o), film, scene, camera, o, options, threads, keep_going);
}
