#pragma once
#include <lambent/core/error.hpp>
#include <lambent/io/file.hpp>
#include <lambent/io/glb.hpp>
#include <lambent/io/load_options.hpp>
#include <lambent/io/partial_file.hpp>
#include <lambent/io/scene_root.hpp>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <tiny_gltf.h>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

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

/// tinygltf's model, some of which may be left in files: the first buffer of a .glb, which is read where somebody looks
/// at it, and images that are files of their own. Refers to the .glb.
struct GltfModel : tinygltf::Model {
    const PartialFile* file = nullptr; ///< that buffers[0] is left in, if it is
    std::size_t offset = 0, length = 0; ///< of it there
    std::map<int, std::string> image_files{}; ///< by index; the bytes of others are there, or could not be had

    std::size_t buffer_size(std::size_t buffer) const {
        return file != nullptr && buffer == 0 ? length : buffers[buffer].data.size();
    }
    /// A validated buffer view's bytes.
    std::string_view view_bytes(int view) const {
        const tinygltf::BufferView& v = bufferViews[std::size_t(view)];
        if (file != nullptr && v.buffer == 0) return file->range(offset + v.byteOffset, v.byteLength);
        return {reinterpret_cast<const char*>(buffers[std::size_t(v.buffer)].data.data()) + v.byteOffset, v.byteLength};
    }
};

/// The files that a glTF document names, as tinygltf asks for them: regular ones inside of the scene's root, and no
/// more bytes than the options allow. Images are not read, but their names kept.
class GltfFiles {
public:
    GltfFiles(const std::string& path, const LoadOptions& options, GltfModel& model)
        : path_(path), root_(root_of(path, options)), left_(options.max_bytes), most_(options.max_bytes),
          model_(model) {}

    /// Why the first file that was asked for was not given; empty if all were.
    const std::string& refusal() const { return refusal_; }

    /// Takes what tinygltf makes of an image; images of buffer views, whose range nobody has checked yet, it does not
    /// even look at. All are decoded later, once they are known to be used.
    void take(tinygltf::Image& image, int index, const unsigned char* data, int size) {
        if (image.bufferView >= 0) return;
        if (left_out_.empty()) image.image.assign(data, data + size);
        else model_.image_files[index] = std::exchange(left_out_, {});
    }

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
            // tinygltf says not for what it wants a file. It has all buffers before the first view of them, and images
            // after: only where there is no view, and so next to nothing to see, an image is read like a buffer.
            if (model_.bufferViews.empty()) return read_file(file, out);
            left_out_ = file;
            out.assign(1, 0); // no file would be an error of the document
        });
    }

    const std::string& path_;
    std::string root_, refusal_, left_out_; ///< the last: of the image that is next
    std::size_t left_, most_;
    GltfModel& model_;
};

/// What tinygltf gets to see of a binary glTF whose buffer it need not copy: the same JSON, but with a buffer of 4 bytes.
/// Fills in where the true one lies. Empty if it has to see all of the file.
inline std::string without_binary(const PartialFile& file, const GlbChunks& chunks, GltfModel& model) {
    std::string_view json = file.range(chunks.json, chunks.json_size);
    const auto [begin, digits] = binary_length(json);
    if (digits == 0 || digits > 10 || chunks.json_size % 4 != 0) return {};
    const auto length = std::size_t(std::stoull(std::string(json.substr(begin, digits))));
    if (length == 0 || length > chunks.binary_size) return {};
    model.file = &file;
    model.offset = chunks.binary;
    model.length = length;
    std::string out(file.range(0, chunks.json + chunks.json_size));
    out.replace(chunks.json + begin, digits, "4" + std::string(digits - 1, ' '));
    const auto add = [&](std::uint32_t word) { out.append(reinterpret_cast<const char*>(&word), 4); };
    add(4), add(0x004E4942), add(0);
    const auto size = std::uint32_t(out.size());
    std::memcpy(out.data() + 8, &size, 4);
    return out;
}

/// Parses a .gltf or .glb file named `path`, which of the two by its first bytes, with buffers loaded but nothing checked;
/// those of a .glb, and images, are left in their files.
/// throws lambent::Error with tinygltf's words on what it notices
inline GltfModel parse_gltf(const PartialFile& file, const std::string& path, const LoadOptions& options) {
    require(file.size() > 0, [&] { return path + ": the file is empty"; });
    require(file.size() <= std::numeric_limits<std::uint32_t>::max(),
            [&] { return path + ": larger than 4 GiB"; });
    const bool binary = file.range(0, std::min<std::size_t>(4, file.size())) == "glTF" || extension_of(path) == "glb";
    GltfModel model;
    std::string_view bytes;
    std::string shorter;
    if (binary) {
        const GlbChunks chunks = check_glb(file, path);
        check_json_depth(file.range(chunks.json, chunks.json_size), path);
        shorter = without_binary(file, chunks, model);
        bytes = shorter.empty() ? file.all() : std::string_view(shorter);
    } else {
        bytes = file.all();
        check_json_depth(bytes, path);
    }
    GltfFiles files(path, options, model);
    tinygltf::TinyGLTF parser;
    parser.SetFsCallbacks(files.callbacks());
    parser.SetImageLoader(
        [](tinygltf::Image* image, int index, std::string*, std::string*, int, int, const unsigned char* data, int size,
           void* self) {
            static_cast<GltfFiles*>(self)->take(*image, index, data, size);
            return true;
        },
        &files);
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
