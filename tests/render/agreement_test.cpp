#include <lambent/sampling/independent.hpp>
#include <lambent/sampling/stratified.hpp>
#include <render/transport.hpp>
#include <doctest/doctest.h>
#include <string>
#include <utility>
#include <vector>

using namespace lambent_test;

/// However light is looked for, paths are ended and numbers are drawn: the mean is one and the same.
namespace {

using Named = std::pair<std::string, Estimate>;

template <class MakeSampler>
void estimate_all(std::vector<Named>& all, const PreparedScene<float>& scene, const std::string& sampler, MakeSampler&& sampler_of) {
    const Camera& camera = scene.scene().cameras[0];
    constexpr ImageSize size{16, 16};
    constexpr PathOptions roulette{}, none{64, PathOptions::unlimited};
    constexpr int spp = 16, seeds = 4;
    const auto add = [&](const char* name, const auto& integrator, int more_seeds) {
        all.emplace_back(sampler + ", " + name, image_mean(scene, camera, size, Reflected{integrator}, spp, more_seeds * seeds, sampler_of));
    };
    add("both", PathIntegrator<>{roulette}, 1);
    add("both, no roulette", PathIntegrator<>{none}, 1);
    add("light", PathIntegrator<PathStrategy::light>{roulette}, 1);
    add("bsdf", PathIntegrator<PathStrategy::bsdf>{roulette}, 4);
}

void check_agreement(const Scene<float>& scene, double precision) {
    SerialExecutor serial;
    const PreparedScene<float> prepared(scene, serial);
    std::vector<Named> all;
    estimate_all(all, prepared, "sobol", [](std::uint32_t seed) { return SobolSampler<float>(seed); });
    estimate_all(all, prepared, "stratified", [](std::uint32_t seed) { return StratifiedSampler<float>(seed, 16); });
    estimate_all(all, prepared, "independent", [](std::uint32_t seed) { return IndependentSampler<float>(seed); });
    for (std::size_t i = 0; i < all.size(); ++i) {
        const auto& name = all[i].first; // clang 14 captures no structured bindings
        const auto& e = all[i].second;
        INFO(name << ": " << e.grey << " +- " << e.grey_error);
        CHECK(e.finite);
        CHECK(e.grey_error < (name.find("bsdf") == std::string::npos ? 0.25 : 1) * precision * e.grey);
        for (std::size_t j = 0; j < i; ++j) {
            INFO(all[j].first << ": " << all[j].second.grey << " +- " << all[j].second.grey_error);
            CHECK(std::abs(e.z(all[j].second)) < max_z);
        }
    }
}

} // namespace

TEST_CASE("S6: strategies, roulette and samplers agree in the mean: builtin:cornell") {
    check_agreement(cornell_scene<float>(), 0.05);
}

TEST_CASE("S3: strategies, roulette and samplers agree in the mean: builtin:room with 1, 2 and 8 lights") {
    for (const int lights : {1, 2, 8}) {
        CAPTURE(lights);
        check_agreement(room_scene<float>(lights), 0.1);
    }
}
