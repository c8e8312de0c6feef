#pragma once
#include <cstddef>
#include <cstdint>
#include <sys/types.h>

/// What this benchmark calls of Embree, after the documentation of its C interface: handles are pointers, enums
/// are ints, and 3 and 4 differ in what a query takes besides the rays.
namespace embree_abi {

using Handle = void*; ///< device, scene or geometry

enum : int {
    property_version_major = 1,
    property_version_minor = 2,
    property_version_patch = 3,
    geometry_triangle = 0,
    buffer_index = 0,
    buffer_vertex = 1,
    format_uint3 = 0x5003,
    format_float3 = 0x9003,
};
inline constexpr std::uint32_t invalid_id = ~0u;

struct alignas(16) Ray {
    float origin[3], t_near, direction[3], time, t_far;
    std::uint32_t mask, id, flags;
};
/// 4.4 added the instance's primitive; elsewhere its place is never written.
struct alignas(16) Hit {
    float normal[3], u, v;
    std::uint32_t primitive, geometry, instance, instance_primitive;
};
struct RayHit {
    Ray ray;
    Hit hit;
};

template <std::size_t n>
struct alignas(4 * n) Rays {
    float origin[3][n], t_near[n], direction[3][n], time[n], t_far[n];
    std::uint32_t mask[n], id[n], flags[n];
};
template <std::size_t n>
struct alignas(4 * n) Hits {
    float normal[3][n], u[n], v[n];
    std::uint32_t primitive[n], geometry[n], instance[n], instance_primitive[n];
};
template <std::size_t n>
struct RayHits {
    Rays<n> ray;
    Hits<n> hit;
};

/// The third argument in Embree 3, before the rays.
struct Context3 {
    int flags; ///< 1: coherent
    void* filter = nullptr;
    std::uint32_t instance = invalid_id;
};
/// The last argument in Embree 4, after the rays.
struct Arguments4 {
    int flags; ///< 1 << 16: coherent
    std::uint32_t features = ~0u;
    void *context = nullptr, *filter = nullptr, *callback = nullptr;
    float min_width = 0;
};

} // namespace embree_abi
