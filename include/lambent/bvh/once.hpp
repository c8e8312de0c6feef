#pragma once
#include <lambent/core/ray.hpp>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Tells the first time that a primitive is met from the others. A tree with spatial splits holds some primitives in
/// several leaves; in one without, nothing is remembered. Up to 32 primitives are kept in place; more of them go to
/// a hash table, which allocates.
class Once {
public:
    explicit Once(bool needed) : needed_(needed) {}

    bool first(std::uint32_t primitive) {
        if (!needed_) return true;
        if (table_.empty()) {
            for (std::size_t i = 0; i < count_; ++i)
                if (few_[i] == primitive) return false;
            if (count_ < capacity) {
                few_[count_++] = primitive;
                return true;
            }
            table_.assign(8 * capacity, no_primitive);
            for (const std::uint32_t p : few_) insert(p);
        } else if (2 * count_ > table_.size()) {
            std::vector<std::uint32_t> old(2 * table_.size(), no_primitive);
            old.swap(table_);
            for (const std::uint32_t p : old)
                if (p != no_primitive) insert(p);
        }
        const bool is_new = insert(primitive);
        count_ += std::size_t(is_new);
        return is_new;
    }

private:
    static constexpr std::size_t capacity = 32;

    bool insert(std::uint32_t primitive) { // the table is at most half full, its size a power of two
        const std::size_t last = table_.size() - 1;
        std::uint32_t hash = primitive * 0x9e3779b1u;
        hash ^= hash >> 15;
        for (std::size_t i = hash & last;; i = (i + 1) & last) {
            if (table_[i] == primitive) return false;
            if (table_[i] == no_primitive) {
                table_[i] = primitive;
                return true;
            }
        }
    }

    bool needed_;
    std::size_t count_ = 0;
    std::uint32_t few_[capacity];
    std::vector<std::uint32_t> table_;
};

/// Calls f, which returns nothing, or false to stop.
template <class F, class... Arguments>
inline bool goes_on(F& f, Arguments&&... arguments) {
    if constexpr (std::is_void_v<std::invoke_result_t<F&, Arguments...>>) {
        f(std::forward<Arguments>(arguments)...);
        return true;
    } else {
        return bool(f(std::forward<Arguments>(arguments)...));
    }
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
