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

/// Arithmetic whose rounding we rely on. All of it holds under -ffp-contract=fast and -ffast-math.
namespace lambent {
inline namespace LAMBENT_ABI {

template <class T> inline constexpr T pi = T(3.14159265358979323846);
template <class T> inline constexpr T inv_pi = T(0.31830988618379067154);

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
} // namespace detail

/// Neither infinite nor NaN, by the exponent's bits: std::isfinite is always true under -ffast-math.
template <std::floating_point T>
constexpr bool is_finite(T x) {
    using Bits = detail::FloatBits<T>;
    return (std::bit_cast<typename Bits::Type>(x) & Bits::exponent) != Bits::exponent;
}

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

/// a·b − c·d with an error below 1.5 ulp and, what hit tests need, the exact sign: swapping the two products
/// only flips the sign, also where the compiler fuses multiply and add.
/// source  Kahan's algorithm; Jeannerod, Louvet, Muller, Math. Comp. 82 (2013)
template <std::floating_point T>
inline T difference_of_products(T a, T b, T c, T d) {
    if constexpr (!LAMBENT_HAS_FMA && std::is_same_v<T, float>) {
        return float(double(a) * double(b) - double(c) * double(d)); // both products are exact in double
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

/// A running sum whose error does not grow with the number of terms.
/// source  Neumaier, ZAMM 54 (1974)
template <std::floating_point T>
class CompensatedSum {
public:
    void add(T x) {
        const T total = detail::opaque(sum_ + x);
        const bool sum_is_larger = std::abs(sum_) >= std::abs(x);
        const T large = sum_is_larger ? sum_ : x, small = sum_is_larger ? x : sum_;
        compensation_ += detail::opaque(large - total) + small;
        sum_ = total;
    }
    T value() const { return sum_ + compensation_; }

private:
    T sum_ = 0;
    T compensation_ = 0;
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
    return pairwise_sum(values.first(half)) + pairwise_sum(values.subspan(half));
}

/// Square root that takes the small negative values of rounding as 0.
template <std::floating_point T>
inline T safe_sqrt(T x) {
    return x > 0 ? std::sqrt(x) : T(0);
}

} // namespace LAMBENT_ABI
} // namespace lambent
