#include "support/random.hpp"
#include <cmath>
#include <doctest/doctest.h>
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec_lanes.hpp>

using namespace lambent;
using lambent_test::Random;

TEST_CASE_TEMPLATE("vectors in lanes: there and back, products and cross product as of vectors", T, float, double) {
    Random random(31);
    const auto vector = [&] {
        const T size = T(std::ldexp(1.0, int(random.uniform() * 40) - 20));
        const auto number = [&] { return size * T(2 * random.uniform() - 1); };
        return Vec3<T>(number(), number(), number());
    };
    for (int i = 0; i < 20000; ++i) {
        const Vec3<T> a = vector();
        const Vec3<T> b = i % 2 == 0 ? vector() : a * T(random.uniform()) + vector() * T(1e-4); // nearly parallel
        CHECK(to_vec(to_lanes(a)) == a);
        CHECK(to_lanes(a)[3] == 0);
        const T size = std::abs(a.x * b.x) + std::abs(a.y * b.y) + std::abs(a.z * b.z);
        CHECK(std::abs(dot(to_lanes(a), to_lanes(b)) - dot(a, b)) <= gamma_bound<T>(8) * size);
        const Lanes3<T> n = robust_cross(to_lanes(a), to_lanes(b));
        CHECK(n[3] == 0);
        // Exact to little more than one rounding, however the products cancel: against twice the precision.
        using Wide = long double;
        const auto exact = [](T p, T q, T r, T s) { return Wide(p) * Wide(q) - Wide(r) * Wide(s); };
        const Wide z[3] = {exact(a.y, b.z, a.z, b.y), exact(a.z, b.x, a.x, b.z), exact(a.x, b.y, a.y, b.x)};
        const Wide slack = sizeof(T) == 4 ? 0 : Wide(0x1p-63) * Wide(size); // long double is not twice a double
        for (int k = 0; k < 3; ++k)
            CHECK(std::abs(Wide(n[k]) - z[k]) <= Wide(2 * gamma_bound<T>(2)) * std::abs(z[k]) + slack);
    }
}
