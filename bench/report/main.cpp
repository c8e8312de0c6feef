// One self-contained page of what the benchmarks wrote.
//   report FOLDER [--bvh-svg FILE]
// Reads FOLDER/*.json, one object a line, and micro.json; what benchmarks said (*.log) and pictures/*.png, where they are.
// Writes FOLDER/report.html, which loads nothing from anywhere, and to FILE its chart of rays.
#include "bvh_chart.hpp"
#include "data.hpp"
#include <cstdint>
#include <set>

namespace {

Data read(const std::filesystem::path& folder) {
    Data data{folder, {}};
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        if (entry.path().extension() != ".json") continue;
        const std::string name = entry.path().stem().string();
        data.rows[name] = name == "micro" ? read_micro(entry.path()) : read_rows(entry.path());
    }
    return data;
}

std::string style() {
    return ":root{color-scheme:light dark;" + palette("light") + "}@media(prefers-color-scheme:dark){:root{" +
           palette("dark") + "}}" + plot_style() +
           "body{font:15px/1.5 sans-serif;max-width:72em;margin:2em auto;padding:0 1em;background:var(--back);"
           "color:var(--text)}a{color:var(--s0)}h2{margin-top:2.2em;border-top:1px solid var(--line);padding-top:.8em}"
           "svg{font-size:12px;max-width:100%;height:auto}figure{margin:1.2em 0}figcaption,.made{color:var(--soft);"
           "font-size:13px}.wide{overflow-x:auto}table{border-collapse:collapse;font-size:13px;margin:1em 0}"
           "th,td{padding:.15em .7em;text-align:right}th{border-bottom:1px solid var(--soft)}"
           "td:first-child,th:first-child{text-align:left}tr:nth-child(even){background:var(--stripe)}"
           ".bad,.bad td{color:var(--bad);font-weight:bold}.box{border-left:4px solid var(--line);padding:.1em 1em;"
           "margin:1em "
           "0}.box.bad{border-color:var(--bad);font-weight:normal}code{font-size:13px;overflow-wrap:anywhere}"
           ".pair{display:flex;flex-wrap:wrap;gap:1em}.compare{margin:.6em 0;flex:1 1 24em;max-width:34em;--x:50%}"
           ".compare div{position:relative}.compare img{display:block;width:100%}.compare "
           ".after{position:absolute;inset:0;"
           "clip-path:inset(0 0 0 var(--x))}.compare input{width:100%;margin:.3em 0 0}";
}

std::string list(const std::vector<std::string>& lines) {
    std::string out = "<ul>";
    for (const std::string& line : lines) out += "<li>" + escaped(line) + "</li>\n";
    return out + "</ul>\n";
}

/// Its texts and what its check says, for a line that names it.
std::string named(const std::string& bench, const Row& row) {
    std::string out = bench + ":";
    for (const auto& [key, value] : row) {
        char* end = nullptr;
        std::strtod(value.c_str(), &end);
        const bool is_text = *end != '\0';
        const bool tells = key == "spp" || key == "wrong" || key == "equal" || key == "right" || key == "within" ||
                           key == "budget" || key == "ratio_to_vector";
        if (key != "bench" && (is_text || tells)) out += " " + key + " " + shown(value) + ",";
    }
    out.pop_back();
    return out;
}

/// Rays that are answered wrongly, by contender: there are many rows, and a few rays that graze an edge in most.
std::vector<std::string> wrong_rays(const std::string& bench, const std::vector<Row>& rows) {
    std::vector<std::string> lines;
    std::map<std::string, std::array<double, 2>> counts;
    for (const Row& row : with(rows, "rays")) {
        auto& [wrong, all] =
            counts[get(row, "library") + " " + get(row, "variant") + (get(row, "batch") == "true" ? ", batch" : "")];
        wrong += number(row, "wrong");
        all += number(row, "rays");
    }
    for (const auto& [name, count] : counts)
        if (count[0] > 0)
            lines.push_back(bench + ": " + name + " answers " + std::to_string(std::int64_t(count[0])) + " of " +
                            std::to_string(std::int64_t(count[1])) + " rays unlike double precision");
    return lines;
}

