#pragma once
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace lambent_test {

inline std::string base64(std::string_view bytes) {
    const char* const digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t block = 0;
        for (std::size_t k = 0; k < 3; ++k)
            block = block << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
        for (std::size_t k = 0; k < 4; ++k)
            out += i + k > bytes.size() ? '=' : digits[block >> (18 - 6 * k) & 63];
    }
    return out;
}

/// Puts together small glTF documents with one embedded buffer.
class GltfBuilder {
public:
    /// Appends raw values as a buffer view of their own and gives its index.
    template <class Value>
    int view(std::initializer_list<Value> values, int stride = 0) {
        while (bytes_.size() % 4 != 0) bytes_ += '\0';
        const std::size_t offset = bytes_.size();
        for (const Value v : values) bytes_.append(reinterpret_cast<const char*>(&v), sizeof v);
        add(views_, R"({"buffer":0,"byteOffset":)" + std::to_string(offset) + R"(,"byteLength":)" +
                        std::to_string(bytes_.size() - offset) +
                        (stride > 0 ? R"(,"byteStride":)" + std::to_string(stride) : "") + "}");
        return view_count_++;
    }

    /// Adds an accessor of a view (-1: none) and gives its index; `more` is JSON to go with it.
    int accessor(int buffer_view, int component, const char* type, int count, const std::string& more = "") {
        add(accessors_, (buffer_view >= 0 ? R"({"bufferView":)" + std::to_string(buffer_view) + "," : "{") +
                            R"("componentType":)" + std::to_string(component) + R"(,"type":")" + type +
                            R"(","count":)" + std::to_string(count) + more + "}");
        return accessor_count_++;
    }

    int floats(const char* type, int count, std::initializer_list<float> values) {
        return accessor(view(values), 5126, type, count);
    }

    /// The document with these accessors; `rest` holds its other top-level members.
    std::string json(const std::string& rest) const {
        return R"({"asset":{"version":"2.0"},)" + rest + R"(,"buffers":[{"byteLength":)" +
               std::to_string(bytes_.size()) + R"(,"uri":"data:application/octet-stream;base64,)" +
               base64(bytes_) + R"("}],"bufferViews":[)" + views_ + R"(],"accessors":[)" + accessors_ + "]}";
    }

    /// One node that shows one mesh.
    std::string mesh(const std::string& primitives, const std::string& node = "",
                     const std::string& rest = "") const {
        return json(R"("scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0)" + node +
                    R"(}],"meshes":[{"primitives":[)" + primitives + "]}]" + rest);
    }

private:
    static void add(std::string& list, const std::string& entry) {
        list += (list.empty() ? "" : ",") + entry;
    }

    std::string bytes_, views_, accessors_;
    int view_count_ = 0, accessor_count_ = 0;
};

} // namespace lambent_test
