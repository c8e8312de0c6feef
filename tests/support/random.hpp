#pragma once
#include <cstddef>
#include <cstdint>
#include <lambent/core/vec.hpp>

namespace lambent_test {

/// Random numbers of the tests' own, so that what is tested is not its own judge: Marsaglia's xorshift64*.
class Random {
public:
    explicit Random(std::uint64_t seed) : state_(seed * 2 + 1) {
        for (int i = 0; i < 20; ++i) bits();
    }
    std::uint64_t bits() {
        state_ ^= state_ >> 12;
        state_ ^= state_ << 25;
        state_ ^= state_ >> 27;
        return state_ * 0x2545f4914f6cdd1du;
    }
    std::uint32_t bits32() { return std::uint32_t(bits() >> 32); }
    double uniform() { return double(bits() >> 11) * 0x1p-53; }      ///< [0, 1), 53 bits
    float uniform_float() { return float(bits() >> 40) * 0x1p-24f; } ///< [0, 1), 24 bits
    double uniform(double low, double high) { return low + (high - low) * uniform(); }
    std::uint32_t below(std::uint32_t n) { return std::uint32_t((std::uint64_t(bits32()) * n) >> 32); }
    std::size_t index(std::size_t n) { return std::size_t(bits() % n); }
    template <class T> lambent::Vec3<T> in_box(double low, double high) {
        const double x = uniform(low, high), y = uniform(low, high), z = uniform(low, high);
        return {T(x), T(y), T(z)};
    }

private:
    std::uint64_t state_;
};

} // namespace lambent_test
