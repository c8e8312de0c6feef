#pragma once
#include <lambent/bvh/closest_point.hpp>
#include <lambent/render/path_listener.hpp>
#include <lambent/scene/prepared_scene.hpp>
#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <limits>
#include <string>
#include <utility>

/// Prints paths as they come: a line a vertex, and below it what happened there.
class PathPrinter {
public:
    using Vec = lambent::Vec3f;

    explicit PathPrinter(const lambent::PreparedScene<float>& prepared) : prepared_(prepared), scene_(prepared.scene()) {}

    void begin(std::uint64_t sample, const lambent::Rayf& ray) {
        std::printf("\nsample %llu\n", static_cast<unsigned long long>(sample));
        std::printf("  camera ray   from %s along %s\n", world(ray.origin).c_str(), text(ray.direction).c_str());
        end_ = "";
    }
    void end(const Vec& radiance) {
        flush();
        if (!end_.empty()) std::printf("  ends         %s\n", end_.c_str());
        std::printf("  radiance     %s\n", exact(radiance).c_str());
    }

    /// What a path is given to tell of itself: see lambent::NoListener.
    struct Listener {
        PathPrinter* printer = nullptr;

        void hit(const auto& path, const auto& hit, const auto& s) const {
            printer->flush();
            printer->add("  vertex %-5u t %.7g at %s, normal %s, %s, seen from %s\n", path.depth, double(hit.t),
                         printer->world(s.position).c_str(), text(s.shading_normal).c_str(),
                         printer->primitive(hit.primitive).c_str(), s.front ? "the front" : "behind");
            printer->add("    throughput %s\n", exact(path.throughput).c_str());
            printer->end_ = "nothing is scattered here, or the greatest depth is reached";
        }
        void miss(const auto& path) const {
            printer->flush();
            printer->add("  leaves       along %s, throughput %s\n", text(path.ray.direction).c_str(),
                         exact(path.throughput).c_str());
            printer->end_ = "";
        }
        void emission(const auto& path, const Vec& emission, float light_pdf, float weight, const Vec& radiance) const {
            printer->add("    emission   %s met by chance", text(emission).c_str());
            if (path.bsdf_pdf > 0)
                printer->add(": BSDF pdf %.7g, light sample's pdf %.7g, MIS weight %.7g", double(path.bsdf_pdf),
                             double(light_pdf), double(weight));
            printer->add("\n      adds     %s\n", exact(radiance).c_str());
        }
        void light(const auto&, const lambent::LightSample<float>& light) const {
            printer->aims_ = light.pdf > 0;
            if (light.pdf > 0) {
                printer->add("    light      %s, along %s, radiance %s, pdf %.7g\n", printer->name(light).c_str(),
                             text(light.wi).c_str(), text(light.radiance).c_str(), double(light.pdf));
            } else {
                printer->add("    light      none that shines here\n");
            }
        }
        void aim(const auto& path, const lambent::BsdfValue<float>& scattered, float weight) const {
            printer->add("      adds     ");
            printer->visible_ = printer->lines_.size();
            printer->aims_ = false;
            printer->aimed_ = path.shadow_radiance;
            printer->add(": BSDF %s, pdf %.7g, MIS weight %.7g\n", text(scattered.f).c_str(), double(scattered.pdf),
                         double(weight));
        }
        void shadow(const auto& path, bool occluded) const {
            const char* const seen = occluded ? "it is not" : path.shadow_radiance == printer->aimed_ ? "it is" : "it is through panes";
            printer->lines_.insert(printer->visible_, exact(path.shadow_radiance) + " if visible, which " + seen);
        }
        void bounce(const auto&, const lambent::BsdfSample<float>& b, const Vec& wi) const {
            if (std::exchange(printer->aims_, false))
                printer->add("      adds     nothing: it is behind the surface, or is not scattered to here\n");
            if (b.pdf > 0) {
                printer->add("    bounce     along %s, %spdf %.7g, weight %s\n", text(wi).c_str(),
                             b.delta ? "as a mirror or smooth glass, " : "", double(b.pdf), exact(b.weight).c_str());
            } else {
                printer->add("    bounce     none was drawn\n");
            }
            printer->end_ = "the bounce carries nothing";
        }
        void roulette(const auto&, float survival, bool survived) const {
            printer->add("    roulette   goes on with a chance of %.7g: %s\n", double(survival), survived ? "yes" : "no");
            printer->end_ = survived ? "" : "by roulette";
        }
    };
    Listener listener() { return {this}; }

