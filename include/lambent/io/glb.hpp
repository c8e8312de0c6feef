#pragma once
#include <lambent/core/error.hpp>
#include <lambent/io/partial_file.hpp>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Where a binary glTF's JSON and its first chunk of other bytes lie in it.
struct GlbChunks {
    std::size_t json = 0, json_size = 0, binary = 0, binary_size = 0;
};

/// Checks a binary glTF's header and chunk lengths against the bytes that are there.
inline GlbChunks check_glb(const PartialFile& bytes, const std::string& path) {
    const auto word = [&](std::size_t at) {
        std::uint32_t value = 0;
        std::memcpy(&value, bytes.range(at, 4).data(), 4);
        return std::uint64_t(value);
    };
    require(bytes.size() >= 20,
            [&] { return path + ": " + std::to_string(bytes.size()) + " bytes are no binary glTF"; });
    require(bytes.range(0, 4) == "glTF", [&] { return path + ": does not start with 'glTF'"; });
    require(word(4) == 2,
            [&] { return path + ": binary glTF version " + std::to_string(word(4)) + ", 2 is supported"; });
    const std::uint64_t length = word(8);
    require(length <= bytes.size(), [&] {
        return path + ": claims " + std::to_string(length) + " bytes but has " + std::to_string(bytes.size());
    });
    std::uint64_t at = 12;
    GlbChunks chunks;
    for (int chunk = 0; at + 8 <= length; ++chunk) {
        const std::uint64_t size = word(at);
        require(size <= length - at - 8, [&] {
            return path + ": chunk " + std::to_string(chunk) + " claims " + std::to_string(size) +
                   " bytes of " + std::to_string(length - at - 8);
        });
        require(chunk > 0 || (word(at + 4) == 0x4E4F534A && size > 0),
                [&] { return path + ": its first chunk is not JSON"; });
        if (chunk == 0) chunks.json = std::size_t(at) + 8, chunks.json_size = std::size_t(size);
        if (chunk == 1 && word(at + 4) == 0x004E4942) {
            chunks.binary = std::size_t(at) + 8;
            chunks.binary_size = std::size_t(size);
        }
        at += 8 + size;
    }
    return chunks;
}

/// Where JSON text has the digits of /buffers/0/byteLength, if that buffer is the binary chunk: (begin, length). Length 0
/// where that is not plain to see; the text need not be valid.
inline std::pair<std::size_t, std::size_t> binary_length(std::string_view text) {
    constexpr std::pair<std::size_t, std::size_t> unclear(0, 0);
    const auto after_space = [&](std::size_t i) {
        while (i < text.size() && (text[i] == ' ' || text[i] == '\t' || text[i] == '\n' || text[i] == '\r')) ++i;
        return i;
    };
    const auto at = [&](std::size_t i) { return i < text.size() ? text[i] : '\0'; };
    const auto digit = [&](std::size_t i) { return at(i) >= '0' && at(i) <= '9'; };
    std::pair<std::size_t, std::size_t> found = unclear;
    std::string_view root_key;
    bool seen = false, in_buffers = false, in_first = false;
    int depth = 0;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (c == '"') {
            std::size_t end = i + 1;
            bool escaped = false;
            for (; end < text.size() && text[end] != '"'; ++end)
                if (text[end] == '\\') escaped = true, ++end;
            const std::string_view word = text.substr(i + 1, std::min(end, text.size()) - i - 1);
            i = end;
            const std::size_t colon = after_space(end + 1);
            if (at(colon) != ':') continue;
            if (escaped && (depth == 1 || in_first)) return unclear;
            if (depth == 1) {
                root_key = word;
                if (word == "buffers" && std::exchange(seen, true)) return unclear;
            } else if (depth == 3 && in_first) {
                if (word == "uri") return unclear;
                if (word != "byteLength") continue;
                const std::size_t begin = after_space(colon + 1);
                std::size_t past = begin;
                while (digit(past)) ++past;
                if (found.second > 0 || past == begin || at(begin) == '0' || at(past) == '.' || at(past) == 'e' || at(past) == 'E') return unclear;
                found = {begin, past - begin};
            }
        } else if (c == '{' || c == '[') {
            ++depth;
            if (depth == 2) in_buffers = c == '[' && root_key == "buffers";
            if (depth == 3) in_first = c == '{' && in_buffers && found.second == 0;
        } else if (c == '}' || c == ']') {
            if (depth == 3 && in_first) {
                if (found.second == 0) return unclear;
                in_first = in_buffers = false;
            }
            --depth;
        }
    }
    return found;
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
