#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/core/sincos.hpp>
#include <lambent/light/light_sample.hpp>
#include <lambent/sampling/distribution.hpp>
#include <lambent/sampling/warp.hpp>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Light from infinitely far away: a constant, or a latitude-longitude map, bilinear. Direction d looks up
/// u = 0.5 + atan2(d.z, d.x) / 2π, v = acos(d.y) / π, after a turn about +y.
/// Beside bounces of the BSDF (Companion::bsdf) directions are drawn in proportion to what is above the map's mean:
/// what shines from everywhere is theirs, and of a constant nothing is drawn at all. Alone, the rest is drawn
/// evenly.
/// source  Karlík, Šik, Vévoda, Skřivan, Křivánek, "MIS compensation", SIGGRAPH Asia 2019
template <class T>
class EnvironmentLight {
public:
    EnvironmentLight() = default; ///< black

    /// The map (width · height, row 0 up; empty for a constant) stays the caller's.
    EnvironmentLight(std::span<const Vec3f> map, int width, int height, const Vec3f& scale, double rotation_degrees)
        : map_(map), width_(width), height_(height), scale_(scale),
          cos_(T(std::cos(rotation_degrees * pi<double> / 180))),
          sin_(T(std::sin(rotation_degrees * pi<double> / 180))) {
        if (is_black(scale)) return;
        mean_ = luminance(Vec3<T>(scale_));
        if (map_.empty()) return;
        std::vector<float> weights(map_.size());
        double sum = 0, solid_angle = 0;
        const auto for_each_cell = [&](auto&& f) {
            for (int y = 0; y < height_; ++y) {
                const double sine = std::sin((double(y) + 0.5) / height_ * pi<double>);
                for (int x = 0; x < width_; ++x) f(weights[std::size_t(y) * std::size_t(width_) + std::size_t(x)], sine, x, y);
            }
        };
        for_each_cell([&](float& weight, double sine, int x, int y) {
            weight = float(cell_mean(x, y));
            sum += double(weight) * sine;
            solid_angle += sine;
        });
        const double mean = sum / solid_angle;
        double excess = 0;
        for_each_cell([&](float& weight, double sine, int, int) {
            weight = float(std::max(double(weight) - mean, 0.0) * sine);
            excess += double(weight);
        });
        mean_ = T(mean);
        excess_ = T(excess / solid_angle);
        distribution_ = Distribution2D(weights, std::uint32_t(width_), std::uint32_t(height_));
    }

    bool black() const { return !(mean_ > 0); }
    /// Mean luminance over the sphere of directions, of what sample() looks for.
    T mean_luminance(Companion companion = Companion::none) const { return companion == Companion::none ? mean_ : excess_; }

    Vec3<T> radiance(const Vec3<T>& direction) const {
        return map_.empty() ? Vec3<T>(scale_) : look_up(to_map(direction));
    }

    /// Density per solid angle with which sample() draws this direction.
    T pdf(const Vec3<T>& direction, Companion companion = Companion::none) const {
        return pdf(excess_ > 0 ? to_map(direction) : MapPoint(), companion);
    }