    static std::string exact(const Vec& v) { return format("(%.9g, %.9g, %.9g)", double(v.x), double(v.y), double(v.z)); }

private:
    [[gnu::format(printf, 1, 2)]] static std::string format(const char* pattern, ...) {
        char buffer[512];
        va_list arguments;
        va_start(arguments, pattern);
        std::vsnprintf(buffer, sizeof buffer, pattern, arguments);
        va_end(arguments);
        return buffer;
    }
    template <class... Args>
    void add(const char* pattern, const Args&... arguments) {
        char buffer[1024];
        if constexpr (sizeof...(arguments) == 0) lines_ += pattern;
        else lines_.append(buffer, std::size_t(std::max(0, std::snprintf(buffer, sizeof buffer, pattern, arguments...))));
    }
    void flush() { std::fputs(std::exchange(lines_, {}).c_str(), stdout); }

    static std::string text(const Vec& v) { return format("(%.6g, %.6g, %.6g)", double(v.x), double(v.y), double(v.z)); }
    std::string world(const Vec& v) const {
        const lambent::Vec3d p = lambent::Vec3d(v) + scene_.origin;
        return format("(%.9g, %.9g, %.9g)", p.x, p.y, p.z);
    }

    /// "triangle 7 of 'white'"
    std::string primitive(std::uint32_t index) const {
        const bool sphere = index >= scene_.triangles.size();
        const std::size_t number = sphere ? index - scene_.triangles.size() : index;
        const std::uint32_t material = sphere ? scene_.spheres[number].material : scene_.triangle_materials[number];
        return format("%s %zu of material %u '%.200s'", sphere ? "sphere" : "triangle", number, material,
                      scene_.materials[material].name.c_str());
    }

    /// A sample does not say which light it is of: what lies where it ends does.
    std::string name(const lambent::LightSample<float>& light) const {
        using Kind = lambent::PunctualLight::Kind;
        if (light.infinite && !light.delta) return "environment";
        for (std::size_t i = 0; light.delta && i < scene_.punctual_lights.size(); ++i) {
            const lambent::PunctualLight& p = scene_.punctual_lights[i];
            if (light.infinite != (p.kind == Kind::directional)) continue;
            if (light.infinite ? light.wi == -Vec(p.direction) : light.target == Vec(p.position - scene_.origin))
                return format("punctual light %zu", i);
        }
        const auto nearest = closest_point(prepared_.bvh(), light.target);
        float distance = nearest ? nearest.distance : std::numeric_limits<float>::infinity();
        std::size_t found = nearest.primitive;
        for (std::size_t i = 0; i < scene_.spheres.size(); ++i) {
            const float away = std::abs(length(light.target - scene_.spheres[i].center) - scene_.spheres[i].radius);
            if (away >= distance) continue;
            distance = away;
            found = scene_.triangles.size() + i;
        }
        return primitive(std::uint32_t(found)) + " at " + world(light.target);
    }

    const lambent::PreparedScene<float>& prepared_;
    const lambent::Scene<float>& scene_;
    std::string lines_;      ///< of the vertex under way
    std::size_t visible_ = 0; ///< where in them the answer to the shadow ray belongs
    Vec aimed_{0};            ///< what it would add if nothing were in its way
    bool aims_ = false;       ///< a light was picked, and nothing was said of what it adds
    std::string end_;
};
