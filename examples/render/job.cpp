#include "job.hpp"
#include "../support/stopwatch.hpp"
#include "identity.hpp"
#include "scene_setup.hpp"
#include <cstdio>

using namespace lambent;

namespace {

/// Writes down how long it lived.
struct Timed {
    double& seconds;
    const Stopwatch watch{};
    ~Timed() { seconds = watch.seconds(); }
};

} // namespace

Job::Job(const Options& o)
    : options(o), threads(o.threads), scene([&] {
          const Timed timed{load_s};
          return make_scene(o, threads);
      }()),
      camera(choose_camera(scene, o)),
      prepared([&] {
          const Timed timed{build_s};
          return PreparedScene<float>(scene, threads);
      }()) {
    if (!o.quiet)
        for (const std::string& note : scene.notes) std::fprintf(stderr, "note: %s\n", note.c_str());
}

FilmState<float> empty_state(const Job& job) {
    const Options& o = job.options;
    FilmState<float> state;
    state.width = o.width;
    state.height = o.height;
    state.window = o.crop.empty() ? PixelWindow{0, 0, o.width, o.height} : o.crop;
    state.camera = job.camera;
    state.origin = job.scene.origin;
    state.identity = identity_of(o, job.scene, job.camera);
    state.settings = o.image.given;
    state.film = Film<float>(state.window.width(), state.window.height(), o.planes());
    return state;
}

FilmState<float> resumed_state(const Job& job, const std::string& path) {
    const Options& o = job.options;
    FilmState<float> state = empty_state(job);
    FilmState<float> saved = read_film<float>(path);
    const std::string differs = difference(saved, state);
    require(differs.empty(), [&] { return path + " is of another render: its " + differs; });
    require(contains(saved.film.planes(), o.planes()), [&] {
        return path + ": it has " + describe(saved.film.planes()) + "; --aov and --denoise need " +
               describe(o.planes());
    });
    state.film = std::move(saved.film);
    return state;
}

RenderOptions render_options(const Options& o, const FilmState<float>& state) {
    RenderOptions options;
    options.width = o.width;
    options.height = o.height;
    options.window = state.window;
    options.firefly_clamp = o.firefly_clamp;
    options.planes = state.film.planes();
    options.filter = o.filter;
    return options;
}
