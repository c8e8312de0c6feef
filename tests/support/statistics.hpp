#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

/// Statistics that tests decide by, in double. Seeds are fixed, so a verdict never changes from run to run:
/// the confidence says how likely a right program was to fail when the test was first written.
namespace lambent_test {

inline constexpr double infinity = std::numeric_limits<double>::infinity();

/// Bound for |z|: a right program exceeds it with probability 6.3e-5.
inline constexpr double max_z = 4.0;
/// Bound for chi-square's p: a right program falls below it with probability 0.001.
inline constexpr double min_p = 0.001;

/// Regularised upper incomplete gamma function Q(a, x), a > 0, x >= 0, to about 1e-12.
/// Series for P below a + 1, Lentz's continued fraction for Q above.
inline double gamma_q(double a, double x) {
    if (!(x > 0)) return 1;
    const double front = std::exp(a * std::log(x) - x - std::lgamma(a));
    if (x < a + 1) {
        double term = 1 / a, sum = term;
        for (double k = a + 1; term > sum * 1e-15; ++k) sum += term *= x / k;
        return 1 - front * sum;
    }
    double b = x + 1 - a, c = 1e300, d = 1 / b, h = d;
    for (double i = 1; i < 1e5; ++i) {
        const double numerator = -i * (i - a);
        b += 2;
        d = 1 / (numerator * d + b);
        c = b + numerator / c;
        h *= d * c;
        if (std::abs(d * c - 1) < 1e-15) break;
    }
    return front * h;
}

/// Chance that a chi-square variable of that many degrees of freedom is at least `statistic`.
inline double chi_square_p(double statistic, double degrees_of_freedom) {
    return gamma_q(degrees_of_freedom / 2, statistic / 2);
}

/// Pearson's test of counts against expected counts that sum to the same total. Bins that expect fewer than 5
/// are pooled. 0 where something fell into what expects nothing.
inline double chi_square_test(std::span<const double> observed, std::span<const double> expected) {
    double statistic = 0, pooled_observed = 0, pooled_expected = 0;
    int bins = 0;
    const auto add = [&](double o, double e) {
        statistic += (o - e) * (o - e) / e;
        ++bins;
    };
    for (std::size_t i = 0; i < observed.size(); ++i) {
        if (expected[i] <= 0 && observed[i] > 0) return 0;
        if (expected[i] >= 5) {
            add(observed[i], expected[i]);
        } else {
            pooled_observed += observed[i];
            pooled_expected += expected[i];
        }
    }
    if (pooled_expected >= 5) add(pooled_observed, pooled_expected);
    return bins > 1 ? chi_square_p(statistic, bins - 1) : 1;
}

/// The same against equal chances.
inline double chi_square_uniform(std::span<const double> observed) {
    double total = 0;
    for (const double o : observed) total += o;
    const std::vector<double> expected(observed.size(), total / double(observed.size()));
    return chi_square_test(observed, expected);
}

/// Running mean and variance (Welford).
class Moments {
public:
    void add(double x) {
        ++count_;
        const double delta = x - mean_;
        mean_ += delta / double(count_);
        squares_ += delta * (x - mean_);
    }
    std::size_t count() const { return count_; }
    double mean() const { return mean_; }
    double variance() const { return count_ > 1 ? squares_ / double(count_ - 1) : 0; } ///< of one value
    double standard_error() const { return std::sqrt(variance() / double(count_)); }   ///< of the mean

    /// How many standard errors the mean lies above `expected`; values must be independent of one another.
    double z(double expected) const { return z_of(mean_ - expected, standard_error()); }

    /// The same for the difference of two means.
    double z(const Moments& other) const {
        return z_of(mean_ - other.mean_, std::hypot(standard_error(), other.standard_error()));
    }

private:
    static double z_of(double difference, double error) {
        if (error > 0) return difference / error;
        return difference == 0 ? 0 : std::numeric_limits<double>::infinity();
    }
    std::size_t count_ = 0;
    double mean_ = 0, squares_ = 0;
};

/// Slope of the least-squares line through (x, y): a rate of convergence where both are logarithms.
inline double slope(std::span<const double> x, std::span<const double> y) {
    double mx = 0, my = 0, xx = 0, xy = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        mx += x[i] / double(x.size());
        my += y[i] / double(x.size());
    }
    for (std::size_t i = 0; i < x.size(); ++i) {
        xx += (x[i] - mx) * (x[i] - mx);
        xy += (x[i] - mx) * (y[i] - my);
    }
    return xy / xx;
}

} // namespace lambent_test
