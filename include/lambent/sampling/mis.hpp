#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/core/simd.hpp>

/// Weights for samples of one integral drawn by two strategies. pdf_a belongs to the strategy that made the
/// sample, pdf_b is the other's for the same sample, both in the same measure and each times its number of
/// samples. A pdf of 0 weighs 0, as does NaN (but for -ffast-math); an infinite one, a delta, weighs 1, two
/// of them a half. Written in ratios of the smaller to the larger, so that nothing overflows; weight(a, b) +
/// weight(b, a) is 1 within 2 ulp (but under clang's -ffast-math, whose divisions are approximate, for pdfs < 1e-30).
/// source  Veach, thesis (1997), ch. 9
namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {
/// The weight of a where share(r) = g(r) / (1 + g(r)) is given by g of the ratio r <= 1 of the pdfs.
template <class T, class Power>
constexpr T heuristic(T pdf_a, T pdf_b, Power g) {
    if (!(pdf_a > 0)) return 0;
    if (!(pdf_b > 0)) return 1;
    const bool a_finite = is_finite(pdf_a), b_finite = is_finite(pdf_b);
    if (!a_finite || !b_finite) return a_finite ? T(0) : b_finite ? T(1) : T(0.5);
    if (pdf_a >= pdf_b) return 1 / (1 + g(pdf_b / pdf_a));
    const T r = g(pdf_a / pdf_b);
    return r / (1 + r);
}
/// The same lane by lane, of finite pdf_b.
template <class T, int N, class Power>
inline Pack<T, N> heuristic(Pack<T, N> pdf_a, Pack<T, N> pdf_b, Power g) {
    using P = Pack<T, N>;
    const auto a_is_larger = pdf_a >= pdf_b;
    const P large = select(a_is_larger, pdf_a, pdf_b), small = select(a_is_larger, pdf_b, pdf_a);
    const P r = g(select(small > P(0), small / large, P(0))), share = select(a_is_larger, P(1), r) / (P(1) + r);
    return select(pdf_a > P(0), share, P(0));
}
} // namespace detail

/// pdf_a / (pdf_a + pdf_b).
template <std::floating_point T>
constexpr T balance_heuristic(T pdf_a, T pdf_b) {
    return detail::heuristic(pdf_a, pdf_b, [](T r) { return r; });
}
template <class T, int N>
inline Pack<T, N> balance_heuristic(Pack<T, N> pdf_a, Pack<T, N> pdf_b) {
    return detail::heuristic(pdf_a, pdf_b, [](Pack<T, N> r) { return r; });
}

/// pdf_a² / (pdf_a² + pdf_b²): less noise where one of the two is nearly perfect.
template <std::floating_point T>
constexpr T power_heuristic(T pdf_a, T pdf_b) {
    return detail::heuristic(pdf_a, pdf_b, [](T r) { return r * r; });
}
template <class T, int N>
inline Pack<T, N> power_heuristic(Pack<T, N> pdf_a, Pack<T, N> pdf_b) {
    return detail::heuristic(pdf_a, pdf_b, [](Pack<T, N> r) { return r * r; });
}

} // namespace LAMBENT_ABI
} // namespace lambent
