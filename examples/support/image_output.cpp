#include "image_output.hpp"
#include "denoise_frame.hpp"
#include "preview.hpp"
#include "stopwatch.hpp"
#include <lambent/core/parallel.hpp>
#include <lambent/film/error_estimate.hpp>
#include <lambent/io/exr_frame.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>

using namespace lambent;

namespace {

/// What --aov knows, each with the film's planes that it is made of.
const std::vector<std::pair<std::string, FilmPlanes>> layer_planes = {
    {"albedo", FilmPlanes::albedo},     {"illumination", FilmPlanes::illumination},
    {"emission", FilmPlanes::emission}, {"N", FilmPlanes::normal},
    {"P", FilmPlanes::position},        {"Z", FilmPlanes::depth},
    {"material", FilmPlanes::material}, {"samples", FilmPlanes::radiance},
    {"variance", FilmPlanes::radiance}, {"error", FilmPlanes::statistics},
    {"statistics", FilmPlanes::statistics}};

FilmPlanes planes_of_layers(const ImageSettings& settings) {
    if (!settings.layers) return FilmPlanes::features;
    FilmPlanes planes = FilmPlanes::radiance;
    for (const auto& [name, plane] : layer_planes)
        if (std::find(settings.layers->begin(), settings.layers->end(), name) != settings.layers->end()) planes |= plane;
    return planes;
}

void set_layers(ImageSettings& settings, const std::string& text) {
    settings.layers.reset();
    if (text == "all") return;
    settings.layers.emplace();
    if (text == "none") return;
    std::vector<std::string> names;
    for (const auto& [name, plane] : layer_planes) names.push_back(name);
    for (const std::string& name : split(text, ',')) {
        if (name != "all") settings.layers->push_back(names[to_choice(name, names)]);
        else
            settings.layers->insert(settings.layers->end(), names.begin(),
                                    names.end() - 2); // without error and statistics
    }
}

void set_method(ImageSettings& settings, const std::string& text) {
    std::vector<std::string> methods = split(std::string(denoise_methods), '|');
    settings.denoise = methods[to_choice(text, methods)];
}

int to_kernel(const std::string& text) {
    const int kernel = int(to_integer(text, 0, 1023));
    if (kernel % 2 == 0 && kernel != 0) throw UsageError("must be odd, or 0 for no filter");
    return kernel;
}

double to_sigma(const std::string& text) {
    return text == "off" ? std::numeric_limits<double>::infinity() : to_positive(text);
}

std::map<std::string, ExrValue> metadata(const FilmState<float>& state) {
    std::map<std::string, ExrValue> attributes = camera_attributes(state.camera, state.width, state.height);
    attributes["version"] = std::string("lambent " LAMBENT_VERSION);
    attributes["spp"] = int(std::min<std::uint64_t>(state.film.sample_count(), std::numeric_limits<int>::max()));
    const auto seed = state.identity.find("seed");
    if (seed != state.identity.end()) attributes["seed"] = std::strtod(seed->second.c_str(), nullptr);
    for (const auto& [name, key] : {std::pair{"facts", "scene facts"},
                                    {"skipped", "skipped"},
                                    {"integrator", "integrator"},
                                    {"sampler", "sampler"}}) // what --explain prints
        if (const auto words = state.identity.find(key); words != state.identity.end())
            attributes[name] = words->second;
    const std::vector<SampleRange> ranges = state.film.ranges();
    if (ranges.size() != 1 || ranges[0].begin != 0) { // a part of an image, to be merged with others
        std::string text;
        for (const SampleRange& range : ranges) text.append(text.empty() ? "" : " ").append(describe(range));
        attributes["sampleRanges"] = text;
    }
    return attributes;
}

} // namespace

DenoiseOptions ImageSettings::denoise_options() const {
    DenoiseOptions options = lambent::denoise_options(denoise);
    const auto replace = [](auto& value, const auto& by) {
        if (by) value = *by;
    };
    if (denoise != "none") replace(options.kernel, kernel);
    replace(options.sigma_spatial, sigma_spatial);
    replace(options.sigma_illumination, sigma_illumination);
    replace(options.sigma_position, sigma_position);
    replace(options.sigma_normal, sigma_normal);
    replace(options.sigma_material, sigma_material);
    replace(options.despike, despike);
    replace(options.firefly, firefly);
    if (firefly && !despike && std::isinf(*firefly)) options.despike = *firefly; // --firefly off
    if (kernel || sigma_spatial || sigma_illumination || sigma_position || sigma_normal || sigma_material || despike ||
        firefly)
        options.noise = NoiseUse::filter; // these are its
    return options;
}

FilmPlanes ImageSettings::planes() const {
    FilmPlanes planes = planes_of_layers(*this) | FilmPlanes::emission;
    if (denoises())
        planes |= FilmPlanes::albedo | FilmPlanes::normal | FilmPlanes::position | FilmPlanes::material;
    const NoiseUse use = denoise_options().noise;
    if (use == NoiseUse::regression || use == NoiseUse::coarse_regression) planes |= FilmPlanes::statistics;
    return planes;
}

