#pragma once
#include "options.hpp"
#include <lambent/scene/camera.hpp>
#include <lambent/scene/scene.hpp>
#include <map>
#include <string>

/// What the samples depend on, in words, for film files: the scene's content, camera, integrator, sampler, seed. Not
/// the number of samples (but for stratified ones, whose strata it sets), nor threads, nor what is made of them.
std::map<std::string, std::string> identity_of(const Options& options, const lambent::Scene<float>& scene,
                                               const lambent::Camera& camera);
