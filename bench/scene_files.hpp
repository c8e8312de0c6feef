#pragma once
#include <lambent/scene/scene.hpp>
#include <string>

/// The readers of scenes and skies, compiled once for the benchmarks: lambent::load_scene(), lambent::read_environment().
lambent::Scene<float> scene_of_file(const std::string& path);
lambent::Environment sky_of_file(const std::string& path);
