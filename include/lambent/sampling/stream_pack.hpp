#pragma once
#include <lambent/core/simd.hpp>
#include <lambent/sampling/sampler.hpp>
#include <array>
#include <cstddef>
#include <cstdint>

// See simd.hpp.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace lambent {
inline namespace LAMBENT_ABI {

/// N streams side by side, each in its lane with the numbers it has alone. Streams that can draw together have a
/// Together<N> with these members; others draw one after the other.
template <SampleStream Stream, int N>
class StreamPack {
public:
    using T = typename Stream::Scalar;

    /// Refers to the stream. Lanes are filled from the first on.
    void set(int lane, const Stream& stream) {
        if constexpr (together) pack_.set(lane, stream);
        else {
            pack_.streams[std::size_t(lane)] = &stream;
            pack_.size = lane + 1;
        }
    }
    Pack<T, N> get_1d(std::uint32_t dimension) const {
        if constexpr (together) return pack_.get_1d(dimension);
        else {
            Pack<T, N> numbers(T(0));
            for (int i = 0; i < pack_.size; ++i) numbers.set(i, pack_.streams[std::size_t(i)]->get_1d(dimension));
            return numbers;
        }
    }
    Vec2<Pack<T, N>> get_2d(std::uint32_t dimension) const {
        if constexpr (together) return pack_.get_2d(dimension);
        else {
            Pack<T, N> x(T(0)), y(T(0));
            for (int i = 0; i < pack_.size; ++i) {
                const Vec2<T> u = pack_.streams[std::size_t(i)]->get_2d(dimension);
                x.set(i, u.x);
                y.set(i, u.y);
            }
            return {x, y};
        }
    }

private:
    static constexpr bool together = requires { typename Stream::template Together<N>; };
    struct Apart {
        std::array<const Stream*, std::size_t(N)> streams;
        int size = 0;
    };
    static auto pack() {
        if constexpr (together) return typename Stream::template Together<N>();
        else return Apart();
    }
    decltype(pack()) pack_;
};

} // namespace LAMBENT_ABI
} // namespace lambent

#pragma GCC diagnostic pop