    /// A direction; none where it is under the horizon of unit `normal`, unless that is 0.
    LightSample<T> sample(const Vec2<T>& u, Companion companion = Companion::none, const Vec3<T>& normal = Vec3<T>(0)) const {
        LightSample<T> s;
        s.infinite = true;
        const T share = companion == Companion::none ? peaks_share() : T(excess_ > 0 ? 1 : 0);
        if (u.x < share) {
            const auto drawn = distribution_.sample(Vec2<T>(std::min(u.x / share, one_minus_epsilon<T>), u.y));
            const auto [sin_theta, cos_theta] = sincos_of_turn(drawn.p.y / 2);
            const auto [sin_phi, cos_phi] = sincos_of_turn(drawn.p.x - T(0.5));
            const Vec3<T> d(sin_theta * cos_phi, cos_theta, sin_theta * sin_phi);
            s.wi = normalize(Vec3<T>(cos_ * d.x - sin_ * d.z, d.y, sin_ * d.x + cos_ * d.z));
        } else if (companion == Companion::none && !black()) {
            s.wi = square_to_uniform_sphere(Vec2<T>(std::min((u.x - share) / (1 - share), one_minus_epsilon<T>), u.y));
        } else {
            return s;
        }
        if (dot(s.wi, normal) < 0) return s;
        const MapPoint at = map_.empty() ? MapPoint() : to_map(s.wi);
        s.pdf = pdf(at, companion); // what a path that goes there by chance would be told, to the bit
        s.radiance = map_.empty() ? Vec3<T>(scale_) : look_up(at);
        return s;
    }

private:
    /// Where on the map a direction looks, and its distance from the map's poles.
    struct MapPoint {
        Vec2<T> uv{0}; ///< in [0, 1)
        T sine = 0;    ///< of the polar angle
    };

    /// Of what sample() draws alone, how much goes to the peaks.
    T peaks_share() const { return excess_ > 0 ? excess_ / (excess_ + mean_) : T(0); }
    T uniform() const { return black() ? T(0) : uniform_sphere_pdf<T>(); }

    T pdf(const MapPoint& at, Companion companion) const {
        const T peaks = at.sine > 0 ? distribution_.pdf(at.uv) / (2 * pi<T> * pi<T> * at.sine) : T(0);
        if (companion == Companion::bsdf) return peaks;
        const T share = peaks_share();
        return share * peaks + (1 - share) * uniform();
    }

    MapPoint to_map(const Vec3<T>& direction) const {
        const T x = cos_ * direction.x + sin_ * direction.z, z = cos_ * direction.z - sin_ * direction.x;
        const T sine = std::sqrt(direction.x * direction.x + direction.z * direction.z);
        const T u = T(0.5) + turn_of(z, x);
        const T v = 2 * turn_of(sine, direction.y); // acos is coarse at the poles
        constexpr T below_one = 1 - std::numeric_limits<T>::epsilon() / 2;
        return {{std::clamp(u, T(0), below_one), std::clamp(v, T(0), below_one)}, sine};
    }

    /// The map there, bilinear.
    Vec3<T> look_up(const MapPoint& at) const {
        const T x = at.uv.x * T(width_) - T(0.5), y = at.uv.y * T(height_) - T(0.5);
        const T fx = std::floor(x), fy = std::floor(y);
        const int x0 = int(fx), y0 = int(fy);
        const Vec3<T> top = mix(texel(x0, y0), texel(x0 + 1, y0), x - fx);
        const Vec3<T> bottom = mix(texel(x0, y0 + 1), texel(x0 + 1, y0 + 1), x - fx);
        return mix(top, bottom, y - fy) * Vec3<T>(scale_);
    }

    Vec3<T> texel(int x, int y) const {
        x = x < 0 ? x + width_ : x >= width_ ? x - width_ : x;
        y = std::clamp(y, 0, height_ - 1);
        return Vec3<T>(map_[std::size_t(y) * std::size_t(width_) + std::size_t(x)]);
    }

    /// Mean luminance of the bilinear map over the cell of one texel.
    double cell_mean(int x, int y) const {
        static constexpr double share[3] = {0.125, 0.75, 0.125};
        double sum = 0;
        for (int j = -1; j <= 1; ++j)
            for (int i = -1; i <= 1; ++i)
                sum += share[i + 1] * share[j + 1] *
                       luminance(Vec3d(texel((x + i + width_) % width_, y + j)) * Vec3d(scale_));
        return std::max(sum, 0.0);
    }

    std::span<const Vec3f> map_;
    int width_ = 0, height_ = 0;
    Vec3f scale_{0};
    T cos_ = 1, sin_ = 0;
    T mean_ = 0, excess_ = 0; ///< luminance over the sphere: all of it, and above the mean
    Distribution2D distribution_; ///< of the excess
};

} // namespace LAMBENT_ABI
} // namespace lambent
