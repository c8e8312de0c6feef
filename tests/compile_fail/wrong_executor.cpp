// names: Executor
#include <lambent/core/parallel.hpp>

struct Mine {
    template <class F>
    void parallel_for(std::size_t n, std::size_t, F&& f) {
        f(0, n);
    }
#ifdef RIGHT
    unsigned concurrency() const { return 1; }
#endif
};

void work(lambent::Executor auto& executor) { executor.parallel_for(1, 1, [](std::size_t, std::size_t) {}); }

void use(Mine& mine) { work(mine); }
