#pragma once
#include <lambent/core/config.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/simd_mask.hpp>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

/// Pack<T, N>: N floats or doubles in one register, on the compilers' vector extensions plus the handful of
/// intrinsics that they lack. Here, in simd_mask.hpp and in simd_order.hpp are the only ones. Every width works on
/// every machine; what the hardware lacks, the compiler splits.
// Compilers warn that wide vectors are passed otherwise by code with other flags; LAMBENT_ABI keeps such code apart.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace lambent {
inline namespace LAMBENT_ABI {

template <class T, int N> struct Pack;
namespace detail {
enum class Comparison { less, less_equal, equal };
template <Comparison comparison, class T, int N>
Mask<T, N> compare(Pack<T, N> a, Pack<T, N> b);
} // namespace detail

/// N values of T side by side. Operators work lane by lane; comparisons give a Mask.
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

    friend Mask<T, N> operator<(Pack a, Pack b) { return detail::compare<detail::Comparison::less, T, N>(a, b); }
    friend Mask<T, N> operator<=(Pack a, Pack b) { return detail::compare<detail::Comparison::less_equal, T, N>(a, b); }
    friend Mask<T, N> operator>(Pack a, Pack b) { return detail::compare<detail::Comparison::less, T, N>(b, a); }
    friend Mask<T, N> operator>=(Pack a, Pack b) { return detail::compare<detail::Comparison::less_equal, T, N>(b, a); }
    friend Mask<T, N> operator==(Pack a, Pack b) { return detail::compare<detail::Comparison::equal, T, N>(a, b); }
};

/// The first and the second half of the lanes.
template <class T, int N>
inline Pack<T, N / 2> low_half(Pack<T, N> a) {
    Pack<T, N / 2> r;
    std::memcpy(&r.v, &a.v, sizeof(r.v));
    return r;
}
/// The second half of the lanes.
template <class T, int N>
inline Pack<T, N / 2> high_half(Pack<T, N> a) {
    Pack<T, N / 2> r;
    std::memcpy(&r.v, reinterpret_cast<const char*>(&a.v) + sizeof(r.v), sizeof(r.v));
    return r;
}
/// Both one behind the other.
template <class T, int N>
inline Pack<T, 2 * N> join(Pack<T, N> low, Pack<T, N> high) {
    return [&]<int... i>(std::integer_sequence<int, i...>) -> Pack<T, 2 * N> { // by memcpy it would go through memory
        return __builtin_shufflevector(low.v, high.v, i...);
    }(std::make_integer_sequence<int, 2 * N>{});
}

/// The lanes' values in another type, rounded to nearest.
template <class To, class T, int N>
inline Pack<To, N> convert(Pack<T, N> a) {
    return __builtin_convertvector(a.v, typename Pack<To, N>::Vector);
}

namespace detail {
template <Comparison comparison, class T, int N>
[[gnu::always_inline]] inline Mask<T, N> compare(Pack<T, N> a, Pack<T, N> b) {
#if defined(__AVX512F__)
    constexpr int how = comparison == Comparison::less         ? _CMP_LT_OS
                        : comparison == Comparison::less_equal ? _CMP_LE_OS
                                                               : _CMP_EQ_OQ;
    if constexpr (is_pack<float, 16, T, N>) return {_mm512_cmp_ps_mask(__m512(a.v), __m512(b.v), how)};
    if constexpr (is_pack<double, 8, T, N>) return {_mm512_cmp_pd_mask(__m512d(a.v), __m512d(b.v), how)};
#endif
    if constexpr (Mask<T, N>::in_halves) {
        return {{compare<comparison>(low_half(a), low_half(b)), compare<comparison>(high_half(a), high_half(b))}};
    } else if constexpr (!Mask<T, N>::one_bit_a_lane) {
        if constexpr (comparison == Comparison::less) return {a.v < b.v};
        if constexpr (comparison == Comparison::less_equal) return {a.v <= b.v};
        if constexpr (comparison == Comparison::equal) return {a.v == b.v};
    }
}
} // namespace detail

/// a where the mask is set, else b.
template <class T, int N>
[[gnu::always_inline]] inline Pack<T, N> select(Mask<T, N> mask, Pack<T, N> a, Pack<T, N> b) {
#if defined(__AVX512F__)
    using Vector [[maybe_unused]] = typename Pack<T, N>::Vector;
    if constexpr (detail::is_pack<float, 16, T, N>)
        return Vector(_mm512_mask_blend_ps(mask.v, __m512(b.v), __m512(a.v)));
    if constexpr (detail::is_pack<double, 8, T, N>)
        return Vector(_mm512_mask_blend_pd(__mmask8(mask.v), __m512d(b.v), __m512d(a.v)));
#endif
    if constexpr (Mask<T, N>::in_halves) {
        return join(select(mask.v.low, low_half(a), low_half(b)), select(mask.v.high, high_half(a), high_half(b)));
    } else if constexpr (!Mask<T, N>::one_bit_a_lane) {
        return mask.v ? a.v : b.v;
    }
}

