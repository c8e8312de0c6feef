#pragma once
#include <lambent/core/error.hpp>
#include <lambent/io/file.hpp>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// A regular file's bytes, of which those are read that are asked for, in blocks and once: what nobody asks for costs
/// neither time nor memory. Or bytes that lie in memory anyway. Any thread may ask.
class PartialFile {
public:
    /// throws lambent::Error when the file can't be opened
    explicit PartialFile(const std::string& path)
        : path_(path), size_(std::size_t(file_size(path))), file_(std::fopen(path.c_str(), "rb")),
          bytes_(std::make_unique_for_overwrite<char[]>(size_)), read_((size_ + block - 1) / block) {
        require(file_ != nullptr, [&] { return path_ + ": cannot be opened for reading"; });
    }
    /// `bytes` stay the caller's.
    explicit PartialFile(std::string_view bytes) : size_(bytes.size()), memory_(bytes.data()) {}

    std::size_t size() const { return size_; }
    /// Blocks of 64 KiB that were read so far.
    std::size_t blocks_read() const { return std::size_t(std::count(read_.begin(), read_.end(), true)); }

    /// Bytes [begin, begin + length) of it; they stay where they are.
    /// throws lambent::Error when they can't be read, as when the file has become shorter
    std::string_view range(std::size_t begin, std::size_t length) const {
        require(begin <= size_ && length <= size_ - begin, [&] {
            return path_ + ": bytes " + std::to_string(begin) + " + " + std::to_string(length) + " of " +
                   std::to_string(size_);
        });
        if (memory_ != nullptr) return {memory_ + begin, length};
        const std::lock_guard lock(mutex_);
        const std::size_t end = (begin + length + block - 1) / block;
        for (std::size_t first = begin / block; first < end;) {
            std::size_t last = first;
            while (last < end && !read_[last]) ++last;
            if (last > first) read(first, last);
            first = last + 1;
        }
        return {bytes_.get() + begin, length};
    }
    std::string_view all() const { return range(0, size_); }

private:
    static constexpr std::size_t block = std::size_t(1) << 16;

    void read(std::size_t first, std::size_t last) const {
        const std::size_t begin = first * block, length = std::min(size_, last * block) - begin;
        const bool there = std::fseek(file_.get(), long(begin), SEEK_SET) == 0;
        const std::size_t got = there ? std::fread(bytes_.get() + begin, 1, length, file_.get()) : 0;
        require(got == length, [&] {
            return path_ + ": read " + std::to_string(got) + " of " + std::to_string(length) + " bytes from byte " +
                   std::to_string(begin);
        });
        std::fill(read_.begin() + std::ptrdiff_t(first), read_.begin() + std::ptrdiff_t(last), true);
    }

    std::string path_;
    std::size_t size_;
    const char* memory_ = nullptr;
    OpenFile file_;
    std::unique_ptr<char[]> bytes_;
    mutable std::vector<bool> read_; ///< blocks
    mutable std::mutex mutex_;
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
