// render by many processes, on all machines that mpirun starts them on: each takes a part of the samples and leaves its
// film beside the image, in a folder that all of them see, and rank 0 puts the films together in order. One that dies is
// noticed by the lock that it held and loses its own part only; start with mpirun --enable-recovery, or mpirun ends the
// others with it. The image is the one that render writes, byte for byte.
#include "render/interrupt.hpp"
#include "render/run.hpp"
#include "support/process_lock.hpp"
#include "support/program.hpp"
#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <filesystem>
#include <mpi.h>
#include <optional>
#include <unistd.h>

using namespace lambent;

namespace {

struct World {
    int rank = 0, size = 1;

    World() {
        MPI_Comm_rank(MPI_COMM_WORLD, &rank);
        MPI_Comm_size(MPI_COMM_WORLD, &size);
    }
    bool all(bool mine) const {
        int value = mine ? 1 : 0;
        MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_INT, MPI_LAND, MPI_COMM_WORLD);
        return value != 0;
    }
};

std::string lock_of(const Options& o, int rank) { return with_extension(o.out, ".rank" + std::to_string(rank) + ".lock"); }

/// The rank's share of the samples in these ranges.
std::vector<SampleRange> share_of(const std::vector<SampleRange>& ranges, int rank, int size) {
    std::uint64_t all = 0, begin = 0;
    for (const SampleRange& range : ranges) all += range.size();
    const std::uint64_t from = all * std::uint64_t(rank) / std::uint64_t(size);
    const std::uint64_t to = all * std::uint64_t(rank + 1) / std::uint64_t(size);
    std::vector<SampleRange> share;
    for (const SampleRange& range : ranges) {
        const std::uint64_t low = std::max(from, begin), high = std::min(to, begin + range.size());
        if (low < high) share.push_back({range.begin + (low - begin), range.begin + (high - begin)});
        begin += range.size();
    }
    return share;
}

std::string part_of(const Options& o, const std::vector<SampleRange>& share) {
    const std::string samples = std::to_string(share.front().begin) + "-" + std::to_string(share.back().end);
    return with_extension(o.out, std::string(".").append(samples).append(".film"));
}

/// What a rank leaves in its lock when it is done.
std::string note_of(const Work& work) {
    char text[128];
    std::snprintf(text, sizeof text, "%" PRIu64 " %" PRIu64 " %" PRIu64 " %" PRIu64 " %" PRIu64 " %u %.9g %.9g\n",
                  work.samples, work.background_samples, work.rays.closest, work.rays.shadow, work.rays.saved, work.threads,
                  work.rendering_s, work.saving_s);
    return text;
}
std::optional<Work> read_note(const std::string& note) {
    Work work;
    if (std::sscanf(note.c_str(), "%" SCNu64 " %" SCNu64 " %" SCNu64 " %" SCNu64 " %" SCNu64 " %u %lg %lg",
                    &work.samples, &work.background_samples, &work.rays.closest, &work.rays.shadow, &work.rays.saved,
                    &work.threads, &work.rendering_s, &work.saving_s) != 8)
        return std::nullopt;
    return work;
}

std::string list(const std::vector<SampleRange>& ranges) {
    std::string text;
    for (const SampleRange& range : ranges) text.append(text.empty() ? "" : ", ").append(describe(range));
    return text;
}

/// The samples of one rank: those that an earlier run left in its file, and the others.
Work render_share(Job& job, FilmState<float>& state, const std::vector<SampleRange>& share) {
    if (share.empty()) return {.threads = job.threads.concurrency()};
    if (std::filesystem::exists(job.options.film)) state = resumed_state(job, job.options.film);
    const std::uint64_t before = state.film.total_samples();
    std::vector<SampleRange> missing;
    for (const SampleRange& range : share)
        for (const SampleRange& rest : state.film.missing(range)) missing.push_back(rest);
    Passes passes(job, state);
    passes.run(missing);
    return {.rays = passes.rays,
            .background_samples = passes.background_samples,
            .rendering_s = passes.rendering_s,
            .saving_s = passes.saving_s,
            .samples = state.film.total_samples() - before,
            .threads = job.threads.concurrency()};
}

/// Waits for every rank in turn and takes what it left. Returns those that died.
std::vector<int> collect(const Options& o, const World& world, const std::vector<std::string>& parts,
                         FilmState<float>& state, Work& work) {
    std::vector<int> dead;
    for (int rank = 1; rank < world.size; ++rank) {
        const std::optional<Work> other = read_note(ProcessLock::wait_for(lock_of(o, rank)));
        if (!other) dead.push_back(rank);
        else {
            work.rays += other->rays;
            work.samples += other->samples;
            work.background_samples += other->background_samples;
            work.threads += other->threads;
            work.saving_s += other->saving_s;
            work.rendering_s = std::max(work.rendering_s, other->rendering_s);
        }
        const std::string& part = parts[std::size_t(rank)];
        if (part.empty() || !std::filesystem::exists(part)) continue;
        FilmState<float> film = read_film<float>(part);
        const std::string differs = difference(film, state);
        require(differs.empty(), [&] { return part + " is of another render: its " + differs; });
        if (state.film.blocks().empty()) state.film = std::move(film.film);
        else state.film.merge(std::move(film.film));
    }
    return dead;
}

