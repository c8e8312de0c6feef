#pragma once
#include <lambent/core/error.hpp>
#include <lambent/io/decimal.hpp>
#include <lambent/io/file.hpp>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// A file's words as a message may show them: 40 bytes at most, in quotes, all but printable ASCII as \x...
inline std::string quoted(std::string_view text) {
    static constexpr char hex[] = "0123456789abcdef";
    std::string shown = "'";
    for (const char c : text.substr(0, 40))
        if (c >= ' ' && c <= '~') {
            shown += c;
        } else {
            shown.append("\\x").append(1, hex[(c >> 4) & 15]).append(1, hex[c & 15]);
        }
    return shown + (text.size() > 40 ? "...'" : "'");
}

/// Lines of an OBJ or MTL file: LF or CRLF, the last one with or without; a backslash at the end of a line that is no
/// comment joins the next one. Knows the line's number for messages.
/// memory  a file is read in pieces of `piece` bytes; the longest line is held as a whole
class ObjLines {
public:
    static constexpr std::size_t piece = std::size_t(1) << 18;

    /// Of a text that stays where it is; `name` is for messages.
    ObjLines(std::string_view text, const std::string& name) : text_(text), name_(&name), size_(text.size()) {}

    /// Of a regular file.
    /// throws lambent::Error when it can't be read
    explicit ObjLines(const std::string& path) : name_(&path), size_(file_size(path)) {
        file_.reset(std::fopen(path.c_str(), "rb"));
        require(file_ != nullptr, [&] { return path + ": cannot be opened for reading"; });
        buffer_.resize(piece);
    }

    /// Steps to the next line; false at the end.
    bool next() {
        if (number_ == 0) begin();
        if (!fill()) return false;
        number_ = next_number_;
        line_ = take();
        if (!line_.ends_with('\\') || line_.starts_with('#')) return true;
        joined_.clear();
        for (;;) {
            joined_.append(line_.substr(0, line_.size() - 1)).push_back(' ');
            line_ = fill() ? take() : std::string_view();
            if (!line_.ends_with('\\')) break;
        }
        joined_.append(line_);
        line_ = joined_;
        return true;
    }

    std::string_view line() const { return line_; }
    std::size_t number() const { return number_; }
    std::size_t size() const { return size_; } ///< in bytes, of the whole text
    const std::string& name() const { return *name_; }

    [[noreturn]] void refuse(const std::string& why) const {
        fail(*name_ + ":" + std::to_string(number_) + ": " + why);
    }

private:
    void begin() {
        if (!fill()) return;
        if (text_.starts_with("\xef\xbb\xbf")) text_.remove_prefix(3);
        require(!text_.starts_with("\xff\xfe") && !text_.starts_with("\xfe\xff"),
                [&] { return *name_ + ": text in UTF-16; only ASCII and UTF-8 are read"; });
    }

    /// Whether there is any text left, read from the file where need be.
    bool fill() { return !text_.empty() || refill(); }

    /// Reads on behind what is left; false at the file's end.
    bool refill() {
        if (file_ == nullptr) return false;
        const std::size_t left = text_.size();
        if (left > 0) std::memmove(buffer_.data(), text_.data(), left);
        if (left > buffer_.size() / 2) buffer_.resize(2 * buffer_.size());
        const std::size_t got = std::fread(buffer_.data() + left, 1, buffer_.size() - left, file_.get());
        text_ = {buffer_.data(), left + got};
        if (got > 0) return true;
        require(std::ferror(file_.get()) == 0, [&] { return *name_ + ": cannot be read"; });
        file_.reset();
        return false;
    }

    std::string_view take() {
        ++next_number_;
        std::size_t size = text_.find('\n');
        for (std::size_t searched = text_.size(); size == text_.npos && refill(); searched = text_.size())
            size = text_.find('\n', searched);
        std::string_view line = text_.substr(0, size);
        text_.remove_prefix(size == text_.npos ? text_.size() : size + 1);
        if (line.ends_with('\r')) line.remove_suffix(1);
        return line;
    }

