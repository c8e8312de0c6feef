// contributing: begin
#include <doctest/doctest.h>
#include <lambent/material/lambert.hpp>
#include <lambent/material/oren_nayar.hpp>

using namespace lambent;

TEST_CASE("OrenNayar: smooth it is Lambert's, rough it sends light back to where it comes from") {
    const Vec3d grey(0.5), wo = normalize(Vec3d(1, 0, 0.3)), back = wo, forth(-wo.x, 0, wo.z);
    const OrenNayar<double> smooth{grey, 0}, rough{grey, 0.5};
    CHECK(smooth.eval(wo, forth).x == doctest::Approx(Lambert<double>{grey}.eval(wo, forth).x));
    CHECK(rough.eval(wo, back).x > 1.5 * rough.eval(wo, forth).x);
    CHECK(rough.eval(wo, back) == rough.eval(back, wo));
    const auto drawn = rough.sample(wo, 0, {0.3, 0.7});
    CHECK(drawn.weight.x == doctest::Approx(rough.eval(wo, drawn.wi).x * drawn.wi.z / drawn.pdf));
}
// contributing: end
