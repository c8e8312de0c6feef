#pragma once
#include <lambent/core/config.hpp>
#include <cstdint>
#include <string>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Sample indices [begin, end).
struct SampleRange {
    std::uint64_t begin = 0, end = 0;

    std::uint64_t size() const { return end - begin; }
    bool overlaps(const SampleRange& other) const { return begin < other.end && other.begin < end; }
    friend bool operator==(const SampleRange&, const SampleRange&) = default;
};

/// "[0, 64)", for messages.
inline std::string describe(const SampleRange& range) {
    return std::string("[").append(std::to_string(range.begin)) + ", " + std::to_string(range.end) + ")";
}

/// The samples [first, first + 2^level): a block of a dyadic partition, in which `first` is a multiple of the size.
struct DyadicBlock {
    std::uint64_t first = 0;
    std::uint32_t level = 0;

    std::uint64_t size() const { return std::uint64_t(1) << level; }
    std::uint64_t end() const { return first + size(); }
    SampleRange range() const { return {first, end()}; }
    /// Whether the two halves of one aligned block are this and `next`.
    bool joins(const DyadicBlock& next) const {
        return level == next.level && next.first == end() && first % (2 * size()) == 0;
    }
    friend bool operator==(const DyadicBlock&, const DyadicBlock&) = default;
};

/// The largest aligned dyadic block that begins at `begin`, ends by `end` and holds at most `largest` samples.
/// begin < end, largest >= 1
inline DyadicBlock dyadic_block_at(std::uint64_t begin, std::uint64_t end, std::uint64_t largest) {
    DyadicBlock block{begin, 0};
    while (2 * block.size() <= largest && begin % (2 * block.size()) == 0 && begin + 2 * block.size() <= end)
        ++block.level;
    return block;
}

/// The one partition of the samples [begin, end) into the largest aligned dyadic blocks.
inline std::vector<DyadicBlock> dyadic_blocks(std::uint64_t begin, std::uint64_t end) {
    std::vector<DyadicBlock> blocks;
    for (; begin < end; begin = blocks.back().end()) blocks.push_back(dyadic_block_at(begin, end, end - begin));
    return blocks;
}

} // namespace LAMBENT_ABI
} // namespace lambent