// AVX-512's plain min, max and sqrt start from a register that gcc 12 warns has not been set; with a full mask they are
// the same instructions.

/// Lane-wise a < b ? a : b, so b where either is NaN (as the x86 instruction does).
template <class T, int N>
[[gnu::always_inline]] inline Pack<T, N> min(Pack<T, N> a, Pack<T, N> b) {
    using Vector [[maybe_unused]] = typename Pack<T, N>::Vector;
#if defined(__AVX512F__)
    if constexpr (detail::is_pack<float, 16, T, N>)
        return Vector(_mm512_maskz_min_ps(0xffff, __m512(a.v), __m512(b.v)));
    if constexpr (detail::is_pack<double, 8, T, N>)
        return Vector(_mm512_maskz_min_pd(0xff, __m512d(a.v), __m512d(b.v)));
#endif
#if defined(__AVX__)
    if constexpr (detail::is_pack<float, 8, T, N>) return Vector(_mm256_min_ps(__m256(a.v), __m256(b.v)));
    if constexpr (detail::is_pack<double, 4, T, N>) return Vector(_mm256_min_pd(__m256d(a.v), __m256d(b.v)));
#endif
#if defined(__SSE2__)
    if constexpr (detail::is_pack<float, 4, T, N>) return Vector(_mm_min_ps(__m128(a.v), __m128(b.v)));
    if constexpr (detail::is_pack<double, 2, T, N>) return Vector(_mm_min_pd(__m128d(a.v), __m128d(b.v)));
#endif
    if constexpr (detail::splits<T, N>) {
        return join(min(low_half(a), low_half(b)), min(high_half(a), high_half(b)));
    } else {
        return a.v < b.v ? a.v : b.v;
    }
}

/// Lane-wise a > b ? a : b, so b where either is NaN.
template <class T, int N>
[[gnu::always_inline]] inline Pack<T, N> max(Pack<T, N> a, Pack<T, N> b) {
    using Vector [[maybe_unused]] = typename Pack<T, N>::Vector;
#if defined(__AVX512F__)
    if constexpr (detail::is_pack<float, 16, T, N>)
        return Vector(_mm512_maskz_max_ps(0xffff, __m512(a.v), __m512(b.v)));
    if constexpr (detail::is_pack<double, 8, T, N>)
        return Vector(_mm512_maskz_max_pd(0xff, __m512d(a.v), __m512d(b.v)));
#endif
#if defined(__AVX__)
    if constexpr (detail::is_pack<float, 8, T, N>) return Vector(_mm256_max_ps(__m256(a.v), __m256(b.v)));
    if constexpr (detail::is_pack<double, 4, T, N>) return Vector(_mm256_max_pd(__m256d(a.v), __m256d(b.v)));
#endif
#if defined(__SSE2__)
    if constexpr (detail::is_pack<float, 4, T, N>) return Vector(_mm_max_ps(__m128(a.v), __m128(b.v)));
    if constexpr (detail::is_pack<double, 2, T, N>) return Vector(_mm_max_pd(__m128d(a.v), __m128d(b.v)));
#endif
    if constexpr (detail::splits<T, N>) {
        return join(max(low_half(a), low_half(b)), max(high_half(a), high_half(b)));
    } else {
        return a.v > b.v ? a.v : b.v;
    }
}

/// Lane i is the lanes[i]-th of a.
template <class T>
[[gnu::always_inline]] inline Pack<T, 4> permute(Pack<T, 4> a, const int (&lanes)[4]) {
    using Vector = typename Pack<T, 4>::Vector;
#if defined(__AVX__)
    if constexpr (sizeof(T) == 4) {
        __m128i from;
        std::memcpy(&from, lanes, sizeof from);
        return Vector(_mm_permutevar_ps(__m128(a.v), from));
    }
#endif
    T x[4];
    a.store(x);
    return Vector{x[lanes[0]], x[lanes[1]], x[lanes[2]], x[lanes[3]]};
}

/// Lane-wise magnitude, by the sign bit.
template <class T, int N>
[[gnu::always_inline]] inline Pack<T, N> abs(Pack<T, N> a) {
    using Ints = typename Mask<T, N>::Vector;
    constexpr typename Mask<T, N>::Lane rest = std::numeric_limits<typename Mask<T, N>::Lane>::max();
    return typename Pack<T, N>::Vector(Ints(a.v) & rest);
}

