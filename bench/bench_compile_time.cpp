// What a header costs to compile, in multiples of <vector>: a program that includes it and does nothing, CPU time of
// the compiler that built this, -std=c++20 -O2 and no flags of a processor, interleaved, medians. Once checked
// (-fsyntax-only), once compiled (-c). Beside it size and compile time of the example program render, as ninja noted them
// when it built that; those are on the wall clock, with other compilers at their side.
#include "../examples/support/command_line.hpp"
#include "output.hpp"
#include "process.hpp"
#include "timing.hpp"
#include <fstream>
#include <map>
#include <span>
#include <sstream>

namespace {

struct Header {
    const char* name;
    double budget; ///< in multiples of <vector>; 0: none
};
constexpr Header headers[] = {{"vector", 0},
                              {"lambent/core/vec.hpp", 0},
                              {"lambent/sampling/sobol.hpp", 0},
                              {"lambent/film/film.hpp", 0},
                              {"lambent/bvh/bvh.hpp", 5},
                              {"lambent/denoise/denoise.hpp", 5},
                              {"lambent/scene/prepared_scene.hpp", 0},
                              {"lambent/render/path.hpp", 0},
                              {"lambent/lambent.hpp", 7.5},
                              {"lambent/io/gltf.hpp", 0}};

struct Mode {
    const char* name;
    std::vector<std::string> words;
};
const std::vector<Mode> modes = {{"-fsyntax-only", {"-fsyntax-only"}}, {"-c", {"-c", "-o", "/dev/null"}}};

std::vector<std::string> compiler() {
    std::vector<std::string> words = {LAMBENT_COMPILER, "-std=c++20", "-O2"};
    for (const std::string& folder : split(LAMBENT_INCLUDE_DIRS, ':'))
        if (!folder.empty()) words.insert(words.end(), {"-I", folder});
    return words;
}

/// CPU seconds of the compiler.
double compile(const TemporaryFolder& folder, const Header& header, const Mode& mode) {
    const std::string source = (folder.path / "one.cpp").string();
    std::ofstream(source) << "#include <" << header.name << ">\nint main() {}\n";
    std::vector<std::string> words = compiler();
    words.insert(words.end(), mode.words.begin(), mode.words.end());
    words.push_back(source);
    return run_process(words).cpu_s;
}

/// Without -c where there is little time.
void measure_headers(int rounds, bool quick, bool json) {
    const TemporaryFolder folder;
    std::map<std::string, std::map<std::string, std::vector<double>>> seconds, ratios; // by mode and header
    const std::span<const Mode> chosen = std::span(modes).first(quick ? 1 : modes.size());
    for (int round = 0; round < rounds; ++round)
        for (const Mode& mode : chosen)
            for (const Header& h : headers) {
                const double took = compile(folder, h, mode);
                seconds[mode.name][h.name].push_back(took);
                ratios[mode.name][h.name].push_back(took / seconds[mode.name]["vector"].back());
            }
    for (const Mode& mode : chosen)
        for (const Header& h : headers) {
            const double ratio = median(ratios[mode.name][h.name]);
            Line line(json);
            line.add("header", h.name).add("mode", mode.name).words();
            line.add("seconds", median(seconds[mode.name][h.name])).add("ratio_to_vector", ratio);
            if (h.budget > 0) line.add("budget", h.budget).add("within", ratio <= h.budget ? "true" : "false");
        }
}

/// Last start and end of each object of a program, in ms, from the log of the ninja that built it.
double built_in_seconds(const std::string& objects) {
    std::ifstream log(LAMBENT_BUILD_DIR "/.ninja_log");
    std::map<std::string, double> took;
    for (std::string line; std::getline(log, line);) {
        std::istringstream words(line);
        double start = 0, end = 0, time = 0;
        std::string output;
        if (words >> start >> end >> time >> output && output.rfind(objects, 0) == 0)
            took[output] = (end - start) / 1000;
    }
    double sum = 0;
    for (const auto& [output, s] : took) sum += s;
    return sum;
}

void measure_program(bool json) {
    const std::string program = "examples/render", file = LAMBENT_BUILD_DIR "/" + program;
    if (!std::filesystem::exists(file)) {
        std::fprintf(stderr, "bench_compile_time: the program render is left out, it is not built\n");
        return;
    }
    Line line(json);
    line.add("program", program).words().add("mib", double(std::filesystem::file_size(file)) / (1 << 20));
    const double seconds = built_in_seconds("examples/CMakeFiles/render.dir/") + built_in_seconds(program);
    if (seconds > 0) line.add("compile_s", seconds);
}

} // namespace

int main(int argc, char** argv) try {
    int rounds = 5;
    bool json = false, quick = false, help = false;
    CommandLine line("bench_compile_time [options]");
    line.add("--rounds N", "of which medians are taken (5)",
             [&](const std::string& v) { rounds = int(to_integer(v, 1, 1000)); });
    line.add("--quick", "one round of -fsyntax-only", [&](const std::string&) { rounds = 1, quick = true; });
    line.add("--json", "one object a line", [&](const std::string&) { json = true; });
    line.add("--help", "this list", [&](const std::string&) { help = true; });
    if (!line.parse(argc, argv).empty()) throw UsageError("takes options only");
    if (help) return line.print_help(), 0;
    measure_headers(rounds, quick, json);
    measure_program(json);
    return 0;
} catch (const UsageError& e) {
    std::fprintf(stderr, "bench_compile_time: %s\n", e.what());
    return 2;
} catch (const std::exception& e) {
    std::fprintf(stderr, "bench_compile_time: %s\n", e.what());
    return 1;
}
