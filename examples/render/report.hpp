#pragma once
#include "../support/image_output.hpp"
#include "facts.hpp"
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
    std::uint64_t background_samples = 0; ///< of this run, that were not traced: RenderResult::skipped
    unsigned threads = 0;
    ImageReport image;
    std::vector<std::string> facts, skipped; ///< see facts.hpp
    std::string integrator, sampler;         ///< in words, with what they were specialised for
    lambent::FilmPlanes planes{};
    double planes_saved_mib = 0, planes_all_mib = 0; ///< of a block of samples: those left out; all there are
    double stopped = 0; ///< share of the pixels that stopped before the others
};

/// `--explain`: facts, specialisation, what was left out and why, and what that saved.
void print_explanation(const RunReport& report);

void print_report(const RunReport& report, const std::vector<std::string>& files);

/// As JSON. throws lambent::Error when it cannot be written
void write_stats(const std::string& path, const RunReport& report);
