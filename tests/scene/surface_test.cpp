#include "support/random.hpp"
#include <cmath>
#include <doctest/doctest.h>
#include <lambent/scene/surface.hpp>
#include <limits>

using namespace lambent;
using lambent_test::Random;

TEST_CASE_TEMPLATE("leave_surface: off the surface on every axis, however small the error, and hardly farther", T, float,
                   double) {
    Random random(41);
    const T infinite = std::numeric_limits<T>::infinity();
    for (int i = 0; i < 20000; ++i) {
        const Vec3<T> p = random.in_box<T>(-1, 1) * T(std::ldexp(1.0, int(random.below(40)) - 20));
        Vec3<T> n = random.in_box<T>(-1, 1);
        if (i % 3 == 0) n[i % 2] = 0; // across an axis: that coordinate stays
        n = normalize(n);
        const Vec3<T> direction = random.in_box<T>(-1, 1);
        const int bits = int(random.below(std::numeric_limits<T>::digits + 16)); // often far below the rounding
        const T error = max_component(abs(p)) * T(std::ldexp(1.0, -bits));
        const Vec3<T> q = leave_surface(p, Vec3<T>(error), n, direction);
        const T side = dot(direction, n) < 0 ? T(-1) : T(1);
        for (int k = 0; k < 3; ++k) {
            if (n[k] == 0) {
                CHECK(q[k] == p[k]);
                continue;
            }
            const T to = side * n[k] > 0 ? infinite : -infinite;
            CHECK((to > 0 ? q[k] > p[k] : q[k] < p[k]));
            const T ulp = std::abs(std::nextafter(p[k], to) - p[k]), step = T(1.001) * 2 * error * std::abs(n[k]);
            CHECK(std::abs(q[k] - p[k]) <= step + 3 * ulp + std::numeric_limits<T>::epsilon() * step);
        }
    }
}
