#pragma once
#include "../support/stopwatch.hpp"
#include "job.hpp"
#include "progress.hpp"
#include <lambent/film/dyadic.hpp>
#include <vector>

/// Renders samples in passes of one dyadic block each, at first of one sample and then as large as fits into a second:
/// an interrupt loses no more than that, and the film's bits do not depend on the split.
class Passes {
public:
    Passes(Job& job, lambent::FilmState<float>& state);

    /// These of every pixel, or with an error target, rounds until it is met. Ends early when it is out of time or
    /// interrupted. throws lambent::Error when a checkpoint cannot be written
    void run(const std::vector<lambent::SampleRange>& ranges);

    lambent::RayCounts rays;
    std::uint64_t background_samples = 0; ///< that were not traced
    double rendering_s = 0;
    double saving_s = 0;  ///< checkpoints
    bool finished = true; ///< neither out of time nor interrupted

private:
    std::uint64_t largest() const;
    bool out_of_time() const { return samples_ > 0 && rendering_s + seconds_a_sample_ > o_.time_limit; }
    void render_range(const lambent::SampleRange& range);
    void render_rounds();
    void render_block(const lambent::DyadicBlock& block);
    void save_now_and_then();

    const Options& o_;
    Job& job_;
    lambent::FilmState<float>& state_;
    lambent::RenderOptions options_;
    std::uint64_t samples_ = 0; ///< a pixel
    std::size_t active_count_;
    double seconds_a_sample_ = 0, last_save_s_ = 0;
    Stopwatch since_saved_;
    Progress progress_;
    double done_ = 0; ///< samples of all pixels
};
