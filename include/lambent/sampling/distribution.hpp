#pragma once
#include <algorithm>
#include <lambent/core/vec.hpp>
#include <lambent/sampling/hash.hpp>
#include <lambent/sampling/quantise.hpp>
#include <span>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

namespace detail {

/// Cumulative sums of weights in whole quanta: starts[i] to starts[i + 1] is item i's share of cdf_total.
inline constexpr std::uint32_t cdf_total = 1u << 31;

/// Fills starts (one more than weights); false where all weights are 0.
template <std::floating_point W>
inline bool make_cdf(std::span<const W> weights, std::span<std::uint32_t> starts, const char* what) {
    const bool any = quantise_weights(weights, cdf_total, starts.first(weights.size()), what);
    std::uint32_t sum = 0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
        const std::uint32_t count = starts[i];
        starts[i] = sum;
        sum += count;
    }
    starts[weights.size()] = sum;
    return any;
}

/// Of some items, all that a target within them may fall to, the last that starts at or before it: never one of no share.
inline std::uint32_t search_cdf(std::span<const std::uint32_t> starts, std::uint32_t target, std::uint32_t first_item,
                                std::uint32_t last_item) {
    const std::uint32_t* first = starts.data() + first_item;
    for (std::size_t n = last_item - first_item + std::size_t(1); n > 1;) {
        const std::size_t half = n / 2;
        first += first[half] <= target ? half : 0; // a conditional move, not a branch
        n -= half;
    }
    return std::uint32_t(first - starts.data());
}

/// Cuts [0, 1) into equal parts and tells to which item each one's start falls, so that a search looks at few items where
/// few share most of the weight, as those of a sun in the sky do.
inline constexpr std::uint32_t cdf_guides = 17, cdf_guide_width = cdf_total / (cdf_guides - 1);

inline void make_cdf_guide(std::span<const std::uint32_t> starts, std::span<std::uint32_t> guide) {
    const auto last = std::uint32_t(starts.size() - 2);
    for (std::uint32_t i = 0; i + 1 < cdf_guides; ++i) guide[i] = search_cdf(starts, i * cdf_guide_width, 0, last);
    guide[cdf_guides - 1] = last;
}

/// The item that u falls to.
template <class T>
inline std::uint32_t search_cdf(std::span<const std::uint32_t> starts, std::span<const std::uint32_t> guide, T u) {
    const auto target = std::uint32_t(std::min(u, one_minus_epsilon<T>) * T(cdf_total));
    const std::uint32_t part = target / cdf_guide_width;
    return search_cdf(starts, target, guide[part], guide[part + 1]);
}

/// Density over [0, 1) of the piecewise-constant function in cell i.
template <class T>
inline T cdf_density(std::span<const std::uint32_t> starts, std::size_t i) {
    return T(starts[i + 1] - starts[i]) * (T(starts.size() - 1) / T(cdf_total));
}

/// The cell of [0, 1) cut into n that x lies in.
template <class T>
inline std::uint32_t cell_of(T x, std::size_t n) {
    return x > 0 ? std::uint32_t(std::min(std::size_t(x * T(n)), n - 1)) : 0u;
}

/// Where in [0, 1) u lands that fell to cell i; cell_of() of it is i again, whatever the rounding.
template <class T>
inline T place_in_cell(std::span<const std::uint32_t> starts, std::uint32_t i, T u) {
    const std::size_t n = starts.size() - 1;
    const T share = T(starts[i + 1] - starts[i]);
    const T inside = share > 0 ? (u * T(cdf_total) - T(starts[i])) / share : u;
    T x = std::min((T(i) + std::clamp(inside, T(0), one_minus_epsilon<T>)) / T(n), one_minus_epsilon<T>);
    while (cell_of(x, n) > i) x = next_down(x);
    while (cell_of(x, n) < i) x = next_up(x);
    return x;
}

} // namespace detail

/// A piecewise-constant density over [0, 1) from non-negative weights, one a cell of equal width.
/// Probabilities are whole multiples of 2^-31: `pdf` of a drawn x is the drawn pdf to the bit, the density
/// integrates to 1 exactly, weights of 0 are never drawn and all others can be. Drawing is monotone in
/// u, so that well-spread u stay so.
class Distribution1D {
public:
    /// A point drawn on the line.
    template <class T>
    struct Sample {
        T x;                 ///< in [0, 1), inside the cell
        T pdf;               ///< pdf(x) to the bit; 0 where the distribution is empty
        std::uint32_t index; ///< the cell
    };

    Distribution1D() = default;

    /// Empty where there are no weights or all are 0. Throws lambent::Error on a negative or non-finite
    /// weight, and on more than 2^20 of them. O(n).
    explicit Distribution1D(std::span<const double> weights) { build(weights); }
    explicit Distribution1D(std::span<const float> weights) { build(weights); }

    bool empty() const { return starts_.empty(); }
    std::size_t size() const { return empty() ? 0 : starts_.size() - 1; }

