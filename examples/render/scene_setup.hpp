#pragma once
#include "options.hpp"
#include <lambent/core/parallel.hpp>
#include <lambent/scene/scene.hpp>

/// The scene as its file, or the code of a builtin one, has it. throws lambent::Error, UsageError
lambent::Scene<float> load_named_scene(const Options& options, lambent::ThreadExecutor& threads);

/// Loads or makes the scene and adds what the options ask for: environment, sphere lights, a sky where there is
/// no light at all. throws lambent::Error, UsageError
lambent::Scene<float> make_scene(const Options& options, lambent::ThreadExecutor& threads);

/// The camera by the options: one of the scene's, or one that frames it, with its parts replaced.
lambent::Camera choose_camera(const lambent::Scene<float>& scene, const Options& options);
