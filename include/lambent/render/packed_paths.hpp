#pragma once
#include <lambent/core/frame.hpp>
#include <lambent/core/ray.hpp>
#include <lambent/core/vec_packs.hpp>
#include <lambent/film/pixel_sample.hpp>
#include <lambent/light/light_sample.hpp>
#include <lambent/light/triangle_light.hpp>
#include <lambent/render/integrator.hpp>
#include <lambent/render/path.hpp>
#include <lambent/render/sample_batch.hpp>
#include <lambent/sampling/mis.hpp>
#include <lambent/sampling/stream_pack.hpp>
#include <lambent/sampling/warp.hpp>
#include <lambent/scene/attributes.hpp>
#include <lambent/scene/features.hpp>
#include <lambent/scene/plain_surface.hpp>
#include <lambent/scene/scene.hpp>
#include <lambent/scene/specialised_scene.hpp>
#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

// See simd.hpp.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// PathIntegrator through plain scenes, a register's worth of paths at once: what SampleBatch makes of the same rays one by
/// one, to rounding, in half the time. It pays where all paths do the same at a vertex: nothing but diffuse reflection, and
/// no ray but one bounce and one to a light. A lane's numbers do not depend on the others', so neither does a pixel on what
/// is rendered beside it.
template <class S, PathStrategy strategy, MisHeuristic heuristic, class Stream>
class PackedPaths {
public:
    using T = typename S::Scalar;
    static constexpr std::size_t capacity = 512; ///< as of SampleBatch

    /// Refers to the scene. `expected`: rays in all; there is room for no more than that, nor than `capacity`.
    PackedPaths(const S& scene, const PathIntegrator<strategy, heuristic>& integrator, std::uint64_t expected)
        : scene_(scene), options_(integrator.options) {
        const auto most = std::size_t(std::min<std::uint64_t>(expected, capacity));
        streams_.reserve(most);
        results_.reserve(most);
        rays_.resize(most);
        hits_.resize(most);
        paths_.resize(most);
        shadow_rays_.resize(most);
        shadows_.resize(most);
        occluded_.reset(new bool[most]);
    }

    /// Whether there is no more room.
    bool full() const { return streams_.size() == rays_.size(); }

    /// Call only where there is room.
    void add(const Ray<T>& ray, const Stream& stream) {
        rays_[streams_.size()] = ray;
        streams_.push_back(stream);
    }

    /// Calls take(sample) for each ray, in the order in which they were added, and forgets the rays.
    template <class Take>
    void run(RayCounts& counts, const Take& take) {
        std::size_t n = streams_.size();
        results_.assign(n, {});
        for (std::size_t i = 0; i < n; ++i) paths_[i] = {.sample = std::uint32_t(i)};
        for (depth_ = 0; n > 0; ++depth_) n = step(n, counts);
        for (const PixelSample<T>& result : results_) take(result);
        streams_.clear();
    }

private:
    static constexpr int N = native_width<T>;
    using P = Pack<T, N>;
    using V = Vec3Pack<T, N>;
    using Column = std::array<T, std::size_t(N)>;
    using Lanes = unsigned; ///< a bit each, lane 0 lowest
    static constexpr Companion companion = strategy == PathStrategy::both ? Companion::bsdf : Companion::none;

    /// A path under way, of the ray in rays_ at the same place.
    struct Path {
        Vec3<T> throughput{1};
        T bsdf_pdf = 0;    ///< of the ray's direction; 0 from the camera
        Vec3<T> normal{0}; ///< of the surface that the ray left
        std::uint32_t sample = 0;
    };
    /// What a shadow ray brings, unless it is occluded.
    struct Shadow {
        Vec3<T> radiance{0};
        std::uint32_t sample = 0;
    };
    /// Paths that met a surface.
    struct Group {
        PlainHits<T, N> hits;
        Vec3Column<T, N> throughput, albedo;
        std::array<std::uint32_t, std::size_t(N)> at, sample; ///< their places in rays_, and in streams_
        Lanes emitters = 0;
        std::size_t size = 0;

        Lanes all() const { return Lanes((1ull << size) - 1); }
    };
    struct LightSamples {
        V wi, radiance, target, target_error, target_normal;
        P pdf;
        Lanes delta = 0, infinite = 0;
    };
    /// Which lanes may leave a surface, and which of those from where its lift leads.
    struct Exits {
        Lanes open, lifted;
    };

    template <class F>
    static void for_each_lane(Lanes lanes, F&& f) {
        for (; lanes != 0; lanes &= lanes - 1) f(std::size_t(std::countr_zero(lanes)));
    }
    template <class U>
    static U mis_weight(U pdf, U other) {
        return heuristic == MisHeuristic::power ? power_heuristic(pdf, other) : balance_heuristic(pdf, other);
    }

