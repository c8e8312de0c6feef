#pragma once
#include <lambent/io/gltf.hpp>
#include <io/gltf_builder.hpp>
#include <support/temporary_folder.hpp>
#include <doctest/doctest.h>
#include <cstdint>
#include <string>

namespace lambent_test {

/// A number as a .glb has it.
inline std::string word(std::uint32_t value) { return std::string(reinterpret_cast<const char*>(&value), 4); }

inline lambent::Scene<float> load_text(const std::string& text, const lambent::LoadOptions& options = {}) {
    const TemporaryFolder folder;
    return lambent::load_gltf(folder.write("scene.gltf", text), options);
}

/// What load_gltf() says of a document that it refuses; it names the file.
inline std::string gltf_refusal(const std::string& text, const lambent::LoadOptions& options = {}) {
    try {
        load_text(text, options);
    } catch (const lambent::Error& error) {
        CHECK(std::string(error.what()).find("scene.gltf: ") != std::string::npos);
        return error.what();
    }
    return "loaded";
}

inline bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// Position accessor 0: (0,0,0) (1,0,0) (0,1,0) (1,1,0).
inline GltfBuilder square() {
    GltfBuilder b;
    b.floats("VEC3", 4, {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0});
    return b;
}

} // namespace lambent_test
