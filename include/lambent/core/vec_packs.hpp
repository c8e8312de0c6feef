#pragma once
#include <lambent/core/simd.hpp>
#include <lambent/core/vec.hpp>
#include <array>
#include <cstddef>

/// Several vectors side by side: Vec3 of Packs, a vector a lane. GLM's operators do for them; here is what they lack.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace lambent {
inline namespace LAMBENT_ABI {

template <class T, int N> using Vec3Pack = Vec3<Pack<T, N>>;
template <class T, int N> using Vec2Pack = Vec2<Pack<T, N>>;

/// The same vector in every lane.
template <class T, int N>
[[gnu::always_inline]] inline Vec3Pack<T, N> spread(const Vec3<T>& v) {
    return {Pack<T, N>(v.x), Pack<T, N>(v.y), Pack<T, N>(v.z)};
}

template <class T, int N>
[[gnu::always_inline]] inline Pack<T, N> dot(const Vec3Pack<T, N>& a, const Vec3Pack<T, N>& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
/// Summed in the order of vec_lanes.hpp, for the same bits: (x + z) + y.
template <class T, int N>
[[gnu::always_inline]] inline Pack<T, N> dot_xzy(const Vec3Pack<T, N>& a, const Vec3Pack<T, N>& b) {
    return a.x * b.x + a.z * b.z + a.y * b.y;
}
template <class T, int N>
[[gnu::always_inline]] inline Vec3Pack<T, N> abs(const Vec3Pack<T, N>& a) {
    return {abs(a.x), abs(a.y), abs(a.z)};
}
template <class T, int N>
[[gnu::always_inline]] inline Vec3Pack<T, N> normalize(const Vec3Pack<T, N>& a) {
    return a * (Pack<T, N>(T(1)) / sqrt(dot(a, a)));
}
template <class T, int N>
[[gnu::always_inline]] inline Pack<T, N> max_component(const Vec3Pack<T, N>& a) {
    return max(a.x, max(a.y, a.z));
}
/// Which vectors have no component but 0; and which none that is infinite or NaN.
template <class T, int N>
[[gnu::always_inline]] inline Mask<T, N> is_black(const Vec3Pack<T, N>& a) {
    const Pack<T, N> zero(T(0));
    return (a.x == zero) & (a.y == zero) & (a.z == zero);
}
template <class T, int N>
[[gnu::always_inline]] inline Mask<T, N> is_finite(const Vec3Pack<T, N>& a) {
    return is_finite(a.x) & is_finite(a.y) & is_finite(a.z);
}
template <class T, int N>
[[gnu::always_inline]] inline Vec3Pack<T, N> select(Mask<T, N> mask, const Vec3Pack<T, N>& a, const Vec3Pack<T, N>& b) {
    return {select(mask, a.x, b.x), select(mask, a.y, b.y), select(mask, a.z, b.z)};
}
/// Cross product with every component a faithful difference of products, as robust_cross() of vectors.
template <class T, int N>
[[gnu::always_inline]] inline Vec3Pack<T, N> robust_cross(const Vec3Pack<T, N>& a, const Vec3Pack<T, N>& b) {
    return {difference_of_products(a.y, b.z, a.z, b.y), difference_of_products(a.z, b.x, a.x, b.z),
            difference_of_products(a.x, b.y, a.y, b.x)};
}

/// N vectors as memory holds them when they are written one by one and read as a pack, or the other way round.
template <class T, int N>
struct Vec3Column {
    alignas(64) std::array<T, std::size_t(N)> x, y, z;

    void set(std::size_t i, const Vec3<T>& v) { x[i] = v.x, y[i] = v.y, z[i] = v.z; }
    Vec3<T> operator[](std::size_t i) const { return {x[i], y[i], z[i]}; }
    Vec3Pack<T, N> load() const {
        return {Pack<T, N>::load(x.data()), Pack<T, N>::load(y.data()), Pack<T, N>::load(z.data())};
    }
    void store(const Vec3Pack<T, N>& v) { v.x.store(x.data()), v.y.store(y.data()), v.z.store(z.data()); }
};

} // namespace LAMBENT_ABI
} // namespace lambent

#pragma GCC diagnostic pop
