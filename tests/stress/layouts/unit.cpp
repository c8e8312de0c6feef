// One unit of the program of main.cpp; LAMBENT_UNIT names its function.
#include "stress/layouts/report.hpp"
#include <bit>
#include <cstddef>
#include <lambent/bvh/bvh.hpp>
#include <lambent/denoise/cross_bilateral.hpp>
#include <lambent/film/film.hpp>
#include <lambent/film/film_pass.hpp>
#include <lambent/sampling/sobol.hpp>
#include <lambent/sampling/stratified.hpp>

#define LAMBENT_TEXT_(x) #x
#define LAMBENT_TEXT(x) LAMBENT_TEXT_(x)

using namespace lambent;

namespace {

// Helpers of the tests are not in the library's namespace: a copy of each unit's own.
struct Numbers {
    std::uint32_t state = 1;
    float next() {
        state = state * 747796405u + 2891336453u;
        return float(state >> 8) * 0x1p-24f;
    }
    Vec3f in_box(float low, float high) {
        const float x = next(), y = next(), z = next();
        return Vec3f(low) + Vec3f(x, y, z) * (high - low);
    }
};

void work_on_samples(LayoutReport& report) {
    const SobolSampler<float> sobol(7);
    const StratifiedSampler<float> stratified(7, 30);
    FilmPass<float> pass(1, 1, FilmPlanes::features, 0, 1000);
    {
        FilmPass<float>::Pixel pixel(pass, 0, 0);
        for (std::uint32_t i = 0; i < 1000; ++i) {
            const Vec2f a = sobol.at(3, i % 9, i).get_2d(i % 5), b = stratified.at(i % 7, 2, i % 30).get_2d(i % 4);
            for (const float u : {a.x, a.y, b.x, b.y}) report.points.push_back(std::bit_cast<std::uint32_t>(u));
            PixelSample<float> s;
            s.radiance = Vec3f(a.x, a.y * 100, b.x * b.x);
            s.hit = true;
            s.position = Vec3f(b.y);
            pixel.add(s);
        }
    }
    const Film<float> film = pass.finish();
    for (const auto& block : film.blocks()) report.film.insert(report.film.end(), block.sums.begin(), block.sums.end());
}

/// All directions with components of -1, 0 and 1 and zeros of either sign, from a cube's planes, edges and corners:
/// their distances are whole numbers.
void work_on_slabs(LayoutReport& report) {
    std::vector<Vec3f> vertices;
    std::vector<UVec3> faces;
    for (int i = 0; i < 8; ++i)
        vertices.push_back(Vec3f((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1) +
                           Vec3f(1, -2, 0));
    for (const auto& q :
         {UVec3(0, 4, 6), UVec3(0, 6, 2), UVec3(5, 1, 3), UVec3(5, 3, 7), UVec3(0, 1, 5), UVec3(0, 5, 4),
          UVec3(6, 7, 3), UVec3(6, 3, 2), UVec3(1, 0, 2), UVec3(1, 2, 3), UVec3(4, 5, 7), UVec3(4, 7, 6)})
        faces.push_back(q);
    const Bvh bvh = Bvh::build(triangles(vertices, faces));
    for (int i = 0; i < 729; ++i)
        for (const float zero : {0.0f, -0.0f}) {
            int digits = i;
            float c[6];
            for (float& x : c) {
                x = float(digits % 3 - 1);
                digits /= 3;
            }
            for (int k = 3; k < 6; ++k) c[k] = c[k] == 0 ? zero : c[k];
            const Rayf ray{Vec3f(1, -2, 0) + Vec3f(c[0], c[1], c[2]), {c[3], c[4], c[5]}};
            report.slabs.push_back(std::bit_cast<std::uint32_t>(bvh.intersect(ray).t));
            report.slabs.push_back(std::uint32_t(bvh.occluded(ray)));
        }
}

void work_on_rays(LayoutReport& report) {
    Numbers numbers;
    std::vector<Vec3f> vertices;
    std::vector<UVec3> faces;
    for (std::uint32_t i = 0; i < 5000; ++i) {
        const Vec3f center = numbers.in_box(-1, 1);
        for (int k = 0; k < 3; ++k) vertices.push_back(center + numbers.in_box(-0.05f, 0.05f));
        faces.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    const Bvh bvh = Bvh::build(triangles(vertices, faces));
    for (int i = 0; i < 20000; ++i) {
        const Vec3f from = numbers.in_box(-1, 1);
        const Hit<float> hit = bvh.intersect(Rayf{from, numbers.in_box(-1, 1)});
        report.primitives.push_back(hit ? hit.primitive : no_primitive);
        report.t.push_back(hit ? hit.t : 0);
    }
}

void work_on_images(LayoutReport& report) {
    Numbers numbers;
    constexpr int width = 75, height = 53;
    Plane<float, 3> image(width, height), guide(width, height), out(width, height);
    for (float& v : image.values()) v = numbers.next() * (numbers.next() < 0.05f ? 20.0f : 1.0f);
    for (float& v : guide.values()) v = numbers.next();
    SerialExecutor serial;
    for (const auto form :
         {BilateralForm::separable, BilateralForm::separable_reuse, BilateralForm::naive_2d, BilateralForm::reuse_2d}) {
        cross_bilateral<float>(image.view(), out.view(), {.kernel = 17, .sigma_illumination = 0.7, .form = form},
                               serial, DistanceFeature<float>(guide.view(), 0.5));
        auto& to =
            form == BilateralForm::separable || form == BilateralForm::separable_reuse ? report.lines : report.windows;
        to.insert(to.end(), out.values().begin(), out.values().end());
    }
}

} // namespace

LayoutReport LAMBENT_UNIT() {
    LayoutReport report{
        LAMBENT_TEXT(LAMBENT_ABI), native_width<float>, LAMBENT_HAS_FMA != 0, {}, {}, {}, {}, {}, {}, {}};
    work_on_samples(report);
    work_on_slabs(report);
    work_on_rays(report);
    work_on_images(report);
    return report;
}
