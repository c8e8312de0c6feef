// The whole chain: a glTF file in, a denoised EXR with all its layers out.
//   gltf_to_exr IN.gltf OUT.exr [SAMPLES]
// readme: begin
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise.hpp>
#include <lambent/io/exr_frame.hpp>
#include <lambent/io/gltf.hpp>
#include <lambent/render/path.hpp>
#include <lambent/render/render.hpp>
#include <lambent/sampling/sobol.hpp>
// readme: end
#include <lambent/scene/builtin.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>

namespace {

// readme: begin
void gltf_to_exr(const char* in, const char* out, std::uint64_t samples) {
    lambent::ThreadExecutor threads;
    lambent::Scene<float> scene = lambent::load_gltf(in);
    // readme: end
    const auto emissive = [](const lambent::Material& m) { return m.emissive(); };
    if (scene.punctual_lights.empty() && std::none_of(scene.materials.begin(), scene.materials.end(), emissive))
        scene.environment = lambent::soft_sky();
    if (scene.cameras.empty()) scene.cameras.push_back(lambent::framing_camera(scene.bounds(), 640.0 / 360));
    for (const std::string& note : scene.notes) std::fprintf(stderr, "note: %s\n", note.c_str());
    // readme: begin
    const lambent::PreparedScene<float> prepared(scene, threads);
    const lambent::RenderOptions options{.width = 640, .height = 360, .end_sample = samples};
    const auto frame = lambent::render(prepared, scene.cameras[0], lambent::PathIntegrator<>{},
                                       lambent::SobolSampler<float>(1), options, threads);
    const auto clean = lambent::denoise(frame, lambent::denoise_options("best"), threads);
    lambent::write_exr<float>(out, frame, {.denoised = clean.radiance.view()});
}
// readme: end

} // namespace

int main(int argc, char** argv) try {
    const long samples = argc == 4 ? std::atol(argv[3]) : 64;
    if (argc < 3 || argc > 4 || samples < 1) {
        std::fprintf(stderr, "usage: %s IN.gltf OUT.exr [SAMPLES]\n", argv[0]);
        return 2;
    }
    gltf_to_exr(argv[1], argv[2], std::uint64_t(samples));
    return 0;
} catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
}