    /// Takes the first n paths one step on; returns how many of them go on, which are then the first.
    std::size_t step(std::size_t n, RayCounts& counts) {
        const std::span<const Ray<T>> rays(rays_.data(), n);
        if (depth_ == 0) camera_hit_each<S, T>(scene_, rays, hits_);
        else intersect_each<S, T>(scene_, rays, hits_);
        counts.closest += n;
        going_on_ = aimed_ = 0;
        Group group{};
        for (std::size_t i = 0; i < n; ++i) {
            if (hits_[i]) add_to(group, i);
            else meet_background(i);
            if (group.size < std::size_t(N) && (i + 1 < n || group.size == 0)) continue;
            advance(group, counts);
            group.size = 0;
            group.emitters = 0;
        }
        trace_shadow_rays(counts);
        return going_on_;
    }

    void add_to(Group& group, std::size_t i) const {
        const Scene<T>& scene = scene_.scene();
        const std::size_t lane = group.size++;
        group.hits.set(lane, scene, rays_[i], hits_[i]);
        group.throughput.set(lane, paths_[i].throughput);
        group.at[lane] = std::uint32_t(i);
        group.sample[lane] = paths_[i].sample;
        const Material& material = material_at(i);
        const Vec3<T> albedo(material.unlit ? Vec3f(0) : base_color_at<false>(scene, material, Attributes()));
        group.albedo.set(lane, albedo);
        group.emitters |= Lanes(material.unlit || material.emissive()) << lane;
    }

    const Material& material_at(std::size_t i) const {
        const Scene<T>& scene = scene_.scene();
        return scene.materials[scene.triangle_materials[hits_[i].primitive]];
    }

    void meet_background(std::size_t i) {
        const Vec3<T>& direction = rays_[i].direction;
        add_emission(paths_[i], scene_.background(direction), [&] { return scene_.background_pdf(direction); });
    }

    void meet_emitter(std::size_t i, bool front) {
        const Material& m = material_at(i);
        if (!m.unlit && !front && !m.double_sided) return;
        const Vec3<T> emission(m.unlit ? base_color_at<false>(scene_.scene(), m, Attributes()) : m.emission);
        add_emission(paths_[i], emission, [&] { return scene_.hit_light_pdf(rays_[i], hits_[i], paths_[i].normal); });
    }

    /// Light that a path met by chance.
    template <class Pdf>
    void add_emission(const Path& path, const Vec3<T>& emission, Pdf light_pdf) {
        if (is_black(emission)) return;
        PixelSample<T>& result = results_[path.sample];
        Vec3<T> radiance = path.throughput * emission;
        if (path.bsdf_pdf > 0) {
            if constexpr (strategy == PathStrategy::light) return;
            if constexpr (strategy == PathStrategy::both) radiance *= mis_weight(path.bsdf_pdf, T(light_pdf()));
        }
        result.radiance += radiance;
        if (depth_ == 0) result.emission = radiance;
        else (depth_ == 1 ? result.direct : result.indirect) += radiance;
    }

    /// Light and the next direction at the surfaces that a group has met.
    void advance(const Group& group, RayCounts& counts) {
        const PlainSurfaces<T, N> surface = group.hits.surfaces();
        if (depth_ == 0) record(group, surface);
        const Lanes front = bits(surface.front);
        for_each_lane(group.emitters, [&](std::size_t lane) { meet_emitter(group.at[lane], (front >> lane & 1u) != 0); });
        if (depth_ >= options_.max_depth) return;

        const V albedo = group.albedo.load();
        const Lanes reflecting = group.all() & ~bits(is_black(albedo));
        StreamPack<Stream, N> numbers;
        for (std::size_t lane = 0; lane < group.size; ++lane) numbers.set(int(lane), streams_[group.sample[lane]]);
        const std::uint32_t first = dimensions::first_vertex + dimensions::per_vertex * depth_;
        V throughput = group.throughput.load();
        if constexpr (strategy != PathStrategy::bsdf)
            if (scene_.has_lights(companion))
                aim_at_lights(group, surface, albedo, throughput, numbers.get_2d(first + dimensions::light), reflecting, counts);

        const V local = square_to_cosine_hemisphere(numbers.get_2d(first + dimensions::direction));
        const V wi = normalize(Frame<P>(surface.shading_normal).to_world(local));
        const Exits exits = ways_out(surface, wi, local.z, reflecting & bits(local.z > P(T(0))), counts);
        throughput *= albedo;
        const Lanes bad = exits.open & ~bits(is_finite(throughput));
        if (bad != 0) reject(group, throughput, bad);
        const P strength = max_component(throughput);
        Lanes alive = exits.open & ~bad & bits(strength > P(T(0)));
        if (depth_ + 1 >= options_.roulette_depth) {
            const P survival = min(max(strength / P(T(options_.roulette_strength)), P(T(0.05))), P(T(0.99)));
            alive &= bits(numbers.get_1d(first + dimensions::roulette) < survival);
            throughput = throughput / survival;
        }
        Vec3Column<T, N> origins, directions, throughputs, normals;
        Column pdfs;
        origins.store(leave_by(exits, surface, wi));
        directions.store(wi);
        throughputs.store(throughput);
        normals.store(surface.shading_normal);
        (local.z * P(inv_pi<T>)).store(pdfs.data());
        for_each_lane(alive, [&](std::size_t lane) {
            rays_[going_on_] = {.origin = origins[lane], .direction = directions[lane]};
            paths_[going_on_++] = {throughputs[lane], pdfs[lane], normals[lane], group.sample[lane]};
        });
    }

