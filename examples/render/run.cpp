#include "../support/command_line.hpp"
#include "../support/preview.hpp"
#include "output.hpp"
#include "scene_setup.hpp"
#include "trace.hpp"
#include <lambent/film/error_estimate.hpp>
#include <lambent/io/exr_frame.hpp>
#include <chrono>
#include <cstdio>

using namespace lambent;

volatile std::sig_atomic_t interrupted = 0;

namespace {

class Stopwatch {
public:
    double seconds() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    }

private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

Tracer tracer_of(SamplerKind kind) {
    switch (kind) {
    case SamplerKind::sobol: return trace_sobol;
    case SamplerKind::stratified: return trace_stratified;
    case SamplerKind::independent: return trace_independent;
    }
    return trace_sobol;
}

} // namespace

int run(const Options& o) {
    Stopwatch load_watch;
    const Scene<float> scene = make_scene(o);
    const Camera camera = choose_camera(scene, o);
    const double load_s = load_watch.seconds();
    if (!o.quiet)
        for (const std::string& note : scene.notes) std::fprintf(stderr, "note: %s\n", note.c_str());

    ThreadExecutor threads(o.threads);
    Stopwatch build_watch;
    const PreparedScene<float> prepared(scene, threads);
    const double build_s = build_watch.seconds();

    RenderOptions options;
    options.width = o.width;
    options.height = o.height;
    options.window = o.crop;
    options.firefly_clamp = o.firefly_clamp;
    options.planes = o.aov == "none" ? FilmPlanes::radiance : FilmPlanes::features;

    // Passes of 1, 1, 2, 4, … samples: Ctrl-C and the time limit lose little, and the film's bits do not
    // depend on how the samples are split.
    Film<float> film;
    RenderResult total;
    Stopwatch render_watch;
    std::uint64_t next = o.range_begin.value_or(0);
    const std::uint64_t begin = next, end = o.range_end.value_or(o.spp);
    const auto keep_going = [&] { return interrupted == 0 && (film.blocks().empty() || render_watch.seconds() < o.time_limit); };
    while (next < end && !total.stopped) {
        options.first_sample = next;
        options.end_sample = std::min(end, next + std::max<std::uint64_t>(1, next - begin));
        const RenderResult pass = tracer_of(o.sampler)(film, prepared, camera, o, options, threads, keep_going);
        total.rays += pass.rays;
        
        total.stopped = pass.stopped;
        next = options.end_sample;
        if (!o.quiet) std::fprintf(stderr, "\r%llu of %llu samples", (unsigned long long)next, (unsigned long long)end);
    }
    const double render_s = render_watch.seconds();
    if (!o.quiet) std::fprintf(stderr, "\n");
    if (film.blocks().empty()) fail("interrupted before the first sample was done: nothing to save");

    const PixelData<float> frame = film.resolve(scene.origin);
    ExrFrameOptions<float> exr;
    exr.precision = o.full_float ? ExrPrecision::full : ExrPrecision::compact;
    exr.attributes = camera_attributes(camera, o.width, o.height);
    write_exr(o.out, frame, exr);
    if (!o.preview.empty()) write_preview(o.preview, frame.radiance.view(), o.exposure);

    const double samples = double(film.sample_count()) * frame.width * frame.height;
    const double rays = double(total.rays.closest + total.rays.shadow);
    if (!o.quiet) {
        std::printf("triangles        %zu (%zu dropped), %zu spheres, %zu lights\n", scene.triangles.size(),
                    prepared.bvh().dropped(), scene.spheres.size(), prepared.light_count());
        std::printf("seconds          load %.3f, build %.3f, render %.3f\n", load_s, build_s, render_s);
        std::printf("samples          %llu a pixel, %.3g million/s, %.3g Mrays/s\n",
                    (unsigned long long)film.sample_count(), samples / render_s * 1e-6, rays / render_s * 1e-6);
        if (film.rejected() > 0) std::printf("rejected         %llu samples were not finite\n", (unsigned long long)film.rejected());
        const double error = estimated_error(frame);
        if (error >= 0) std::printf("estimated error  %.4f\n", error);
        std::printf("wrote            %s%s%s\n", o.out.c_str(), o.preview.empty() ? "" : ", ", o.preview.c_str());
    }
    return interrupted != 0 ? 130 : 0;
}
