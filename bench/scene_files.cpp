#include "scene_files.hpp"
#include <lambent/io/environment.hpp>
#include <lambent/io/scene_file.hpp>

lambent::Scene<float> scene_of_file(const std::string& path) { return lambent::load_scene<float>(path); }
lambent::Environment sky_of_file(const std::string& path) { return lambent::read_environment(path); }
