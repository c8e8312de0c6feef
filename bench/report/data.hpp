#pragma once
#include "plot.hpp"
#include <map>

/// What lies in the folder: rows of each benchmark by its name, what it said (NAME.log), and how it ended (runs.json).
struct Data {
    std::filesystem::path folder;
    std::map<std::string, std::vector<Row>> rows;

    const std::vector<Row>& of(const std::string& name) const {
        static const std::vector<Row> none;
        const auto found = rows.find(name);
        return found == rows.end() ? none : found->second;
    }
    Row run(const std::string& name) const {
        const std::vector<Row> runs = where(of("runs"), "bench", name);
        return runs.empty() ? Row{} : runs.back();
    }
    std::vector<std::string> said(const std::string& name) const {
        std::ifstream in(folder / (name + ".log"));
        std::vector<std::string> lines;
        for (std::string line; std::getline(in, line);)
            if (!line.empty()) lines.push_back(line);
        return lines;
    }
};

/// A chart, what it shows and the command that made it; nothing where there is no chart.
inline std::string figure(const Data& data, const std::string& source, const std::string& chart,
                          const std::string& caption) {
    if (chart.empty()) return "";
    const std::string command = get(data.run(source), "command");
    return "<figure>" + chart + "<figcaption>" + escaped(caption) + " Made by <code>" +
           escaped(command.empty() ? source : command) + "</code>.</figcaption></figure>\n";
}

/// A part of the page. `body` is what it shows of the rows of `source`, which are not empty.
struct Section {
    const char *id, *title, *source;
    std::string (*body)(const Data&, const std::vector<Row>&);
};

std::string error_time_section(const Data&, const std::vector<Row>&);
std::string materials_section(const Data&, const std::vector<Row>&);
std::string frame_section(const Data&, const std::vector<Row>&);
std::string memory_section(const Data&, const std::vector<Row>&);
std::string skip_section(const Data&, const std::vector<Row>&);
std::string instructions_section(const Data&, const std::vector<Row>&);
std::string rays_section(const Data&, const std::vector<Row>&);
std::string denoise_section(const Data&, const std::vector<Row>&);
std::string filter_section(const Data&, const std::vector<Row>&);
std::string experiments_section(const Data&, const std::vector<Row>&);
std::string load_section(const Data&, const std::vector<Row>&);
std::string compile_time_section(const Data&, const std::vector<Row>&);
std::string micro_section(const Data&, const std::vector<Row>&);

/// In the order of the page.
inline const Section sections[] = {
    {"error", "Error against run time", "bench_error_time", error_time_section},
    {"materials", "Materials beside Cycles", "bench_materials", materials_section},
    {"rays", "Rays a second against Embree", "bench_bvh", rays_section},
    {"denoising", "Denoising, before and after", "bench_denoise", denoise_section},
    {"filters", "Filters against the naive program and OpenCV", "bench_filter", filter_section},
    {"skipping", "What skipping saves", "bench_skip", skip_section},
    {"instructions", "What skipping saves, in instructions", "bench_instructions", instructions_section},
    {"frame", "Where a frame's time goes", "bench_frame", frame_section},
    {"memory", "Peak memory", "bench_frame", memory_section},
    {"loading", "Loading scenes", "bench_load", load_section},
    {"compiling", "What a header costs to compile", "bench_compile_time", compile_time_section},
    {"experiments", "The seed document's experiments", "bench_experiments", experiments_section},
    {"small", "Small functions", "micro", micro_section},
};
