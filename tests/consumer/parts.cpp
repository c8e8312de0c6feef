// A tree and a denoiser in a program that has nothing else of ours: compiled with the one-file edition, and without
// exceptions and run-time types, where an error handler takes a throw's place.
#if defined(CONSUMER_SINGLE)
#include "lambent_single.hpp"
#else
#include <lambent/bvh/bvh.hpp>
#include <lambent/core/parallel.hpp>
#include <lambent/denoise/denoise.hpp>
#include <lambent/film/film.hpp>
#endif
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#if !defined(CONSUMER_SINGLE) && (defined(__cpp_exceptions) || defined(__cpp_rtti))
#error "to be compiled with -fno-exceptions -fno-rtti"
#endif

int main() {
    const std::vector<lambent::Vec3f> vertices{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const std::vector<unsigned> faces{0, 1, 2};
    const auto mesh = lambent::triangles(vertices, faces);
    lambent::ThreadExecutor threads(2);
    const lambent::Bvh bvh = lambent::Bvh::build(mesh, {}, threads);
    const lambent::Rayf ray{.origin = {0.25f, 0.25f, -2}, .direction = {0, 0, 1}};
    if (bvh.intersect(ray).t != 2 || !bvh.occluded(ray)) return 1;

    lambent::PixelData<float> frame;
    frame.width = frame.height = 16;
    frame.radiance.allocate(16, 16, 0.5f);
    const auto clean = lambent::denoise(frame, lambent::denoise_options("balanced"), threads);
    const float middle = clean.radiance.load(8, 8).x;
    if (!(middle > 0.499f && middle < 0.501f)) return 2;

#if defined(CONSUMER_SINGLE)
    try {
        lambent::denoise_options("no such method");
    } catch (const lambent::Error&) {
        return 0;
    }
#else
    lambent::error_handler() = [](const std::string& message) {
        std::exit(message.find("no such method") == std::string::npos ? 3 : 0);
    };
    lambent::denoise_options("no such method");
#endif
    return 4;
}
