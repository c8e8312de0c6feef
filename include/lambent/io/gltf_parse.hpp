#pragma once
#include <lambent/core/error.hpp>
#include <lambent/io/file.hpp>
#include <cstdint>
#include <cstring>
#include <exception>
#include <filesystem>
#include <limits>
#include <string>
#include <system_error>
#include <tiny_gltf.h>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Checks a binary glTF's header and chunk lengths against the bytes that are there.
inline void check_glb(const std::string& bytes, const std::string& path) {
    const auto word = [&](std::size_t at) {
        std::uint32_t value = 0;
        std::memcpy(&value, bytes.data() + at, 4);
        return std::uint64_t(value);
    };
    require(bytes.size() >= 20,
            [&] { return path + ": " + std::to_string(bytes.size()) + " bytes are no binary glTF"; });
    require(bytes.starts_with("glTF"), [&] { return path + ": does not start with 'glTF'"; });
    require(word(4) == 2,
            [&] { return path + ": binary glTF version " + std::to_string(word(4)) + ", 2 is supported"; });
    const std::uint64_t length = word(8);
    require(length <= bytes.size(), [&] {
        return path + ": claims " + std::to_string(length) + " bytes but has " + std::to_string(bytes.size());
    });
    std::uint64_t at = 12;
    for (int chunk = 0; at + 8 <= length; ++chunk) {
        const std::uint64_t size = word(at);
        require(size <= length - at - 8, [&] {
            return path + ": chunk " + std::to_string(chunk) + " claims " + std::to_string(size) +
                   " bytes of " + std::to_string(length - at - 8);
        });
        require(chunk > 0 || (word(at + 4) == 0x4E4F534A && size > 0),
                [&] { return path + ": its first chunk is not JSON"; });
        at += 8 + size;
    }
}

/// tinygltf reads files through these: regular files only, and images stay as they are stored.
inline tinygltf::FsCallbacks gltf_file_callbacks() {
    tinygltf::FsCallbacks callbacks{};
    callbacks.FileExists = [](const std::string& file, void*) {
        std::error_code error;
        return std::filesystem::is_regular_file(file, error);
    };
    callbacks.ExpandFilePath = [](const std::string& file, void*) { return file; };
    callbacks.ReadWholeFile = [](std::vector<unsigned char>* out, std::string* message,
                                 const std::string& file, void*) {
        try {
            const std::string bytes = read_file(file);
            out->assign(bytes.begin(), bytes.end());
            return true;
        } catch (const std::exception& error) {
            if (message != nullptr) *message += error.what();
            return false;
        }
    };
    return callbacks;
}

/// Parses a .gltf or .glb file, by its first bytes, with buffers and images loaded but nothing checked.
/// throws lambent::Error with tinygltf's words on what it notices
inline tinygltf::Model parse_gltf(const std::string& path) {
    const std::string bytes = read_file(path);
    require(!bytes.empty(), [&] { return path + ": the file is empty"; });
    require(bytes.size() <= std::numeric_limits<std::uint32_t>::max(),
            [&] { return path + ": larger than 4 GiB"; });
    const bool binary = bytes.starts_with("glTF") || extension_of(path) == "glb";
    if (binary) check_glb(bytes, path);
    tinygltf::Model model;
    tinygltf::TinyGLTF parser;
    parser.SetFsCallbacks(gltf_file_callbacks());
    // Encoded images are kept and decoded later, once they are known to be used; those in a buffer view,
    // whose range nobody has checked here, are not even looked at.
    parser.SetImageLoader(
        [](tinygltf::Image* image, int, std::string*, std::string*, int, int, const unsigned char* data,
           int size, void*) {
            if (image->bufferView < 0 && size > 0) image->image.assign(data, data + size);
            return true;
        },
        nullptr);
    std::string error, warning;
    bool parsed = false;
    try {
        const auto size = std::uint32_t(bytes.size());
        const std::string folder = folder_of(path);
        parsed = binary ? parser.LoadBinaryFromMemory(&model, &error, &warning,
                                                      reinterpret_cast<const unsigned char*>(bytes.data()),
                                                      size, folder)
                        : parser.LoadASCIIFromString(&model, &error, &warning, bytes.data(), size, folder);
    } catch (const std::exception& exception) {
        error = exception.what();
    }
    for (char& c : error)
        if (c == '\n') c = ' ';
    while (error.ends_with(' ')) error.pop_back();
    require(parsed, [&] { return path + ": " + (error.empty() ? "not a glTF file" : error); });
    return model;
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
