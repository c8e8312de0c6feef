#pragma once
#include <lambent/core/config.hpp>
#include <algorithm>
#include <concepts>
#include <cstddef>

namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {
struct AnyRangeFunction {
    void operator()(std::size_t, std::size_t) const {}
};
} // namespace detail

/// What runs our loops. `parallel_for(n, grain, f)` calls f(begin, end) for consecutive ranges of at most
/// `grain` items that cover [0, n) once, in any order and on any thread, and returns when all are done.
/// The ranges depend on n and grain alone, never on the number of threads, so a result that is made range by
/// range has the same bits everywhere. The first exception is rethrown to the caller. Bring your own pool
/// by any type that fits.
template <class E>
concept Executor = requires(E& executor, std::size_t n, detail::AnyRangeFunction f) {
    executor.parallel_for(n, n, f);
    { executor.concurrency() } -> std::convertible_to<unsigned>;
};

/// Runs everything on the calling thread.
class SerialExecutor {
public:
    unsigned concurrency() const { return 1; }

    template <class F>
    void parallel_for(std::size_t n, std::size_t grain, F&& f) {
        grain = std::max<std::size_t>(grain, 1);
        for (std::size_t begin = 0; begin < n;) {
            const std::size_t end = begin + std::min(grain, n - begin);
            f(begin, end);
            begin = end;
        }
    }
};

} // namespace LAMBENT_ABI
} // namespace lambent