void add_image_options(CommandLine& line, ImageSettings& settings) {
    const auto add = [&](const std::string& spelling, const std::string& help, auto set) {
        const std::string name = spelling.substr(0, spelling.find(' '));
        line.add(spelling, help, [&settings, name, set](const std::string& text) {
            set(settings, text);
            settings.given[name] = text;
        });
    };
    using S = ImageSettings;
    using Text = const std::string&;
    add("--denoise METHOD", std::string(denoise_methods) + " (best)", [](S& s, Text t) { set_method(s, t); });
    add("--kernel N", "taps along a side, odd; 0 = off (by the method)", [](S& s, Text t) { s.kernel = to_kernel(t); });
    add("--sigma-spatial X", "in pixels (by the method: kernel / 6.4)", [](S& s, Text t) { s.sigma_spatial = to_positive(t); });
    add("--sigma-illumination X|off", "of the filter's weights (by the method)",
        [](S& s, Text t) { s.sigma_illumination = to_sigma(t); });
    add("--sigma-position X|off", "likewise", [](S& s, Text t) { s.sigma_position = to_sigma(t); });
    add("--sigma-normal X|off", "likewise", [](S& s, Text t) { s.sigma_normal = to_sigma(t); });
    add("--sigma-material X|off", "likewise", [](S& s, Text t) { s.sigma_material = to_sigma(t); });
    add("--despike X|off", "clamp pixels X deviations above their neighbours (by the method)",
        [](S& s, Text t) { s.despike = to_sigma(t); });
    add("--aov all|none|LIST", "planes beside the image, as albedo,N,Z; all,statistics for denoise (all)",
        [](S& s, Text t) { set_layers(s, t); });
    add("--float", "float32 throughout the EXR (half where it will do)", [](S& s, Text) { s.full_float = true; });
}

void set_firefly(ImageSettings& settings, const std::string& text) {
    if (text == "off") {
        settings.firefly = std::numeric_limits<double>::infinity();
    } else if (text == "seed") {
        settings.firefly = 25;
    } else if (text.rfind("seed:", 0) == 0) {
        settings.firefly = to_positive(text.substr(5));
    } else {
        throw UsageError("is none of off, seed, seed:S");
    }
    settings.given["--firefly"] = text;
}

void take_settings(ImageSettings& settings, const std::map<std::string, std::string>& given, const std::string& path) {
    CommandLine line("");
    add_image_options(line, settings);
    line.add("--firefly RULE", "", [&](const std::string& text) { set_firefly(settings, text); });
    try {
        for (const auto& [name, value] : given) line.set(name, value);
    } catch (const UsageError& e) {
        fail(path + ": its image settings are of another version: " + e.what());
    }
}

ImageReport write_image(const FilmState<float>& state, const ImageSettings& settings, const ImageFiles& files,
                        ThreadExecutor& threads) {
    const FilmPlanes wanted = settings.layers ? planes_of_layers(settings) : FilmPlanes::radiance;
    require(contains(state.film.planes(), wanted), [&] {
        return files.exr + ": the film has " + describe(state.film.planes()) + "; asked for " + describe(wanted);
    });
    ImageReport report;
    const Stopwatch whole;
    const PixelData<float> frame = state.film.resolve(state.origin);
    report.estimated_error = estimated_error(frame);

    Denoised<float> denoised;
    if (settings.denoises()) {
        const Stopwatch watch;
        denoised = denoise_frame(frame, settings.denoise_options(), threads);
        report.spikes = denoised.report.spikes;
        report.bilateral = denoised.report.bilateral;
        report.denoise_s = watch.seconds();
    }

    ExrFrameOptions<float> exr;
    exr.denoised = std::as_const(denoised).radiance.view();
    exr.error = std::as_const(denoised).error.view();
    if (!exr.error.absent() && report.estimated_error >= 0)
        report.denoised_error = estimated_error<float>(exr.denoised, exr.error, frame.emission.view());
    exr.precision = settings.full_float ? ExrPrecision::full : ExrPrecision::compact;
    exr.layers = settings.layers;
    if (exr.layers) exr.layers->push_back("noisy");
    exr.attributes = metadata(state);
    exr.window = state.window;
    exr.image_width = state.width;
    exr.image_height = state.height;
    write_exr(files.exr, frame, exr);
    if (!files.preview.empty())
        write_preview(files.preview, {exr.denoised.absent() ? std::as_const(frame).radiance.view() : exr.denoised},
                      files.exposure);
    report.write_s = whole.seconds() - report.denoise_s;
    return report;
}

void check_writable(const std::string& path) {
    require(!std::filesystem::is_directory(path), [&] { return path + ": is a folder"; });
    const std::filesystem::path folder = std::filesystem::path(path).parent_path();
    require(folder.empty() || std::filesystem::is_directory(folder),
            [&] { return path + ": there is no folder " + folder.string(); });
    const std::string probe = path + ".part"; // where the file will be written before it is renamed
    const bool fresh = !std::filesystem::exists(probe);
    const lambent::detail::OpenFile file(std::fopen(probe.c_str(), "ab"));
    require(file != nullptr, [&] { return path + ": no file can be written there"; });
    std::error_code ignored;
    if (fresh) std::filesystem::remove(probe, ignored);
}

std::string with_extension(const std::string& path, const std::string& extension) {
    return std::filesystem::path(path).replace_extension(extension).string();
}