    std::string_view text_, line_; ///< text_: what is read and not yet taken
    std::string joined_;
    std::vector<char> buffer_;
    OpenFile file_;
    const std::string* name_;
    std::size_t size_, number_ = 0, next_number_ = 1;
};

/// The words of one line, split at spaces and tabs.
class ObjWords {
public:
    explicit ObjWords(const ObjLines& lines) : ObjWords(lines, lines.line()) {}

    /// Of a part of the line that `lines` is at.
    ObjWords(const ObjLines& lines, std::string_view part) : lines_(&lines), left_(part) { skip(); }

    bool done() const { return left_.empty(); }

    /// Whether only a comment is left, or nothing; for statements without names, in which # may stand.
    bool no_more() const { return left_.empty() || left_.front() == '#'; }

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

    /// The next word as a finite number that a T can hold.
    /// throws lambent::Error with file and line else
    template <class T = double>
    double number() {
        double value = 0;
        const char* const end = left_.data() + left_.size();
        const char* const stop = parse_short_decimal(left_.data(), end, value); // less than 1e38: any T holds it
        if (stop != nullptr && (stop == end || space(*stop))) {
            move_to(stop);
            skip();
            return value;
        }
        const std::string_view text = word();
        if (!parse_number(text, value))
            lines_->refuse(text.empty() ? std::string("a number is missing at the end")
                                        : quoted(text) + " is not a finite number");
        if (value > double(std::numeric_limits<T>::max()) || value < double(std::numeric_limits<T>::lowest()))
            lines_->refuse(quoted(text) + " is not a finite number in " + std::to_string(8 * sizeof(T)) + " bits");
        return value;
    }

    /// The next word as a finite number.
    /// returns false, and moves on nevertheless, when it is none
    bool try_number(double& value) { return parse_number(word(), value); }

    bool starts_with(std::string_view text) const { return left_.starts_with(text); }

    /// Takes a whole number of up to 18 digits that stands next; for words of several parts, which end_word() ends.
    /// returns false, and moves nowhere, when there is none
    bool take_integer(std::int64_t& value) {
        const char* p = left_.data();
        const char* const end = p + left_.size();
        const bool negative = p != end && *p == '-';
        if (p != end && (*p == '-' || *p == '+')) ++p;
        const char* const first = p;
        std::int64_t size = 0;
        for (; p != end && unsigned(*p - '0') < 10 && p - first < 18; ++p) size = 10 * size + (*p - '0');
        if (p == first || (p != end && unsigned(*p - '0') < 10)) return false;
        value = negative ? -size : size;
        move_to(p);
        return true;
    }

    /// Takes `c` if it stands next.
    bool take(char c) {
        if (left_.empty() || left_.front() != c) return false;
        left_.remove_prefix(1);
        return true;
    }

    bool at_word_end() const { return left_.empty() || space(left_.front()); }

    /// Moves to the next word from a word's end.
    void end_word() { skip(); }

private:
    static bool space(char c) { return c == ' ' || c == '\t'; }
    void move_to(const char* p) { left_.remove_prefix(std::size_t(p - left_.data())); }
    void skip() {
        while (!left_.empty() && space(left_.front())) left_.remove_prefix(1);
    }

    const ObjLines* lines_;
    std::string_view left_;
};

/// Something that a file does wrong, counted so that a million times make one note.
struct Counted {
    std::size_t count = 0;
    std::size_t line = 0; ///< of the first one
    std::string first{};  ///< what it was, if that tells something

    void add(const ObjLines& lines, std::string_view what = {}) {
        if (count++ > 0) return;
        line = lines.number();
        if (!what.empty()) first = quoted(what);
    }

    /// Adds "file: 12 materials are odd, the first in line 7: 'x'", unless there was none.
    void note(const std::string& file, const char* what, std::vector<std::string>& notes) const {
        if (count == 0) return;
        std::string text = file + ": " + std::to_string(count) + " " + what;
        if (line > 0) text += (count > 1 ? ", the first in line " : ", in line ") + std::to_string(line);
        notes.push_back(first.empty() ? text : text + ": " + first);
    }
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
