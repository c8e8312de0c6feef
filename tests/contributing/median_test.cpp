// contributing: begin
#include <doctest/doctest.h>
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/median.hpp>

using namespace lambent;

TEST_CASE("median: a bright pixel goes, an edge stays where it is") {
    Plane<float, 3> image(8, 5, 0.25f);
    const auto view = image.view();
    for (int y = 0; y < 5; ++y)
        for (int x = 4; x < 8; ++x) view.store(x, y, Vec3f(1, 2, 3));
    const auto clean = image.values();
    view.store(1, 2, Vec3f(1000));
    ThreadExecutor threads(2);
    median<float>(view, view, threads);
    CHECK(image.values() == clean);
    CHECK_THROWS_AS(median<float>(view, Plane<float, 3>(8, 4).view(), threads), Error);
}
// contributing: end
