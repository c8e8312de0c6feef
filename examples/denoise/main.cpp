// EXR in, denoised EXR out: our planes, or those of Blender, Mitsuba and pbrt.
#include "../support/denoise_frame.hpp"
#include "../support/image_output.hpp"
#include "../support/preview.hpp"
#include "../support/program.hpp"
#include "../support/stopwatch.hpp"
#include <lambent/core/parallel.hpp>
#include <lambent/film/error_estimate.hpp>
#include <lambent/io/exr_frame.hpp>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

using namespace lambent;

namespace {

struct Options {
    std::string in, out, preview, compare, stats;
    double exposure = 0;
    unsigned threads = 0;
    bool quiet = false;
    ImageSettings image;
};

std::optional<Options> parse_options(int argc, char** argv) {
    Options o;
    CommandLine line("denoise IN.exr --out OUT.exr [options]");
    bool help = false;
    line.add("--out F.exr", "the denoised image, with the planes that it is made of", [&](auto& v) { o.out = v; });
    line.add("--method METHOD", "another name for --denoise; auto = best, by what the file has (auto)",
             [&](auto& v) { line.set("--denoise", v == "auto" ? "best" : v); });
    add_image_options(line, o.image);
    line.add("--firefly off|seed[:S]", "divide what exceeds S (25) by S, as the original did (by the method)",
             [&](auto& v) { set_firefly(o.image, v); });
    line.add("--preview F.png", "an sRGB preview of the denoised image (none)", [&](auto& v) { o.preview = v; });
    line.add("--compare F.png", "before and after, side by side (none)", [&](auto& v) { o.compare = v; });
    line.add("--exposure EV", "of the previews, in stops (0)", [&](auto& v) { o.exposure = to_number(v); });
    line.add("--threads N", "0 = all of the machine's (0); the image does not depend on it",
             [&](auto& v) { o.threads = unsigned(to_integer(v, 0, 4096)); });
    line.add("--stats F.json", "counts and times (none)", [&](auto& v) { o.stats = v; });
    line.add("--quiet", "say nothing but errors (off)", [&](auto&) { o.quiet = true; });
    line.add("--help", "this text", [&](auto&) { help = true; });
    const std::vector<std::string> files = line.parse(argc, argv);
    if (help) {
        line.add_example("an image of ours, of Blender, Mitsuba or pbrt", "denoise noisy.exr --out clean.exr");
        line.add_example("and a look at it", "denoise noisy.exr --out clean.exr --compare both.png");
        line.add_example("faster", "denoise noisy.exr --out clean.exr --method fast");
        line.add_example("best of all, and with its error: render the statistics first",
                         "render scene.glb --spp 64 --denoise none --aov all,statistics --float --out noisy.exr");
        line.print_help();
        return std::nullopt;
    }
    if (files.size() != 1) throw UsageError(files.empty() ? "no image" : "more than one image: " + files[0] + " and " + files[1]);
    if (o.out.empty()) throw UsageError("--out F.exr is missing");
    o.in = files[0];
    return o;
}

/// The planes that would have kept edges sharp, had the file had them.
std::vector<std::string> missing_planes(const PixelData<float>& frame) {
    std::vector<std::string> missing;
    const auto check = [&](const char* name, const auto& plane) {
        if (plane.absent()) missing.push_back(name);
    };
    check("albedo", frame.albedo);
    check("normal", frame.normal);
    check("position", frame.position);
    check("material", frame.material);
    check("emission", frame.emission);
    check("variance", frame.variance);
    if (!has_light_statistics(frame.view())) missing.push_back("statistics"); // --aov statistics writes them
    return missing;
}

struct Times {
    double read_s = 0, denoise_s = 0, write_s = 0;
};

void write_stats(const Options& o, const PixelData<float>& frame, const DenoiseReport& report, unsigned threads,
                 const std::vector<std::string>& missing, const Times& times) {
    lambent::detail::PendingFile pending(o.stats);
    lambent::detail::OpenFile file(std::fopen(pending.name().c_str(), "w"));
    require(file != nullptr, [&] { return o.stats + ": cannot be opened for writing"; });
    std::string names;
    for (const std::string& name : missing) names.append(names.empty() ? "\"" : ", \"").append(name).append("\"");
    std::fprintf(file.get(),
                 "{\n  \"width\": %d,\n  \"height\": %d,\n  \"method\": \"%s\",\n  \"kernel\": %d,\n  \"threads\": %u,\n"
                 "  \"spikes\": %zu,\n  \"non_finite\": %zu,\n  \"missing\": [%s],\n"
                 "  \"filter_exponentials\": %llu,\n  \"filter_taps\": %llu,\n"
                 "  \"read_s\": %.9g,\n  \"denoise_s\": %.9g,\n  \"write_s\": %.9g\n}\n",
                 frame.width, frame.height, o.image.denoise.c_str(), o.image.denoise_options().kernel, threads,
                 report.spikes, report.non_finite, names.c_str(),
                 static_cast<unsigned long long>(report.bilateral.exponentials),
                 static_cast<unsigned long long>(report.bilateral.taps), times.read_s, times.denoise_s, times.write_s);
    const bool written = std::ferror(file.get()) == 0 && std::fclose(file.release()) == 0;
    require(written, [&] { return o.stats + ": cannot be written; is the disk full?"; });
    pending.commit();
}

/// The error before and after, and by what it is known; or why it isn't.
void print_error(const PixelData<float>& frame, const Denoised<float>& denoised) {
    const double before = estimated_error(frame);
    if (before < 0) {
        const char* why = frame.variance.absent()  ? "the file has no variance of its pixels, or not of how many samples"
                          : frame.samples.absent() ? "the file has no number of samples"
                                                   : "it takes two samples a pixel";
        std::printf("estimated error  unknown: %s\n", why);
        return;
    }
    std::printf("estimated error  %.4f, by the %s; ", before, frame.halves.absent() ? "pixels' variance" : "halves of the samples");
    if (denoised.report.error)
        std::printf("denoised %.4f, by their statistics\n",
                    estimated_error<float>(denoised.radiance.view(), denoised.error.view(), frame.emission.view()));
    else std::printf("denoised unknown: it takes statistics of the samples, and a method that uses them\n");
}

int run(const Options& o) {
    for (const std::string& file : {o.out, o.preview, o.compare, o.stats})
        if (!file.empty()) check_writable(file);
    Times times;
    const Stopwatch read_watch;
    const ExrImage image = read_exr(o.in);
    PixelData<float> frame = frame_from_exr(image);
    times.read_s = read_watch.seconds();
    const std::vector<std::string> missing = missing_planes(frame);
    if (!missing.empty() && !o.quiet) {
        std::string names;
        for (const std::string& name : missing) names.append(names.empty() ? "" : ", ").append(name);
        std::fprintf(stderr, "denoise: %s: denoised without %s\n", o.in.c_str(), names.c_str());
    }

    ThreadExecutor threads(o.threads);
    const Stopwatch denoise_watch;
    const Denoised<float> denoised = denoise_frame(frame, o.image.denoise_options(), threads);
    times.denoise_s = denoise_watch.seconds();

    const Stopwatch write_watch;
    ExrFrameOptions<float> exr;
    if (o.image.denoises()) {
        exr.denoised = denoised.radiance.view();
        exr.error = denoised.error.view();
    }
    exr.precision = o.image.full_float ? ExrPrecision::full : ExrPrecision::compact;
    exr.layers = o.image.layers;
    if (exr.layers) exr.layers->push_back("noisy");
    exr.attributes = image.attributes;
    if (image.display_width > 0) {
        exr.window = {image.left, image.top, image.left + image.width, image.top + image.height};
        exr.image_width = image.display_width;
        exr.image_height = image.display_height;
    }
    write_exr(o.out, frame, exr);
    const PixelView<const float, 3> before = std::as_const(frame).radiance.view(), after = denoised.radiance.view();
    if (!o.preview.empty()) write_preview(o.preview, {after}, o.exposure);
    if (!o.compare.empty()) write_preview(o.compare, {before, after}, o.exposure);
    times.write_s = write_watch.seconds();
    if (!o.stats.empty()) write_stats(o, frame, denoised.report, threads.concurrency(), missing, times);
    if (!o.quiet) {
        std::printf("image            %d x %d, %zu pixels mended, %zu clamped\n", frame.width, frame.height,
                    denoised.report.non_finite, denoised.report.spikes);
        print_error(frame, denoised);
        std::printf("seconds          read %.3f, denoise %.3f, write %.3f\n", times.read_s, times.denoise_s, times.write_s);
        std::string files = o.out;
        for (const std::string& file : {o.preview, o.compare, o.stats})
            if (!file.empty()) files += ", " + file;
        std::printf("wrote            %s\n", files.c_str());
    }
    return 0;
}

} // namespace

int main(int argc, char** argv) {
    return run_program("denoise", [&] {
        const auto options = parse_options(argc, argv);
        return options ? run(*options) : 0;
    });
}
