#pragma once
#include <array>
#include <cstddef>
#include <lambent/core/simd.hpp>

namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {
template <class T> struct ExpConstants;
template <> struct ExpConstants<float> {
    static constexpr float lowest = -88.029691932f; ///< -127 ln 2, from where on the scale's exponent is 0
    /// 1.5 · 2^23 + bias: adding it leaves n + bias in the low bits.
    static constexpr float shifter = 12582912.0f + 127;
    static constexpr int mantissa = 23;
    /// 2^f on [-1/2, 1/2] with 2^0 = 1 exactly, relative error below 9.2e-8: minimax, f^5 first.
    static constexpr std::array<float, 6> power = {0.001326474261f, 0.00967151802f, 0.05550733756f,
                                                   0.24022242f,     0.6931469776f,  1.0f};
};
template <> struct ExpConstants<double> {
    static constexpr double lowest = -709.08956571282398; ///< -1023 ln 2
    static constexpr double shifter = 6755399441055744.0 + 1023; ///< 1.5 · 2^52 + bias
    static constexpr int mantissa = 52;
    /// ln(2)^k / k!: the series, cut where it is below an ulp.
    static constexpr std::array<double, 14> power = {
        1.3691488853904128881e-12, 2.5678435993488205141e-11, 4.4455382718708114976e-10, 7.0549116208011233299e-9,
        1.0178086009239699728e-7,  1.3215486790144309488e-6,  1.5252733804059840280e-5,  1.5403530393381609954e-4,
        1.3333558146428443423e-3,  9.6181291076284771619e-3,  5.5504108664821579953e-2,  2.4022650695910071233e-1,
        6.9314718055994530942e-1,  1.0};
};
} // namespace detail

namespace detail {
/// x[k] = 2^(x[k] · scale) for products from lowest · log2 e to 0. Step by step for all k: a chain of
/// operations that wait for each other fills a processor's queue, several side by side keep it busy.
template <std::size_t K, class T, int N>
[[gnu::always_inline]] inline void powers_of_two(Pack<T, N>* x, T scale) {
    using C = ExpConstants<T>;
    using Bits = typename Mask<T, N>::Vector;
    using P = Pack<T, N>;
    P shifted[K], power[K];
#pragma GCC unroll 8
    for (std::size_t k = 0; k < K; ++k) shifted[k] = opaque(multiply_add(x[k], P(scale), P(C::shifter)));
#pragma GCC unroll 8
    for (std::size_t k = 0; k < K; ++k) {
        x[k] = multiply_add(x[k], P(scale), P(C::shifter) - shifted[k]);
        power[k] = P(C::power[0]);
    }
#pragma GCC unroll 16
    for (std::size_t i = 1; i < C::power.size(); ++i)
#pragma GCC unroll 8
        for (std::size_t k = 0; k < K; ++k) power[k] = multiply_add(power[k], x[k], P(C::power[i]));
#pragma GCC unroll 8
    for (std::size_t k = 0; k < K; ++k)
        x[k] = power[k] * P((typename P::Vector)((Bits)shifted[k].v << C::mantissa));
}
inline constexpr double log2_e = 1.4426950408889634074;
} // namespace detail

/// e^x of every lane, for x <= 0: 1 at 0 exactly, 0 where e^x is below the smallest normal number, -infinity
/// included; never NaN. Relative error below 2e-7 + |x| · 3e-8 (float) and 1e-15 + |x| · 1e-16 (double), with three
/// times the slope where there is no FMA.
/// cost  11 operations in float with FMA, no branch, no table
template <class T, int N>
inline Pack<T, N> exp_of_negative(Pack<T, N> x) {
    x = max(x, Pack<T, N>(detail::ExpConstants<T>::lowest));
    detail::powers_of_two<1>(&x, T(detail::log2_e));
    return x;
}

/// x[k] = e^(-x[k]/2) of every lane, for x >= 0 and K packs: the Gaussian of a squared distance in sigmas. As
/// exact as exp_of_negative, with an operation less each; infinity and NaN give 0.
template <std::size_t K, class T, int N>
[[gnu::always_inline]] inline void gaussians(Pack<T, N>* x) {
    Pack<T, N> limited[K];
#pragma GCC unroll 8
    for (std::size_t k = 0; k < K; ++k)
        limited[k] = min(x[k], Pack<T, N>(T(-2) * detail::ExpConstants<T>::lowest));
    detail::powers_of_two<K>(limited, T(-0.5 * detail::log2_e));
#pragma GCC unroll 8
    for (std::size_t k = 0; k < K; ++k) x[k] = limited[k];
}

} // namespace LAMBENT_ABI
} // namespace lambent
