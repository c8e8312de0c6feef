#pragma once
/// The library's version and the inline namespace that all of it lives in.
///
/// The same header compiled with other `-m` flags gives other machine code under the same name, and the
/// linker keeps whichever copy it meets first. So everything of ours lives in an inline namespace named
/// after the flags that change code: two translation units with different flags then hold different
/// functions, and handing one of our types from one to the other is a link error, not a crash.

#define LAMBENT_VERSION_MAJOR 0
#define LAMBENT_VERSION_MINOR 1
#define LAMBENT_VERSION_PATCH 0
#define LAMBENT_VERSION "0.1.0"

#if defined(__FMA__) || defined(__aarch64__)
#define LAMBENT_HAS_FMA 1 ///< std::fma is one instruction
#else
#define LAMBENT_HAS_FMA 0
#endif

#if defined(__AVX512F__) && defined(__AVX512VL__) && defined(__AVX512DQ__) && defined(__AVX512BW__)
#define LAMBENT_ISA avx512
#elif defined(__AVX2__) && defined(__FMA__)
#define LAMBENT_ISA avx2
#elif defined(__AVX__) && defined(__FMA__)
#define LAMBENT_ISA avx_fma
#elif defined(__AVX__)
#define LAMBENT_ISA avx
#elif defined(__SSE4_1__)
#define LAMBENT_ISA sse4
#elif defined(__SSE2__)
#define LAMBENT_ISA sse2
#elif defined(__ARM_NEON)
#define LAMBENT_ISA neon
#else
#define LAMBENT_ISA scalar
#endif

#if defined(__FAST_MATH__)
#define LAMBENT_MATH _fast
#else
#define LAMBENT_MATH
#endif

#define LAMBENT_CONCAT_(a, b) a##b
#define LAMBENT_CONCAT(a, b) LAMBENT_CONCAT_(a, b)
#define LAMBENT_ABI LAMBENT_CONCAT(LAMBENT_ISA, LAMBENT_MATH)
