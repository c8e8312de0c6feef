#pragma once
#include <lambent/core/memory.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/ray.hpp>
#include <lambent/core/simd.hpp>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// A box by its low end and its negated high end: a min makes both grow. In one register, where they are that wide.
/// Lanes 3 and 7 are unused.
template <class T>
struct PackBox {
    static constexpr int width = native_width<T> >= 8 ? 8 : 4, parts = 8 / width;
    using Lanes = Pack<T, 4>;
    Pack<T, width> part[std::size_t(parts)];

    PackBox() : PackBox(std::numeric_limits<T>::infinity()) {}
    explicit PackBox(T x) {
        for (auto& p : part) p = x;
    }
    PackBox(Lanes low, Lanes minus_high) {
        if constexpr (parts == 1) {
            part[0] = join(low, minus_high);
        } else {
            part[0] = low;
            part[1] = minus_high;
        }
    }
    static PackBox load(const void* from) {
        PackBox b;
        std::memcpy(static_cast<void*>(&b.part), from, sizeof(b.part));
        return b;
    }
    void store(void* to) const { std::memcpy(to, static_cast<const void*>(&part), sizeof(part)); }

    Lanes low() const {
        if constexpr (parts == 1) return low_half(part[0]);
        else return part[0];
    }
    Lanes minus_high() const {
        if constexpr (parts == 1) return high_half(part[0]);
        else return part[1];
    }
    T lo(int axis) const { return low()[axis]; }
    T hi(int axis) const { return -minus_high()[axis]; }

    void add(const PackBox& b) {
        for (int i = 0; i < parts; ++i) part[i] = min(part[i], b.part[i]);
    }
    void intersect(const PackBox& b) {
        for (int i = 0; i < parts; ++i) part[i] = max(part[i], b.part[i]);
    }
    friend PackBox operator+(PackBox a, const PackBox& b) {
        for (int i = 0; i < parts; ++i) a.part[i] += b.part[i];
        return a;
    }
    Lanes minus_size() const { return low() + minus_high(); }
    bool empty() const { return (bits(minus_size() > Lanes(T(0))) & 7u) != 0; }
    T half_area() const {
        const Lanes d = minus_size(); // the signs cancel
        return d[0] * d[1] + d[1] * d[2] + d[2] * d[0];
    }
    /// Twice the centre, as a box. Beyond half of the largest number it is infinite: bins then hold too much.
    PackBox center() const {
        const Lanes c = low() - minus_high();
        return {c, -c};
    }
};

/// What the builder moves about in place of a triangle. The lane of the name holds no denormal number, with which
/// arithmetic would be slow.
template <class T>
struct alignas(16) Reference {
    using Bits = typename FloatBits<T>::Type;
    static constexpr Bits tag = Bits(1) << (8 * sizeof(T) - 2);
    T lo[3];
    Bits name;
    T minus_hi[3];
    T unused = 0;

    void set_primitive(std::size_t i) { name = tag | Bits(i); }
    std::uint32_t primitive() const { return std::uint32_t(name & ~tag); }
    PackBox<T> box() const { return PackBox<T>::load(this); }
};

/// A node of the binary tree from which the wide one is made. Its triangles are references [first, first +
/// count), whether it is a leaf or not; its children, if it has any, are nodes left and left + 1.
template <class T>
struct BinaryNode {
    PackBox<T> box;
    std::uint32_t first = 0, count = 0;
    std::uint32_t left = 0; ///< 0: a leaf
};

template <class T>
struct BinaryTree {
    LargeArray<BinaryNode<T>> nodes;
    LargeArray<Reference<T>> references;
    std::size_t dropped = 0;
    std::size_t duplicates = 0; ///< references to primitives that have another: of primitives cut at planes
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