/// Everything that went wrong, before anything else.
std::string failures(const Data& data) {
    std::vector<std::string> lines;
    for (const Row& run : data.of("runs"))
        if (get(run, "status") != "0") {
            lines.push_back(get(run, "bench") + " ended with status " + get(run, "status"));
            const std::vector<std::string> said = data.said(get(run, "bench"));
            for (std::size_t i = said.size() - std::min<std::size_t>(said.size(), 3); i < said.size(); ++i)
                lines.back() += "; " + said[i];
        }
    for (const auto& [bench, rows] : data.rows) {
        const bool of_rays = !with(rows, "rays").empty();
        if (of_rays)
            for (const std::string& line : wrong_rays(bench, rows)) lines.push_back(line);
        std::size_t told = 0;
        for (const Row& row : rows)
            if (!of_rays && failed(row) && ++told <= 20) lines.push_back(named(bench, row));
        if (told > 20) lines.push_back(bench + ": and " + std::to_string(told - 20) + " more");
    }
    if (lines.empty()) return "<p class='box'>Every benchmark ended well, and no row failed its check.</p>\n";
    return "<div class='box bad'><h3>Failed checks and missed budgets</h3>" + list(lines) + "</div>\n";
}

/// What was not measured, in the benchmarks' own words and by what is missing here.
std::string left_out(const Data& data) {
    std::vector<std::string> lines;
    std::set<std::string> seen;
    const auto add = [&](const std::string& line) {
        if (seen.insert(line).second) lines.push_back(line);
    };
    for (const Section& s : sections) {
        if (data.of(s.source).empty()) add(std::string(s.source) + " left no rows: no section '" + s.title + "'");
        for (const std::string& line : data.said(s.source))
            if (line.find("left out") != std::string::npos || line.find("no ratios") != std::string::npos) add(line);
    }
    return lines.empty() ? "" : "<div class='box'><h3>Left out</h3>" + list(lines) + "</div>\n";
}

std::string machine(const Data& data) {
    std::string out;
    for (const Row& row : data.of("machine"))
        for (const auto& [key, value] : row)
            out += "<tr><td>" + escaped(key) + "</td><td style='text-align:left'>" + escaped(value) + "</td></tr>\n";
    return out.empty() ? "<p>Machine, flags and date: not told (machine.json is absent).</p>\n"
                       : "<table>" + out + "</table>\n";
}

std::string section(const Data& data, const Section& s) {
    std::string out = "<h2 id='" + std::string(s.id) + "'>" + s.title + "</h2>\n";
    const std::vector<Row>& rows = data.of(s.source);
    if (rows.empty()) return out + "<p class='box bad'>Not measured: " + s.source + ".json has no rows.</p>\n";
    const Row run = data.run(s.source);
    out += "<p class='made'><code>" + escaped(get(run, "command").empty() ? s.source : get(run, "command")) + "</code>";
    if (!run.empty()) out += ", " + get(run, "seconds") + " s, status " + get(run, "status");
    out += ". Rows: <a href='" + std::string(s.source) + ".json'>" + s.source + ".json</a></p>\n" + s.body(data, rows);
    const std::vector<std::string> said = data.said(s.source);
    return said.empty() ? out : out + folded("What it said", list(said));
}

void write_file(const std::filesystem::path& file, const std::string& content) {
    std::ofstream out(file, std::ios::binary);
    out << content;
    if (!out.flush()) throw std::runtime_error(file.string() + ": cannot be written");
    std::printf("%s\n", file.string().c_str());
}

void write_report(const Data& data) {
    std::string page = "<!doctype html>\n<html lang='en'><head><meta charset='utf-8'>"
                       "<meta name='viewport' content='width=device-width'><title>lambent: benchmarks</title><style>" +
                       style() + "</style></head><body>\n<h1>lambent: benchmarks</h1>\n" + machine(data) +
                       failures(data) + left_out(data) + "<p>";
    for (const Section& s : sections) page += "<a href='#" + std::string(s.id) + "'>" + s.title + "</a> &middot; ";
    page += "<a href='#runs'>Runs</a></p>\n";
    for (const Section& s : sections) page += section(data, s);
    page += "<h2 id='runs'>Runs</h2>\n<p>What was run, its wall-clock seconds and exit status.</p>\n" +
            table(data.of("runs")) + "</body></html>\n";
    write_file(data.folder / "report.html", page);
}

} // namespace

int main(int argc, char** argv) try {
    if (argc != 2 && !(argc == 4 && std::string(argv[2]) == "--bvh-svg")) {
        std::fprintf(stderr, "usage: %s FOLDER [--bvh-svg FILE]\n", argv[0]);
        return 2;
    }
    const Data data = read(argv[1]);
    write_report(data);
    if (argc == 2) return 0;
    const std::string chart = as_file(bvh_chart(data.of("bench_bvh")));
    if (chart.empty()) throw std::runtime_error("bench_bvh.json has no ratios to Embree to draw");
    write_file(argv[3], chart);
    return 0;
} catch (const std::exception& e) {
    std::fprintf(stderr, "report: %s\n", e.what());
    return 1;
}
