#pragma once
#include <lambent/core/executor.hpp>
#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <type_traits>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// A pool of std::threads that lives as long as the object; the calling thread works too. Nested calls run
/// serially on the thread that makes them. One caller at a time.
class ThreadExecutor {
public:
    /// `threads` = 0 takes as many as the machine has.
    explicit ThreadExecutor(unsigned threads = 0) {
        if (threads == 0) threads = std::max(1u, std::thread::hardware_concurrency());
        workers_.reserve(threads - 1);
        for (unsigned i = 1; i < threads; ++i) workers_.emplace_back([this] { work(); });
    }
    ~ThreadExecutor() {
        {
            const std::lock_guard lock(mutex_);
            stop_ = true;
        }
        wake_.notify_all();
        for (std::thread& worker : workers_) worker.join();
    }
    ThreadExecutor(const ThreadExecutor&) = delete;
    ThreadExecutor& operator=(const ThreadExecutor&) = delete;

    unsigned concurrency() const { return unsigned(workers_.size()) + 1; }

    template <class F>
    void parallel_for(std::size_t n, std::size_t grain, F&& f) {
        grain = std::max<std::size_t>(grain, 1);
        if (workers_.empty() || inside() || n <= grain) return SerialExecutor{}.parallel_for(n, grain, f);

        Job job{n, grain, &f, [](const void* function, std::size_t begin, std::size_t end) {
                    using Function = std::remove_reference_t<F>;
                    (*static_cast<Function*>(const_cast<void*>(function)))(begin, end);
                }};
        {
            const std::lock_guard lock(mutex_);
            job_ = &job;
            ++generation_;
            busy_ = workers_.size();
        }
        wake_.notify_all();
        run(job);
        {
            std::unique_lock lock(mutex_);
            done_.wait(lock, [this] { return busy_ == 0; });
            job_ = nullptr;
        }
        if (job.error) std::rethrow_exception(job.error);
    }

private:
    struct Job {
        std::size_t n, grain;
        const void* function;
        void (*call)(const void*, std::size_t, std::size_t);
        std::atomic<std::size_t> next{0};
        std::atomic<bool> failed{false};
        std::exception_ptr error{};
    };

    static bool& inside() {
        thread_local bool value = false;
        return value;
    }

    void run(Job& job) {
        inside() = true;
        while (!job.failed.load(std::memory_order_relaxed)) {
            const std::size_t range = job.next.fetch_add(1, std::memory_order_relaxed); // counted, so that no end wraps
            if (range > (job.n - 1) / job.grain) break;
            const std::size_t begin = range * job.grain, end = begin + std::min(job.grain, job.n - begin);
#if defined(__cpp_exceptions)
            try {
                job.call(job.function, begin, end);
            } catch (...) {
                if (!job.failed.exchange(true)) job.error = std::current_exception();
            }
#else
            job.call(job.function, begin, end);
#endif
        }
        inside() = false;
    }

    void work() {
        std::size_t seen = 0;
        for (;;) {
            Job* job = nullptr;
            {
                std::unique_lock lock(mutex_);
                wake_.wait(lock, [&] { return stop_ || generation_ != seen; });
                if (stop_) return;
                seen = generation_;
                job = job_;
            }
            run(*job);
            bool last = false;
            {
                const std::lock_guard lock(mutex_);
                last = --busy_ == 0;
            }
            if (last) done_.notify_one();
        }
    }

    std::vector<std::thread> workers_;
    std::mutex mutex_;
    std::condition_variable wake_, done_;
    Job* job_ = nullptr;
    std::size_t generation_ = 0;
    std::size_t busy_ = 0;
    bool stop_ = false;
};

} // namespace LAMBENT_ABI
} // namespace lambent
