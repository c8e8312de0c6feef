#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/vec.hpp>
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
    GltfAccessors(const tinygltf::Model& model, const std::string& path) : model_(model), path_(path) {}

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

    /// All elements of an accessor of unsigned integers.
    std::vector<std::uint32_t> indices(int accessor) const {
        const tinygltf::Accessor& a = model_.accessors[std::size_t(accessor)];
        std::vector<std::uint32_t> out(a.count, 0);
        const auto size = std::size_t(tinygltf::GetComponentSizeInBytes(std::uint32_t(a.componentType)));
        if (a.bufferView != -1) {
            const tinygltf::BufferView& view = model_.bufferViews[std::size_t(a.bufferView)];
            const std::size_t stride = view.byteStride == 0 ? size : view.byteStride;
            const unsigned char* data = bytes(a.bufferView) + a.byteOffset;
            for (std::size_t i = 0; i < a.count; ++i) out[i] = unsigned_integer(data + i * stride, size);
        }
        if (a.sparse.isSparse) {
            const unsigned char* values = bytes(a.sparse.values.bufferView) + a.sparse.values.byteOffset;
            for_sparse(accessor, [&](std::size_t k, std::size_t at) {
                out[at] = unsigned_integer(values + k * size, size);
            });
        }
        return out;
    }

private:
    const unsigned char* bytes(int buffer_view) const {
        const tinygltf::BufferView& view = model_.bufferViews[std::size_t(buffer_view)];
        return model_.buffers[std::size_t(view.buffer)].data.data() + view.byteOffset;
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

    const tinygltf::Model& model_;
    const std::string& path_;
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
