#pragma once
#include <lambent/core/error.hpp>
#include <lambent/io/file.hpp>
#include <lambent/io/load_options.hpp>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>

/// Which files a scene file may name: those in its own folder and below, or in LoadOptions::root.
namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// The folder out of which no name in scene file `path` may lead.
inline std::string root_of(const std::string& path, const LoadOptions& options) {
    if (!options.root.empty()) return options.root;
    const std::string folder = folder_of(path);
    return folder.empty() ? "." : folder;
}

/// Whether `file` lies in folder `root` or below, links followed.
inline bool is_inside(const std::string& root, const std::string& file) {
    std::error_code error;
    const std::filesystem::path top = std::filesystem::weakly_canonical(root, error);
    // Absolute first: of a relative name of which nothing exists, it would give just that.
    const std::filesystem::path whole = error ? top : std::filesystem::absolute(file, error);
    const std::filesystem::path real = error ? top : std::filesystem::weakly_canonical(whole, error);
    return !error && std::mismatch(top.begin(), top.end(), real.begin(), real.end()).first == top.end();
}

/// throws lambent::Error, beginning with `where`, when it does not
inline void check_inside(const std::string& root, const std::string& file, const std::string& where) {
    require(is_inside(root, file), [&] { return where + ": " + file + " is outside of the folder " + root +
                                                  "; a wider LoadOptions::root (--scene-root) allows it"; });
}

/// A URI's text with its %xx escapes replaced.
inline std::string percent_decoded(std::string_view uri) {
    const auto digit = [](char c) {
        if (c >= '0' && c <= '9') return c - '0';
        if (c >= 'a' && c <= 'f') return c - 'a' + 10;
        return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
    };
    std::string out;
    for (std::size_t i = 0; i < uri.size(); ++i) {
        const bool escape = uri[i] == '%' && i + 2 < uri.size() && digit(uri[i + 1]) >= 0 && digit(uri[i + 2]) >= 0;
        out += escape ? char(digit(uri[i + 1]) * 16 + digit(uri[i + 2])) : uri[i];
        if (escape) i += 2;
    }
    return out;
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
