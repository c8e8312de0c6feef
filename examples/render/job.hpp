#pragma once
#include "options.hpp"
#include <lambent/core/parallel.hpp>
#include <lambent/io/film_file.hpp>
#include <lambent/render/render.hpp>
#include <lambent/scene/prepared_scene.hpp>

/// What every run starts with: the scene as the options want it, ready for rays.
struct Job {
    /// Loads, and prints notes on the scene unless told to be quiet. throws lambent::Error, UsageError
    explicit Job(const Options& options);
    Job(const Job&) = delete;
    Job& operator=(const Job&) = delete;

    const Options& options;
    double load_s = 0, build_s = 0;
    lambent::ThreadExecutor threads;
    lambent::Scene<float> scene;
    lambent::Camera camera;
    lambent::PreparedScene<float> prepared;
};

/// A film without samples, with all that belongs to this job.
lambent::FilmState<float> empty_state(const Job& job);

/// The film in a file. throws lambent::Error unless it is of this job
lambent::FilmState<float> resumed_state(const Job& job, const std::string& path);

/// For passes over this film.
lambent::RenderOptions render_options(const Options& options, const lambent::FilmState<float>& state);
