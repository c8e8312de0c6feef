#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <lambent/core/vec.hpp>

namespace lambent {
inline namespace LAMBENT_ABI {

/// A smooth function of a cosine and a roughness, both in [0, 1], tabulated at construction: even in the square root of
/// the cosine, since albedos change fast at grazing angles; linear in between. For directional albedos; some KiB.
/// V     what a value is: a number or a vector of float
/// side  points along each of the two
template <class V, int side = 24>
class AlbedoTable {
public:

    /// f(cosine, roughness) is asked for at side² points, both in double and in (0, 1].
    template <class F>
    explicit AlbedoTable(F&& f) {
        const auto place = [](int i) { return std::max(double(i) / (side - 1), 1e-3); };
        for (int r = 0; r < side; ++r)
            for (int c = 0; c < side; ++c) values_[index(r, c)] = f(place(c) * place(c), place(r));
    }

    V at(float cosine, float roughness) const {
        constexpr float last = side - 1;
        const float x = last * std::sqrt(std::clamp(cosine, 0.0f, 1.0f)), y = last * std::clamp(roughness, 0.0f, 1.0f);
        const int c = std::min(int(x), side - 2), r = std::min(int(y), side - 2);
        const float s = x - float(c), t = y - float(r);
        return (values_[index(r, c)] * (1 - s) + values_[index(r, c + 1)] * s) * (1 - t) +
               (values_[index(r + 1, c)] * (1 - s) + values_[index(r + 1, c + 1)] * s) * t;
    }

private:
    static std::size_t index(int r, int c) { return std::size_t(r * side + c); }
    std::array<V, std::size_t(side* side)> values_;
};

} // namespace LAMBENT_ABI
} // namespace lambent
