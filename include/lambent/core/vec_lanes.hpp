#pragma once
#include <lambent/core/simd.hpp>
#include <lambent/core/vec.hpp>

/// Vectors of three in one register. Compilers keep Vec3 in three, and do all that is done to it three times over: this
/// is for what every ray goes through.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace lambent {
inline namespace LAMBENT_ABI {

/// x, y, z, and a lane that is 0 where it comes from to_lanes(), and stays it under what keeps zeros.
template <class T> using Lanes3 = Pack<T, 4>;

template <class T>
[[gnu::always_inline]] inline Lanes3<T> to_lanes(const Vec3<T>& v) {
    return typename Lanes3<T>::Vector{v.x, v.y, v.z, T(0)};
}
template <class T>
[[gnu::always_inline]] inline Vec3<T> to_vec(Lanes3<T> a) {
    return {a.v[0], a.v[1], a.v[2]};
}

/// The first three lanes' products, summed: (x + z) + y.
template <class T>
[[gnu::always_inline]] inline T dot(Lanes3<T> a, Lanes3<T> b) {
    return sum(a * b);
}

/// Cross product with every component a faithful difference of products, as robust_cross() of vectors.
template <class T>
[[gnu::always_inline]] inline Lanes3<T> robust_cross(Lanes3<T> a, Lanes3<T> b) {
    const auto yzx = [](Lanes3<T> p) -> Lanes3<T> { return __builtin_shufflevector(p.v, p.v, 1, 2, 0, 3); };
    return yzx(difference_of_products(a, yzx(b), yzx(a), b)); // z, x, y are what is in the brackets
}

} // namespace LAMBENT_ABI
} // namespace lambent

#pragma GCC diagnostic pop