void remove_files(const Options& o, const World& world, const std::vector<std::string>& parts) {
    std::error_code ignored;
    for (const std::string& part : parts)
        for (const char* unfinished : {"", ".part"}) std::filesystem::remove(part + unfinished, ignored);
    for (int rank = 1; rank < world.size; ++rank) std::filesystem::remove(lock_of(o, rank), ignored);
}

/// Rank 0 after its share: the image of all. Returns the exit code; `lost` where a rank died.
int finish(Job& job, Options& o, const World& world, const std::vector<std::string>& parts, FilmState<float>& state,
           Work work, const Stopwatch& whole, bool& lost) {
    if (!o.resume.empty()) { // what there was before
        FilmState<float> before = resumed_state(job, o.resume);
        if (!state.film.blocks().empty()) before.film.merge(std::move(state.film));
        state = std::move(before);
    }
    const std::vector<int> dead = collect(o, world, parts, state, work);
    lost = !dead.empty();
    for (const int rank : dead) std::fprintf(stderr, "render_mpi: rank %d died\n", rank);
    require(!state.film.blocks().empty(), "no rank has finished a sample: nothing is saved");
    const std::vector<SampleRange> missing = state.film.missing(o.samples());
    write_results(job, state, work, o.wants_state() || !missing.empty(), whole);
    remove_files(o, world, parts);
    if (missing.empty()) return 0;
    std::fprintf(stderr, "render_mpi: samples %s are missing; the others are saved in %s; to go on, after mpirun:\n  %s\n",
                 list(missing).c_str(), o.film.c_str(), how_to_go_on(o).c_str());
    return lost ? 1 : interrupt::asked() ? 130 : 0;
}

/// One rank from the command line to the end; `lost` where not all of them came so far.
int run_rank(const World& world, int argc, char** argv, bool& lost, std::string& last_file) {
    std::optional<Options> parsed = parse_options(argc, argv, "render_mpi");
    if (!parsed) return 0;
    Options& o = *parsed;
    if (o.error_target > 0 || o.pixel || o.validate)
        throw UsageError("--error-target, --pixel and --validate are for render: they take one process");
    interrupt::listen();
    const Stopwatch whole;
    std::optional<ProcessLock> lock;
    const int locked = run_program("render_mpi", [&] {
        if (world.rank == 0) check_files(o);
        lock.emplace(lock_of(o, world.rank));
        return 0;
    });
    if (!world.all(locked == 0)) return 1; // from here on, a lock that is free is of a rank that ended
    lost = true;

    o.quiet = o.quiet || world.rank != 0;
    Job job(o);
    std::vector<SampleRange> wanted = {o.samples()};
    if (!o.resume.empty()) wanted = resumed_state(job, o.resume).film.missing(o.samples());
    std::vector<std::string> parts;
    for (int rank = 0; rank < world.size; ++rank) {
        const std::vector<SampleRange> share = share_of(wanted, rank, world.size);
        parts.push_back(share.empty() ? "" : part_of(o, share));
    }
    const std::string film = std::exchange(o.film, parts[std::size_t(world.rank)]);
    FilmState<float> state = empty_state(job);
    const Work work = render_share(job, state, share_of(wanted, world.rank, world.size));
    if (world.rank != 0) {
        if (!state.film.blocks().empty()) write_film(o.film, state);
        lock->leave(note_of(work));
        lost = ProcessLock::wait_for(lock_of(o, 0)) != "done";
        return 0;
    }
    o.film = film;
    const int code = finish(job, o, world, parts, state, work, whole, lost);
    lock->leave(lost ? "lost" : "done");
    if (!lost) last_file = lock_of(o, 0);
    return code;
}

} // namespace

int main(int argc, char** argv) {
    MPI_Init(&argc, &argv);
    const World world;
    if (world.rank != 0 && std::freopen("/dev/null", "w", stdout) == nullptr) return 1; // one of them speaks
    bool lost = false;
    std::string last_file; // to be removed when all have read it
    const int code = run_program("render_mpi", [&] {
        try {
            return run_rank(world, argc, argv, lost, last_file);
        } catch (const UsageError&) { // all ranks have the same command line
            if (world.rank == 0) throw;
            return 2;
        }
    });
    if (lost) { // to finalize is to wait for all ranks, also for those that died
        std::fflush(stdout);
        _exit(code);
    }
    MPI_Finalize();
    std::error_code ignored;
    if (!last_file.empty()) std::filesystem::remove(last_file, ignored);
    return code;
}
