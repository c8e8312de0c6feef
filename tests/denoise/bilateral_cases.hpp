#pragma once
#include "support/random.hpp"
#include <cmath>
#include <cstdint>
#include <fstream>
#include <lambent/denoise/cross_bilateral.hpp>
#include <optional>
#include <string>
#include <support/statistics.hpp>
#include <vector>

namespace lambent_test {

using lambent::BilateralForm;
using lambent::CrossBilateralOptions;
using lambent::PixelView;
using lambent::Plane;
using lambent::SecondPassGuide;
using lambent::Vec3;


/// An image and what guides its filter.
template <class T>
struct Planes {
    Plane<T, 3> image, normal, position;
    Plane<T, 1> material;

    Planes(int width, int height)
        : image(width, height), normal(width, height), position(width, height), material(width, height) {}
    int width() const { return image.width(); }
    int height() const { return image.height(); }
};

/// The original's case (seed/cases), before its firefly rule; empty where the files are not there.
template <class T>
std::optional<Plane<T, 3>> seed_plane(const std::string& name, int channels = 3) {
    constexpr int width = 97, height = 73;
    std::ifstream file(std::string(LAMBENT_SHARED_DIR) + "/seed/cases/room_" + name + ".f32", std::ios::binary);
    std::vector<float> values(std::size_t(width * height * channels));
    if (!file.read(reinterpret_cast<char*>(values.data()), std::streamsize(4 * values.size()))) return std::nullopt;
    Plane<T, 3> plane(width, height);
    for (std::size_t i = 0; i < std::size_t(width * height); ++i)
        for (std::size_t c = 0; c < 3; ++c)
            plane.values()[3 * i + c] = T(values[std::size_t(channels) * i + (channels == 3 ? c : 0)]);
    return plane;
}

template <class T>
std::optional<Planes<T>> seed_case() {
    const auto raw = seed_plane<T>("raw"), normal = seed_plane<T>("normal"), position = seed_plane<T>("position"),
               material = seed_plane<T>("material", 1);
    if (!raw || !normal || !position || !material) return std::nullopt;
    Planes<T> planes(raw->width(), raw->height());
    planes.image = *raw;
    planes.normal = *normal;
    planes.position = *position;
    for (std::size_t i = 0; i < planes.material.values().size(); ++i)
        planes.material.values()[i] = material->values()[3 * i];
    return planes;
}

/// Random but lit like a scene: a noisy image of HDR range, unit normals of a few directions, a folded surface,
/// three materials.
template <class T>
Planes<T> random_planes(int width, int height, std::uint64_t seed) {
    Random random(seed);
    Planes<T> planes(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double u = random.uniform();
            const double light = (x + y < width ? 1.0 : 0.3) * (u < 0.05 ? 20.0 : u);
            planes.image.view().store(x, y, Vec3<T>(T(light), T(light * random.uniform()), T(0.5 * light)));
            const double tilt = 0.4 * std::sin(0.3 * x) + (y > height / 2 ? 0.8 : 0.0);
            planes.normal.view().store(x, y, Vec3<T>(T(std::sin(tilt)), 0, T(std::cos(tilt))));
            planes.position.view().store(x, y, Vec3<T>(T(0.05 * x), T(0.05 * y), T(0.2 * std::sin(0.2 * x))));
            planes.material.view().store(x, y, T((x / 7 + y / 9) % 3));
        }
    return planes;
}

/// The original's sigmas. `illumination` is 50 as handed in, or the document's 25.
inline CrossBilateralOptions seed_options(BilateralForm form, SecondPassGuide guide = SecondPassGuide::first_pass,
                                          double illumination = 50) {
    return {.kernel = 65, .sigma_spatial = 10, .sigma_illumination = illumination, .second_pass_factor = 1.0 / 3,
            .form = form, .guide = guide};
}

/// Filters with the four features of the original.
template <class T, class E>
Plane<T, 3> filter(const Planes<T>& planes, const CrossBilateralOptions& options, E& executor,
                   double position = 2, double normal = 0.5, double material = 0.5) {
    Plane<T, 3> out(planes.width(), planes.height());
    lambent::cross_bilateral<T>(planes.image.view(), out.view(), options, executor,
                                lambent::DistanceFeature<T>(planes.position.view(), position),
                                lambent::NormalFeature<T>(planes.normal.view(), normal),
                                lambent::IdentityFeature<T>(planes.material.view(), material));
    return out;
}
template <class T>
Plane<T, 3> filter(const Planes<T>& planes, const CrossBilateralOptions& options, double position = 2,
                   double normal = 0.5, double material = 0.5) {
    lambent::SerialExecutor serial;
    return filter(planes, options, serial, position, normal, material);
}

/// The largest difference of two planes, absolute or relative to `scale` of each value, whichever is smaller.
template <class A, class B>
double largest_difference(const A& a, const B& b) {
    double largest = 0;
    for (std::size_t i = 0; i < a.values().size(); ++i)
        largest = std::max(largest, std::abs(double(a.values()[i]) - double(b.values()[i])));
    return largest;
}
template <class A, class B>
double largest_relative_difference(const A& a, const B& b) {
    double largest = 0;
    for (std::size_t i = 0; i < a.values().size(); ++i) {
        const double x = double(a.values()[i]), y = double(b.values()[i]);
        largest = std::max(largest, std::abs(x - y) / std::max(1e-3, std::abs(y)));
    }
    return largest;
}

inline constexpr BilateralForm all_forms[] = {BilateralForm::naive_2d, BilateralForm::reuse_2d,
                                              BilateralForm::separable, BilateralForm::separable_reuse};

} // namespace lambent_test
