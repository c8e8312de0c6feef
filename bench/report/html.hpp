#pragma once
#include "rows.hpp"
#include <sstream>

// Pieces of the page: text, numbers, tables, pictures. All of them in the page itself, which loads nothing.

inline std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text)
        out += c == '<'    ? "&lt;"
               : c == '>'  ? "&gt;"
               : c == '&'  ? "&amp;"
               : c == '"'  ? "&quot;"
               : c == '\'' ? "&#39;"
                           : std::string(1, c);
    return out;
}

/// Four digits.
inline std::string shown(double x) {
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.4g", x);
    return digits;
}

/// Of a number that is not whole four digits; text as it is.
inline std::string shown(const std::string& value) {
    char* end = nullptr;
    const double x = std::strtod(value.c_str(), &end);
    if (value.empty() || *end != '\0' || value.find_first_of(".e") == std::string::npos) return escaped(value);
    return shown(x);
}

/// All rows, a column for each member that any of them has; rows whose check failed are marked.
inline std::string table(const std::vector<Row>& rows) {
    std::vector<std::string> columns;
    for (const Row& row : rows)
        for (const auto& [key, value] : row)
            if (key != "bench" && std::find(columns.begin(), columns.end(), key) == columns.end())
                columns.push_back(key);
    std::ostringstream out;
    out << "<div class='wide'><table><tr>";
    for (const std::string& c : columns) out << "<th>" << escaped(c) << "</th>";
    out << "</tr>\n";
    for (const Row& row : rows) {
        out << (failed(row) ? "<tr class='bad'>" : "<tr>");
        for (const std::string& c : columns) out << "<td>" << shown(get(row, c)) << "</td>";
        out << "</tr>\n";
    }
    out << "</table></div>\n";
    return out.str();
}

inline std::string folded(const std::string& summary, const std::string& content) {
    return "<details><summary>" + summary + "</summary>\n" + content + "</details>\n";
}

inline std::string base64(const std::string& bytes) {
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        unsigned bits = 0;
        for (std::size_t k = 0; k < 3; ++k)
            bits = bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
        for (std::size_t k = 0; k < 4; ++k) out += i + k <= bytes.size() ? digits[bits >> (18 - 6 * k) & 63] : '=';
    }
    return out;
}

/// A PNG as part of the page; throws std::runtime_error where it cannot be read.
inline std::string image(const std::filesystem::path& file, const std::string& description, const char* style = "") {
    std::ifstream in(file, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    if (bytes.empty()) throw std::runtime_error(file.string() + ": cannot be read");
    return "<img class='" + std::string(style) + "' alt='" + escaped(description) + "' src='data:image/png;base64," +
           base64(bytes) + "'>";
}

/// Two pictures of one view, one over the other; the slider moves where one ends and the other starts.
inline std::string slider(const std::filesystem::path& before, const std::filesystem::path& after,
                          const std::string& caption) {
    return "<figure class='compare'><div>" + image(before, caption + ": before") +
           image(after, caption + ": after", "after") +
           "</div><input type='range' value='50' aria-label='how much is shown before denoising'"
           " oninput=\"this.parentNode.style.setProperty('--x',this.value+'%')\"><figcaption>" +
           escaped(caption) + "</figcaption></figure>\n";
}