/// Lane-wise square root, correctly rounded.
template <class T, int N>
[[gnu::always_inline]] inline Pack<T, N> sqrt(Pack<T, N> a) {
    using Vector [[maybe_unused]] = typename Pack<T, N>::Vector;
#if defined(__AVX512F__)
    if constexpr (detail::is_pack<float, 16, T, N>) return Vector(_mm512_maskz_sqrt_ps(0xffff, __m512(a.v)));
    if constexpr (detail::is_pack<double, 8, T, N>) return Vector(_mm512_maskz_sqrt_pd(0xff, __m512d(a.v)));
#endif
#if defined(__AVX__)
    if constexpr (detail::is_pack<float, 8, T, N>) return Vector(_mm256_sqrt_ps(__m256(a.v)));
    if constexpr (detail::is_pack<double, 4, T, N>) return Vector(_mm256_sqrt_pd(__m256d(a.v)));
#endif
#if defined(__SSE2__)
    if constexpr (detail::is_pack<float, 4, T, N>) return Vector(_mm_sqrt_ps(__m128(a.v)));
    if constexpr (detail::is_pack<double, 2, T, N>) return Vector(_mm_sqrt_pd(__m128d(a.v)));
#elif defined(__aarch64__)
    if constexpr (detail::is_pack<float, 4, T, N>) return Vector(vsqrtq_f32(float32x4_t(a.v)));
    if constexpr (detail::is_pack<double, 2, T, N>) return Vector(vsqrtq_f64(float64x2_t(a.v)));
#endif
    if constexpr (detail::splits<T, N>) {
        return join(sqrt(low_half(a)), sqrt(high_half(a)));
    } else {
        for (int i = 0; i < N; ++i) a.v[i] = std::sqrt(a.v[i]);
        return a;
    }
}

/// Whether lanes are neither infinite nor NaN, by their bits: holds under -ffast-math too.
template <class T, int N>
[[gnu::always_inline]] inline Mask<T, N> is_finite(Pack<T, N> a) {
    using Ints = typename Mask<T, N>::Vector;
    constexpr auto exponent = std::bit_cast<typename Mask<T, N>::Lane>(std::numeric_limits<T>::infinity());
#if defined(__AVX512F__)
    const Ints bits = Ints(a.v) & exponent, all_set = exponent - Ints{};
    if constexpr (detail::is_pack<float, 16, T, N>)
        return {_mm512_cmp_epi32_mask(__m512i(bits), __m512i(all_set), _MM_CMPINT_NE)};
    if constexpr (detail::is_pack<double, 8, T, N>)
        return {_mm512_cmp_epi64_mask(__m512i(bits), __m512i(all_set), _MM_CMPINT_NE)};
#endif
    if constexpr (Mask<T, N>::in_halves) {
        return {{is_finite(low_half(a)), is_finite(high_half(a))}};
    } else if constexpr (!Mask<T, N>::one_bit_a_lane) {
        return {(Ints(a.v) & exponent) != exponent};
    }
}

/// Which lanes are NaN, by their bits.
template <class T, int N>
[[gnu::always_inline]] inline Mask<T, N> is_nan(Pack<T, N> a) {
    if constexpr (Mask<T, N>::in_halves) {
        return {{is_nan(low_half(a)), is_nan(high_half(a))}};
    } else if constexpr (Mask<T, N>::one_bit_a_lane) {
        return ~(is_finite(a) | (abs(a) == Pack<T, N>(std::numeric_limits<T>::infinity())));
    } else {
        constexpr auto infinity = std::bit_cast<typename Mask<T, N>::Lane>(std::numeric_limits<T>::infinity());
        return {typename Mask<T, N>::Vector(abs(a).v) > infinity};
    }
}

/// Lane-wise |magnitude| with the sign of the other, zeros' signs included.
template <class T, int N>
[[gnu::always_inline]] inline Pack<T, N> copysign(Pack<T, N> magnitude, Pack<T, N> sign) {
    using Ints = typename Mask<T, N>::Vector;
    constexpr typename Mask<T, N>::Lane rest = std::numeric_limits<typename Mask<T, N>::Lane>::max();
    return typename Pack<T, N>::Vector((Ints(magnitude.v) & rest) | (Ints(sign.v) & ~rest));
}

