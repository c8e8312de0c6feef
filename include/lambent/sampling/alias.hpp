#pragma once
#include <algorithm>
#include <lambent/sampling/hash.hpp>
#include <lambent/sampling/quantise.hpp>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Draws an index in proportion to given weights in constant time.
/// Probabilities are whole multiples of 2^-32 / n, so that `probability(i)` is what `sample` does and not an
/// estimate of it. Weights of 0 are never drawn; all others can be. Neighbouring u give unrelated
/// indices: where the spread of u matters, as in an environment map, take a Distribution.
/// source  Vose, IEEE Trans. Software Eng. 17:9 (1991)
class AliasTable {
public:
    /// What a draw gives.
    template <class T>
    struct Sample {
        std::uint32_t index; ///< 0 in an empty table
        T probability;       ///< probability(index) to the bit; 0 in an empty table
        T u;                 ///< the part of u not yet used, in [0, 1)
    };

    AliasTable() = default;

    /// Empty where there are no weights or all are 0. Throws lambent::Error on a negative or non-finite
    /// weight, and on more than 2^30 of them. O(n).
    explicit AliasTable(std::span<const double> weights) {
        require(weights.size() <= (std::size_t(1) << 30), "AliasTable: more than 2^30 weights");
        const std::size_t n = weights.size();
        std::vector<std::uint64_t> count(n); // what of item i is still to be placed; a slot holds `full`
        if (!detail::quantise_weights(weights, n * full, std::span(count), "AliasTable")) return;

        slots_.resize(n);
        probability_.resize(n);
        std::vector<std::uint32_t> small, large;
        for (std::uint32_t i = 0; i < n; ++i) {
            probability_[i] = float(double(count[i]) / (double(n) * double(full)));
            (count[i] < full ? small : large).push_back(i);
        }
        while (!small.empty()) {
            const std::uint32_t poor = small.back(), rich = large.back();
            small.pop_back();
            slots_[poor] = {std::uint32_t(count[poor]), rich};
            count[rich] -= full - count[poor];
            if (count[rich] < full) {
                large.pop_back();
                small.push_back(rich);
            }
        }
        for (const std::uint32_t i : large) slots_[i] = {0, i}; // exactly full: the counts add up
    }

    bool empty() const { return slots_.empty(); }
    std::size_t size() const { return slots_.size(); }

    /// u in [0, 1). A float of 24 bits leaves 2^24 / size() levels inside a slot: from some ten thousand
    /// items on, draw u in double.
    template <std::floating_point T>
    Sample<T> sample(T u) const {
        if (empty()) return {0, 0, u};
        const double position = double(u) * double(slots_.size());
        const auto slot = std::min(std::uint32_t(position), std::uint32_t(slots_.size() - 1));
        const double fraction = position - slot, threshold = slots_[slot].threshold * 0x1p-32;
        const bool own = fraction < threshold;
        const std::uint32_t index = own ? slot : slots_[slot].alias;
        const T rest = T(own ? fraction / threshold : (fraction - threshold) / (1 - threshold));
        return {index, T(probability_[index]), std::min(rest, one_minus_epsilon<T>)};
    }

    /// The chance that `sample` returns this index; 0 in an empty table and beyond its end.
    float probability(std::size_t index) const {
        return index < probability_.size() ? probability_[index] : 0;
    }

private:
    static constexpr std::uint64_t full = std::uint64_t(1) << 32;
    struct Slot {
        std::uint32_t threshold; ///< below this fraction, in 2^-32, the slot's own item, else the alias
        std::uint32_t alias;
    };
    std::vector<Slot> slots_;
    std::vector<float> probability_;
};

} // namespace LAMBENT_ABI
} // namespace lambent
