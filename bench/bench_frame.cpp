// Where the time of a frame goes: whole runs of the example program, scene to denoised EXR and PNG, by its own --stats;
// medians. A run is wrong if its stages take longer than the whole, or a sample was not finite.
#include "../examples/support/command_line.hpp"
#include "output.hpp"
#include "process.hpp"
#include "timing.hpp"
#include <cstdio>
#include <fstream>
#include <iterator>
#include <map>

namespace {

struct Options {
    std::vector<std::string> scenes;
    std::string size = "640x360", spp = "16", denoise = "best";
    int rounds = 3;
    bool json = false;
};

const std::vector<std::string> stages = {"load_s", "build_s", "render_s", "denoise_s", "write_s"};

/// A number of the file that --stats wrote; throws lambent::Error where it lacks it.
double stat(const std::string& text, const std::string& key) {
    const std::size_t at = text.find("\"" + key + "\": ");
    lambent::require(at != std::string::npos, [&] { return "render --stats has no " + key; });
    return std::strtod(text.c_str() + at + key.size() + 4, nullptr);
}

/// Prints a scene's row; returns whether all its runs were right.
bool measure(const Options& o, const std::string& scene) {
    const TemporaryFolder folder;
    const auto file = [&](const char* name) { return (folder.path / name).string(); };
    std::map<std::string, std::vector<double>> numbers;
    bool right = true;
    for (int round = 0; round <= o.rounds; ++round) { // the first brings files and libraries into memory
        const Spent spent =
            run_process({LAMBENT_RENDER, scene, "--size", o.size, "--spp", o.spp, "--denoise", o.denoise, "--out",
                         file("out.exr"), "--preview", file("out.png"), "--stats", file("stats.json"), "--quiet"});
        std::ifstream in(file("stats.json"));
        const std::string text{std::istreambuf_iterator<char>(in), {}};
        const double total = stat(text, "total_s");
        double sum = 0;
        for (const std::string& stage : stages) sum += stat(text, stage);
        right = right && sum <= 1.001 * total && total <= spent.wall_s + 0.001 && stat(text, "rejected") == 0 &&
                std::filesystem::file_size(folder.path / "out.exr") > 0;
        if (round == 0) continue;
        for (const std::string& stage : stages) numbers[stage].push_back(stat(text, stage));
        for (const char* key : {"total_s", "mrays_per_s", "peak_mib", "triangles", "threads"})
            numbers[key].push_back(stat(text, key));
        numbers["process_s"].push_back(spent.wall_s);
    }
    Line line(o.json);
    line.add("scene", std::filesystem::path(scene).stem().string()).add("size", o.size).words();
    line.add("spp", std::strtod(o.spp.c_str(), nullptr));
    for (const std::string& stage : stages) line.add(stage.c_str(), median(numbers[stage]));
    for (const char* key : {"total_s", "process_s", "mrays_per_s", "peak_mib", "triangles", "threads"})
        line.add(key, median(numbers[key]));
    line.add("wrong", right ? 0 : 1);
    return right;
}

} // namespace

int main(int argc, char** argv) try {
    Options o;
    bool help = false, quick = false;
    CommandLine line("bench_frame [SCENE...] [options]   what render takes; builtin ones, and scenes of ../shared");
    line.add("--size WxH", "in pixels (640x360)", [&](const std::string& v) { o.size = v; });
    line.add("--spp N", "samples a pixel (16)", [&](const std::string& v) { o.spp = v; });
    line.add("--denoise METHOD", "of render (best)", [&](const std::string& v) { o.denoise = v; });
    line.add("--rounds N", "of which medians are taken (3)",
             [&](const std::string& v) { o.rounds = int(to_integer(v, 1, 1000)); });
    line.add("--quick", "one round of 320x180 with 4 samples", [&](const std::string&) { quick = true; });
    line.add("--json", "one object a line", [&](const std::string&) { o.json = true; });
    line.add("--help", "this list", [&](const std::string&) { help = true; });
    o.scenes = line.parse(argc, argv);
    if (help) return line.print_help(), 0;
    if (quick) o.size = "320x180", o.spp = "4", o.rounds = 1;
    if (!std::filesystem::exists(LAMBENT_RENDER)) {
        std::fprintf(stderr, "bench_frame: all is left out, the program render is not built\n");
        return 0;
    }
    if (o.scenes.empty()) {
        o.scenes = {"builtin:cornell", "builtin:room"};
        for (const char* name :
             {"sponza_crytek/sponza.glb", "damaged_helmet/DamagedHelmet.glb", "hotel_room/hotel_room.glb"}) {
            const std::string file = std::string(LAMBENT_SHARED_DIR "/scenes/") + name;
            if (std::filesystem::exists(file))
                o.scenes.push_back(file);
            else
                std::fprintf(stderr, "bench_frame: %s is absent and left out\n", name);
        }
    }
    bool right = true;
    for (const std::string& scene : o.scenes) right = measure(o, scene) && right;
    return right ? 0 : 1;
} catch (const UsageError& e) {
    std::fprintf(stderr, "bench_frame: %s\n", e.what());
    return 2;
} catch (const std::exception& e) {
    std::fprintf(stderr, "bench_frame: %s\n", e.what());
    return 1;
}