/// a·b + c with one rounding. Exact everywhere, but a function call a lane where the machine has no such
/// instruction: see multiply_add.
template <class T, int N>
[[gnu::always_inline]] inline Pack<T, N> fma(Pack<T, N> a, Pack<T, N> b, Pack<T, N> c) {
    using Vector [[maybe_unused]] = typename Pack<T, N>::Vector;
#if defined(__AVX512F__)
    if constexpr (detail::is_pack<float, 16, T, N>)
        return Vector(_mm512_fmadd_ps(__m512(a.v), __m512(b.v), __m512(c.v)));
    if constexpr (detail::is_pack<double, 8, T, N>)
        return Vector(_mm512_fmadd_pd(__m512d(a.v), __m512d(b.v), __m512d(c.v)));
#endif
#if defined(__FMA__)
    if constexpr (detail::is_pack<float, 8, T, N>)
        return Vector(_mm256_fmadd_ps(__m256(a.v), __m256(b.v), __m256(c.v)));
    if constexpr (detail::is_pack<double, 4, T, N>)
        return Vector(_mm256_fmadd_pd(__m256d(a.v), __m256d(b.v), __m256d(c.v)));
    if constexpr (detail::is_pack<float, 4, T, N>)
        return Vector(_mm_fmadd_ps(__m128(a.v), __m128(b.v), __m128(c.v)));
    if constexpr (detail::is_pack<double, 2, T, N>)
        return Vector(_mm_fmadd_pd(__m128d(a.v), __m128d(b.v), __m128d(c.v)));
#elif defined(__aarch64__)
    if constexpr (detail::is_pack<float, 4, T, N>)
        return Vector(vfmaq_f32(float32x4_t(c.v), float32x4_t(a.v), float32x4_t(b.v)));
    if constexpr (detail::is_pack<double, 2, T, N>)
        return Vector(vfmaq_f64(float64x2_t(c.v), float64x2_t(a.v), float64x2_t(b.v)));
#endif
    if constexpr (detail::splits<T, N>) {
        return join(fma(low_half(a), low_half(b), low_half(c)), fma(high_half(a), high_half(b), high_half(c)));
    } else {
        Pack<T, N> r;
        for (int i = 0; i < N; ++i) r.v[i] = std::fma(a.v[i], b.v[i], c.v[i]);
        return r;
    }
}

/// a·b + c, rounded once or twice, whichever is fast here.
template <class T, int N>
[[gnu::always_inline]] inline Pack<T, N> multiply_add(Pack<T, N> a, Pack<T, N> b, Pack<T, N> c) {
    if constexpr (LAMBENT_HAS_FMA) {
        return fma(a, b, c);
    } else {
        return a * b + c;
    }
}

/// Hides how the lanes came about, so that -ffast-math cannot reassociate across this point.
template <class T, int N>
inline Pack<T, N> opaque(Pack<T, N> a) {
#if defined(__FAST_MATH__)
    asm volatile("" : "+m"(a.v));
#endif
    return a;
}

/// a·b − c·d with the exact sign: see the scalar function of this name in core/numerics.hpp.
template <class T, int N>
[[gnu::always_inline]] inline Pack<T, N> difference_of_products(Pack<T, N> a, Pack<T, N> b, Pack<T, N> c,
                                                               Pack<T, N> d) {
    if constexpr (!LAMBENT_HAS_FMA && std::is_same_v<T, float>) {
        const auto ab = opaque(convert<double>(a) * convert<double>(b));
        const auto cd = opaque(convert<double>(c) * convert<double>(d));
        return convert<float>(ab - cd);
    } else if constexpr (!LAMBENT_HAS_FMA) {
        Pack<T, N> r;
        for (int i = 0; i < N; ++i) r.set(i, difference_of_products(a[i], b[i], c[i], d[i]));
        return r;
    } else {
        const auto cd = opaque(c * d);
        return fma(a, b, -cd) + opaque(fma(-c, d, cd));
    }
}

/// a·b + c with the exact sign of the result, and an error of little more than one rounding.
template <class T, int N>
[[gnu::always_inline]] inline Pack<T, N> exact_multiply_add(Pack<T, N> a, Pack<T, N> b, Pack<T, N> c) {
    if constexpr (!LAMBENT_HAS_FMA && std::is_same_v<T, float>) {
        const auto product = opaque(convert<double>(a) * convert<double>(b)); // exact
        return convert<float>(product + convert<double>(c));
    } else if constexpr (!LAMBENT_HAS_FMA) {
        return difference_of_products(c, Pack<T, N>(T(1)), -a, b);
    } else {
        return fma(a, b, c);
    }
}

/// Sum of the lanes by halves: the same order on every machine.
template <class T, int N>
inline T sum(Pack<T, N> a) {
    if constexpr (N == 1) {
        return a.v[0];
    } else {
        return sum(low_half(a) + high_half(a));
    }
}

/// The largest of the lanes, none of which is NaN.
template <class T, int N>
inline T largest(Pack<T, N> a) {
    if constexpr (N == 1) {
        return a.v[0];
    } else {
        return largest(max(low_half(a), high_half(a)));
    }
}
/// The smallest of the lanes, none of which is NaN.
template <class T, int N>
inline T smallest(Pack<T, N> a) {
    if constexpr (N == 1) {
        return a.v[0];
    } else {
        return smallest(min(low_half(a), high_half(a)));
    }
}

} // namespace LAMBENT_ABI
} // namespace lambent

#pragma GCC diagnostic pop
