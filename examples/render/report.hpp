#pragma once
#include "../support/image_output.hpp"
#include "options.hpp"
#include <lambent/render/integrator.hpp>
#include <lambent/scene/prepared_scene.hpp>
#include <cstdint>
#include <string>

/// What a run did and how long it took.
struct RunReport {
    std::size_t triangles = 0, dropped = 0, spheres = 0, lights = 0;
    double load_s = 0, build_s = 0, render_s = 0, write_s = 0, total_s = 0; ///< beside image.denoise_s
    std::uint64_t samples = 0; ///< of all pixels, in this run
    std::uint64_t spp = 0;     ///< in the film, with those that it was resumed with: the most that a pixel has
    std::uint64_t min_spp = 0;
    double mean_spp = 0;
    double error_target = 0;   ///< 0 = none
    std::uint64_t rejected = 0;
    lambent::RayCounts rays;
    unsigned threads = 0;
    ImageReport image;
    std::vector<std::string> facts, skipped; ///< what the scene uses; what this run has no code for
};

/// What the scene uses.
std::vector<std::string> facts_of(const lambent::PreparedScene<float>& scene);

/// What the run leaves out: not asked for or not in the scene.
std::vector<std::string> skipped_by(const Options& options, const lambent::Scene<float>& scene);

void print_report(const RunReport& report, const std::vector<std::string>& files);

/// As JSON. throws lambent::Error when it cannot be written
void write_stats(const std::string& path, const RunReport& report);
