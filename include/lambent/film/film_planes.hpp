#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/film/pixel_sample.hpp>
#include <cmath>
#include <cstdint>
#include <string>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Which planes a film accumulates besides radiance, its variance and alpha, which it always has: a set, joined by
/// `|`. What is not in it takes no memory. Illumination is derived, and brings what it is derived from.
enum class FilmPlanes : std::uint8_t {
    radiance = 0,
    emission = 1,
    albedo = 2,
    normal = 4,
    position = 8,
    depth = 16,
    material = 32,
    illumination = 64 | emission | albedo,
    features = 127 ///< all of them
};

constexpr FilmPlanes operator|(FilmPlanes a, FilmPlanes b) {
    return FilmPlanes(std::uint8_t(std::uint8_t(a) | std::uint8_t(b)));
}
constexpr FilmPlanes& operator|=(FilmPlanes& a, FilmPlanes b) { return a = a | b; }
/// Whether all of `part` is in `planes`.
constexpr bool contains(FilmPlanes planes, FilmPlanes part) { return (planes | part) == planes; }

/// "radiance, albedo, depth", for messages.
inline std::string describe(FilmPlanes planes) {
    std::string names = "radiance";
    const auto add = [&](FilmPlanes plane, const char* name) {
        if (contains(planes, plane)) names += std::string(", ") + name;
    };
    add(FilmPlanes::emission, "emission");
    add(FilmPlanes::albedo, "albedo");
    add(FilmPlanes::normal, "normal");
    add(FilmPlanes::position, "position");
    add(FilmPlanes::depth, "depth");
    add(FilmPlanes::material, "material");
    add(FilmPlanes::illumination, "illumination");
    return names;
}

namespace detail {

/// a · b + c rounded once where the machine can, twice where it cannot: never at the compiler's choice.
template <class T>
inline T multiply_add(T a, T b, T c) {
    if constexpr (LAMBENT_HAS_FMA) return std::fma(a, b, c);
    else return opaque(a * b) + c;
}

/// Where a pixel's sums stand: radiance, its squared deviations from the mean, the number of hits, then the
/// planes asked for; -1 = not there. Merging is written so that no two compilations of it round differently.
struct FilmLayout {
    static constexpr int radiance = 0, deviation = 3, alpha = 6, most_channels = 20;
    int emission = -1, albedo = -1, normal = -1, position = -1, depth = -1;
    int channels = alpha + 1;

    explicit FilmLayout(FilmPlanes planes) {
        const auto place = [&](FilmPlanes plane, int& offset, int size) {
            if (!contains(planes, plane)) return;
            offset = channels;
            channels += size;
        };
        place(FilmPlanes::emission, emission, 3);
        place(FilmPlanes::albedo, albedo, 3);
        place(FilmPlanes::normal, normal, 3);
        place(FilmPlanes::position, position, 3);
        place(FilmPlanes::depth, depth, 1);
    }

    template <class T>
    void pack(const PixelSample<T>& s, T* out) const {
        const auto put = [&](int offset, const Vec3<T>& v) {
            if (offset < 0) return;
            for (int c = 0; c < 3; ++c) out[offset + c] = v[c];
        };
        put(radiance, s.radiance);
        put(deviation, Vec3<T>(0));
        out[alpha] = s.hit ? T(1) : T(0);
        put(emission, s.emission);
        put(albedo, s.albedo);
        put(normal, s.normal);
        put(position, s.position);
        if (depth >= 0) out[depth] = s.depth;
    }

    /// Adds the sums b to the sums a, each of n samples, n a power of two.
    /// source  Chan, Golub, LeVeque, The American Statistician 37:3 (1983), for the deviations
    template <class T>
    void merge_halves(T* a, const T* b, double n) const {
        const T scale = T(0.5 / n);
        for (int c = 0; c < 3; ++c) {
            const T difference = b[radiance + c] - a[radiance + c];
            a[deviation + c] = multiply_add(difference * difference, scale, a[deviation + c] + b[deviation + c]);
        }
        for (int c = 0; c < 3; ++c) a[radiance + c] += b[radiance + c];
        for (int c = alpha; c < channels; ++c) a[c] += b[c];
    }

    /// Adds the sums b of nb samples to the sums a of na samples, any numbers, in double.
    template <class T>
    void merge(double* a, double na, const T* b, double nb) const {
        const double weight = na * nb / (na + nb);
        for (int c = 0; c < 3; ++c) {
            const double difference = double(b[radiance + c]) / nb - a[radiance + c] / na;
            a[deviation + c] = multiply_add(difference * difference, weight, a[deviation + c] + double(b[deviation + c]));
        }
        for (int c = 0; c < 3; ++c) a[radiance + c] += double(b[radiance + c]);
        for (int c = alpha; c < channels; ++c) a[c] += double(b[c]);
    }
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
