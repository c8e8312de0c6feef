/// Searches for the orders of include/lambent/sampling/sobol_order.hpp and prints them: one after the other, the most
/// important dimension first, each the best of many drawn by chance beside those before it. Minutes; always the same.
#include <lambent/sampling/sobol.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <random>
#include <utility>
#include <vector>

namespace {

using namespace lambent;

constexpr int max_bits = 8;  ///< of a sample's index: up to 256 samples are looked at
constexpr int max_level = 5; ///< of detail of an integrand along an axis, level n being intervals of 2^-n
constexpr int max_levels = max_level + 2; ///< of all axes together

/// How much a dimension matters: the pixel's 1, the lens', then each vertex' light, direction, lobe and roulette.
double importance(int dimension) {
    static constexpr double of_vertex[4][4] = {{0.7, 1, 0.4, 0.05}, {0.6, 0.7, 0.3, 0.3}, {0.35, 0.35, 0.2, 0.2}, {0.2, 0.2, 0.1, 0.1}};
    if (dimension < 2) return dimension == 0 ? 1 : 0.4;
    const int vertex = (dimension - 2) / 4, use = (dimension - 2) % 4;
    return of_vertex[std::min(vertex, 3)][use] * std::pow(0.6, std::max(vertex - 3, 0));
}

using Masks = std::array<std::uint32_t, 4>;
/// Of which bits of the index the first bits of a number are sums, by Masks' order: of its x, of its y.
struct Dimension {
    std::array<std::array<std::uint32_t, max_level>, 2> bits{};
    int number = 0, axes = 2;
    double importance = 0;
};

Dimension make_dimension(const Masks& masks, int number) {
    Dimension d{.number = number, .axes = number < 2 || (number - 2) % 4 < 2 ? 2 : 1, .importance = importance(number)};
    for (int b = 0; b < max_bits; ++b) {
        const std::uint32_t x = detail::apply_order(1u << b, masks[0], masks[1], masks[2], masks[3]);
        const std::uint32_t y = detail::sobol_second_reversed(x);
        for (std::size_t n = 0; n < max_level; ++n) {
            d.bits[0][n] |= (x >> n & 1u) << b;
            d.bits[1][n] |= (y >> n & 1u) << b;
        }
    }
    return d;
}

/// What two dimensions do together: for 2^bits samples, the variance of a product of functions of them over that by
/// independent pairs, a mean over levels of detail. Nets have Walsh functions of which their points see nothing but the
/// mean: as many as rows of their matrices depend on one another.
class Together {
public:
    double variance(const Dimension& a, const Dimension& b, int bits) {
        fill(a, b, (1u << bits) - 1, 0, 0, 0, Basis());
        for (const std::size_t axis : stride) // up to these levels, less those below
            for (std::size_t i = unseen_.size(); i-- > axis;)
                if (i / axis % (max_level + 1) > 0) unseen_[i] -= unseen_[i - axis];
        double sum = 0, total = 0;
        std::array<int, 4> n{};
        for (n[0] = 0; n[0] <= levels_of(a, b, 0); ++n[0])
            for (n[1] = 0; n[1] <= levels_of(a, b, 1); ++n[1])
                for (n[2] = 0; n[2] <= levels_of(a, b, 2); ++n[2])
                    for (n[3] = 0; n[3] <= levels_of(a, b, 3) && n[0] + n[1] + n[2] + n[3] <= max_levels; ++n[3]) {
                        if (n[0] + n[1] == 0 || n[2] + n[3] == 0) continue;
                        double share = 1, weight = 1;
                        std::size_t at = 0;
                        for (std::size_t axis = 0; axis < 4; ++axis) {
                            share *= of_level[std::size_t(n[axis])];
                            weight *= weight_of_level[std::size_t(n[axis])];
                            at += std::size_t(n[axis]) * stride[axis];
                        }
                        if ((n[0] > 0) + (n[1] > 0) + (n[2] > 0) + (n[3] > 0) > 2) weight /= 2;
                        sum += weight * std::ldexp(std::min(unseen_[at] * share, 1.0), bits);
                        total += weight;
                    }
        return sum / total;
    }

private:
    static constexpr std::array<std::size_t, 4> stride = {216, 36, 6, 1};
    static constexpr std::array<double, max_level + 1> of_level = {1, 1, 1.0 / 2, 1.0 / 4, 1.0 / 8, 1.0 / 16}; ///< one over its functions
    /// Of an integrand's variance: a third from level to level.
    static constexpr std::array<double, max_level + 1> weight_of_level = {1, 1.0 / 3, 1.0 / 9, 1.0 / 27, 1.0 / 81, 1.0 / 243};

