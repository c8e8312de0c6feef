#pragma once
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

/// The members of one flat JSON object, in its order; strings without their quotes.
using Row = std::vector<std::pair<std::string, std::string>>;

inline std::string get(const Row& row, const std::string& key) {
    for (const auto& [k, v] : row)
        if (k == key) return v;
    return "";
}
inline double number(const Row& row, const std::string& key) { return std::strtod(get(row, key).c_str(), nullptr); }

/// throws std::runtime_error on what is no flat object
inline Row parse(const std::string& line) {
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

inline std::vector<Row> read_rows(const std::filesystem::path& path) {
    std::ifstream in(path);
    std::vector<Row> rows;
    for (std::string line; std::getline(in, line);)
        if (!line.empty()) rows.push_back(parse(line));
    return rows;
}

/// Google Benchmark's file has one member a line: a name, perhaps that it found an error, and later its time in ns.
inline std::vector<Row> read_micro(const std::filesystem::path& path) {
    std::ifstream in(path);
    std::vector<Row> rows;
    std::string name, wrong;
    for (std::string line; std::getline(in, line);) {
        const std::size_t colon = line.find("\": ");
        if (colon == std::string::npos) continue;
        std::string value = line.substr(colon + 3);
        while (!value.empty() && (value.back() == ',' || value.back() == '"')) value.pop_back();
        if (line.find("\"name\"") < colon) name = value.substr(1), wrong = "false";
        if (line.find("\"error_occurred\"") < colon) wrong = value;
        if (line.find("\"cpu_time\"") < colon) rows.push_back({{"function", name}, {"ns", value}, {"wrong", wrong}});
    }
    return rows;
}

/// Distinct values of a member, in the order in which they appear.
inline std::vector<std::string> values(const std::vector<Row>& rows, const std::string& key) {
    std::vector<std::string> found;
    for (const Row& row : rows)
        if (const std::string v = get(row, key); std::find(found.begin(), found.end(), v) == found.end())
            found.push_back(v);
    return found;
}

/// Those whose member has the value.
inline std::vector<Row> where(const std::vector<Row>& rows, const std::string& key, const std::string& value) {
    std::vector<Row> found;
    std::copy_if(rows.begin(), rows.end(), std::back_inserter(found),
                 [&](const Row& row) { return get(row, key) == value; });
    return found;
}

/// Those that have the member.
inline std::vector<Row> with(const std::vector<Row>& rows, const std::string& key) {
    std::vector<Row> found;
    std::copy_if(rows.begin(), rows.end(), std::back_inserter(found),
                 [&](const Row& row) { return !get(row, key).empty(); });
    return found;
}

/// Whether the benchmark's check of its own answer failed or a budget was missed, in the words that benchmarks have for it.
inline bool failed(const Row& row) {
    const std::string wrong = get(row, "wrong");
    return wrong == "true" || std::strtod(wrong.c_str(), nullptr) > 0 || get(row, "equal") == "0" ||
           get(row, "right") == "false" || get(row, "within") == "false";
}
