#pragma once
#include <lambent/core/executor.hpp>
#include <lambent/io/file.hpp>
#include <lambent/io/gltf.hpp>
#include <lambent/io/obj.hpp>
#include <string>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Loads a scene by its file's extension: .gltf, .glb, .obj. The executor decodes images.
/// throws lambent::Error on another extension, and what load_gltf() and load_obj() throw
template <class T = float, class E>
Scene<T> load_scene(const std::string& path, const LoadOptions& options, E& executor) {
    const std::string extension = detail::extension_of(path);
    if (extension == "gltf" || extension == "glb") return load_gltf<T>(path, options, executor);
    if (extension == "obj") return load_obj<T>(path, options, executor);
    fail(path + ": unknown kind of scene; supported are .gltf, .glb and .obj");
}
/// The same, images decoded on the calling thread.
template <class T = float>
Scene<T> load_scene(const std::string& path, const LoadOptions& options = {}) {
    SerialExecutor serial;
    return load_scene<T>(path, options, serial);
}

} // namespace LAMBENT_ABI
} // namespace lambent