    /// u in [0, 1). O(log n).
    template <std::floating_point T>
    Sample<T> sample(T u) const {
        if (empty()) return {u, 0, 0};
        const std::uint32_t i = detail::search_cdf<T>(starts_, guide_, u);
        return {detail::place_in_cell<T>(starts_, i, u), detail::cdf_density<T>(starts_, i), i};
    }

    /// Density at x in [0, 1).
    template <std::floating_point T>
    T pdf(T x) const {
        return empty() ? T(0) : detail::cdf_density<T>(starts_, detail::cell_of(x, size()));
    }

    /// The chance that `sample` returns this cell.
    double probability(std::size_t index) const {
        return index < size() ? double(starts_[index + 1] - starts_[index]) / double(detail::cdf_total) : 0.0;
    }

private:
    template <class W>
    void build(std::span<const W> weights) {
        require(weights.size() <= (std::size_t(1) << 20), "Distribution1D: more than 2^20 weights");
        starts_.resize(weights.size() + 1);
        if (!detail::make_cdf(weights, std::span(starts_), "Distribution1D")) return starts_.clear();
        guide_.resize(detail::cdf_guides);
        detail::make_cdf_guide(starts_, guide_);
    }
    std::vector<std::uint32_t> starts_, guide_;
};

/// A piecewise-constant density over the unit square from an image of non-negative weights: the row is drawn
/// from the rows' sums by u.y, then the column in that row by u.x. Exact in the same sense as Distribution1D.
/// For an environment map multiply each row by the sine of its centre's polar angle first.
class Distribution2D {
public:
    /// A point drawn in the square.
    template <class T>
    struct Sample {
        Vec2<T> p;           ///< in [0, 1)²: x along a row, y down the rows
        T pdf;               ///< pdf(p) to the bit; 0 where the distribution is empty
        std::uint32_t index; ///< row · width + column
    };

    Distribution2D() = default;

    /// `weights` holds height rows of width values. Empty where all of them are 0 or there are none. Throws
    /// lambent::Error on a negative or non-finite weight, on a size that does not match, and on a side above
    /// 2^20.
    /// cost  O(width · height); keeps 4 bytes a value and 68 a row
    Distribution2D(std::span<const float> weights, std::uint32_t width, std::uint32_t height) {
        require(weights.size() == std::size_t(width) * height, [&] {
            return "Distribution2D: " + std::to_string(weights.size()) + " weights for " +
                   std::to_string(width) + " x " + std::to_string(height);
        });
        require(width <= (1u << 20) && height <= (1u << 20), "Distribution2D: a side is above 2^20");
        width_ = width;
        columns_.resize((std::size_t(width) + 1) * height);
        guides_.resize(std::size_t(detail::cdf_guides) * height);
        std::vector<double> rows(height);
        for (std::uint32_t y = 0; y < height; ++y) {
            const auto row = weights.subspan(std::size_t(y) * width, width);
            const auto starts = std::span(columns_).subspan(y * (std::size_t(width) + 1), width + 1);
            if (detail::make_cdf(row, starts, "Distribution2D"))
                detail::make_cdf_guide(starts, std::span(guides_).subspan(y * std::size_t(detail::cdf_guides), detail::cdf_guides));
            CompensatedSum<double> sum;
            for (const float weight : row) sum.add(weight);
            rows[y] = sum.value();
        }
        rows_ = Distribution1D(std::span<const double>(rows));
        if (rows_.empty()) columns_.clear(), guides_.clear();
    }

    bool empty() const { return rows_.empty(); }
    std::uint32_t width() const { return width_; }
    std::uint32_t height() const { return std::uint32_t(rows_.size()); }

    /// u in [0, 1)². O(log width + log height).
    template <std::floating_point T>
    Sample<T> sample(const Vec2<T>& u) const {
        if (empty()) return {u, 0, 0};
        const auto row = rows_.sample(u.y);
        const auto starts = columns(row.index);
        const auto guide = std::span(guides_).subspan(row.index * std::size_t(detail::cdf_guides), detail::cdf_guides);
        const std::uint32_t column = detail::search_cdf<T>(starts, guide, u.x);
        return {{detail::place_in_cell<T>(starts, column, u.x), row.x},
                row.pdf * detail::cdf_density<T>(starts, column),
                row.index * width_ + column};
    }

    /// Density at p in [0, 1)².
    template <std::floating_point T>
    T pdf(const Vec2<T>& p) const {
        if (empty()) return 0;
        const std::uint32_t row = detail::cell_of(p.y, rows_.size());
        return rows_.pdf(p.y) * detail::cdf_density<T>(columns(row), detail::cell_of(p.x, width_));
    }

private:
    std::span<const std::uint32_t> columns(std::uint32_t row) const {
        const std::size_t stride = std::size_t(width_) + 1;
        return std::span(columns_).subspan(row * stride, stride);
    }
    Distribution1D rows_;
    std::vector<std::uint32_t> columns_, guides_; ///< of each row
    std::uint32_t width_ = 0;
};

} // namespace LAMBENT_ABI
} // namespace lambent
