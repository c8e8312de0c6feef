#pragma once
#include <lambent/sampling/hash.hpp>
#include <lambent/sampling/sampler.hpp>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Plain random numbers, every one on its own: the yardstick for the other samplers.
template <class T>
class IndependentSampler {
public:
    explicit IndependentSampler(std::uint32_t seed = 0) : seed_(seed) {}

    /// One sample's numbers: a pure function of pixel, sample, dimension and seed.
    class Stream {
    public:
        using Scalar = T;

        T get_1d(std::uint32_t dimension) const { return to_unit<T>(derive_key(key_, dimension)); }

        Vec2<T> get_2d(std::uint32_t dimension) const {
            const std::uint64_t bits = derive_key(key_, dimension);
            return {to_unit<T>(std::uint32_t(bits >> 32)), to_unit<T>(std::uint32_t(bits))};
        }

    private:
        friend IndependentSampler;
        explicit Stream(std::uint64_t key) : key_(key) {}
        std::uint64_t key_;
    };

    Stream at(std::uint32_t x, std::uint32_t y, std::uint32_t index) const {
        return Stream(derive_key(pixel_key(seed_, x, y), index));
    }

private:
    std::uint32_t seed_;
};

} // namespace LAMBENT_ABI
} // namespace lambent
