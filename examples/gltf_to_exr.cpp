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
#include <lambent/scene/missing.hpp>
// readme: end
#include <cstdio>
#include <cstdlib>
#include <exception>

namespace {

// readme: begin
void gltf_to_exr(const char* in, const char* out, std::uint64_t samples) {
    lambent::ThreadExecutor threads;
    lambent::Scene<float> scene = lambent::load_gltf(in);
    lambent::add_missing_light(scene); // a sky and a camera, where the file has none
    lambent::add_missing_camera(scene);
    // readme: end
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
