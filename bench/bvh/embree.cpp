#include "embree.hpp"
#include "embree_abi.hpp"
#include <lambent/core/error.hpp>
#include <algorithm>
#include <dlfcn.h>

using namespace embree_abi;

struct EmbreeLibrary::Functions {
    Handle (*new_device)(const char* options);
    void (*release_device)(Handle device);
    ssize_t (*get_property)(Handle device, int property);
    void (*set_memory_monitor)(Handle device, bool (*monitor)(void*, ssize_t, bool), void* user);
    Handle (*new_scene)(Handle device);
    void (*release_scene)(Handle scene);
    void (*set_quality)(Handle scene, int quality);
    void (*commit_scene)(Handle scene);
    Handle (*new_geometry)(Handle device, int type);
    void (*release_geometry)(Handle geometry);
    void* (*new_buffer)(Handle geometry, int type, unsigned slot, int format, std::size_t stride, std::size_t count);
    void (*set_geometry_quality)(Handle geometry, int quality);
    void (*commit_geometry)(Handle geometry);
    unsigned (*attach)(Handle scene, Handle geometry);
    void *intersect1, *occluded1, *intersect8, *occluded8, *intersect16, *occluded16; ///< types differ by version
};

EmbreeLibrary::EmbreeLibrary(const std::string& path, int major) : major_(major) {
    // Its own symbols first: the program may hold another TBB. Never closed, as threads of TBB's may remain.
    void* const library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_DEEPBIND);
    lambent::require(library != nullptr, [&] { return "Embree: " + std::string(dlerror()); });
    const auto load = [&](auto& function, const char* name) {
        void* const symbol = dlsym(library, name);
        lambent::require(symbol != nullptr, [&] { return path + ": no Embree, lacks " + name; });
        function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(symbol);
    };
    const auto f = std::make_shared<Functions>();
    load(f->new_device, "rtcNewDevice");
    load(f->release_device, "rtcReleaseDevice");
    load(f->get_property, "rtcGetDeviceProperty");
    load(f->set_memory_monitor, "rtcSetDeviceMemoryMonitorFunction");
    load(f->new_scene, "rtcNewScene");
    load(f->release_scene, "rtcReleaseScene");
    load(f->set_quality, "rtcSetSceneBuildQuality");
    load(f->commit_scene, "rtcCommitScene");
    load(f->new_geometry, "rtcNewGeometry");
    load(f->release_geometry, "rtcReleaseGeometry");
    load(f->new_buffer, "rtcSetNewGeometryBuffer");
    load(f->set_geometry_quality, "rtcSetGeometryBuildQuality");
    load(f->commit_geometry, "rtcCommitGeometry");
    load(f->attach, "rtcAttachGeometry");
    load(f->intersect1, "rtcIntersect1");
    load(f->occluded1, "rtcOccluded1");
    load(f->intersect8, "rtcIntersect8");
    load(f->occluded8, "rtcOccluded8");
    load(f->intersect16, "rtcIntersect16");
    load(f->occluded16, "rtcOccluded16");
    functions_ = f;

    const Handle device = f->new_device("threads=1");
    lambent::require(device != nullptr, [&] { return path + ": makes no device"; });
    const ssize_t found = f->get_property(device, property_version_major);
    version_ = std::to_string(found) + "." + std::to_string(f->get_property(device, property_version_minor)) + "." +
               std::to_string(f->get_property(device, property_version_patch));
    f->release_device(device);
    lambent::require(found == major, [&] {
        return path + ": is Embree " + version_ + " where " + std::to_string(major) + " is expected";
    });
}

/// One geometry of triangles and the tree over it, built on the calling thread.
class EmbreeScene {
public:
    EmbreeScene(const EmbreeLibrary& library, const Soup& soup, EmbreeQuality quality)
        : f_(library.functions_), device_(f_->new_device("threads=1")), scene_(f_->new_scene(device_)) {
        f_->set_memory_monitor(device_, count_bytes, &bytes_);
        f_->set_quality(scene_, int(quality));
        const Handle geometry = f_->new_geometry(device_, geometry_triangle);
        if (quality == EmbreeQuality::low) f_->set_geometry_quality(geometry, int(quality)); // Morton needs both
        auto* vertices = static_cast<float*>(
            f_->new_buffer(geometry, buffer_vertex, 0, format_float3, 12, soup.vertices.size()));
        for (const lambent::Vec3f& v : soup.vertices)
            for (int k = 0; k < 3; ++k) *vertices++ = v[k];
        auto* faces = static_cast<std::uint32_t*>(
            f_->new_buffer(geometry, buffer_index, 0, format_uint3, 12, soup.faces.size()));
        for (const lambent::UVec3& face : soup.faces)
            for (int k = 0; k < 3; ++k) *faces++ = face[k];

        const ssize_t before = bytes_;
        const double start = cpu_seconds();
        f_->commit_geometry(geometry);
        f_->attach(scene_, geometry);
        f_->commit_scene(scene_);
        cost_.seconds = cpu_seconds() - start;
        cost_.bytes_per_triangle = double(bytes_ - before) / double(std::max<std::size_t>(soup.faces.size(), 1));
        f_->release_geometry(geometry);
    }
    EmbreeScene(const EmbreeScene&) = delete;
    EmbreeScene& operator=(const EmbreeScene&) = delete;
    ~EmbreeScene() {
        f_->release_scene(scene_);
        f_->release_device(device_);
    }

    const BuildCost& cost() const { return cost_; }

