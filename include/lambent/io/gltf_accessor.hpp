#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/vec.hpp>
#include <lambent/io/gltf_parse.hpp>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <tiny_gltf.h>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// One component as stored, to double; normalised integers by glTF 2.0 §3.6.2.2.
inline double gltf_component(const unsigned char* p, int type, bool normalized) {
    const auto load = [p](auto value) {
        std::memcpy(&value, p, sizeof value);
        return double(value);
    };
    switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE: {
        const double v = load(std::int8_t());
        return normalized ? std::max(v / 127, -1.0) : v;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        return load(std::uint8_t()) / (normalized ? 255 : 1);
    case TINYGLTF_COMPONENT_TYPE_SHORT: {
        const double v = load(std::int16_t());
        return normalized ? std::max(v / 32767, -1.0) : v;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        return load(std::uint16_t()) / (normalized ? 65535 : 1);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        return load(std::uint32_t());
    case TINYGLTF_COMPONENT_TYPE_INT:
        return load(std::int32_t());
    default:
        return load(float());
    }
}

/// Reads accessors of a validated model.
class GltfAccessors {
public:
    GltfAccessors(const GltfModel& model, const std::string& path) : model_(model), path_(path) {}

    /// All elements as vectors of type V (Vec2f, Vec3f, Vec4f); components that the accessor lacks are 1.
    /// throws lambent::Error on a sparse index out of range
    template <class V>
    std::vector<V> vectors(int accessor) const {
        const tinygltf::Accessor& a = model_.accessors[std::size_t(accessor)];
        const int stored = tinygltf::GetNumComponentsInType(std::uint32_t(a.type));
        const int components = std::min(stored, int(V::length()));
        const auto component_size =
            std::size_t(tinygltf::GetComponentSizeInBytes(std::uint32_t(a.componentType)));
        std::vector<V> out(a.count, a.bufferView == -1 ? V(0) : V(1));
        const auto decode = [&](const unsigned char* p, V& value) {
            if (a.componentType == TINYGLTF_COMPONENT_TYPE_FLOAT && components == V::length()) {
                std::memcpy(&value, p, sizeof value);
                return;
            }
            for (int c = 0; c < components; ++c)
                value[c] =
                    float(gltf_component(p + std::size_t(c) * component_size, a.componentType, a.normalized));
        };
        const std::size_t size = component_size * std::size_t(stored);
        if (a.bufferView != -1) {
            const tinygltf::BufferView& view = model_.bufferViews[std::size_t(a.bufferView)];
            const std::size_t stride = view.byteStride == 0 ? size : view.byteStride;
            const unsigned char* data = bytes(a.bufferView) + a.byteOffset;
            for (std::size_t i = 0; i < a.count; ++i) decode(data + i * stride, out[i]);
        }
        if (a.sparse.isSparse) {
            const unsigned char* values = bytes(a.sparse.values.bufferView) + a.sparse.values.byteOffset;
            for_sparse(accessor, [&](std::size_t k, std::size_t at) { decode(values + k * size, out[at]); });
        }
        return out;
    }

    /// Calls f(i, element) for every element in order; without a copy where they are stored as V itself.
    template <class V, class F>
    void for_each(int accessor, F&& f) const {
        const tinygltf::Accessor& a = model_.accessors[std::size_t(accessor)];
        const bool plain = a.componentType == TINYGLTF_COMPONENT_TYPE_FLOAT && a.bufferView != -1 && !a.sparse.isSparse &&
                           tinygltf::GetNumComponentsInType(std::uint32_t(a.type)) == V::length();
        if (!plain) {
            const std::vector<V> values = vectors<V>(accessor);
            for (std::size_t i = 0; i < values.size(); ++i) f(i, values[i]);
            return;
        }
        const std::size_t stride = model_.bufferViews[std::size_t(a.bufferView)].byteStride;
        const unsigned char* data = bytes(a.bufferView) + a.byteOffset;
        for (std::size_t i = 0; i < a.count; ++i, data += stride == 0 ? sizeof(V) : stride) {
            V value;
            std::memcpy(&value, data, sizeof value);
            f(i, value);
        }
    }

    /// Calls f(at) with a function at(i) that gives element i of an accessor of unsigned integers.
    template <class F>
    void with_indices(int accessor, F&& f) const {
        const tinygltf::Accessor& a = model_.accessors[std::size_t(accessor)];
        const auto size = std::size_t(tinygltf::GetComponentSizeInBytes(std::uint32_t(a.componentType)));
        if (a.bufferView == -1 || a.sparse.isSparse) {
            std::vector<std::uint32_t> values(a.count, 0);
            if (a.bufferView != -1)
                visit_indices(a, size, [&](auto&& at) {
                    for (std::size_t i = 0; i < a.count; ++i) values[i] = at(i);
                });
            if (a.sparse.isSparse) {
                const unsigned char* data = bytes(a.sparse.values.bufferView) + a.sparse.values.byteOffset;
                for_sparse(accessor, [&](std::size_t k, std::size_t at) {
                    values[at] = unsigned_integer(data + k * size, size);
                });
            }
            f([&](std::size_t i) { return values[i]; });
        } else {
            visit_indices(a, size, f);
        }
    }

private:
    const unsigned char* bytes(int buffer_view) const {
        return reinterpret_cast<const unsigned char*>(model_.view_bytes(buffer_view).data());
    }

    static std::uint32_t unsigned_integer(const unsigned char* p, std::size_t size) {
        std::uint16_t u16 = 0;
        std::uint32_t u32 = 0;
        if (size == 1) return *p;
        if (size == 2) {
            std::memcpy(&u16, p, 2);
            return u16;
        }
        std::memcpy(&u32, p, 4);
        return u32;
    }

    /// with_indices() of an accessor that has a view and no sparse elements: one loop for each size.
    template <class F>
    void visit_indices(const tinygltf::Accessor& a, std::size_t size, F&& f) const {
        const std::size_t own = model_.bufferViews[std::size_t(a.bufferView)].byteStride, stride = own == 0 ? size : own;
        const unsigned char* data = bytes(a.bufferView) + a.byteOffset;
        const auto read = [&](auto type) {
            f([=](std::size_t i) {
                decltype(type) value;
                std::memcpy(&value, data + i * stride, sizeof value);
                return std::uint32_t(value);
            });
        };
        if (size == 1) read(std::uint8_t());
        else if (size == 2) read(std::uint16_t());
        else read(std::uint32_t());
    }

    /// Calls use(k, index) for the k-th substituted element.
    template <class Use>
    void for_sparse(int accessor, Use&& use) const {
        const tinygltf::Accessor& a = model_.accessors[std::size_t(accessor)];
        const auto size =
            std::size_t(tinygltf::GetComponentSizeInBytes(std::uint32_t(a.sparse.indices.componentType)));
        const unsigned char* data = bytes(a.sparse.indices.bufferView) + a.sparse.indices.byteOffset;
        for (std::size_t k = 0; k < std::size_t(a.sparse.count); ++k) {
            const std::size_t at = unsigned_integer(data + k * size, size);
            require(at < a.count, [&] {
                return path_ + ": /accessors/" + std::to_string(accessor) + "/sparse/indices: index " +
                       std::to_string(at) + " of " + std::to_string(a.count);
            });
            use(k, at);
        }
    }

    const GltfModel& model_;
    const std::string& path_;
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
