// One self-contained page of what the benchmarks wrote.
//   report FOLDER [--bvh-svg FILE]
// Reads FOLDER/*.json, one object a line, and micro.json; writes FOLDER/report.html, and to FILE its chart of rays.
#include "bvh_chart.hpp"
#include "report_rows.hpp"
#include <cmath>
#include <iterator>
#include <sstream>

namespace {

void write_table(std::ostream& out, const std::vector<Row>& rows) {
    std::vector<std::string> columns;
    for (const Row& row : rows)
        for (const auto& [key, value] : row)
            if (std::find(columns.begin(), columns.end(), key) == columns.end()) columns.push_back(key);
    out << "<table><tr>";
    for (const std::string& c : columns) out << "<th>" << escaped(c) << "</th>";
    out << "</tr>\n";
    for (const Row& row : rows) {
        out << "<tr>";
        for (const std::string& c : columns) out << "<td>" << shown(get(row, c)) << "</td>";
        out << "</tr>\n";
    }
    out << "</table>\n";
}

const char* const colors[] = {"#1b6ca8", "#c8553d", "#4a8f3c", "#8e5ea2",
                              "#d99a2b", "#2a9d8f", "#7a7a7a", "#b23a6b"};

/// Error over seconds, both logarithmic; a line for each method.
void write_chart(std::ostream& out, const std::string& scene, const std::vector<Row>& rows) {
    constexpr double width = 640, height = 400, left = 70, right = 170, top = 30, bottom = 50;
    double low[2] = {1e300, 1e300}, high[2] = {0, 0};
    const char* const axes[2] = {"seconds", "rel_mse"};
    const auto drawn = [&](const Row& row) { return number(row, axes[0]) > 0 && number(row, axes[1]) > 0; };
    for (const Row& row : rows)
        for (int a = 0; a < 2; ++a)
            if (drawn(row)) {
                low[a] = std::min(low[a], number(row, axes[a]));
                high[a] = std::max(high[a], number(row, axes[a]));
            }
    if (!(high[0] > 0)) return;
    for (int a = 0; a < 2; ++a) {
        low[a] = std::floor(std::log10(low[a]));
        high[a] = std::max(low[a] + 1, std::ceil(std::log10(high[a])));
    }
    const auto x_of = [&](double decade) {
        return left + (width - left - right) * (decade - low[0]) / (high[0] - low[0]);
    };
    const auto y_of = [&](double decade) {
        return height - bottom - (height - top - bottom) * (decade - low[1]) / (high[1] - low[1]);
    };

    out << "<svg viewBox='0 0 " << width << ' ' << height << "' width='" << width << "' role='img'><text x='"
        << left << "' y='18' class='title'>" << escaped(scene) << "</text>\n<g class='grid'>";
    for (double d = low[0]; d <= high[0]; ++d)
        out << "<line x1='" << x_of(d) << "' x2='" << x_of(d) << "' y1='" << top << "' y2='"
            << height - bottom << "'/><text x='" << x_of(d) << "' y='" << height - bottom + 18
            << "' text-anchor='middle'>" << std::pow(10, d) << "</text>";
    for (double d = low[1]; d <= high[1]; ++d)
        out << "<line y1='" << y_of(d) << "' y2='" << y_of(d) << "' x1='" << left << "' x2='" << width - right
            << "'/><text x='" << left - 6 << "' y='" << y_of(d) + 4 << "' text-anchor='end'>"
            << std::pow(10, d) << "</text>";
    out << "<text x='" << (left + width - right) / 2 << "' y='" << height - 10
        << "' text-anchor='middle'>CPU seconds</text>"
        << "<text transform='translate(16 " << height / 2
        << ") rotate(-90)' text-anchor='middle'>relative MSE</text></g>\n";

    const std::vector<std::string> methods = values(rows, "method");
    for (std::size_t m = 0; m < methods.size(); ++m) {
        const char* const color = colors[m % std::size(colors)];
        std::ostringstream line, dots;
        for (const Row& row : rows) {
            if (get(row, "method") != methods[m] || !drawn(row)) continue;
            const double x = x_of(std::log10(number(row, axes[0]))),
                         y = y_of(std::log10(number(row, axes[1])));
            line << x << ',' << y << ' ';
            dots << "<circle cx='" << x << "' cy='" << y << "' r='3'><title>" << escaped(methods[m]) << ", "
                 << get(row, "spp") << " spp: " << shown(get(row, "seconds")) << " s, "
                 << shown(get(row, "rel_mse")) << "</title></circle>";
        }
        const double y = top + 14 + 18 * double(m);
        out << "<g stroke='" << color << "' fill='" << color << "'><polyline fill='none' points='"
            << line.str() << "'/>" << dots.str() << "<line x1='" << width - right + 12 << "' x2='"
            << width - right + 32 << "' y1='" << y << "' y2='" << y << "'/><text stroke='none' x='"
            << width - right + 38 << "' y='" << y + 4 << "'>" << escaped(methods[m]) << "</text></g>\n";
    }
    out << "</svg>\n";
}

std::string processor() {
    std::ifstream in("/proc/cpuinfo");
    for (std::string line; std::getline(in, line);)
        if (line.rfind("model name", 0) == 0) return line.substr(line.find(": ") + 2);
    return "unknown processor";
}

void write_report(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        if (entry.path().extension() == ".json") files.push_back(entry.path());
    std::sort(files.begin(), files.end());

    std::ofstream out(folder / "report.html");
    out << "<!doctype html>\n<html lang='en'><head><meta charset='utf-8'><title>lambent: "
           "benchmarks</title><style>\n"
           "body{font:15px/1.5 sans-serif;max-width:70em;margin:2em auto;padding:0 1em;color:#222}\n"
           "table{border-collapse:collapse;font-size:13px;margin:1em 0}th,td{padding:.15em "
           ".7em;text-align:right}\n"
           "th{border-bottom:1px solid "
           "#999}tr:nth-child(even){background:#f4f4f4}svg{font-size:12px;margin:.5em}\n"
           ".title{font-weight:bold;font-size:14px}.grid line{stroke:#ddd}polyline{stroke-width:1.6}\n"
           "</style></head><body>\n<h1>lambent: benchmarks</h1>\n<p>"
        << escaped(processor()) << "; compiled by " << escaped(__VERSION__) << ".</p>\n";
    for (const std::filesystem::path& file : files) {
        const std::string name = file.stem().string();
        const std::vector<Row> rows = name == "micro" ? read_micro(file) : read_rows(file);
        if (rows.empty()) continue;
        out << "<h2>" << escaped(name) << "</h2>\n";
        if (name == "bench_error_time") {
            out << "<p>Relative mean squared error against converged images; pixels that see an emitter are "
                   "left out. "
                   "The lower and the further left, the better.</p>\n";
            for (const std::string& scene : values(rows, "scene")) {
                std::vector<Row> of_scene;
                for (const Row& row : rows)
                    if (get(row, "scene") == scene) of_scene.push_back(row);
                write_chart(out, scene, of_scene);
            }
            out << "<details><summary>All rows</summary>\n";
            write_table(out, rows);
            out << "</details>\n";
        } else {
            if (name == "bench_bvh") out << bvh_chart(rows);
            write_table(out, rows);
        }
    }
    out << "</body></html>\n";
    if (!out.flush()) throw std::runtime_error((folder / "report.html").string() + ": cannot be written");
    std::printf("%s\n", (folder / "report.html").string().c_str());
}

void write_bvh_svg(const std::filesystem::path& folder, const std::string& file) {
    const std::string chart = bvh_chart(read_rows(folder / "bench_bvh.json"), ChartUse::file);
    if (chart.empty()) throw std::runtime_error("bench_bvh.json has no ratios to Embree to draw");
    std::ofstream out(file);
    out << chart;
    if (!out.flush()) throw std::runtime_error(file + ": cannot be written");
    std::printf("%s\n", file.c_str());
}

} // namespace

int main(int argc, char** argv) try {
    if (argc != 2 && !(argc == 4 && std::string(argv[2]) == "--bvh-svg")) {
        std::fprintf(stderr, "usage: %s FOLDER [--bvh-svg FILE]\n", argv[0]);
        return 2;
    }
    write_report(argv[1]);
    if (argc == 4) write_bvh_svg(argv[1], argv[3]);
    return 0;
} catch (const std::exception& e) {
    std::fprintf(stderr, "report: %s\n", e.what());
    return 1;
}
