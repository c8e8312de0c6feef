#include "support/random.hpp"
#include <cmath>
#include <doctest/doctest.h>
#include <lambent/core/frame.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec_packs.hpp>
#include <limits>

using namespace lambent;
using lambent_test::Random;

namespace {

constexpr int width = 8;
using P = Pack<float, width>;

bool near(const Vec3f& a, const Vec3f& b, float size) {
    return max_component(abs(a - b)) <= 4 * std::numeric_limits<float>::epsilon() * size;
}

} // namespace

TEST_CASE("vectors side by side: in each lane what the vector alone gives, to rounding") {
    Random random(31);
    for (int i = 0; i < 2000; ++i) {
        Vec3Column<float, width> a, b;
        for (int lane = 0; lane < width; ++lane) {
            a.set(std::size_t(lane), random.in_box<float>(-1, 1));
            b.set(std::size_t(lane), random.in_box<float>(-1, 1));
        }
        const Vec3Pack<float, width> x = a.load(), y = b.load();
        const P product = dot(x, y), other_order = dot_xzy(x, y), largest = max_component(x);
        const Mask<float, width> mask = x.x < y.x;
        Vec3Column<float, width> units, crossed, chosen, magnitudes, turned;
        units.store(normalize(x));
        crossed.store(robust_cross(x, y));
        chosen.store(select(mask, x, y));
        magnitudes.store(abs(x));
        turned.store(Frame<P>(normalize(x)).to_world(y));
        for (int lane = 0; lane < width; ++lane) {
            const auto k = std::size_t(lane);
            const Vec3f v = a[k], w = b[k];
            REQUIRE(std::abs(product[lane] - dot(v, w)) <= 1e-6f);
            REQUIRE(std::abs(other_order[lane] - dot(v, w)) <= 1e-6f);
            REQUIRE(largest[lane] == max_component(v));
            REQUIRE(near(units[k], normalize(v), 1));
            REQUIRE(near(crossed[k], robust_cross(v, w), 1));
            REQUIRE(chosen[k] == (v.x < w.x ? v : w));
            REQUIRE(magnitudes[k] == abs(v));
            REQUIRE(near(turned[k], Frame<float>(normalize(v)).to_world(w), 4));
        }
    }
}
