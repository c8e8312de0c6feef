#pragma once
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <lambent/core/vec.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// A wrong command line: the program says so and exits with 2.
struct UsageError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// How many letters must be added, taken away or replaced to make the one of the other.
inline std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        std::size_t diagonal = std::exchange(row[0], i);
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t replaced = diagonal + (a[i - 1] != b[j - 1] ? 1 : 0);
            diagonal = row[j];
            row[j] = std::min({row[j] + 1, row[j - 1] + 1, replaced});
        }
    }
    return row[b.size()];
}

/// "; did you mean 'NAME'?" with the name that is nearest to `text`; empty where none is near.
inline std::string did_you_mean(const std::string& text, const std::vector<std::string>& names) {
    const std::string* nearest = nullptr;
    std::size_t least = 1 + std::max<std::size_t>(2, text.size() / 2); // farther is another word
    for (const std::string& name : names)
        if (const std::size_t distance = edit_distance(text, name); distance < least) {
            least = distance;
            nearest = &name;
        }
    return nearest != nullptr ? "; did you mean '" + *nearest + "'?" : "";
}

/// Options by name, each with a line of help. `--x v` and `--x=v` mean the same; values may start with '-'.
class CommandLine {
public:
    explicit CommandLine(std::string usage) : usage_(std::move(usage)) {}

    /// `spelling` is "--name VALUE", or "--name" for a flag; `set` gets the value and may throw UsageError.
    void add(const std::string& spelling, const std::string& help, std::function<void(const std::string&)> set) {
        const std::size_t space = spelling.find(' ');
        options_.push_back({spelling.substr(0, space), space == std::string::npos ? "" : spelling.substr(space + 1),
                            help, std::move(set)});
    }

    /// A line of the help's examples: what it does, and the arguments.
    void add_example(std::string what, std::string command) {
        examples_.emplace_back(std::move(what), std::move(command));
    }

    /// Returns what is not an option. throws UsageError
    std::vector<std::string> parse(int argc, char** argv) const {
        std::vector<std::string> rest;
        for (int i = 1; i < argc; ++i) {
            const std::string argument = argv[i];
            if (argument.size() < 2 || argument[0] != '-') {
                rest.push_back(argument);
                continue;
            }
            const std::size_t equals = argument.find('=');
            const Option& option = find(argument.substr(0, equals));
            const bool flag = option.value.empty();
            if (flag && equals != std::string::npos) throw UsageError(option.name + " takes no value");
            std::string value;
            if (equals != std::string::npos) {
                value = argument.substr(equals + 1);
            } else if (!flag) {
                if (i + 1 >= argc || is_option(argv[i + 1])) throw UsageError(option.name + " needs a value: " + option.value);
                value = argv[++i];
            }
            apply(option, value);
        }
        return rest;
    }

    /// The same for one option. throws UsageError
    void set(const std::string& name, const std::string& value) const { apply(find(name), value); }

    void print_help() const {
        std::printf("usage: %s\n", usage_.c_str());
        for (const Option& o : options_)
            std::printf("  %-36s %s\n", (o.name + (o.value.empty() ? "" : " " + o.value)).c_str(), o.help.c_str());
        if (!examples_.empty()) std::printf("examples:\n");
        for (const auto& [what, command] : examples_) std::printf("  %s\n      %s\n", what.c_str(), command.c_str());
        std::printf("exit code: 0 done, 1 scene or file error, 2 wrong command line, 130 interrupted\n");
    }

private:
    struct Option {
        std::string name, value, help;
        std::function<void(const std::string&)> set;
    };

    static void apply(const Option& option, const std::string& value) {
        try {
            option.set(value);
        } catch (const UsageError& e) {
            throw UsageError(option.name + (value.empty() ? "" : " " + value) + ": " + e.what());
        }
    }

    bool is_option(const std::string& name) const {
        return std::any_of(options_.begin(), options_.end(), [&](const Option& o) { return o.name == name; });
    }

    const Option& find(const std::string& name) const {
        std::vector<std::string> names;
        for (const Option& o : options_) {
            if (o.name == name) return o;
            names.push_back(o.name);
        }
        throw UsageError("unknown option '" + name + "'" + did_you_mean(name, names));
    }

    std::string usage_;
    std::vector<Option> options_;
    std::vector<std::pair<std::string, std::string>> examples_;
};

/// Whole text as a finite number. throws UsageError
inline double to_number(const std::string& text) {
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    if (text.empty() || std::isspace(static_cast<unsigned char>(text[0])) || *end != '\0' || !(std::fabs(value) < 1e300))
        throw UsageError("'" + text + "' is not a number");
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
    if (text.empty() || std::isspace(static_cast<unsigned char>(text[0])) || *end != '\0')
        throw UsageError("'" + text + "' is not a whole number");
    if (value < low || value > high)
        throw UsageError("must lie in [" + std::to_string(low) + ", " + std::to_string(high) + "]");
    return value;
}

/// The parts of `text` between separators; an empty text has one empty part.
inline std::vector<std::string> split(const std::string& text, char separator) {
    std::vector<std::string> parts;
    std::size_t begin = 0;
    for (;;) {
        const std::size_t end = text.find(separator, begin);
        parts.push_back(text.substr(begin, end == std::string::npos ? end : end - begin));
        if (end == std::string::npos) return parts;
        begin = end + 1;
    }
}

/// Exactly `count` parts between separators. throws UsageError
inline std::vector<std::string> split_exactly(const std::string& text, char separator, std::size_t count) {
    std::vector<std::string> parts = split(text, separator);
    if (parts.size() != count)
        throw UsageError("has " + std::to_string(parts.size()) + " parts where " + std::to_string(count) + " belong");
    return parts;
}

/// Exactly `count` numbers with commas between them. throws UsageError
inline std::vector<double> to_numbers(const std::string& text, std::size_t count) {
    std::vector<double> numbers;
    for (const std::string& part : split_exactly(text, ',', count)) numbers.push_back(to_number(part));
    return numbers;
}

/// Three of them, as x,y,z. throws UsageError
inline lambent::Vec3d to_vector(const std::string& text) {
    const std::vector<double> n = to_numbers(text, 3);
    return {n[0], n[1], n[2]};
}

/// The index of `text` among the choices. throws UsageError that lists them and names the nearest
inline std::size_t to_choice(const std::string& text, const std::vector<std::string>& choices) {
    std::string all;
    for (std::size_t i = 0; i < choices.size(); ++i) {
        if (choices[i] == text) return i;
        all += (i > 0 ? "|" : "") + choices[i];
    }
    throw UsageError("must be one of " + all + did_you_mean(text, choices));
}
