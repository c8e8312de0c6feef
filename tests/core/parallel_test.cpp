#include <atomic>
#include <doctest/doctest.h>
#include <lambent/core/parallel.hpp>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

using namespace lambent;

static_assert(Executor<SerialExecutor> && Executor<ThreadExecutor>);

namespace {

using Range = std::pair<std::size_t, std::size_t>;

template <class E>
std::set<Range> ranges_of(E& executor, std::size_t n, std::size_t grain) {
    std::mutex mutex;
    std::set<Range> ranges;
    std::size_t calls = 0;
    executor.parallel_for(n, grain, [&](std::size_t begin, std::size_t end) {
        const std::lock_guard lock(mutex);
        ranges.insert({begin, end});
        ++calls;
    });
    CHECK(calls == ranges.size());
    return ranges;
}

} // namespace

TEST_CASE("parallel: each item once, in ranges that no number of threads changes") {
    SerialExecutor serial;
    for (const unsigned threads : {1u, 2u, 3u, 7u, 16u}) {
        CAPTURE(threads);
        ThreadExecutor executor(threads);
        CHECK(executor.concurrency() == threads);
        for (const std::size_t n : {0u, 1u, 2u, 63u, 64u, 65u, 1000u})
            for (const std::size_t grain : {0u, 1u, 7u, 64u, 5000u}) {
                const std::set<Range> ranges = ranges_of(executor, n, grain);
                REQUIRE(ranges == ranges_of(serial, n, grain));
                std::size_t next = 0;
                for (const auto& [begin, end] : ranges) {
                    REQUIRE(begin == next);
                    REQUIRE(end > begin);
                    REQUIRE(end - begin <= std::max<std::size_t>(grain, 1));
                    next = end;
                }
                REQUIRE(next == n);
            }
    }
}

TEST_CASE("parallel: a grain near the largest size neither loops nor wraps") {
    SerialExecutor serial;
    ThreadExecutor threads(4);
    for (const std::size_t grain : {std::size_t(-1), std::size_t(-1) / 2 + 1}) {
        CHECK(ranges_of(serial, 10, grain) == std::set<Range>{{0, 10}});
        CHECK(ranges_of(threads, 10, grain) == std::set<Range>{{0, 10}});
    }
    const std::size_t n = std::size_t(-1), half = n / 2 + 1;
    CHECK(ranges_of(serial, n, half) == std::set<Range>{{0, half}, {half, n}});
    CHECK(ranges_of(threads, n, half) == std::set<Range>{{0, half}, {half, n}});
}

TEST_CASE("parallel: the first exception reaches the caller, the pool goes on working") {
    for (const unsigned threads : {1u, 2u, 8u}) {
        ThreadExecutor executor(threads);
        for (int round = 0; round < 200; ++round) {
            std::atomic<int> calls{0};
            bool caught = false;
            try {
                executor.parallel_for(1000, 1, [&](std::size_t begin, std::size_t) {
                    ++calls;
                    if (begin == std::size_t(round * 4))
                        throw std::runtime_error("item " + std::to_string(begin));
                });
            } catch (const std::runtime_error& error) {
                caught = error.what() == "item " + std::to_string(round * 4);
            }
            REQUIRE(caught);
            REQUIRE(calls <= 1000);
        }
        // All of them throw at once.
        CHECK_THROWS_AS(executor.parallel_for(100, 1, [](std::size_t, std::size_t) { throw 5; }), int);
        std::atomic<std::size_t> sum{0};
        executor.parallel_for(100, 3, [&](std::size_t begin, std::size_t end) { sum += end - begin; });
        CHECK(sum == 100);
    }
}

TEST_CASE("parallel: calls inside calls run, on the same pool, on another, and after an exception inside") {
    ThreadExecutor outer(4), other(3);
    std::atomic<std::size_t> sum{0};
    for (int round = 0; round < 50; ++round) {
        sum = 0;
        outer.parallel_for(20, 1, [&](std::size_t, std::size_t) {
            outer.parallel_for(10, 2, [&](std::size_t begin, std::size_t end) {
                outer.parallel_for(3, 1, [&](std::size_t, std::size_t) { sum += end - begin; });
            });
        });
        REQUIRE(sum == 20 * 10 * 3);
        sum = 0;
        outer.parallel_for(6, 1, [&](std::size_t, std::size_t) {
            other.parallel_for(10, 1, [&](std::size_t, std::size_t) { ++sum; });
        });
        REQUIRE(sum == 60);
        CHECK_THROWS_AS(outer.parallel_for(4, 1,
                                           [&](std::size_t, std::size_t) {
                                               outer.parallel_for(4, 1,
                                                                  [](std::size_t, std::size_t) { throw 1; });
                                           }),
                        int);
    }
}

TEST_CASE(
    "parallel: several threads take work when there is some, also after an exception inside a nested call") {
    ThreadExecutor executor(4);
    for (int round = 0; round < 3; ++round) {
        // Each range waits for another thread to come in: with one thread working it would not end by itself.
        std::atomic<int> inside{0};
        std::atomic<bool> met{false};
        executor.parallel_for(4, 1, [&](std::size_t, std::size_t) {
            ++inside;
            for (long spin = 0; spin < 20000000 && !met; ++spin) {
                if (inside >= 2) met = true;
                if (spin % 1000 == 0) std::this_thread::yield();
            }
        });
        CHECK(met);
        try {
            executor.parallel_for(8, 1, [&](std::size_t, std::size_t) {
                executor.parallel_for(8, 1, [](std::size_t, std::size_t) { throw 1; });
            });
        } catch (int) {
        }
    }
}

TEST_CASE("parallel: writes of the workers are seen by the caller; 20 000 short jobs end") {
    for (const unsigned threads : {2u, 5u}) {
        ThreadExecutor executor(threads);
        std::vector<std::size_t> data(64);
        for (std::size_t job = 0; job < 10000; ++job) {
            executor.parallel_for(data.size(), 4, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i) data[i] += i + job;
            });
        }
        std::size_t wrong = 0;
        for (std::size_t i = 0; i < data.size(); ++i) wrong += data[i] != 10000 * i + 9999 * 10000 / 2;
        CHECK(wrong == 0);
    }
    for (int i = 0; i < 200; ++i) ThreadExecutor executor(4); // made and gone without work
}
