#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/film/pixel_sample.hpp>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Which planes a film accumulates besides radiance, its variance and alpha, which it always has: a set, joined by
/// `|`. What is not in it takes no memory. Illumination is derived, and brings what it is derived from.
enum class FilmPlanes : std::uint16_t {
    radiance = 0,
    emission = 1,
    albedo = 2,
    normal = 4,
    position = 8,
    depth = 16,
    material = 32,
    illumination = 64 | emission | albedo,
    features = 127,                                  ///< all of the above
    light_moments = 128,                             ///< direct and indirect light; moments of their roots, halves
    feature_moments = 256 | albedo | normal | depth, ///< their variances
    halves = 512 | emission | albedo,                ///< how far the means of each half of the samples are apart
    statistics = features | light_moments | feature_moments | halves ///< what denoisers can use: all planes
};

/// The planes of both.
constexpr FilmPlanes operator|(FilmPlanes a, FilmPlanes b) {
    return FilmPlanes(std::uint16_t(std::uint16_t(a) | std::uint16_t(b)));
}
/// Adds the planes of b.
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
    add(FilmPlanes::light_moments, "light moments");
    add(FilmPlanes::feature_moments, "feature moments");
    add(FilmPlanes::halves, "halves");
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
    static constexpr int radiance = 0, deviation = 3, alpha = 6, most_channels = 50;
    int emission = -1, albedo = -1, normal = -1, position = -1, depth = -1;
    int direct = -1, indirect = -1, root_direct = -1, root_indirect = -1;
    int channels = alpha + 1;

    int halves = -1, root_halves = -1; ///< of radiance; of root_direct and root_indirect, each summed over its channels

    int sums_end = 0; ///< channels from alpha to here are sums, those behind are deviations and halves

    /// Sums of so many channels and the squared deviations that belong to them.
    struct Moment {
        int sum, deviation, size;
    };
    std::array<Moment, 5> moments{}; ///< besides radiance's, which every film has
    std::size_t moment_count = 0;

    explicit FilmLayout(FilmPlanes planes) {
        const auto take = [&](int size) {
            const int offset = channels;
            channels += size;
            return offset;
        };
        const auto place = [&](FilmPlanes plane, int& offset, int size) {
            if (contains(planes, plane)) offset = take(size);
        };
        const auto place_deviation = [&](int sum, int size) { moments[moment_count++] = {sum, take(size), size}; };
        place(FilmPlanes::emission, emission, 3);
        place(FilmPlanes::albedo, albedo, 3);
        place(FilmPlanes::normal, normal, 3);
        place(FilmPlanes::position, position, 3);
        place(FilmPlanes::depth, depth, 1);
        place(FilmPlanes::light_moments, direct, 3);
        place(FilmPlanes::light_moments, indirect, 3);
        place(FilmPlanes::light_moments, root_direct, 3);
        place(FilmPlanes::light_moments, root_indirect, 3);
        sums_end = channels;
        if (contains(planes, FilmPlanes::light_moments)) {
            place_deviation(root_direct, 3);
            place_deviation(root_indirect, 3);
        }
        if (contains(planes, FilmPlanes::feature_moments)) {
            place_deviation(albedo, 3);
            place_deviation(normal, 3);
            place_deviation(depth, 1);
        }
        place(FilmPlanes::halves, halves, 3);
        place(FilmPlanes::light_moments, root_halves, 2);
    }

    /// Where the deviations of these sums stand.
    int deviation_of(int sum) const {
        for (std::size_t i = 0; i < moment_count; ++i)
            if (moments[i].sum == sum) return moments[i].deviation;
        return -1;
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
        if (direct >= 0) {
            put(direct, s.direct);
            put(indirect, s.indirect);
            put(root_direct, sqrt(max(s.direct, Vec3<T>(0))));
            put(root_indirect, sqrt(max(s.indirect, Vec3<T>(0))));
        }
        for (int c = sums_end; c < channels; ++c) out[c] = 0;
    }

    /// Calls f(sum, deviation) for every channel that has both.
    template <class F>
    void for_each_moment(F&& f) const {
        for (int c = 0; c < 3; ++c) f(radiance + c, deviation + c);
        for (std::size_t i = 0; i < moment_count; ++i)
            for (int c = 0; c < moments[i].size; ++c) f(moments[i].sum + c, moments[i].deviation + c);
    }
    /// Calls f with every channel that is a sum.
    template <class F>
    void for_each_sum(F&& f) const {
        for (int c = 0; c < 3; ++c) f(radiance + c);
        for (int c = alpha; c < sums_end; ++c) f(c);
    }

    /// Adds the sums b to the sums a, each of n samples, n a power of two.
    /// source  Chan, Golub, LeVeque, The American Statistician 37:3 (1983), for the deviations
    template <class T>
    void merge_halves(T* a, const T* b, double n) const {
        const T scale = T(0.5 / n);
        const auto apart = [&](int sum) { return b[sum] - a[sum]; };
        for_each_moment([&](int sum, int squares) {
            a[squares] = multiply_add(apart(sum) * apart(sum), scale, a[squares] + b[squares]);
        });
        for (int c = 0; halves >= 0 && c < 3; ++c) {
            const T means_apart = apart(radiance + c) * scale;
            a[halves + c] = means_apart * means_apart;
        }
        if (root_halves >= 0) {
            const auto together = [&](int sum) {
                const T x = apart(sum) * scale, y = apart(sum + 1) * scale, z = apart(sum + 2) * scale;
                return multiply_add(z, z, multiply_add(y, y, x * x));
            };
            a[root_halves] = together(root_direct);
            a[root_halves + 1] = together(root_indirect);
        }
        for_each_sum([&](int c) { a[c] += b[c]; });
    }

    /// Adds the sums b of nb samples to the sums a of na samples, any numbers, in double.
    template <class T>
    void merge(double* a, double na, const T* b, double nb) const {
        const double weight = na * nb / (na + nb);
        for_each_moment([&](int sum, int squares) {
            const double difference = double(b[sum]) / nb - a[sum] / na;
            a[squares] = multiply_add(difference * difference, weight, a[squares] + double(b[squares]));
        });
        const auto larger = [&](int c) { // the part's that is larger, as if all samples were like its
            a[c] = nb > na ? double(b[c]) * (nb / (na + nb)) : a[c] * (na / (na + nb));
        };
        for (int c = 0; halves >= 0 && c < 3; ++c) larger(halves + c);
        for (int c = 0; root_halves >= 0 && c < 2; ++c) larger(root_halves + c);
        for_each_sum([&](int c) { a[c] += double(b[c]); });
    }
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
