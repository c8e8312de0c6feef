#pragma once
#include <lambent/core/error.hpp>
#include <lambent/io/file.hpp>
#include <lambent/io/load_options.hpp>
#include <lambent/io/scene_root.hpp>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <limits>
#include <string>
#include <string_view>
#include <tiny_gltf.h>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Checks a binary glTF's header and chunk lengths against the bytes that are there; gives its JSON.
inline std::string_view check_glb(std::string_view bytes, const std::string& path) {
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
    return bytes.substr(20, std::size_t(word(12)));
}

/// Checks that JSON text does not nest deeper than any glTF file does: readers recurse.
inline void check_json_depth(std::string_view text, const std::string& path) {
    constexpr int most = 256;
    int depth = 0;
    bool quoted = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (quoted) {
            if (c == '\\') ++i;
            else if (c == '"') quoted = false;
        } else if (c == '"') {
            quoted = true;
        } else if (c == '{' || c == '[') {
            require(++depth <= most, [&] { return path + ": JSON nested deeper than " + std::to_string(most); });
        } else if (c == '}' || c == ']') {
            --depth;
        }
    }
}

/// The files that a glTF document names, as tinygltf asks for them: regular ones inside of the scene's root, and no
/// more bytes than the options allow.
class GltfFiles {
public:
    GltfFiles(const std::string& path, const LoadOptions& options)
        : path_(path), root_(root_of(path, options)), left_(options.max_bytes), most_(options.max_bytes) {}

    /// Why the first file that was asked for was not given; empty if all were.
    const std::string& refusal() const { return refusal_; }

    tinygltf::FsCallbacks callbacks() {
        tinygltf::FsCallbacks c{};
        c.user_data = this;
        c.FileExists = [](const std::string& file, void* self) { return static_cast<GltfFiles*>(self)->exists(file); };
        c.ExpandFilePath = [](const std::string& file, void*) { return file; };
        c.ReadWholeFile = [](std::vector<unsigned char>* out, std::string*, const std::string& file, void* self) {
            return static_cast<GltfFiles*>(self)->read(*out, file);
        };
        return c;
    }

private:
    template <class F>
    bool attempt(F&& f) {
        try {
            f();
            return true;
        } catch (const std::exception& error) {
            if (refusal_.empty()) refusal_ = error.what();
            return false;
        }
    }
    bool exists(const std::string& file) {
        return attempt([&] {
            check_inside(root_, file, path_);
            file_size(file);
        });
    }
    bool read(std::vector<unsigned char>& out, const std::string& file) {
        return attempt([&] {
            const std::uint64_t size = file_size(file);
            require(size <= left_, [&] {
                return path_ + ": the files that it names have more than " + std::to_string(most_) + " bytes";
            });
            left_ -= std::size_t(size);
            read_file(file, out);
        });
    }

    const std::string& path_;
    std::string root_, refusal_;
    std::size_t left_, most_;
};

/// Parses the bytes of a .gltf or .glb file named `path`, which of the two by its first bytes, with buffers and images
/// loaded but nothing checked.
/// throws lambent::Error with tinygltf's words on what it notices
inline tinygltf::Model parse_gltf(std::string_view bytes, const std::string& path, const LoadOptions& options) {
    require(!bytes.empty(), [&] { return path + ": the file is empty"; });
    require(bytes.size() <= std::numeric_limits<std::uint32_t>::max(),
            [&] { return path + ": larger than 4 GiB"; });
    const bool binary = bytes.starts_with("glTF") || extension_of(path) == "glb";
    check_json_depth(binary ? check_glb(bytes, path) : bytes, path);
    GltfFiles files(path, options);
    tinygltf::Model model;
    tinygltf::TinyGLTF parser;
    parser.SetFsCallbacks(files.callbacks());
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
    require(parsed, [&] {
        return path + ": " + (error.empty() ? "not a glTF file" : error) +
               (files.refusal().empty() ? "" : " (" + files.refusal() + ")");
    });
    return model;
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