    template <int version>
    void trace_single(const RayClass& rays, std::size_t begin, std::size_t end, Answers& answers) const {
        Extra<version> extra{0};
        for (std::size_t i = begin; i < end; ++i) {
            RayHit query;
            query.ray = to_embree(rays.rays[i]);
            if (rays.any) {
                call1<version>(f_->occluded1, &query.ray, extra);
                answers.t[i] = query.ray.t_far < 0 ? 0 : no_hit;
                continue;
            }
            query.hit.geometry = query.hit.instance = invalid_id;
            call1<version>(f_->intersect1, &query, extra);
            if (query.hit.geometry == invalid_id) {
                answers.miss(i);
            } else {
                answers.t[i] = query.ray.t_far;
                answers.primitive[i] = query.hit.primitive;
            }
        }
    }

    template <int version, std::size_t n>
    void trace_packets(const RayClass& rays, std::size_t begin, std::size_t end, Answers& answers) const {
        Extra<version> extra{rays.coherent ? (version == 3 ? 1 : 1 << 16) : 0};
        for (std::size_t first = begin; first < end; first += n) {
            const std::size_t used = std::min(n, end - first);
            alignas(4 * n) int valid[n];
            RayHits<n> query;
            for (std::size_t lane = 0; lane < n; ++lane) {
                valid[lane] = lane < used ? -1 : 0;
                put(rays.rays[first + std::min(lane, used - 1)], lane, query.ray);
                query.hit.geometry[lane] = query.hit.instance[lane] = invalid_id;
            }
            if (rays.any) {
                call_packet<version>(n == 8 ? f_->occluded8 : f_->occluded16, valid, &query.ray, extra);
            } else {
                call_packet<version>(n == 8 ? f_->intersect8 : f_->intersect16, valid, &query, extra);
            }
            for (std::size_t lane = 0; lane < used; ++lane) {
                const std::size_t i = first + lane;
                if (rays.any) {
                    answers.t[i] = query.ray.t_far[lane] < 0 ? 0 : no_hit;
                } else if (query.hit.geometry[lane] == invalid_id) {
                    answers.miss(i);
                } else {
                    answers.t[i] = query.ray.t_far[lane];
                    answers.primitive[i] = query.hit.primitive[lane];
                }
            }
        }
    }

private:
    template <int version>
    using Extra = std::conditional_t<version == 3, Context3, Arguments4>;

    template <int version>
    void call1(void* function, void* rays, Extra<version>& extra) const {
        using Function = void (*)(Handle, void*, void*);
        if constexpr (version == 3) {
            reinterpret_cast<Function>(function)(scene_, &extra, rays);
        } else {
            reinterpret_cast<Function>(function)(scene_, rays, &extra);
        }
    }

    template <int version>
    void call_packet(void* function, const int* valid, void* rays, Extra<version>& extra) const {
        using Function = void (*)(const int*, Handle, void*, void*);
        if constexpr (version == 3) {
            reinterpret_cast<Function>(function)(valid, scene_, &extra, rays);
        } else {
            reinterpret_cast<Function>(function)(valid, scene_, rays, &extra);
        }
    }

    static embree_abi::Ray to_embree(const lambent::Rayf& r) {
        const lambent::Vec3f &o = r.origin, &d = r.direction;
        return {{o.x, o.y, o.z}, r.t_min, {d.x, d.y, d.z}, 0, r.t_max, ~0u, 0, 0};
    }

    template <std::size_t n>
    static void put(const lambent::Rayf& r, std::size_t lane, Rays<n>& rays) {
        for (int k = 0; k < 3; ++k) rays.origin[k][lane] = r.origin[k], rays.direction[k][lane] = r.direction[k];
        rays.t_near[lane] = r.t_min, rays.t_far[lane] = r.t_max, rays.time[lane] = 0;
        rays.mask[lane] = ~0u, rays.id[lane] = rays.flags[lane] = 0;
    }

    static bool count_bytes(void* sum, ssize_t bytes, bool) {
        *static_cast<ssize_t*>(sum) += bytes;
        return true;
    }

    std::shared_ptr<const EmbreeLibrary::Functions> f_;
    ssize_t bytes_ = 0; ///< held now
    Handle device_, scene_;
    BuildCost cost_;
};

namespace {

template <int version>
void enter(std::shared_ptr<const EmbreeScene> scene, const std::string& library, bool packets,
           std::vector<Contender>& contenders) {
    Contender c;
    c.library = library;
    c.build_s = scene->cost().seconds;
    c.bytes_per_triangle = scene->cost().bytes_per_triangle;
    const auto add = [&](const std::string& variant, bool batch, auto trace) {
        c.variant = variant;
        c.batch = batch;
        c.trace = [scene, trace](const RayClass& rays, std::size_t begin, std::size_t end, Answers& answers) {
            ((*scene).*trace)(rays, begin, end, answers);
        };
        contenders.push_back(c);
    };
    add("high", false, &EmbreeScene::trace_single<version>);
    if (!packets) return;
    add("high-packets8", true, &EmbreeScene::trace_packets<version, 8>);
    add("high-packets16", true, &EmbreeScene::trace_packets<version, 16>);
}

} // namespace

std::vector<Contender> embree_contenders(const EmbreeLibrary& library, const Soup& soup, bool packets) {
    const auto scene = std::make_shared<const EmbreeScene>(library, soup, EmbreeQuality::high);
    std::vector<Contender> contenders;
    if (library.name() == "embree") {
        enter<3>(scene, library.name(), packets, contenders);
    } else {
        enter<4>(scene, library.name(), packets, contenders);
    }
    return contenders;
}

BuildCost build_embree(const EmbreeLibrary& library, const Soup& soup, EmbreeQuality quality) {
    return EmbreeScene(library, soup, quality).cost();
}
