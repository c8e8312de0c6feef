#pragma once
#include <lambent/core/config.hpp>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// A 64-bit hash of bytes, fed piece by piece: tells apart what differs by accident, not what an adversary made.
/// How the bytes are cut into pieces matters. About 3 GB/s.
class ContentHash {
public:
    void add_bytes(const void* data, std::size_t size) {
        const unsigned char* bytes = static_cast<const unsigned char*>(data);
        mix(size);
        for (; size >= 8; size -= 8, bytes += 8) {
            std::uint64_t word = 0;
            std::memcpy(&word, bytes, 8);
            mix(word);
        }
        if (size > 0) {
            std::uint64_t word = 0;
            std::memcpy(&word, bytes, size);
            mix(word);
        }
    }

    /// A value without padding: numbers, enumerations, vectors of them.
    template <class V>
        requires std::is_trivially_copyable_v<V>
    void add(const V& value) {
        add_bytes(&value, sizeof(V));
    }

    template <class V>
        requires std::is_trivially_copyable_v<V>
    void add(const std::vector<V>& values) {
        add_bytes(values.data(), values.size() * sizeof(V));
    }

    std::uint64_t value() const { return state_ ^ (state_ >> 29); }

private:
    /// One step of FNV-1a by words, with the upper half folded in so that every bit reaches every other.
    void mix(std::uint64_t word) {
        state_ = (state_ ^ word) * 0x9fb21c651e98df25u;
        state_ ^= state_ >> 32;
    }

    std::uint64_t state_ = 0xcbf29ce484222325u;
};

} // namespace LAMBENT_ABI
} // namespace lambent
