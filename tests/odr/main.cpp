// Two translation units of one program, one compiled for SSE2 and one for AVX2 and FMA, use the same inline
// functions. Without the inline namespace named after the flags the linker would keep one copy of each, whichever
// it met first, and the SSE2 unit might run AVX code, or the wrong width's. So both orders are linked.
#include "report.hpp"
#include <cstdio>

int main() {
    if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) {
        std::printf("SKIPPED: odr, this machine has no AVX2\n");
        return 0;
    }
    const Report narrow = narrow_report(), wide = wide_report();
    int failures = 0;
    const auto expect = [&](bool holds, const char* what) {
        if (holds) return;
        std::printf("does not hold: %s\n", what);
        ++failures;
    };
    expect(narrow.flags == "sse2" && narrow.width == 4 && !narrow.fma, "the narrow unit has its own view");
    expect(wide.flags == "avx2" && wide.width == 8 && wide.fma, "the wide unit has its own view");
    expect(narrow.functions.size() == wide.functions.size(), "as many functions");
    for (std::size_t i = 0; i < narrow.functions.size(); ++i)
        expect(narrow.functions[i] != wide.functions[i], "each unit runs its own copy of a function");
    expect(narrow.values.size() == wide.values.size(), "as many values");
    for (std::size_t i = 0; i < narrow.values.size(); ++i)
        if (narrow.values[i] != wide.values[i]) {
            std::printf("value %zu: %.9g narrow, %.9g wide\n", i, narrow.values[i], wide.values[i]);
            ++failures;
        }
    return failures == 0 ? 0 : 1;
}
