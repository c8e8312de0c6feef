#include "passes.hpp"
#include "interrupt.hpp"
#include "trace.hpp"
#include <lambent/render/adaptive.hpp>
#include <algorithm>
#include <atomic>
#include <bit>
#include <cstdio>

using namespace lambent;

namespace {

constexpr double longest_pass_s = 1;

} // namespace

Passes::Passes(Job& job, FilmState<float>& state)
    : o_(job.options), job_(job), state_(state), options_(render_options(job.options, state)),
      active_count_(state.film.pixel_count()), progress_(Progress::style(job.options.quiet), job.options.time_limit) {}

void Passes::run(const std::vector<SampleRange>& ranges) {
    if (o_.error_target > 0) return render_rounds();
    std::uint64_t samples = 0;
    for (const SampleRange& range : ranges) samples += range.size();
    progress_.expect(double(samples) * double(state_.film.pixel_count()));
    for (const SampleRange& range : ranges) render_range(range);
}

/// Samples in the next pass by the speed of the last.
std::uint64_t Passes::largest() const {
    if (samples_ == 0) return 1;
    const double left = std::max(0.0, o_.time_limit - rendering_s);
    const double fits = std::min(longest_pass_s, left) / std::max(1e-9, seconds_a_sample_);
    return std::max<std::uint64_t>(1, std::min(samples_, std::uint64_t(std::min(fits, 1e9))));
}

void Passes::render_range(const SampleRange& range) {
    for (std::uint64_t next = range.begin; next < range.end && finished;) {
        const DyadicBlock block = dyadic_block_at(next, range.end, largest());
        if (out_of_time()) finished = false;
        else render_block(block);
        next = block.end();
    }
}

/// Rounds that double the samples, each of the pixels that need them; where each one ends depends on its film alone, so
/// that an interrupted render goes on as it would have.
void Passes::render_rounds() {
    const AdaptiveOptions adaptive{.error_target = o_.error_target};
    const std::uint64_t limit = o_.samples().end;
    while (finished && state_.film.sample_count() < limit) {
        const std::uint64_t done = state_.film.sample_count();
        Plane<std::uint8_t, 1> active = going_on(state_.film);
        if (done >= adaptive.first_samples && std::has_single_bit(done)) {
            const Stopwatch watch;
            AdaptiveRound round = next_round(state_.film, adaptive, job_.threads);
            rendering_s += watch.seconds();
            if (round.count == 0) return;
            seconds_a_sample_ *= double(round.count) / double(std::max<std::size_t>(1, active_count_));
            active_count_ = round.count;
            active = std::move(round.active);
            char note[64]; // the error falls with the root of the samples
            std::snprintf(note, sizeof note, "error %.3g for a target of %.3g", round.estimated_error, o_.error_target);
            progress_.note(note);
            const double longer = round.estimated_error / o_.error_target;
            progress_.expect(done_ + double(state_.film.total_samples()) * std::max(0.0, longer * longer - 1));
        }
        options_.active = std::as_const(active).view();
        const std::uint64_t end = done < adaptive.first_samples ? adaptive.first_samples : std::bit_ceil(done + 1);
        render_range({done, std::min(limit, end)});
        options_.active = {};
    }
}

void Passes::render_block(const DyadicBlock& block) {
    const Stopwatch watch;
    options_.first_sample = block.first;
    options_.end_sample = block.end();
    const auto along = [&](int pixels) { return (pixels + options_.tile - 1) / options_.tile; };
    const double tiles = double(along(state_.window.width())) * double(along(state_.window.height()));
    const double samples = double(block.size()) * double(active_count_);
    std::atomic<std::size_t> begun{0};
    const auto keep_going = [&] { // asked before each tile
        progress_.at(done_ + samples * (double(begun++) / tiles));
        return !interrupt::asked();
    };
    const RenderResult result =
        tracer_of(o_.sampler)(state_.film, job_.prepared, state_.camera, o_, options_, job_.threads, keep_going);
    rays += result.rays;
    background_samples += result.skipped;
    rendering_s += watch.seconds();
    finished = !result.stopped;
    if (!finished) return;
    samples_ += block.size();
    seconds_a_sample_ = watch.seconds() / double(block.size());
    done_ += samples;
    progress_.at(done_);
    if (o_.checkpoint) save_now_and_then();
}

/// Saving takes at most a twentieth of the time.
void Passes::save_now_and_then() {
    if (since_saved_.seconds() < std::max(1.0, 20 * last_save_s_)) return;
    const Stopwatch watch;
    write_film(o_.film, state_);
    last_save_s_ = watch.seconds();
    saving_s += last_save_s_;
    since_saved_ = Stopwatch();
}
