#pragma once
#include <cstring>
#include <lambent/film/film.hpp>

namespace lambent_test {

/// Whether two films hold the same bits.
inline bool same_bits(const lambent::Film<float>& a, const lambent::Film<float>& b) {
    if (a.blocks().size() != b.blocks().size() || a.material() != b.material() || a.rejected() != b.rejected()) return false;
    for (std::size_t i = 0; i < a.blocks().size(); ++i) {
        const auto &x = a.blocks()[i], &y = b.blocks()[i];
        if (!(x.samples == y.samples) || x.sums.size() != y.sums.size() ||
            std::memcmp(x.sums.data(), y.sums.data(), x.sums.size() * sizeof(float)) != 0)
            return false;
    }
    return true;
}

} // namespace lambent_test
