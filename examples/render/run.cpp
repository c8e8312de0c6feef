#include "run.hpp"
#include "../support/stopwatch.hpp"
#include "identity.hpp"
#include "interrupt.hpp"
#include "report.hpp"
#include "scene_setup.hpp"
#include "trace.hpp"
#include <lambent/core/parallel.hpp>
#include <lambent/render/adaptive.hpp>
#include <algorithm>
#include <bit>
#include <cstdio>
#include <unistd.h>

using namespace lambent;

namespace {

Tracer tracer_of(SamplerKind kind) {
    switch (kind) {
    case SamplerKind::sobol: return trace_sobol;
    case SamplerKind::stratified: return trace_stratified;
    case SamplerKind::independent: return trace_independent;
    }
    return trace_sobol;
}

void check_files(const Options& o) {
    check_writable(o.out);
    check_writable(o.film); // an interrupt writes it, asked for or not
    if (!o.preview.empty()) check_writable(o.preview);
    if (!o.stats.empty()) check_writable(o.stats);
}

/// What there is before the first sample: an empty film, or the one to go on with.
FilmState<float> starting_state(const Options& o, const Scene<float>& scene, const Camera& camera) {
    FilmState<float> state;
    state.width = o.width;
    state.height = o.height;
    state.window = o.crop.empty() ? PixelWindow{0, 0, o.width, o.height} : o.crop;
    state.camera = camera;
    state.origin = scene.origin;
    state.identity = identity_of(o, scene, camera);
    state.settings = o.image.given;
    state.film = Film<float>(state.window.width(), state.window.height(), o.planes());
    if (o.resume.empty()) return state;

    FilmState<float> saved = read_film<float>(o.resume);
    const std::string differs = difference(saved, state);
    require(differs.empty(), [&] { return o.resume + " is of another render: its " + differs; });
    require(contains(saved.film.planes(), o.planes()), [&] {
        return o.resume + ": it has " + describe(saved.film.planes()) + "; --aov and --denoise need " +
               describe(o.planes());
    });
    state.film = std::move(saved.film);
    return state;
}

/// Renders the samples that are missing in passes of one dyadic block each, at first of one sample and then as large
/// as fits into a second: an interrupt loses no more than that, and the film's bits do not depend on the split.
class Passes {
public:
    Passes(const Options& o, FilmState<float>& state, const PreparedScene<float>& scene, ThreadExecutor& threads)
        : o_(o), state_(state), scene_(scene), threads_(threads) {
        options_.width = o.width;
        options_.height = o.height;
        options_.window = state.window;
        options_.firefly_clamp = o.firefly_clamp;
        options_.planes = state.film.planes();
        options_.filter = o.filter;
    }

    void run() {
        if (o_.error_target > 0) render_rounds();
        else
            for (const SampleRange& range : state_.film.missing(o_.samples())) render_range(range);
        if (progress_) std::fprintf(stderr, "\n");
    }

    RayCounts rays;
    double rendering_s = 0;
    double saving_s = 0; ///< checkpoints
    bool finished = true; ///< neither out of time nor interrupted

private:
    static constexpr double longest_pass_s = 1;

    /// Samples in the next pass by the speed of the last.
    std::uint64_t largest() const {
        if (samples_ == 0) return 1;
        const double left = std::max(0.0, o_.time_limit - rendering_s);
        const double fits = std::min(longest_pass_s, left) / std::max(1e-9, seconds_a_sample_);
        return std::max<std::uint64_t>(1, std::min(samples_, std::uint64_t(std::min(fits, 1e9))));
    }
    bool out_of_time() const { return samples_ > 0 && rendering_s + seconds_a_sample_ > o_.time_limit; }

    void render_range(const SampleRange& range) {
        for (std::uint64_t next = range.begin; next < range.end && finished;) {
            const DyadicBlock block = dyadic_block_at(next, range.end, largest());
            if (out_of_time()) finished = false;
            else render_block(block);
            next = block.end();
        }
    }

    /// Rounds that double the samples, each of the pixels that need them; where each one ends depends on its film
    /// alone, so that an interrupted render goes on as it would have.
    void render_rounds() {
        const AdaptiveOptions adaptive{.error_target = o_.error_target};
        const std::uint64_t limit = o_.samples().end;
        while (finished && state_.film.sample_count() < limit) {
            const std::uint64_t done = state_.film.sample_count();
            Plane<std::uint8_t, 1> active = going_on(state_.film);
            if (done >= adaptive.first_samples && std::has_single_bit(done)) {
                const Stopwatch watch;
                AdaptiveRound round = next_round(state_.film, adaptive, threads_);
                rendering_s += watch.seconds();
                if (round.count == 0) return;
                seconds_a_sample_ *= double(round.count) / double(std::max<std::size_t>(1, active_count_));
                active_count_ = round.count;
                active = std::move(round.active);
            }
            options_.active = std::as_const(active).view();
            const std::uint64_t end = done < adaptive.first_samples ? adaptive.first_samples : std::bit_ceil(done + 1);
            render_range({done, std::min(limit, end)});
            options_.active = {};
        }
    }