    struct Basis {
        std::array<std::uint32_t, max_bits> rows{};
        int rank = 0;
        void add(std::uint32_t row) {
            for (int i = 0; i < rank; ++i) row = std::min(row, row ^ rows[std::size_t(i)]);
            if (row != 0) rows[std::size_t(rank++)] = row;
        }
    };

    static int levels_of(const Dimension& a, const Dimension& b, int axis) {
        return (axis & 1) < (axis < 2 ? a : b).axes ? max_level : 0;
    }

    /// How many Walsh functions up to these levels the points do not see.
    void fill(const Dimension& a, const Dimension& b, std::uint32_t mask, int axis, int levels, std::size_t at, Basis basis) {
        if (axis == 4) {
            unseen_[at] = std::ldexp(1.0, levels - basis.rank);
            return;
        }
        const auto& rows = (axis < 2 ? a : b).bits[std::size_t(axis & 1)];
        for (int n = 0; n <= levels_of(a, b, axis) && levels + n <= max_levels; ++n) {
            if (n > 0) basis.add(rows[std::size_t(n - 1)] & mask);
            fill(a, b, mask, axis + 1, levels + n, at + std::size_t(n) * stride[std::size_t(axis)], basis);
        }
    }

    std::array<double, 1296> unseen_{}; ///< Walsh functions of these levels that the points do not see
};

/// Whether a path multiplies what it makes of the one with what it makes of the other: a light sample goes with the way
/// to its vertex, not with other lights or the way from there.
bool meet(int a, int b) {
    if (a > b) std::swap(a, b);
    if (a < 2) return true;
    const int vertex_a = (a - 2) / 4, vertex_b = (b - 2) / 4;
    const bool light_a = (a - 2) % 4 == 0, light_b = (b - 2) % 4 == 0;
    return !light_a && (!light_b || vertex_a < vertex_b);
}

} // namespace

int main() {
    constexpr int count = int(detail::sobol_orders);
    constexpr std::pair<int, double> weights[] = {{4, 2.5}, {6, 2.5}, {5, 1}, {8, 0.7}, {2, 0.5}, {3, 0.5}}; // of 2^n samples
    std::array<int, count> order{};
    for (int d = 0; d < count; ++d) order[std::size_t(d)] = d;
    std::stable_sort(order.begin(), order.end(), [](int a, int b) { return importance(a) > importance(b); });
    std::array<Masks, count> found{};
    std::vector<Dimension> done;
    std::mt19937 random(1);
    Together together;
    for (const int d : order) {
        Dimension best = make_dimension({}, d);
        double least = std::numeric_limits<double>::infinity();
        const int tries = done.empty() ? 0 : done.size() < 14 ? 100'000 : 20'000;
        for (int i = 0; i < tries; ++i) {
            Masks masks;
            for (std::uint32_t& mask : masks) mask = std::uint32_t(random());
            const Dimension candidate = make_dimension(masks, d);
            double sum = 0; // by a power above 1, so that some noise in many pairs is better than much in few
            for (const Dimension& other : done)
                for (const auto& [bits, weight] : weights)
                    if (meet(d, other.number) && sum < least) sum += weight * other.importance * std::pow(together.variance(other, candidate, bits), 1.5);
            if (!(sum < least)) continue;
            least = sum;
            best = candidate;
            found[std::size_t(d)] = masks;
        }
        done.push_back(best);
        std::fprintf(stderr, "dimension %d done\n", d);
    }
    for (std::size_t mask = 0; mask < 4; ++mask) {
        std::printf("    {");
        for (int i = 0; i < count; ++i) // dimension d stands at (d + 2) % count
            std::printf("%s0x%08x", i == 0 ? "\n        " : i % 8 == 0 ? ",\n        " : ", ", found[std::size_t((i + count - 2) % count)][mask]);
        std::printf("}%s\n", mask < 3 ? "," : "");
    }
}
