#pragma once
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

/// A wrong command line: the program says so and exits with 2.
struct UsageError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Options by name, each with a line of help. `--x v` and `--x=v` mean the same; values may start with '-'.
class CommandLine {
public:
    CommandLine(std::string usage) : usage_(std::move(usage)) {}

    /// `spelling` is "--name VALUE", or "--name" for a flag.
    void add(const std::string& spelling, const std::string& help, std::function<void(const std::string&)> set) {
        const std::size_t space = spelling.find(' ');
        options_.push_back({spelling.substr(0, space), space == std::string::npos ? "" : spelling.substr(space + 1),
                            help, std::move(set)});
    }

    /// Returns what is not an option. throws UsageError
    std::vector<std::string> parse(int argc, char** argv) const {
        std::vector<std::string> rest;
        for (int i = 1; i < argc; ++i) {
            const std::string argument = argv[i];
            if (argument.rfind("--", 0) != 0) {
                rest.push_back(argument);
                continue;
            }
            const std::size_t equals = argument.find('=');
            const std::string name = argument.substr(0, equals);
            const Option* option = find(name);
            if (option == nullptr) throw UsageError("unknown option " + name);
            const bool flag = option->value.empty();
            if (flag && equals != std::string::npos) throw UsageError(name + " takes no value");
            std::string value;
            if (!flag) {
                if (equals == std::string::npos && i + 1 >= argc)
                    throw UsageError(name + " needs a value: " + option->value);
                value = equals != std::string::npos ? argument.substr(equals + 1) : argv[++i];
            }
            try {
                option->set(value);
            } catch (const UsageError& e) {
                throw UsageError(name + " " + value + ": " + e.what());
            }
        }
        return rest;
    }

    void print_help() const {
        std::printf("usage: %s\n", usage_.c_str());
        for (const Option& o : options_)
            std::printf("  %-34s %s\n", (o.name + (o.value.empty() ? "" : " " + o.value)).c_str(), o.help.c_str());
    }

private:
    struct Option {
        std::string name, value, help;
        std::function<void(const std::string&)> set;
    };
    const Option* find(const std::string& name) const {
        for (const Option& o : options_)
            if (o.name == name) return &o;
        return nullptr;
    }
    std::string usage_;
    std::vector<Option> options_;
};

/// Whole text as a finite number. throws UsageError
inline double to_number(const std::string& text) {
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    if (text.empty() || *end != '\0' || !(std::fabs(value) < 1e300)) throw UsageError("'" + text + "' is not a number");
    return value;
}

inline double to_positive(const std::string& text) {
    const double value = to_number(text);
    if (!(value > 0)) throw UsageError("must be greater than 0");
    return value;
}

/// Whole text as an integer in [low, high]. throws UsageError
inline std::int64_t to_integer(const std::string& text, std::int64_t low, std::int64_t high) {
    char* end = nullptr;
    const long long value = std::strtoll(text.c_str(), &end, 10);
    if (text.empty() || *end != '\0') throw UsageError("'" + text + "' is not a whole number");
    if (value < low || value > high)
        throw UsageError("must lie in [" + std::to_string(low) + ", " + std::to_string(high) + "]");
    return value;
}

/// Exactly `count` numbers, separated by `separator`. throws UsageError
inline std::vector<double> to_numbers(const std::string& text, std::size_t count, char separator = ',') {
    std::vector<double> numbers;
    std::size_t begin = 0;
    for (;;) {
        const std::size_t end = text.find(separator, begin);
        numbers.push_back(to_number(text.substr(begin, end == std::string::npos ? end : end - begin)));
        if (end == std::string::npos) break;
        begin = end + 1;
    }
    if (numbers.size() != count)
        throw UsageError("has " + std::to_string(numbers.size()) + " numbers where " + std::to_string(count) + " belong");
    return numbers;
}

/// The index of `text` among the choices. throws UsageError that lists them
inline std::size_t to_choice(const std::string& text, const std::vector<std::string>& choices) {
    std::string all;
    for (std::size_t i = 0; i < choices.size(); ++i) {
        if (choices[i] == text) return i;
        all += (i > 0 ? "|" : "") + choices[i];
    }
    throw UsageError("must be one of " + all);
}
