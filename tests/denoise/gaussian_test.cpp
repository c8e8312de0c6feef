#include <cmath>
#include <doctest/doctest.h>
#include <lambent/denoise/gaussian.hpp>
#include <limits>
#include <numeric>

using namespace lambent;

TEST_CASE_TEMPLATE("F2: Gaussian kernels of any odd size are symmetric, follow the formula and sum to 1", T, float, double) {
    for (const int size : {1, 3, 5, 33, 65, 129})
        for (const double sigma : {0.0, 0.7, 10.0, 1e4}) {
            CAPTURE(size);
            CAPTURE(sigma);
            const std::vector<T> kernel = gaussian_kernel<T>(size, sigma);
            REQUIRE(kernel.size() == std::size_t(size));
            const double s = sigma > 0 ? sigma : size / 6.4;
            double sum = 0;
            for (int i = 0; i < size; ++i) {
                const double x = i - size / 2;
                CHECK(double(kernel[std::size_t(i)]) / double(kernel[std::size_t(size / 2)]) ==
                      doctest::Approx(std::exp(-x * x / (2 * s * s))).epsilon(1e-6));
                CHECK(kernel[std::size_t(i)] == kernel[std::size_t(size - 1 - i)]);
                sum += double(kernel[std::size_t(i)]);
            }
            CHECK(sum == doctest::Approx(1).epsilon(1e-6));
        }
    const std::vector<T> box = gaussian_kernel<T>(5, std::numeric_limits<double>::infinity());
    for (const T tap : box) CHECK(double(tap) == doctest::Approx(0.2));
}

TEST_CASE("F2: even, zero and negative kernel sizes and negative sigmas are refused") {
    for (const int size : {0, 2, 64, -1, -65}) CHECK_THROWS_AS(gaussian_kernel<float>(size), Error);
    CHECK_THROWS_AS(gaussian_kernel<float>(5, -1.0), Error);
    CHECK_THROWS_AS(gaussian_kernel<float>(5, std::numeric_limits<double>::quiet_NaN()), Error);
}
