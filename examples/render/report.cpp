#include "report.hpp"
#include <lambent/io/file.hpp>
#include <algorithm>
#include <cstdio>
#include <map>
#include <sys/resource.h>

using namespace lambent;

namespace {

double per_second(double count, double seconds) { return seconds > 0 ? count / seconds : 0; }

double peak_mib() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return double(usage.ru_maxrss) / 1024;
}

std::string shortened(double number) {
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", number);
    return text;
}

/// Why a run has no code or no work for something, by its name in `skipped`.
const std::map<std::string, std::string>& reasons() {
    static const std::map<std::string, std::string> all = {
        {"textures", "no material looks an image up: no image is decoded, its library is not loaded"},
        {"normal_maps", "no material has one"},
        {"standard_bsdf", "all materials are diffuse: vertices are Lambert's"},
        {"alpha", "no material is masked or blended: rays ask no surface whether it is there"},
        {"general_code", "the scene is plain: paths go side by side in registers, without code for textures, alpha, spheres, other materials"},
        {"light_sampling", "there is nothing to aim at, or it was not asked for: no shadow rays"},
        {"mis", "light is looked for in one way: no second density"}};
    return all;
}

std::string json_list(const std::vector<std::string>& words) {
    std::string text;
    for (const std::string& word : words) text.append(text.empty() ? "\"" : ", \"").append(word).append("\"");
    return "[" + text + "]";
}

} // namespace

void print_report(const RunReport& r, const std::vector<std::string>& files) {
    std::printf("triangles        %zu (%zu dropped), %zu spheres, %zu lights\n", r.triangles, r.dropped, r.spheres, r.lights);
    std::printf("seconds          load %.3f, build %.3f, render %.3f, denoise %.3f, write %.3f\n", r.load_s, r.build_s,
                r.render_s, r.image.denoise_s, r.write_s);
    const std::string spp = r.min_spp == r.spp ? std::to_string(r.spp) + " a pixel"
                                               : std::to_string(r.min_spp) + " to " + std::to_string(r.spp) +
                                                     " a pixel, " + shortened(r.mean_spp) + " on average";
    std::printf("samples          %s, %.3f Msamples/s, %.3f Mrays/s on %u threads\n", spp.c_str(),
                per_second(double(r.samples), r.render_s) * 1e-6,
                per_second(double(r.rays.closest + r.rays.shadow), r.render_s) * 1e-6, r.threads);
    if (r.rejected > 0)
        std::printf("rejected         %llu samples were not finite\n", static_cast<unsigned long long>(r.rejected));
    const std::string target = r.error_target > 0 ? " for a target of " + shortened(r.error_target) : "";
    if (r.image.denoised_error >= 0)
        std::printf("estimated error  %.4f%s, denoised %.4f\n", r.image.estimated_error, target.c_str(),
                    r.image.denoised_error);
    else if (r.image.estimated_error >= 0)
        std::printf("estimated error  %.4f%s\n", r.image.estimated_error, target.c_str());
    else std::printf("estimated error  unknown: it takes two samples a pixel\n");
    std::string names;
    for (const std::string& file : files) names.append(names.empty() ? "" : ", ").append(file);
    std::printf("wrote            %s\n", names.c_str());
}

void print_explanation(const RunReport& r) {
    const auto list = [](const std::vector<std::string>& words) {
        std::string text;
        for (const std::string& word : words) text.append(text.empty() ? "" : ", ").append(word);
        return text.empty() ? std::string("nothing") : text;
    };
    std::printf("facts            %s\n", list(r.facts).c_str());
    std::printf("integrator       %s; %s\n", r.integrator.c_str(), r.sampler.c_str());
    for (const std::string& what : r.skipped)
        std::printf("skipped          %-16s %s\n", what.c_str(), reasons().at(what).c_str());
    std::printf("planes           %s; those left out save %.3f of %.3f MiB a block of samples\n",
                describe(r.planes).c_str(), r.planes_saved_mib, r.planes_all_mib);
    if (r.background_samples > 0)
        std::printf("background       %.1f %% of this run's samples were not traced: their tiles see one colour alone\n",
                    100 * double(r.background_samples) / double(std::max<std::uint64_t>(1, r.samples)));
    if (r.rays.saved > 0)
        std::printf("shadow rays      %.1f %% of the light samples were not worth one\n",
                    100 * double(r.rays.saved) / double(r.rays.saved + r.rays.shadow));
    if (r.error_target > 0)
        std::printf("stopped          %.1f %% of the pixels, which saves %.1f %% of %llu samples a pixel everywhere\n",
                    100 * r.stopped, 100 * (1 - r.mean_spp / double(r.spp)), static_cast<unsigned long long>(r.spp));
}

void write_stats(const std::string& path, const RunReport& r) {
    lambent::detail::PendingFile pending(path);
    lambent::detail::OpenFile file(std::fopen(pending.name().c_str(), "w"));
    require(file != nullptr, [&] { return path + ": cannot be opened for writing"; });
    const auto number = [&](const char* name, double value) { std::fprintf(file.get(), "  \"%s\": %.9g,\n", name, value); };
    const auto count = [&](const char* name, std::uint64_t value) {
        std::fprintf(file.get(), "  \"%s\": %llu,\n", name, static_cast<unsigned long long>(value));
    };
    std::fprintf(file.get(), "{\n");
    count("triangles", r.triangles);
    count("dropped", r.dropped);
    count("spheres", r.spheres);
    count("lights", r.lights);
    number("load_s", r.load_s);
    number("build_s", r.build_s);
    number("render_s", r.render_s);
    number("denoise_s", r.image.denoise_s);
    number("write_s", r.write_s);
    number("total_s", r.total_s);
    count("samples", r.samples);
    number("msamples_per_s", per_second(double(r.samples), r.render_s) * 1e-6);
    count("rays", r.rays.closest + r.rays.shadow);
    count("closest_rays", r.rays.closest);
    count("shadow_rays", r.rays.shadow);
    count("shadow_rays_saved", r.rays.saved);
    count("background_samples", r.background_samples);
    number("mrays_per_s", per_second(double(r.rays.closest + r.rays.shadow), r.render_s) * 1e-6);
    count("threads", r.threads);
    count("spp", r.spp);
    count("spp_min", r.min_spp);
    number("spp_mean", r.mean_spp);
    if (r.error_target > 0) number("error_target", r.error_target);
    count("rejected", r.rejected);
    number("peak_mib", peak_mib());
    number("planes_saved_mib", r.planes_saved_mib);
    count("filter_exponentials", r.image.bilateral.exponentials);
    count("filter_taps", r.image.bilateral.taps);
    number("stopped", r.stopped);
    std::fprintf(file.get(), "  \"integrator\": \"%s\",\n  \"sampler\": \"%s\",\n", r.integrator.c_str(),
                 r.sampler.c_str());
    std::fprintf(file.get(), "  \"facts\": %s,\n  \"skipped\": %s,\n", json_list(r.facts).c_str(), json_list(r.skipped).c_str());
    if (r.image.denoised_error >= 0) number("denoised_error", r.image.denoised_error);
    if (r.image.estimated_error >= 0) std::fprintf(file.get(), "  \"estimated_error\": %.9g\n}\n", r.image.estimated_error);
    else std::fprintf(file.get(), "  \"estimated_error\": null\n}\n");
    const bool written = std::ferror(file.get()) == 0 && std::fclose(file.release()) == 0;
    require(written, [&] { return path + ": cannot be written; is the disk full?"; });
    pending.commit();
}
