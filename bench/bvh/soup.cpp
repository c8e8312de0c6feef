#include "soup.hpp"
#include <lambent/core/error.hpp>
#include <lambent/io/file.hpp>
#include <array>
#include <cstring>
#include <fstream>

using namespace lambent;

namespace {

constexpr std::uint32_t rays_magic = 0x53594152; // 'RAYS'
constexpr std::size_t triangle_bytes = 36, ray_bytes = 32;

template <class T>
T take(const std::string& bytes, std::size_t offset) {
    T value;
    std::memcpy(static_cast<void*>(&value), bytes.data() + offset, sizeof value);
    return value;
}

class Output {
public:
    explicit Output(const std::string& path) : path_(path), out_(path, std::ios::binary) {}

    template <class T>
    void put(const T& value) {
        out_.write(reinterpret_cast<const char*>(&value), sizeof value);
    }
    void close() {
        out_.close();
        require(!out_.fail(), [&] { return path_ + ": cannot be written"; });
    }

private:
    std::string path_;
    std::ofstream out_;
};

} // namespace

Soup read_soup(const std::string& path) {
    const std::string bytes = lambent::detail::read_file(path);
    require(bytes.size() >= 4, [&] { return path + ": too short for a soup of triangles"; });
    const auto count = take<std::uint32_t>(bytes, 0);
    require(bytes.size() - 4 == count * triangle_bytes, [&] {
        return path + ": " + std::to_string(count) + " triangles do not fill " + std::to_string(bytes.size()) +
               " bytes";
    });
    Soup soup;
    soup.name = path;
    for (std::size_t i = 0; i < count; ++i) {
        const auto f = take<std::array<float, 9>>(bytes, 4 + i * triangle_bytes);
        soup.add({f[0], f[1], f[2]}, {f[3], f[4], f[5]}, {f[6], f[7], f[8]});
    }
    return soup;
}

void write_soup(const std::string& path, const Soup& soup) {
    Output out(path);
    out.put(std::uint32_t(soup.faces.size()));
    for (const UVec3& face : soup.faces)
        for (int k = 0; k < 3; ++k) out.put(soup.vertices[face[k]]);
    out.close();
}

RayClass read_rays(const std::string& path) {
    const std::string bytes = lambent::detail::read_file(path);
    require(bytes.size() >= 16, [&] { return path + ": too short for a file of rays"; });
    const auto head = take<std::array<std::uint32_t, 4>>(bytes, 0);
    require(head[0] == rays_magic && head[1] <= 1 && bytes.size() - 16 == head[2] * ray_bytes,
            [&] { return path + ": not a file of rays, or " + std::to_string(head[2]) + " rays do not fill it"; });
    RayClass rays;
    rays.name = path;
    rays.any = head[1] == 1;
    rays.coherent = path.find("primary") != std::string::npos;
    for (std::size_t i = 0; i < head[2]; ++i) {
        const auto f = take<std::array<float, 8>>(bytes, 16 + i * ray_bytes);
        rays.rays.push_back({{f[0], f[1], f[2]}, {f[4], f[5], f[6]}, f[3], f[7]});
    }
    return rays;
}

void write_rays(const std::string& path, const RayClass& rays) {
    Output out(path);
    out.put(std::array{rays_magic, std::uint32_t(rays.any), std::uint32_t(rays.rays.size()), 0u});
    for (const Rayf& r : rays.rays) {
        const Vec3f &o = r.origin, &d = r.direction;
        out.put(std::array{o.x, o.y, o.z, r.t_min, d.x, d.y, d.z, r.t_max});
    }
    out.close();
}
