// One self-contained page of what the benchmarks wrote.
//   report FOLDER      reads FOLDER/*.json, one object a line, and micro.json; writes FOLDER/report.html
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace {

/// The members of one flat JSON object, in its order; strings without their quotes.
using Row = std::vector<std::pair<std::string, std::string>>;

std::string get(const Row& row, const std::string& key) {
    for (const auto& [k, v] : row)
        if (k == key) return v;
    return "";
}
double number(const Row& row, const std::string& key) { return std::strtod(get(row, key).c_str(), nullptr); }

/// throws std::runtime_error on what is no flat object
Row parse(const std::string& line) {
    std::size_t i = 0;
    const auto skip = [&] {
        while (i < line.size() && (line[i] == ' ' || line[i] == '\t')) ++i;
    };
    const auto expect = [&](char c) {
        skip();
        if (i >= line.size() || line[i] != c) throw std::runtime_error("not a flat JSON object: " + line);
        ++i;
    };
    const auto text = [&] {
        std::string s;
        expect('"');
        while (i < line.size() && line[i] != '"') {
            if (line[i] == '\\') ++i;
            if (i < line.size()) s += line[i++];
        }
        expect('"');
        return s;
    };
    Row row;
    expect('{');
    skip();
    while (i < line.size() && line[i] != '}') {
        if (!row.empty()) expect(',');
        std::string key = text(), value;
        expect(':');
        skip();
        if (i < line.size() && line[i] == '"')
            value = text();
        else {
            while (i < line.size() && line[i] != ',' && line[i] != '}' && line[i] != ' ') value += line[i++];
            if (value.empty() || value[0] == '{' || value[0] == '[') expect('"');
        }
        row.emplace_back(key, value);
        skip();
    }
    expect('}');
    return row;
}

std::vector<Row> read_rows(const std::filesystem::path& path) {
    std::ifstream in(path);
    std::vector<Row> rows;
    for (std::string line; std::getline(in, line);)
        if (!line.empty()) rows.push_back(parse(line));
    return rows;
}

/// Google Benchmark's file has one member a line: a name, and later its time in ns.
std::vector<Row> read_micro(const std::filesystem::path& path) {
    std::ifstream in(path);
    std::vector<Row> rows;
    std::string name;
    for (std::string line; std::getline(in, line);) {
        const std::size_t colon = line.find("\": ");
        if (colon == std::string::npos) continue;
        std::string value = line.substr(colon + 3);
        while (!value.empty() && (value.back() == ',' || value.back() == '"')) value.pop_back();
        if (line.find("\"name\"") < colon) name = value.substr(1);
        if (line.find("\"cpu_time\"") < colon) rows.push_back({{"function", name}, {"ns", value}});
    }
    return rows;
}

std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text)
        out += c == '<'   ? "&lt;"
               : c == '>' ? "&gt;"
               : c == '&' ? "&amp;"
               : c == '"' ? "&quot;"
                          : std::string(1, c);
    return out;
}

/// Distinct values of a member, in the order in which they appear.
std::vector<std::string> values(const std::vector<Row>& rows, const std::string& key) {
    std::vector<std::string> found;
    for (const Row& row : rows)
        if (const std::string v = get(row, key); std::find(found.begin(), found.end(), v) == found.end())
            found.push_back(v);
    return found;
}

/// Four digits; text as it is.
std::string shown(const std::string& value) {
    char* end = nullptr;
    const double x = std::strtod(value.c_str(), &end);
    if (value.empty() || *end != '\0' || value.find_first_of(".e") == std::string::npos)
        return escaped(value);
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.4g", x);
    return digits;
}

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
            write_table(out, rows);
        }
    }
    out << "</body></html>\n";
    if (!out.flush()) throw std::runtime_error((folder / "report.html").string() + ": cannot be written");
    std::printf("%s\n", (folder / "report.html").string().c_str());
}

} // namespace

int main(int argc, char** argv) try {
    if (argc != 2) {
        std::fprintf(stderr, "usage: %s FOLDER\n", argv[0]);
        return 2;
    }
    write_report(argv[1]);
    return 0;
} catch (const std::exception& e) {
    std::fprintf(stderr, "report: %s\n", e.what());
    return 1;
}
