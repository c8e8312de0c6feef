#pragma once
#include "command_line.hpp"
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise.hpp>
#include <lambent/film/film_planes.hpp>
#include <lambent/io/film_file.hpp>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

/// How an image is made of a film. Two films with the same samples and the same settings give the same file.
struct ImageSettings {
    std::string denoise = "best"; ///< a method of lambent::denoise_options()
    std::optional<int> kernel;
    std::optional<double> sigma_spatial, sigma_illumination, sigma_position, sigma_normal, sigma_material;
    std::optional<double> despike, firefly;
    std::optional<std::vector<std::string>> layers; ///< unset: all
    bool full_float = false;
    std::map<std::string, std::string> given; ///< the options as they were given; kept in film files

    /// The method's options with those that were given in their places.
    lambent::DenoiseOptions denoise_options() const;
    bool denoises() const { return denoise_options().kernel > 0; }
    /// What a film needs for it. The estimated error leaves out what emits, so emission is always in.
    lambent::FilmPlanes planes() const;
};

/// Adds --denoise, --kernel, --sigma-…, --aov and --float.
void add_image_options(CommandLine& line, ImageSettings& settings);

/// off|seed|seed:S. throws UsageError
void set_firefly(ImageSettings& settings, const std::string& text);

/// Takes over what a film file remembers. throws lambent::Error naming the file
void take_settings(ImageSettings& settings, const std::map<std::string, std::string>& given, const std::string& path);

struct ImageFiles {
    std::string exr;
    std::string preview; ///< PNG; empty = none
    double exposure = 0; ///< of the preview, in stops
};

struct ImageReport {
    double denoise_s = 0, write_s = 0;
    double estimated_error = -1; ///< of the image before denoising, negative = unknown
    double denoised_error = -1;  ///< of the image after it
    std::size_t spikes = 0;      ///< pixels that the denoiser clamped
    lambent::BilateralCounts bilateral{};
};

/// Resolves the film, denoises and writes the EXR with its metadata (no clock in it: equal renders are equal files) and
/// the preview. throws lambent::Error
ImageReport write_image(const lambent::FilmState<float>& state, const ImageSettings& settings, const ImageFiles& files,
                        lambent::ThreadExecutor& threads);

/// Fails unless a file of this name can be made. throws lambent::Error
void check_writable(const std::string& path);

/// `path` with its extension replaced: out.exr → out.film
std::string with_extension(const std::string& path, const std::string& extension);
