#pragma once
#include "rays.hpp"
#include <embree3/rtcore.h>

/// Embree over the same triangles: high build quality, as its users get it by default (not robust).
class EmbreeScene {
public:
    explicit EmbreeScene(const Soup& soup) : device_(rtcNewDevice("threads=1")), scene_(rtcNewScene(device_)) {
        rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
        const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
        auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                                     RTC_FORMAT_FLOAT3, 12, soup.vertices.size()));
        for (const lambent::Vec3f& v : soup.vertices)
            for (int k = 0; k < 3; ++k) *vertices++ = v[k];
        auto* faces = static_cast<unsigned*>(
            rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, soup.faces.size()));
        for (const lambent::UVec3& f : soup.faces)
            for (int k = 0; k < 3; ++k) *faces++ = f[k];
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene_, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene_);
    }
    EmbreeScene(const EmbreeScene&) = delete;
    EmbreeScene& operator=(const EmbreeScene&) = delete;
    ~EmbreeScene() {
        rtcReleaseScene(scene_);
        rtcReleaseDevice(device_);
    }

    /// t of the nearest hit, or infinity.
    float intersect(const lambent::Rayf& ray) const {
        RTCRayHit query;
        query.ray = to_embree(ray);
        query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        rtcIntersect1(scene_, &context, &query);
        return query.hit.geomID == RTC_INVALID_GEOMETRY_ID ? std::numeric_limits<float>::infinity() : query.ray.tfar;
    }

    bool occluded(const lambent::Rayf& ray) const {
        RTCRay query = to_embree(ray);
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        rtcOccluded1(scene_, &context, &query);
        return query.tfar < 0;
    }

private:
    static RTCRay to_embree(const lambent::Rayf& ray) {
        RTCRay r{};
        r.org_x = ray.origin.x, r.org_y = ray.origin.y, r.org_z = ray.origin.z;
        r.dir_x = ray.direction.x, r.dir_y = ray.direction.y, r.dir_z = ray.direction.z;
        r.tnear = ray.t_min, r.tfar = ray.t_max;
        r.mask = ~0u;
        return r;
    }

    RTCDevice device_;
    RTCScene scene_;
};
