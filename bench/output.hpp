#pragma once
#include <cstdio>
#include <string>

/// One object of the output: its members in order, the texts among them first.
class Line {
public:
    explicit Line(bool json) : json_(json) {}
    ~Line() {
        std::puts(json_ ? (text_ + "}").c_str() : text_.c_str());
        std::fflush(stdout);
    }
    Line(const Line&) = delete;
    Line& operator=(const Line&) = delete;

    Line& add(const char* key, const std::string& value) { return add(key, "\"" + value + "\"", value, -26); }
    Line& add(const char* key, double value) {
        char number[32];
        std::snprintf(number, sizeof number, json_ ? "%.6g" : "%.4g", value);
        return add(key, number, (in_words_ ? std::string(key) + " " : "") + number, 10);
    }
    /// From here on numbers stand behind their names in the table too.
    Line& words() { return in_words_ = true, *this; }

private:
    Line& add(const char* key, const std::string& value, const std::string& cell, int width) {
        char padded[128];
        std::snprintf(padded, sizeof padded, "%*s", width, cell.c_str());
        if (json_) text_.append(text_.empty() ? "{\"" : ", \"").append(key).append("\": ").append(value);
        else text_.append(text_.empty() ? "" : " ").append(padded);
        return *this;
    }
    bool json_, in_words_ = false;
    std::string text_;
};
