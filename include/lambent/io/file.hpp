#pragma once
#include <lambent/core/error.hpp>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <system_error>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
};
using OpenFile = std::unique_ptr<std::FILE, CloseFile>;

/// Size in bytes of a regular file, through symbolic links.
/// throws lambent::Error when there is none: folders, pipes, sockets and devices can't be loaded, and are not opened,
///         which might wait for ever
inline std::uint64_t file_size(const std::string& path) {
    require(path.find('\0') == path.npos,
            [&] { return path.substr(0, path.find('\0')) + "…: a file's name cannot hold a zero byte"; });
    std::error_code error;
    const auto status = std::filesystem::status(path, error);
    require(status.type() != std::filesystem::file_type::not_found, [&] { return path + ": no such file"; });
    require(!error, [&] { return path + ": " + error.message(); });
    require(std::filesystem::is_regular_file(status), [&] { return path + ": not a regular file"; });
    const std::uint64_t size = std::filesystem::file_size(path, error);
    require(!error, [&] { return path + ": " + error.message(); });
    return size;
}

/// All bytes of a regular file, to a string or a vector of bytes.
/// throws lambent::Error when it can't be read
template <class Bytes>
void read_file(const std::string& path, Bytes& bytes) {
    const std::size_t size = file_size(path);
    bytes.resize(size);
    const OpenFile file(std::fopen(path.c_str(), "rb"));
    require(file != nullptr, [&] { return path + ": cannot be opened for reading"; });
    const std::size_t got = std::fread(bytes.data(), 1, size, file.get());
    require(got == size, [&] {
        return path + ": read " + std::to_string(got) + " of " + std::to_string(size) + " bytes";
    });
}
inline std::string read_file(const std::string& path) {
    std::string bytes;
    read_file(path, bytes);
    return bytes;
}

/// All bytes of a regular file in memory that nobody cleared first: for files that may be large.
struct FileBytes {
    std::unique_ptr<char[]> bytes;
    std::size_t size = 0;

    /// throws lambent::Error when it can't be read
    explicit FileBytes(const std::string& path) { read_file(path, *this); }
    std::string_view view() const { return {bytes.get(), size}; }
    void resize(std::size_t n) {
        bytes = std::make_unique_for_overwrite<char[]>(n);
        size = n;
    }
    char* data() { return bytes.get(); }
};

/// The folder of `path` with its closing slash; empty for a file of the working folder.
inline std::string folder_of(const std::string& path) {
    const std::size_t slash = path.find_last_of('/');
    return slash == std::string::npos ? std::string() : path.substr(0, slash + 1);
}

/// The extension in lower case, without its dot.
inline std::string extension_of(const std::string& path) {
    std::string extension = std::filesystem::path(path).extension().string();
    if (!extension.empty()) extension.erase(0, 1);
    for (char& c : extension)
        if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
    return extension;
}

/// A file under way: written to a name beside `path` and renamed by commit(), so that `path` is either
/// complete or untouched; without commit() nothing is left behind.
class PendingFile {
public:
    explicit PendingFile(const std::string& path) : path_(path), temporary_(path + ".part") {}
    PendingFile(const PendingFile&) = delete;
    PendingFile& operator=(const PendingFile&) = delete;
    ~PendingFile() {
        std::error_code ignored;
        if (!committed_) std::filesystem::remove(temporary_, ignored);
    }

    const std::string& name() const { return temporary_; }

    /// throws lambent::Error when the file cannot be renamed
    void commit() {
        std::error_code error;
        std::filesystem::rename(temporary_, path_, error);
        require(!error, [&] { return path_ + ": " + error.message(); });
        committed_ = true;
    }

private:
    std::string path_, temporary_;
    bool committed_ = false;
};

/// Writes a file, which appears whole or not at all.
/// throws lambent::Error when it can't be written
inline void write_file(const std::string& path, std::string_view bytes) {
    PendingFile pending(path);
    OpenFile file(std::fopen(pending.name().c_str(), "wb"));
    require(file != nullptr, [&] { return path + ": cannot be opened for writing"; });
    const bool written = std::fwrite(bytes.data(), 1, bytes.size(), file.get()) == bytes.size();
    const bool closed = std::fclose(file.release()) == 0;
    require(written && closed, [&] { return path + ": cannot be written; is the disk full?"; });
    pending.commit();
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
