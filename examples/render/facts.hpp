#pragma once
#include "options.hpp"
#include <lambent/scene/scene.hpp>
#include <string>
#include <vector>

/// What the scene uses.
std::vector<std::string> facts_of(const lambent::Scene<float>& scene);

/// Whether a run uses the integrator that was made for plain scenes alone.
bool is_specialised(const Options& options, const lambent::Scene<float>& scene);

/// What a run leaves out, since it was not asked for or is not in the scene.
std::vector<std::string> skipped_by(const Options& options, const lambent::Scene<float>& scene);
