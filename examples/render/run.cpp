#include "run.hpp"
#include "interrupt.hpp"
#include "report.hpp"
#include <algorithm>
#include <cstdio>

using namespace lambent;

void check_files(const Options& o) {
    check_writable(o.out);
    check_writable(o.film); // an interrupt writes it, asked for or not
    if (!o.preview.empty()) check_writable(o.preview);
    if (!o.stats.empty()) check_writable(o.stats);
}

std::string how_to_go_on(const Options& o) {
    const auto quoted = [](const std::string& word) {
        const std::string plain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_./:,=+%@";
        if (!word.empty() && word.find_first_not_of(plain) == std::string::npos) return word;
        std::string text = "'";
        for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
        return text + "'";
    };
    std::string line;
    for (std::size_t i = 0; i < o.command.size(); ++i) {
        if (o.command[i] == "--resume") ++i; // and its file
        else if (!o.command[i].starts_with("--resume=")) line += quoted(o.command[i]) + " ";
    }
    return line + "--resume " + quoted(o.film);
}

void write_results(Job& job, const FilmState<float>& state, Work work, bool keep_state, const Stopwatch& since_start) {
    const Options& o = job.options;
    RunReport report;
    std::vector<std::string> files = {o.out};
    const Stopwatch saving;
    if (keep_state) {
        write_film(o.film, state);
        files.push_back(o.film);
        work.saving_s += saving.seconds();
    }
    report.image = write_image(state, o.image, {o.out, o.preview, o.exposure}, job.threads);
    if (!o.preview.empty()) files.push_back(o.preview);
    if (!o.stats.empty()) files.push_back(o.stats);

    report.triangles = job.scene.triangles.size();
    report.dropped = job.prepared.bvh().dropped();
    report.spheres = job.scene.spheres.size();
    report.lights = job.prepared.light_count();
    report.load_s = job.load_s;
    report.build_s = job.build_s;
    report.render_s = work.rendering_s;
    report.write_s = report.image.write_s + work.saving_s;
    report.samples = work.samples;
    report.mean_spp = double(state.film.total_samples()) / double(state.film.pixel_count());
    report.spp = state.film.sample_count();
    report.min_spp = report.spp;
    for (std::size_t p = 0; p < state.film.stops().size(); ++p)
        report.min_spp = std::min(report.min_spp, state.film.sample_count(p));
    report.error_target = o.error_target;
    report.rejected = state.film.rejected();
    report.rays = work.rays;
    report.background_samples = work.background_samples;
    report.threads = work.threads;
    report.facts = facts_of(job.scene);
    report.skipped = skipped_by(o, job.scene);
    report.integrator = state.identity.at("integrator");
    report.sampler = state.identity.at("sampler");
    report.planes = state.film.planes();
    const auto plane_mib = [&](int channels) {
        return double(channels) * double(state.film.pixel_count() * sizeof(float)) / 0x1p20;
    };
    report.planes_all_mib = plane_mib(Film<float>(1, 1, FilmPlanes::statistics).channels());
    report.planes_saved_mib = report.planes_all_mib - plane_mib(state.film.channels());
    report.stopped = double(std::count_if(state.film.stops().begin(), state.film.stops().end(),
                                          [](auto stop) { return stop != Film<float>::goes_on; })) /
                     double(state.film.pixel_count());
    report.total_s = since_start.seconds();
    if (!o.stats.empty()) write_stats(o.stats, report);
    if (!o.quiet) print_report(report, files);
    if (o.explain) print_explanation(report);
}

int run(const Options& o) {
    interrupt::listen();
    check_files(o);
    const Stopwatch whole;
    Job job(o);
    FilmState<float> state = o.resume.empty() ? empty_state(job) : resumed_state(job, o.resume);
    const std::uint64_t resumed = state.film.total_samples();
    Passes passes(job, state);
    passes.run(state.film.missing(o.samples()));
    if (state.film.blocks().empty()) {
        std::fprintf(stderr, "interrupted before the first sample was done: nothing is saved\n");
        return 130;
    }

    const bool interrupted = interrupt::asked() && !passes.finished, keep_state = o.wants_state() || interrupted;
    const std::uint64_t samples = state.film.total_samples() - resumed;
    const Work work{.rays = passes.rays,
                    .background_samples = passes.background_samples,
                    .rendering_s = passes.rendering_s,
                    .saving_s = passes.saving_s,
                    .samples = samples,
                    .threads = job.threads.concurrency()};
    write_results(job, state, work, keep_state, whole);
    if (!passes.finished && keep_state && (interrupted || !o.quiet))
        std::fprintf(stderr, "%s: %llu samples a pixel are saved in %s; to go on:\n  %s\n",
                     interrupted ? "interrupted" : "out of time",
                     static_cast<unsigned long long>(state.film.sample_count()), o.film.c_str(), how_to_go_on(o).c_str());
    return interrupted ? 130 : 0;
}