    void render_block(const DyadicBlock& block) {
        const Stopwatch watch;
        options_.first_sample = block.first;
        options_.end_sample = block.end();
        const RenderResult result = tracer_of(o_.sampler)(state_.film, scene_, state_.camera, o_, options_, threads_,
                                                          [] { return !interrupt::asked(); });
        rays += result.rays;
        rendering_s += watch.seconds();
        finished = !result.stopped;
        if (!finished) return;
        samples_ += block.size();
        seconds_a_sample_ = watch.seconds() / double(block.size());
        show(block.end());
        if (o_.checkpoint) save_now_and_then();
    }

    /// Saving takes at most a twentieth of the time.
    void save_now_and_then() {
        if (since_saved_.seconds() < std::max(1.0, 20 * last_save_s_)) return;
        const Stopwatch watch;
        write_film(o_.film, state_);
        last_save_s_ = watch.seconds();
        saving_s += last_save_s_;
        since_saved_ = Stopwatch();
    }

    void show(std::uint64_t done) const {
        if (progress_)
            std::fprintf(stderr, "\r%llu of %llu samples", static_cast<unsigned long long>(done),
                         static_cast<unsigned long long>(o_.samples().end));
    }

    const Options& o_;
    FilmState<float>& state_;
    const PreparedScene<float>& scene_;
    ThreadExecutor& threads_;
    RenderOptions options_;
    std::uint64_t samples_ = 0; ///< a pixel
    std::size_t active_count_ = state_.film.pixel_count();
    double seconds_a_sample_ = 0, last_save_s_ = 0;
    Stopwatch since_saved_;
    const bool progress_ = !o_.quiet && isatty(STDERR_FILENO) != 0;
};

/// What was interrupted: how to go on.
void say_how_to_go_on(const Options& o, const FilmState<float>& state) {
    std::fprintf(stderr, "interrupted: %llu samples a pixel are saved in %s; go on with the same options and --resume %s\n",
                 static_cast<unsigned long long>(state.film.sample_count()), o.film.c_str(), o.film.c_str());
}

} // namespace

int run(const Options& o) {
    interrupt::listen();
    check_files(o);
    RunReport report;
    const Stopwatch whole;
    ThreadExecutor threads(o.threads);
    const Scene<float> scene = make_scene(o, threads);
    const Camera camera = choose_camera(scene, o);
    if (!o.quiet)
        for (const std::string& note : scene.notes) std::fprintf(stderr, "note: %s\n", note.c_str());
    FilmState<float> state = starting_state(o, scene, camera);
    report.load_s = whole.seconds();

    const PreparedScene<float> prepared(scene, threads);
    report.build_s = whole.seconds() - report.load_s;

    const std::uint64_t resumed = state.film.total_samples();
    Passes passes(o, state, prepared, threads);
    passes.run();
    if (state.film.blocks().empty()) {
        std::fprintf(stderr, "interrupted before the first sample was done: nothing is saved\n");
        return 130;
    }

    std::vector<std::string> files = {o.out};
    const Stopwatch saving;
    const bool interrupted = interrupt::asked() && !passes.finished;
    if (o.wants_state() || interrupted) {
        write_film(o.film, state);
        files.push_back(o.film);
    }
    const double saving_s = saving.seconds() + passes.saving_s;
    report.image = write_image(state, o.image, {o.out, o.preview, o.exposure}, threads);
    if (!o.preview.empty()) files.push_back(o.preview);
    if (!o.stats.empty()) files.push_back(o.stats);

    report.triangles = scene.triangles.size();
    report.dropped = prepared.bvh().dropped();
    report.spheres = scene.spheres.size();
    report.lights = prepared.light_count();
    report.render_s = passes.rendering_s;
    report.write_s = report.image.write_s + saving_s;
    report.samples = state.film.total_samples() - resumed;
    report.mean_spp = double(state.film.total_samples()) / double(state.film.pixel_count());
    report.spp = state.film.sample_count();
    report.min_spp = report.spp;
    for (std::size_t p = 0; p < state.film.stops().size(); ++p)
        report.min_spp = std::min(report.min_spp, state.film.sample_count(p));
    report.error_target = o.error_target;
    report.rejected = state.film.rejected();
    report.rays = passes.rays;
    report.threads = threads.concurrency();
    report.facts = facts_of(scene);
    report.skipped = skipped_by(o, scene);
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
    report.total_s = whole.seconds();
    if (!o.stats.empty()) write_stats(o.stats, report);
    if (!o.quiet) print_report(report, files);
    if (o.explain) print_explanation(report);
    if (!interrupted) return 0;
    say_how_to_go_on(o, state);
    return 130;
}