    /// The features of first hits.
    void record(const Group& group, const PlainSurfaces<T, N>& surface) {
        Vec3Column<T, N> position, normal;
        position.store(surface.position);
        normal.store(surface.shading_normal);
        for (std::size_t lane = 0; lane < group.size; ++lane) {
            PixelSample<T>& result = results_[group.sample[lane]];
            const Hit<T>& hit = hits_[group.at[lane]];
            result.hit = true;
            result.albedo = group.albedo[lane];
            result.normal = normal[lane];
            result.position = position[lane];
            result.depth = hit.t;
            result.material = scene_.scene().triangle_materials[hit.primitive];
        }
    }

    /// Samples of a throughput that is not finite: the film counts them, and takes nothing of them.
    void reject(const Group& group, const V& throughput, Lanes lanes) {
        Vec3Column<T, N> throughputs;
        throughputs.store(throughput);
        for_each_lane(lanes, [&](std::size_t lane) { results_[group.sample[lane]].radiance += throughputs[lane]; });
    }

    /// See PathIntegrator::way_out(), for the lanes in `wanted`.
    Exits ways_out(const PlainSurfaces<T, N>& surface, const V& wi, P local_z, Lanes wanted, RayCounts& counts) const {
        const Lanes open = bits(dot(wi, surface.geometric_normal) * local_z > P(T(0)));
        const P lift2 = dot(surface.lift, surface.lift);
        const Lanes lifting = wanted & ~open & bits((local_z > P(T(0))) & (lift2 > P(T(0))));
        Exits exits{wanted & open, 0};
        if (lifting == 0) return exits;
        Vec3Column<T, N> origins, ways;
        const V origin = leave_surface(surface.position, surface.position_error, surface.geometric_normal, surface.lift);
        origins.store(origin);
        ways.store(surface.position + surface.lift - origin);
        for_each_lane(lifting, [&](std::size_t lane) {
            ++counts.shadow;
            if (scene_.occluded({.origin = origins[lane], .direction = ways[lane], .t_max = 1})) return;
            exits.lifted |= 1u << lane;
        });
        exits.open |= exits.lifted;
        return exits;
    }

    /// Where rays in these directions start.
    static V leave_by(const Exits& exits, const PlainSurfaces<T, N>& surface, const V& direction) {
        const V start = leave_surface(surface.position, surface.position_error, surface.geometric_normal, direction);
        if (exits.lifted == 0) return start;
        Column lifted{};
        for_each_lane(exits.lifted, [&](std::size_t lane) { lifted[lane] = 1; });
        return select(P::load(lifted.data()) > P(T(0)), surface.position + surface.lift, start);
    }

    void aim_at_lights(const Group& group, const PlainSurfaces<T, N>& surface, const V& albedo, const V& throughput,
                       const Vec2Pack<T, N>& u, Lanes wanted, RayCounts& counts) {
        LightSamples light;
        if (!sample_triangle(light, surface, u)) sample_lights(light, surface, u, wanted);
        const P zero(T(0)), cosine = dot(light.wi, surface.shading_normal), pdf = cosine * P(inv_pi<T>);
        const V value = albedo * P(inv_pi<T>) * cosine * light.radiance * throughput;
        const Lanes lit = wanted & bits((light.pdf > zero) & (cosine > zero)) & ~bits(is_black(value));
        const Exits exits = ways_out(surface, light.wi, cosine, lit, counts);
        counts.saved += std::uint64_t(std::popcount(wanted & ~exits.open));
        if (exits.open == 0) return;
        Vec3Column<T, N> origins, directions, radiances;
        const V way = light.target - surface.position;
        V origin = leave_by(exits, surface, way);
        V direction = leave_surface(light.target, light.target_error, light.target_normal, -way) - origin;
        P weight = strategy == PathStrategy::both ? mis_weight(light.pdf, pdf) : P(T(1));
        if ((light.delta | light.infinite) != 0) {
            Column delta{}, infinite{};
            for_each_lane(light.delta, [&](std::size_t lane) { delta[lane] = 1; });
            for_each_lane(light.infinite, [&](std::size_t lane) { infinite[lane] = 1; });
            weight = select(P::load(delta.data()) > zero, P(T(1)), weight);
            const auto far = P::load(infinite.data()) > zero;
            origin = select(far, leave_by(exits, surface, light.wi), origin);
            direction = select(far, light.wi, direction);
        }
        origins.store(origin);
        directions.store(direction);
        radiances.store(value * (weight / light.pdf));
        for_each_lane(exits.open, [&](std::size_t lane) {
            const bool far = (light.infinite >> lane & 1u) != 0;
            const T t_max = far ? std::numeric_limits<T>::infinity() : 1 - 4 * std::numeric_limits<T>::epsilon();
            shadow_rays_[aimed_] = {.origin = origins[lane], .direction = directions[lane], .t_max = t_max};
            shadows_[aimed_++] = {radiances[lane], group.sample[lane]};
        });
    }

