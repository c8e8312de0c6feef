#include "renderer.hpp"
#include <lambent/render/path.hpp>
#include <lambent/sampling/sobol.hpp>
#include <lambent/scene/specialised_scene.hpp>

using namespace lambent;

std::unique_ptr<PreparedScene<float>> prepare(const Scene<float>& scene, ThreadExecutor& threads) {
    return std::make_unique<PreparedScene<float>>(scene, threads);
}

void trace_paths(Film<float>& film, const PreparedScene<float>& scene, const Camera& camera, std::uint32_t seed,
                 const RenderOptions& options, ThreadExecutor& threads) {
    with_specialised<plain_features>(scene, [&](const auto& specialised) { // as the program does
        render(film, specialised, camera, PathIntegrator<>{}, SobolSampler<float>(seed), options, threads,
               [] { return true; });
    });
}

PixelData<float> trace_paths(const PreparedScene<float>& scene, const Camera& camera, std::uint32_t seed,
                             const RenderOptions& options, ThreadExecutor& threads) {
    PixelData<float> frame;
    with_specialised<plain_features>(scene, [&](const auto& specialised) {
        frame = render(specialised, camera, PathIntegrator<>{}, SobolSampler<float>(seed), options, threads);
    });
    return frame;
}
