#pragma once
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
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

/// Google Benchmark's file has one member a line: a name, and later its time in ns.
inline std::vector<Row> read_micro(const std::filesystem::path& path) {
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

inline std::string escaped(const std::string& text) {
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
inline std::vector<std::string> values(const std::vector<Row>& rows, const std::string& key) {
    std::vector<std::string> found;
    for (const Row& row : rows)
        if (const std::string v = get(row, key); std::find(found.begin(), found.end(), v) == found.end())
            found.push_back(v);
    return found;
}

/// Four digits; text as it is.
inline std::string shown(const std::string& value) {
    char* end = nullptr;
    const double x = std::strtod(value.c_str(), &end);
    if (value.empty() || *end != '\0' || value.find_first_of(".e") == std::string::npos)
        return escaped(value);
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.4g", x);
    return digits;
}
