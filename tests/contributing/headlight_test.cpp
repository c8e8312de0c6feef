// contributing: begin
#include <doctest/doctest.h>
#include <lambent/core/parallel.hpp>
#include <lambent/render/headlight.hpp>
#include <lambent/render/render.hpp>
#include <lambent/sampling/independent.hpp>
#include <lambent/scene/builtin.hpp>
#include <lambent/scene/prepared_scene.hpp>

using namespace lambent;

TEST_CASE("HeadlightIntegrator: what faces the viewer shows its albedo, nothing more than that") {
    const Scene<float> scene = cornell_scene<float>();
    ThreadExecutor threads(2);
    const PreparedScene<float> prepared(scene, threads);
    const auto frame = render(prepared, scene.cameras[0], HeadlightIntegrator{}, IndependentSampler<float>(1),
                              {.width = 16, .height = 16, .end_sample = 1}, threads);
    for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 16; ++x) CHECK(frame.radiance.load(x, y).x <= frame.albedo.load(x, y).x);
    CHECK(frame.radiance.load(8, 1).x > 0); // the ceiling is seen aslant
}
// contributing: end
