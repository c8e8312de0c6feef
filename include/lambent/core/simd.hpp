#pragma once
#include <lambent/core/config.hpp>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#if defined(__SSE2__)
#include <immintrin.h>
#endif

/// Pack<T, N>: N floats or doubles in one register, on the compilers' vector extensions plus the handful of
/// intrinsics that they lack. The only file with intrinsics. Every width works on every machine; what the
/// hardware lacks, the compiler splits.
namespace lambent {
inline namespace LAMBENT_ABI {

/// The number of T that one register of this build holds; 4 where there is none.
template <class T>
inline constexpr int native_width =
#if defined(__AVX512F__)
    int(64 / sizeof(T));
#elif defined(__AVX__)
    int(32 / sizeof(T));
#else
    sizeof(T) == 4 ? 4 : 2;
#endif

namespace detail {
template <class T, int N>
struct VectorOf {
    typedef T Type __attribute__((vector_size(sizeof(T) * N)));
};
} // namespace detail

/// The result of a comparison: lanes of all ones or all zeros.
template <class T, int N>
struct Mask {
    using Lane = std::conditional_t<sizeof(T) == 4, std::int32_t, std::int64_t>;
    using Vector = typename detail::VectorOf<Lane, N>::Type;
    Vector v;

    friend Mask operator&(Mask a, Mask b) { return {a.v & b.v}; }
    friend Mask operator|(Mask a, Mask b) { return {a.v | b.v}; }
    friend Mask operator^(Mask a, Mask b) { return {a.v ^ b.v}; }
    friend Mask operator~(Mask a) { return {~a.v}; }
};

template <class T, int N>
struct Pack {
    static_assert(std::has_single_bit(unsigned(N)));
    using Vector = typename detail::VectorOf<T, N>::Type;
    static constexpr int width = N;
    Vector v;

    Pack() = default;
    Pack(Vector vector) : v(vector) {}
    Pack(T x) : v(x - Vector{}) {} // x - 0 is x, signed zeros included: a broadcast

    static Pack load(const T* from) {
        Pack p;
        std::memcpy(&p.v, from, sizeof(p.v));
        return p;
    }
    void store(T* to) const { std::memcpy(to, &v, sizeof(v)); }

    T operator[](int i) const { return v[i]; }
    void set(int i, T x) { v[i] = x; }

    friend Pack operator+(Pack a, Pack b) { return a.v + b.v; }
    friend Pack operator-(Pack a, Pack b) { return a.v - b.v; }
    friend Pack operator*(Pack a, Pack b) { return a.v * b.v; }
    friend Pack operator/(Pack a, Pack b) { return a.v / b.v; }
    friend Pack operator-(Pack a) { return -a.v; }
    Pack& operator+=(Pack b) { return *this = *this + b; }
    Pack& operator-=(Pack b) { return *this = *this - b; }
    Pack& operator*=(Pack b) { return *this = *this * b; }

    friend Mask<T, N> operator<(Pack a, Pack b) { return {a.v < b.v}; }
    friend Mask<T, N> operator<=(Pack a, Pack b) { return {a.v <= b.v}; }
    friend Mask<T, N> operator>(Pack a, Pack b) { return {a.v > b.v}; }
    friend Mask<T, N> operator>=(Pack a, Pack b) { return {a.v >= b.v}; }
    friend Mask<T, N> operator==(Pack a, Pack b) { return {a.v == b.v}; }
};

/// a where the mask is set, else b.
template <class T, int N>
inline Pack<T, N> select(Mask<T, N> mask, Pack<T, N> a, Pack<T, N> b) {
    return mask.v ? a.v : b.v;
}

/// Lane-wise a < b ? a : b, so b where either is NaN (as the x86 instruction does).
template <class T, int N>
inline Pack<T, N> min(Pack<T, N> a, Pack<T, N> b) {
#if defined(__AVX__)
    if constexpr (std::is_same_v<T, float> && N == 8) return (typename Pack<T, N>::Vector)_mm256_min_ps(a.v, b.v);
    else if constexpr (std::is_same_v<T, double> && N == 4)
        return (typename Pack<T, N>::Vector)_mm256_min_pd(a.v, b.v);
    else
#endif
#if defined(__SSE2__)
        if constexpr (std::is_same_v<T, float> && N == 4)
        return (typename Pack<T, N>::Vector)_mm_min_ps(a.v, b.v);
    else
#endif
        return a.v < b.v ? a.v : b.v;
}

/// Lane-wise a > b ? a : b, so b where either is NaN.
template <class T, int N>
inline Pack<T, N> max(Pack<T, N> a, Pack<T, N> b) {
#if defined(__AVX__)
    if constexpr (std::is_same_v<T, float> && N == 8) return (typename Pack<T, N>::Vector)_mm256_max_ps(a.v, b.v);
    else if constexpr (std::is_same_v<T, double> && N == 4)
        return (typename Pack<T, N>::Vector)_mm256_max_pd(a.v, b.v);
    else
#endif
#if defined(__SSE2__)
        if constexpr (std::is_same_v<T, float> && N == 4)
        return (typename Pack<T, N>::Vector)_mm_max_ps(a.v, b.v);
    else
#endif
        return a.v > b.v ? a.v : b.v;
}

/// a·b + c with one rounding.
template <class T, int N>
inline Pack<T, N> fma(Pack<T, N> a, Pack<T, N> b, Pack<T, N> c) {
    using Vector = typename Pack<T, N>::Vector;
#if defined(__AVX512F__)
    if constexpr (std::is_same_v<T, float> && N == 16) return (Vector)_mm512_fmadd_ps(a.v, b.v, c.v);
    if constexpr (std::is_same_v<T, double> && N == 8) return (Vector)_mm512_fmadd_pd(a.v, b.v, c.v);
#endif
#if defined(__FMA__)
    if constexpr (std::is_same_v<T, float> && N == 8) return (Vector)_mm256_fmadd_ps(a.v, b.v, c.v);
    if constexpr (std::is_same_v<T, double> && N == 4) return (Vector)_mm256_fmadd_pd(a.v, b.v, c.v);
    if constexpr (std::is_same_v<T, float> && N == 4) return (Vector)_mm_fmadd_ps(a.v, b.v, c.v);
    if constexpr (std::is_same_v<T, double> && N == 2) return (Vector)_mm_fmadd_pd(a.v, b.v, c.v);
#endif
    Vector r{};
    for (int i = 0; i < N; ++i) r[i] = std::fma(a.v[i], b.v[i], c.v[i]);
    return r;
}

/// One bit a lane, lane 0 lowest.
template <class T, int N>
inline unsigned bits(Mask<T, N> mask) {
#if defined(__AVX__)
    if constexpr (sizeof(T) == 4 && N == 8) return unsigned(_mm256_movemask_ps((__m256)mask.v));
    if constexpr (sizeof(T) == 8 && N == 4) return unsigned(_mm256_movemask_pd((__m256d)mask.v));
#endif
#if defined(__SSE2__)
    if constexpr (sizeof(T) == 4 && N == 4) return unsigned(_mm_movemask_ps((__m128)mask.v));
    if constexpr (sizeof(T) == 8 && N == 2) return unsigned(_mm_movemask_pd((__m128d)mask.v));
#endif
    unsigned result = 0;
    for (int i = 0; i < N; ++i) result |= unsigned(mask.v[i] != 0) << i;
    return result;
}

template <class T, int N> inline bool any(Mask<T, N> mask) { return bits(mask) != 0; }
template <class T, int N> inline bool all(Mask<T, N> mask) {
    return bits(mask) == (N == 32 ? ~0u : (1u << N) - 1u);
}

/// Sum of the lanes by halves: the same order on every machine.
template <class T, int N>
inline T sum(Pack<T, N> a) {
    if constexpr (N == 1) {
        return a.v[0];
    } else {
        Pack<T, N / 2> low, high;
        std::memcpy(&low.v, &a.v, sizeof(low.v));
        std::memcpy(&high.v, reinterpret_cast<const char*>(&a.v) + sizeof(low.v), sizeof(high.v));
        return sum(Pack<T, N / 2>(low.v + high.v));
    }
}

} // namespace LAMBENT_ABI
} // namespace lambent
