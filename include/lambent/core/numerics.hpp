#pragma once
#include <lambent/core/config.hpp>
#include <lambent/core/vec.hpp>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>

/// Arithmetic whose rounding we rely on. All of it holds under -ffp-contract=fast and -ffast-math.
namespace lambent {
inline namespace LAMBENT_ABI {

template <class T> inline constexpr T pi = T(3.14159265358979323846); ///< π
template <class T> inline constexpr T inv_pi = T(0.31830988618379067154); ///< 1 / π

namespace detail {
template <class T> struct FloatBits;
template <> struct FloatBits<float> {
    using Type = std::uint32_t;
    static constexpr Type exponent = 0x7f800000u, sign = 0x80000000u;
};
template <> struct FloatBits<double> {
    using Type = std::uint64_t;
    static constexpr Type exponent = 0x7ff0000000000000u, sign = 0x8000000000000000u;
};

/// Hides how `value` came about, so that -ffast-math cannot reassociate across this point.
template <std::floating_point T>
inline T opaque(T value) {
#if defined(__FAST_MATH__)
    asm volatile("" : "+m"(value));
#endif
    return value;
}

/// a·b − product, exactly, for double without the instruction.
/// source  Dekker, Numer. Math. 18 (1971), with Veltkamp's splitting
inline double product_error(double a, double b, double product) {
    const auto upper = [](double x) { // the upper 26 bits
        const double scaled = opaque(134217729.0 * x);
        return opaque(scaled - opaque(scaled - x));
    };
    const double a_high = upper(a), a_low = a - a_high, b_high = upper(b), b_low = b - b_high;
    const double error = opaque(opaque(a_high * b_high) - product);
    return opaque(opaque(error + a_high * b_low) + a_low * b_high) + a_low * b_low;
}
} // namespace detail

/// Neither infinite nor NaN, by the exponent's bits: std::isfinite is always true under -ffast-math.
template <std::floating_point T>
constexpr bool is_finite(T x) {
    using Bits = detail::FloatBits<T>;
    return (std::bit_cast<typename Bits::Type>(x) & Bits::exponent) != Bits::exponent;
}

/// NaN, by its bits: x != x is always false under -ffast-math.
template <std::floating_point T>
constexpr bool is_nan(T x) {
    using Bits = detail::FloatBits<T>;
    return (std::bit_cast<typename Bits::Type>(x) & ~Bits::sign) > Bits::exponent;
}

/// Whether all components are.
template <class T>
constexpr bool is_finite(const Vec3<T>& v) {
    return is_finite(v.x) && is_finite(v.y) && is_finite(v.z);
}

/// The nearest value above x; infinities and NaN stay as they are.
template <std::floating_point T>
constexpr T next_up(T x) {
    using Bits = detail::FloatBits<T>;
    if (!is_finite(x)) return x;
    auto bits = std::bit_cast<typename Bits::Type>(x);
    if ((bits & ~Bits::sign) == 0) return std::numeric_limits<T>::denorm_min();
    bits += (bits & Bits::sign) != 0 ? typename Bits::Type(-1) : typename Bits::Type(1);
    return std::bit_cast<T>(bits);
}

/// The next smaller number.
template <std::floating_point T>
constexpr T next_down(T x) {
    return -next_up(-x);
}

/// Bound on the relative error of n rounded operations in a row: n·u / (1 − n·u), with the unit roundoff u.
template <std::floating_point T>
constexpr T gamma_bound(int n) {
    constexpr T u = std::numeric_limits<T>::epsilon() / 2;
    return T(n) * u / (1 - T(n) * u);
}

/// a·b − c·d with an error of at most 1.5 ulp and, what hit tests need, the exact sign, also where the compiler
/// fuses multiply and add: swapped products give the opposite sign, though not always the same last bit.
/// source  Kahan's algorithm; Jeannerod, Louvet, Muller, Math. Comp. 82 (2013)
template <std::floating_point T>
inline T difference_of_products(T a, T b, T c, T d) {
    if constexpr (!LAMBENT_HAS_FMA && std::is_same_v<T, float>) {
        return float(double(a) * double(b) - double(c) * double(d)); // both products are exact in double
    } else if constexpr (!LAMBENT_HAS_FMA) { // not std::fma: clang makes a·b + c of it under -ffast-math
        const T ab = detail::opaque(a * b), cd = detail::opaque(c * d);
        const T error = detail::opaque(detail::product_error(a, b, ab) - detail::product_error(c, d, cd));
        return detail::opaque(ab - cd) + error;
    } else {
        const T cd = detail::opaque(c * d);
        const T error = std::fma(-c, d, cd);
        return std::fma(a, b, -cd) + error;
    }
}

/// Cross product with every component a faithful difference of products.
template <std::floating_point T>
inline Vec3<T> robust_cross(const Vec3<T>& a, const Vec3<T>& b) {
    return {difference_of_products(a.y, b.z, a.z, b.y), difference_of_products(a.z, b.x, a.x, b.z),
            difference_of_products(a.x, b.y, a.y, b.x)};
}

/// A running sum in twice the precision of T: what rounding loses is carried along, and handed back whenever it
/// has grown enough to be seen. The error stays at one rounding of the result for more terms than can be added.
/// source  Dekker, Numer. Math. 18 (1971); Neumaier's sum, which never hands back, is off by 2e-7 at 1e7 floats
template <std::floating_point T>
class CompensatedSum {
public:
    void add(T x) {
        const T total = detail::opaque(sum_ + x);
        const bool sum_is_larger = std::abs(sum_) >= std::abs(x);
        const T large = sum_is_larger ? sum_ : x, small = sum_is_larger ? x : sum_;
        const T lost = detail::opaque(detail::opaque(large - total) + small) + rest_;
        sum_ = detail::opaque(total + lost);
        rest_ = detail::opaque(total - sum_) + lost;
    }
    T value() const { return sum_; }

private:
    T sum_ = 0;
    T rest_ = 0;
};

/// Sum by halves: the error grows with log2 of the number of terms.
template <std::floating_point T>
inline T pairwise_sum(std::span<const T> values) {
    if (values.size() <= 8) {
        T sum = 0;
        for (const T v : values) sum = detail::opaque(sum + v);
        return sum;
    }
    const std::size_t half = std::bit_ceil(values.size()) / 2;
    return detail::opaque(pairwise_sum(values.first(half)) + pairwise_sum(values.subspan(half)));
}

/// a·b + c, fused where the machine can, and then always: left to itself the compiler may round the same expression
/// otherwise in another place.
template <std::floating_point T>
inline T multiply_add(T a, T b, T c) {
    if constexpr (LAMBENT_HAS_FMA) {
        return std::fma(a, b, c);
    } else {
        return detail::opaque(detail::opaque(a * b) + c);
    }
}

namespace detail {
template <class T> struct LaneOf {
    using Type = T;
};
template <class T>
    requires requires(const T& pack) { pack[0]; }
struct LaneOf<T> {
    using Type = std::remove_cvref_t<decltype(std::declval<const T&>()[0])>;
};
} // namespace detail
/// What a number or each lane of a Pack is.
template <class T> using ScalarOf = typename detail::LaneOf<T>::Type;

/// The scalar case of choosing lane by lane, for what is written for numbers and Packs alike.
template <std::floating_point T>
constexpr T select(bool condition, T a, T b) {
    return condition ? a : b;
}

/// Square root that takes the small negative values of rounding as 0.
template <std::floating_point T>
inline T safe_sqrt(T x) {
    return x > 0 ? std::sqrt(x) : T(0);
}

} // namespace LAMBENT_ABI
} // namespace lambent
