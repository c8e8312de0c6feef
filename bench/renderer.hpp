#pragma once
#include "../examples/support/denoise_frame.hpp"
#include <lambent/core/parallel.hpp>
#include <lambent/film/film.hpp>
#include <lambent/render/render.hpp>
#include <lambent/scene/prepared_scene.hpp>
#include <memory>

/// The path tracer and the denoiser as any program would have them, compiled once for the benchmarks.
std::unique_ptr<lambent::PreparedScene<float>> prepare(const lambent::Scene<float>& scene,
                                                       lambent::ThreadExecutor& threads);

/// lambent::render() of paths by Sobol's points.
void trace_paths(lambent::Film<float>& film, const lambent::PreparedScene<float>& scene, const lambent::Camera& camera,
                 std::uint32_t seed, const lambent::RenderOptions& options, lambent::ThreadExecutor& threads);
lambent::PixelData<float> trace_paths(const lambent::PreparedScene<float>& scene, const lambent::Camera& camera,
                                      std::uint32_t seed, const lambent::RenderOptions& options,
                                      lambent::ThreadExecutor& threads);
