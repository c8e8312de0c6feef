#pragma once
#include <lambent/core/error.hpp>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <string>
#include <sys/file.h>
#include <unistd.h>

/// A file that is locked for as long as a process lives, however it ends, on whatever machine; and in which the process
/// says how it ended, if it came to that.
class ProcessLock {
public:
    /// throws lambent::Error when another process has it, or the folder takes no locks
    explicit ProcessLock(std::string path) : path_(std::move(path)), file_(open(path_.c_str(), O_RDWR | O_CREAT, 0644)) {
        lambent::require(file_ >= 0, [&] { return path_ + ": " + std::strerror(errno); });
        if (flock(file_, LOCK_EX | LOCK_NB) == 0 && ftruncate(file_, 0) == 0) return;
        const bool taken = errno == EWOULDBLOCK;
        const std::string why = taken ? "another process renders to this name" : std::string("cannot be locked: ") + std::strerror(errno);
        close(file_);
        lambent::fail(path_ + ": " + why);
    }
    ~ProcessLock() { release(); }
    ProcessLock(const ProcessLock&) = delete;
    ProcessLock& operator=(const ProcessLock&) = delete;

    /// Lets go, leaving these words. throws lambent::Error when they cannot be written
    void leave(const std::string& words) {
        const bool written = write(file_, words.data(), words.size()) == ssize_t(words.size()) && fsync(file_) == 0;
        release();
        lambent::require(written, [&] { return path_ + ": cannot be written; is the disk full?"; });
    }

    /// Waits until the process that has the lock lets go or ends; returns its words, empty where it left none.
    static std::string wait_for(const std::string& path) {
        const int file = open(path.c_str(), O_RDONLY);
        if (file < 0) return {};
        while (flock(file, LOCK_SH) != 0 && errno == EINTR) {}
        char words[256];
        const ssize_t size = read(file, words, sizeof words);
        close(file);
        return size > 0 ? std::string(words, std::size_t(size)) : std::string();
    }

private:
    void release() {
        if (file_ >= 0) close(file_);
        file_ = -1;
    }

    std::string path_;
    int file_;
};
