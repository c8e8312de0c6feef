#pragma once
#include <lambent/core/parallel.hpp>
#include <lambent/render/path.hpp>
#include <lambent/sampling/sobol.hpp>
#include <lambent/scene/builtin.hpp>
#include <lambent/scene/camera.hpp>
#include <lambent/scene/prepared_scene.hpp>
#include <support/statistics.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

/// Means of images with their standard errors, in double and without a film, and scenes to take them of.
namespace lambent_test {

using namespace lambent;

struct ImageSize {
    int width = 16, height = 16;
};

/// Image mean of one way to render.
struct Estimate {
    Vec3d mean{0}, error{0}; ///< a channel each; error = standard error of the mean
    double grey = 0, grey_error = 0; ///< mean of the channels
    double rays = 0;
    bool finite = true;

    double z(double expected) const { return score(grey - expected, grey_error); }
    double z(const Estimate& other) const { return score(grey - other.grey, std::hypot(grey_error, other.grey_error)); }
    double relative_error() const { return grey_error / grey; }

private:
    /// Rounding of float radiance counts as noise of 2e-5.
    double score(double difference, double noise) const { return difference / std::hypot(noise, 2e-5 * grey); }
};

/// The mean over an image by `seeds` renders of `spp` samples; `sampler_of(seed)` makes the sampler. The error is taken
/// from the spread of each pixel over the seeds, so the samples of a pixel may depend on each other, and those of
/// different seeds do not. It also takes pixels of one seed to be independent. Sobol's are not, which share the points
/// of their tile of 8 x 8: for them the error leaves out what pixels have in common. seeds.hpp has errors that do
/// without this.
template <class S, class I, class MakeSampler>
Estimate image_mean(const S& scene, const Camera& camera, ImageSize size, const I& integrator, int spp, int seeds,
                    MakeSampler&& sampler_of) {
    using T = typename S::Scalar;
    Estimate e;
    const CameraRays<T> rays(camera, size.width, size.height, scene.scene().origin);
    const std::size_t pixels = std::size_t(size.width) * std::size_t(size.height);
    std::vector<std::array<Moments, 4>> moments(pixels);
    RayCounts counts;
    for (int seed = 0; seed < seeds; ++seed) {
        const auto sampler = sampler_of(std::uint32_t(seed));
        for (int y = 0; y < size.height; ++y)
            for (int x = 0; x < size.width; ++x) {
                Vec3d sum(0);
                for (int i = 0; i < spp; ++i) {
                    const auto stream = sampler.at(std::uint32_t(x), std::uint32_t(y), std::uint32_t(i));
                    const auto jitter = stream.get_2d(dimensions::pixel);
                    const auto sample =
                        integrator.sample(scene, rays.ray(T(x) + T(jitter.x), T(y) + T(jitter.y)), stream, counts);
                    e.finite &= is_finite(sample.radiance) && min_component(sample.radiance) >= 0;
                    sum += Vec3d(sample.radiance);
                }
                auto& m = moments[std::size_t(y * size.width + x)];
                for (int c = 0; c < 3; ++c) m[std::size_t(c)].add(sum[c] / spp);
                m[3].add((sum.x + sum.y + sum.z) / (3.0 * spp));
            }
    }
    std::array<double, 4> mean{}, variance{};
    for (const auto& m : moments)
        for (std::size_t c = 0; c < 4; ++c) {
            mean[c] += m[c].mean() / double(pixels);
            variance[c] += m[c].variance() / double(seeds) / double(pixels * pixels);
        }
    e.mean = {mean[0], mean[1], mean[2]};
    e.error = {std::sqrt(variance[0]), std::sqrt(variance[1]), std::sqrt(variance[2])};
    e.grey = mean[3];
    e.grey_error = std::sqrt(variance[3]);
    e.rays = double(counts.closest + counts.shadow);
    return e;
}

/// The same with the default sampler and few seeds.
template <class S, class I>
Estimate image_mean(const S& scene, const Camera& camera, ImageSize size, const I& integrator, int samples) {
    constexpr int seeds = 4;
    return image_mean(scene, camera, size, integrator, samples / seeds, seeds,
                      [](std::uint32_t seed) { return SobolSampler<typename S::Scalar>(seed); });
}

/// Without the light that is seen directly, which every strategy has from the same hit.
template <class I>
struct Reflected {
    I inner;
    template <class S, class Stream>
    auto sample(const S& scene, const Ray<float>& ray, const Stream& stream, RayCounts& counts) const {
        auto s = inner.sample(scene, ray, stream, counts);
        s.radiance = max(s.radiance - s.emission, Vec3f(0));
        return s;
    }
};
template <class I>
Reflected(I) -> Reflected<I>;

inline std::uint32_t add_material(Scene<float>& scene, const Vec3f& color, const Vec3f& emission = Vec3f(0)) {
    Material m;
    m.base_color = color;
    m.emission = emission;
    scene.materials.push_back(m);
    return std::uint32_t(scene.materials.size() - 1);
}

/// Unit icosphere of 20 · 4^level triangles, moved and scaled; seen from the front outside, or inside.
inline void add_icosphere(Scene<float>& scene, const Vec3d& center, double radius, int level, bool inside,
                          std::uint32_t material) {
    const double g = (1 + std::sqrt(5.0)) / 2;
    std::vector<Vec3d> points = {{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0}, {0, -1, g}, {0, 1, g},
                                 {0, -1, -g}, {0, 1, -g}, {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
    std::vector<UVec3> faces = {{0, 11, 5}, {0, 5, 1}, {0, 1, 7}, {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                                {11, 10, 2}, {10, 7, 6}, {7, 1, 8}, {3, 9, 4}, {3, 4, 2}, {3, 2, 6}, {3, 6, 8},
                                {3, 8, 9}, {4, 9, 5}, {2, 4, 11}, {6, 2, 10}, {8, 6, 7}, {9, 8, 1}};
    for (int i = 0; i < level; ++i) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [place, fresh] = middles.try_emplace(std::minmax(a, b), std::uint32_t(points.size()));
            if (fresh) points.push_back(points[a] + points[b]);
            points.back() = normalize(points.back());
            return place->second;
        };
        for (Vec3d& p : points) p = normalize(p);
        std::vector<UVec3> finer;
        for (const UVec3& f : faces) {
            const std::uint32_t a = middle(f.x, f.y), b = middle(f.y, f.z), c = middle(f.z, f.x);
            for (const UVec3& t : {UVec3{f.x, a, c}, UVec3{f.y, b, a}, UVec3{f.z, c, b}, UVec3{a, b, c}})
                finer.push_back(t);
        }
        faces = std::move(finer);
    }
    const auto first = std::uint32_t(scene.positions.size());
    for (const Vec3d& p : points) scene.positions.push_back(Vec3f(center + radius * normalize(p)));
    for (UVec3 f : faces) {
        if (inside) std::swap(f.y, f.z);
        scene.triangles.push_back(f + UVec3(first));
        scene.triangle_materials.push_back(material);
    }
}

/// A closed box seen from inside, [0, 1]³ unless scaled.
inline void add_room(Scene<float>& scene, double size, std::uint32_t material) {
    lambent::detail::add_box(scene, Vec3d(0), Vec3d(size), 0, lambent::detail::BoxFront::inside,
                             {material, material, material, material, material, material});
}

} // namespace lambent_test
