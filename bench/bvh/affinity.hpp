#pragma once
#include <lambent/core/error.hpp>
#include <optional>
#include <string>
#if defined(__linux__)
#include <sched.h>
#endif

/// Keeps the calling thread, and threads that it starts, on one processor for as long as it lives.
class Pinned {
public:
    /// throws lambent::Error where the system refuses
    explicit Pinned(std::optional<int> processor) {
        if (!processor) return;
#if defined(__linux__)
        cpu_set_t wanted;
        CPU_ZERO(&wanted);
        CPU_SET(std::size_t(*processor), &wanted);
        pinned_ = sched_getaffinity(0, sizeof before_, &before_) == 0 &&
                  sched_setaffinity(0, sizeof wanted, &wanted) == 0;
        lambent::require(pinned_, [&] { return "cannot run on processor " + std::to_string(*processor); });
#else
        lambent::fail("--pin works on Linux only");
#endif
    }
    Pinned(const Pinned&) = delete;
    Pinned& operator=(const Pinned&) = delete;
#if defined(__linux__)
    ~Pinned() {
        if (pinned_) sched_setaffinity(0, sizeof before_, &before_);
    }

private:
    cpu_set_t before_;
    bool pinned_ = false;
#endif
};
