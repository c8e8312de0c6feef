#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/numerics.hpp>
#include <charconv>
#include <cstddef>
#include <cstring>
#include <string>
#include <string_view>
#include <system_error>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Lines of an OBJ or MTL file: LF or CRLF, the last one with or without; a backslash at the end joins the
/// next line. Knows the line's number for messages.
class ObjLines {
public:
    ObjLines(std::string_view text, const std::string& path) : text_(text), path_(&path) {
        if (text_.starts_with("\xef\xbb\xbf")) text_.remove_prefix(3);
    }

    /// Steps to the next line; false at the end.
    bool next() {
        if (text_.empty()) return false;
        number_ = next_number_;
        line_ = take();
        if (line_.ends_with('\\')) {
            joined_.clear();
            while (line_.ends_with('\\') && !text_.empty()) {
                joined_.append(line_.substr(0, line_.size() - 1)).push_back(' ');
                line_ = take();
            }
            joined_.append(line_);
            line_ = joined_;
        }
        return true;
    }

    std::string_view line() const { return line_; }

    [[noreturn]] void refuse(const std::string& why) const {
        fail(*path_ + ":" + std::to_string(number_) + ": " + why);
    }
    std::string place() const { return *path_ + ":" + std::to_string(number_); }

private:
    std::string_view take() {
        ++next_number_;
        const void* end = std::memchr(text_.data(), '\n', text_.size());
        const std::size_t size =
            end == nullptr ? text_.size() : std::size_t(static_cast<const char*>(end) - text_.data());
        std::string_view line = text_.substr(0, size);
        text_.remove_prefix(end == nullptr ? size : size + 1);
        if (line.ends_with('\r')) line.remove_suffix(1);
        return line;
    }

    std::string_view text_, line_;
    std::string joined_;
    const std::string* path_;
    std::size_t number_ = 0, next_number_ = 1;
};

/// The words of one line, split at spaces and tabs.
class ObjWords {
public:
    explicit ObjWords(const ObjLines& lines) : lines_(&lines), left_(lines.line()) { skip(); }

    bool done() const { return left_.empty(); }

    std::string_view word() {
        std::size_t n = 0;
        while (n < left_.size() && !space(left_[n])) ++n;
        const std::string_view word = left_.substr(0, n);
        left_.remove_prefix(n);
        skip();
        return word;
    }

    /// What is left, spaces inside kept, none at the ends.
    std::string_view rest() const {
        std::string_view rest = left_;
        while (!rest.empty() && space(rest.back())) rest.remove_suffix(1);
        return rest;
    }

    /// The next word as a finite number.
    /// throws lambent::Error with file and line else
    double number() {
        const std::string_view text = word();
        double value = 0;
        if (!parse_number(text, value)) lines_->refuse("'" + std::string(text) + "' is not a finite number");
        return value;
    }

    /// Whether `text` is a finite number as a whole.
    static bool parse_number(std::string_view text, double& value) {
        if (text.starts_with('+')) text.remove_prefix(1);
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        return error == std::errc() && end == text.data() + text.size() && is_finite(value);
    }

private:
    static bool space(char c) { return c == ' ' || c == '\t'; }
    void skip() {
        while (!left_.empty() && space(left_.front())) left_.remove_prefix(1);
    }

    const ObjLines* lines_;
    std::string_view left_;
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
