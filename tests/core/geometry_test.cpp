#include "support/random.hpp"
#include <doctest/doctest.h>
#include <lambent/core/bounds.hpp>
#include <lambent/core/error.hpp>
#include <lambent/core/frame.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/ray.hpp>
#include <string>
#include <support/statistics.hpp>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

/// Largest deviation of the frame from an orthonormal, right-handed one, beyond what the normal brings
/// itself.
template <class T>
double frame_error(const Vec3<T>& normal) {
    const Frame<T> frame(normal);
    const Vec3d t(frame.tangent), b(frame.bitangent), n(frame.normal);
    double worst = 0;
    for (const double error : {dot(t, b), dot(t, n), dot(b, n), length(t) - 1, length(b) - 1, length(n) - 1,
                               dot(cross(t, b), n) - 1})
        worst = std::max(worst, is_finite(error) ? std::abs(error) : 1e9);
    return worst;
}

} // namespace

TEST_CASE("frame: orthonormal to 3e-7 over 1e7 directions and the neighbours of the poles") {
    constexpr std::uint64_t seed = 11;
    INFO("seed " << seed);
    Random random(seed);
    double worst = 0;
    Vec3f where{0};
    const auto check = [&](const Vec3f& n) {
        const double error = frame_error(n);
        if (error > worst) {
            worst = error;
            where = n;
        }
    };
    for (int i = 0; i < 10000000; ++i) {
        const double z = random.uniform(-1, 1), phi = random.uniform(0, 6.283185307179586),
                     r = std::sqrt(1 - z * z);
        check(Vec3f(Vec3d(r * std::cos(phi), r * std::sin(phi), z)));
    }
    for (int i = 0; i < 1000000; ++i) { // as near a pole as floats get, in every size of tilt
        const double tilt = std::exp(random.uniform(-100, 0)), phi = random.uniform(0, 6.283185307179586);
        for (const double pole : {-1.0, 1.0})
            check(Vec3f(Vec3d(std::sin(tilt) * std::cos(phi), std::sin(tilt) * std::sin(phi),
                              pole * std::cos(tilt))));
    }
    for (const float x : {-1.0f, -0.0f, 0.0f, 1.0f})
        for (const float y : {-1.0f, -0.0f, 0.0f, 1.0f})
            for (const float z : {-1.0f, -0.0f, 0.0f, 1.0f})
                if (std::abs(x) + std::abs(y) + std::abs(z) == 1) check({x, y, z});
    for (float z = -1; z < -0.99999f; z = next_up(z)) check({std::sqrt((1 - z) * (1 + z)), 0, z});
    for (float z = -1e-6f; z < 1e-6f; z += 1e-9f) check({0.6f, 0.8f, z}); // across the seam
    INFO("worst at " << where.x << ' ' << where.y << ' ' << where.z);
    CHECK(worst <= 3e-7);
}

TEST_CASE("frame: there and back; double is as good as double is") {
    Random random(12);
    double worst = 0, worst_double = 0;
    for (int i = 0; i < 100000; ++i) {
        const auto v = [&] {
            return Vec3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        };
        const Vec3d n = normalize(v()), w = v();
        const Frame<float> frame{Vec3f(n)};
        const Vec3f back = frame.to_world(frame.to_local(Vec3f(w)));
        worst = std::max(worst, double(length(back - Vec3f(w))));
        worst_double = std::max(worst_double, frame_error(n));
        REQUIRE(frame.to_local(frame.normal).z == doctest::Approx(1));
        REQUIRE(frame.to_world({0, 0, 1}) == frame.normal);
    }
    CHECK(worst < 1e-6);
    CHECK(worst_double < 1e-15);
}

TEST_CASE_TEMPLATE("bounds: empty, grown, measured", T, float, double) {
    Bounds3<T> box;
    CHECK(box.empty());
    CHECK(box.half_area() == 0);
    box.add(Bounds3<T>{});
    CHECK(box.empty());
    box.add(Vec3<T>(1, 2, 3));
    CHECK(!box.empty());
    CHECK(box.half_area() == 0);
    CHECK(box.center() == Vec3<T>(1, 2, 3));
    box.add(Vec3<T>(-1, 5, 3));
    box.add(Bounds3<T>{});
    CHECK(box.min == Vec3<T>(-1, 2, 3));
    CHECK(box.max == Vec3<T>(1, 5, 3));
    CHECK(box.size() == Vec3<T>(2, 3, 0));
    CHECK(box.half_area() == 6);
    Bounds3<T> other;
    other.add(Vec3<T>(0, 0, 0));
    box.add(other);
    CHECK(box.min == Vec3<T>(-1, 0, 0));
    const T largest = std::numeric_limits<T>::max();
    const Bounds3<T> huge{Vec3<T>(largest / 2), Vec3<T>(largest)};
    CHECK(is_finite(huge.center())); // no overflow on the way
    // A NaN point must not make a box that claims to hold something it does not.
    Bounds3<T> nan;
    nan.add(Vec3<T>(std::numeric_limits<T>::quiet_NaN(), 0, 0));
    CHECK(nan.empty());
    CHECK(nan.half_area() == 0);
}

TEST_CASE("vectors: the small helpers") {
    CHECK(largest_axis(Vec3f(1, -3, 2)) == 1);
    CHECK(largest_axis(Vec3f(-1, 1, 1)) == 0);
    CHECK(largest_axis(Vec3f(0, 1, -2)) == 2);
    CHECK(largest_axis(Vec3f(0, 0, 0)) == 0);
    CHECK(max_component(Vec3f(1, 3, 2)) == 3);
    CHECK(min_component(Vec3f(1, 3, 0.5f)) == 0.5f);
    CHECK(luminance(Vec3d(1, 1, 1)) == doctest::Approx(1));
    CHECK(is_black(Vec3f(0, -0.0f, 0)));
    CHECK(!is_black(Vec3f(0, 0, 1e-30f)));
    CHECK(!Hit<float>{});
    CHECK(bool(Hit<float>{1, 0, 0, 3, 0}));
}

TEST_CASE("error: require says what it is told, and builds its message only on failure") {
    int built = 0;
    const auto message = [&] { return ++built, std::string("width is 0"); };
    require(true, message);
    CHECK(built == 0);
    CHECK_THROWS_WITH_AS(require(false, message), "width is 0", Error);
    CHECK(built == 1);
    CHECK_THROWS_WITH_AS(require(false, "plain"), "plain", Error);
    CHECK_THROWS_AS(fail("x"), std::runtime_error);
}
