#pragma once
#include <lambent/render/path.hpp>
#include <lambent/render/render.hpp>
#include <lambent/scene/scene.hpp>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

enum class IntegratorKind : std::uint8_t { path, direct, ao, first_hit };
enum class SamplerKind : std::uint8_t { sobol, stratified, independent };

struct SphereLightOption {
    lambent::Vec3d center;
    double radius, radiance;
};

/// Everything that the command line of `render` says.
struct Options {
    std::string scene;
    std::string out = "out.exr", preview, stats, resume;
    int width = 1280, height = 720;
    std::uint64_t spp = 16;
    std::optional<std::uint64_t> range_begin, range_end;
    std::uint32_t seed = 0;
    unsigned threads = 0;
    IntegratorKind integrator = IntegratorKind::path;
    SamplerKind sampler = SamplerKind::sobol;
    lambent::PathStrategy strategy = lambent::PathStrategy::both;
    lambent::MisHeuristic mis = lambent::MisHeuristic::power;
    lambent::PathOptions path;
    std::string environment;
    double environment_rotation = 0, environment_scale = 1;
    std::vector<SphereLightOption> sphere_lights;
    int camera = 0;
    bool camera_chosen = false;
    std::optional<lambent::Vec3d> eye, target, up;
    std::optional<double> vertical_fov;
    lambent::PixelWindow crop;
    std::string denoise = "none";
    std::string aov = "all";
    bool full_float = false, quiet = false, checkpoint = false;
    double exposure = 0;
    double time_limit = std::numeric_limits<double>::infinity();
    double firefly_clamp = std::numeric_limits<double>::infinity();

    bool wants_state() const { return range_begin.has_value() || !resume.empty() || checkpoint; }
};

/// throws UsageError; prints the help and exits with 0 when asked for it
Options parse_options(int argc, char** argv);