    /// Where one light is all there is; says whether.
    bool sample_triangle(LightSamples& lights, const PlainSurfaces<T, N>& surface, const Vec2Pack<T, N>& u) const {
        return scene_.lights().with_only_triangle(companion, [&](const TriangleLight<T>& light, const Vec3<T>& radiance, bool both) {
            const TrianglePoints<T, N> s = light.sample(surface.position, u);
            lights.wi = s.wi;
            lights.radiance = spread<T, N>(radiance);
            lights.target = s.target;
            lights.target_error = s.target_error;
            lights.target_normal = spread<T, N>(light.normal());
            lights.pdf = both ? s.pdf : select(s.front, s.pdf, P(T(0)));
        });
    }

    void sample_lights(LightSamples& lights, const PlainSurfaces<T, N>& surface, const Vec2Pack<T, N>& u, Lanes wanted) const {
        Vec3Column<T, N> from, normal, wi{}, radiance{}, target{}, target_error{}, target_normal{};
        Column x, y, pdf{};
        from.store(surface.position);
        normal.store(surface.shading_normal);
        u.x.store(x.data());
        u.y.store(y.data());
        for_each_lane(wanted, [&](std::size_t lane) {
            const LightSample<T> s = scene_.sample_light(from[lane], normal[lane], {x[lane], y[lane]}, companion);
            wi.set(lane, s.wi);
            radiance.set(lane, s.radiance);
            target.set(lane, s.target);
            target_error.set(lane, s.target_error);
            target_normal.set(lane, s.target_normal);
            pdf[lane] = s.pdf;
            lights.delta |= Lanes(s.delta) << lane;
            lights.infinite |= Lanes(s.infinite) << lane;
        });
        lights.wi = wi.load();
        lights.radiance = radiance.load();
        lights.target = target.load();
        lights.target_error = target_error.load();
        lights.target_normal = target_normal.load();
        lights.pdf = P::load(pdf.data());
    }

    void trace_shadow_rays(RayCounts& counts) {
        const std::span<bool> occluded(occluded_.get(), aimed_);
        occluded_each<S, T>(scene_, std::span<const Ray<T>>(shadow_rays_.data(), aimed_), occluded, {});
        counts.shadow += aimed_;
        for (std::size_t i = 0; i < aimed_; ++i) {
            if (occluded[i]) continue;
            PixelSample<T>& result = results_[shadows_[i].sample];
            result.radiance += shadows_[i].radiance;
            (depth_ == 0 ? result.direct : result.indirect) += shadows_[i].radiance;
        }
    }

    const S& scene_;
    PathOptions options_;
    std::vector<Stream> streams_;
    std::vector<PixelSample<T>> results_; ///< of each stream
    std::uint32_t depth_ = 0;             ///< scattering events so far
    std::vector<Ray<T>> rays_;
    std::vector<Hit<T>> hits_;
    std::vector<Path> paths_;
    std::vector<Ray<T>> shadow_rays_;
    std::vector<Shadow> shadows_;
    std::unique_ptr<bool[]> occluded_;    ///< shadow rays
    std::size_t going_on_ = 0, aimed_ = 0; ///< how many paths go on so far, and how many shadow rays there are
};

/// How the samples of a tile are taken: see SampleBatch.
template <class S, class I, class Stream>
struct BatchFor {
    using Type = SampleBatch<S, I, Stream>;
};
template <SceneFeatures features, PathStrategy strategy, MisHeuristic heuristic, class Stream>
    requires(plain_features.hold(features))
struct BatchFor<SpecialisedScene<float, features>, PathIntegrator<strategy, heuristic>, Stream> {
    using Type = PackedPaths<SpecialisedScene<float, features>, strategy, heuristic, Stream>;
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent

#pragma GCC diagnostic pop
