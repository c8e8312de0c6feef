#pragma once
#include <string>
#include <vector>

/// What one translation unit of this test sees of the library.
struct Report {
    std::string flags;                 ///< the inline namespace's name
    int width;                         ///< native_width<float>
    bool fma;                          ///< LAMBENT_HAS_FMA
    std::vector<const void*> functions; ///< addresses of some of the library's inline functions
    std::vector<double> values;        ///< results that do not depend on the flags
};

Report narrow_report(); ///< compiled for SSE2
Report wide_report();   ///< compiled for AVX2 and FMA
