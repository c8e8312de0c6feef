#pragma once
#include "../support/image_output.hpp"
#include <lambent/io/load_options.hpp>
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
    std::vector<std::string> command; ///< the command line, from the program's name on
    std::string scene;
    lambent::LoadOptions load;
    std::string out = "out.exr", preview, stats, resume;
    std::string film; ///< where the state goes: `out` with the extension .film
    int width = 1280, height = 720;
    std::uint64_t spp = 16;
    std::optional<lambent::SampleRange> range; ///< unset: [0, spp)
    std::uint32_t seed = 0;
    unsigned threads = 0;
    IntegratorKind integrator = IntegratorKind::path;
    SamplerKind sampler = SamplerKind::sobol;
    lambent::PathStrategy strategy = lambent::PathStrategy::both;
    lambent::MisHeuristic mis = lambent::MisHeuristic::power;
    lambent::PathOptions path;
    std::string environment; ///< a file
    std::optional<lambent::Vec3d> constant_environment;
    double environment_rotation = 0, environment_scale = 1;
    bool compensated = false; ///< Scene::compensated
    std::vector<SphereLightOption> sphere_lights;
    int camera = 0;
    bool camera_chosen = false;
    std::optional<lambent::Vec3d> eye, target, up;
    std::optional<double> vertical_fov, focus_distance;
    double lens_radius = 0;
    lambent::PixelFilter filter = lambent::PixelFilter::box;
    lambent::PixelWindow crop;
    std::optional<lambent::Vec2<int>> pixel; ///< show its paths instead of rendering
    ImageSettings image;
    bool quiet = false, explain = false, checkpoint = false, validate = false;
    double exposure = 0;
    double error_target = 0; ///< 0 = none
    double time_limit = std::numeric_limits<double>::infinity();
    double firefly_clamp = std::numeric_limits<double>::infinity();

    bool wants_state() const { return range.has_value() || !resume.empty() || checkpoint; }
    /// Of the film.
    lambent::FilmPlanes planes() const {
        using lambent::FilmPlanes;
        return error_target > 0 ? image.planes() | FilmPlanes::albedo | FilmPlanes::halves : image.planes();
    }
    lambent::SampleRange samples() const { return range.value_or(lambent::SampleRange{0, spp}); }
};

/// Checks all that can be checked without a file. Unset when the help was asked for, and printed: by a program's name,
/// since render and render_mpi take the same. throws UsageError
std::optional<Options> parse_options(int argc, char** argv, const std::string& program = "render");
