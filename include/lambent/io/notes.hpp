#pragma once
#include <lambent/core/config.hpp>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// What a loader has to say of one file, each kind of thing once with its count and its first place, however often a
/// file repeats it.
class Notes {
public:
    explicit Notes(std::string path) : path_(std::move(path)) {}

    /// `what` follows the number, as in "3 faces of fewer than three corners were skipped"; `where` is a JSON pointer, a
    /// line's number or empty.
    void add(const std::string& what, const std::string& where = {}, std::size_t count = 1) {
        if (count == 0) return;
        for (Note& note : notes_)
            if (note.what == what) {
                note.count += count;
                return;
            }
        notes_.push_back({what, where, count});
    }

    /// Appends a sentence for each kind to `notes`.
    void store(std::vector<std::string>& notes) const {
        for (const Note& note : notes_)
            notes.push_back(path_ + ": " + std::to_string(note.count) + " " + note.what +
                            (note.where.empty()   ? std::string()
                             : note.count > 1 ? " (the first: " + note.where + ")"
                                                  : " (" + note.where + ")"));
    }

private:
    struct Note {
        std::string what, where;
        std::size_t count;
    };
    std::string path_;
    std::vector<Note> notes_; ///< few kinds: a search from the front is quick
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
