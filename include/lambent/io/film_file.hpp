#pragma once
#include <lambent/core/content_hash.hpp>
#include <lambent/core/error.hpp>
#include <lambent/film/film.hpp>
#include <lambent/film/region.hpp>
#include <lambent/io/file.hpp>
#include <lambent/scene/camera.hpp>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdio>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// A film, and what it takes to go on with it or to make an image of it.
template <class T>
struct FilmState {
    Film<T> film;
    int width = 0, height = 0; ///< of the whole image
    PixelWindow window;        ///< the part that the film covers
    Camera camera;
    Vec3d origin{0};           ///< Scene::origin, to which the film's positions are relative
    std::map<std::string, std::string> identity; ///< what the samples depend on, in words: scene, seed, integrator …
    std::map<std::string, std::string> settings; ///< what they do not depend on: how to make the image
};

/// The first thing in which two states differ so that their samples must not be mixed, as "seed is 1, not 0"; empty
/// where they are of one render. Not the planes, nor which samples are in: those are Film's.
template <class T>
std::string difference(const FilmState<T>& a, const FilmState<T>& b) {
    const auto differs = [](const std::string& what, const std::string& of_a, const std::string& of_b) {
        return what + " is " + of_a + ", not " + of_b;
    };
    const auto size = [](const FilmState<T>& s) { return std::to_string(s.width) + " x " + std::to_string(s.height); };
    if (a.width != b.width || a.height != b.height) return differs("size", size(a), size(b));
    const auto crop = [](const PixelWindow& w) {
        return std::to_string(w.x0) + "," + std::to_string(w.y0) + "," + std::to_string(w.x1) + "," + std::to_string(w.y1);
    };
    if (a.window != b.window) return differs("crop", crop(a.window), crop(b.window));
    for (const auto& [key, value] : a.identity) {
        const auto other = b.identity.find(key);
        if (other == b.identity.end()) return differs(key, value, "given");
        if (other->second != value) return differs(key, value, other->second);
    }
    for (const auto& [key, value] : b.identity)
        if (!a.identity.contains(key)) return differs(key, "not given", value);
    return {};
}

// The file, little-endian, without padding:
//   char[8]  "\x89LFILM\r\n"       u32 version = 2          u32 bytes of a scalar (4 or 8)
//   i32      width, height, x0, y0, x1, y1
//   u32      planes (FilmPlanes)   u32 number of blocks     u64 rejected samples
//   f64      camera: eye, target, up, vertical_fov; origin                       (13 of them)
//   twice    u32 number of pairs, then key and value, each u32 length and bytes  (identity, settings)
//   u32      0, or 1 where pixels have stopped
//   i32      material index a pixel, if the planes have it
//   u8       log2 of the sample index at which it stopped, a pixel, or 255, if pixels have
//   a block  u64 first sample      u32 level                then the sums, pixel by pixel
//   u64      ContentHash of all before, fed as it was written
namespace detail {

inline constexpr std::array<char, 8> film_magic = {'\x89', 'L', 'F', 'I', 'L', 'M', '\r', '\n'};
inline constexpr std::uint32_t film_version = 2;
inline constexpr std::uint64_t max_film_pixels = std::uint64_t(1) << 32;
static_assert(std::endian::native == std::endian::little, "film files are written as they lie in memory");

class FilmWriter {
public:
    FilmWriter(std::FILE* file, const std::string& path) : file_(file), path_(path) {}

    void bytes(const void* data, std::size_t size) {
        hash_.add_bytes(data, size);
        require(size == 0 || std::fwrite(data, 1, size, file_) == size,
                [&] { return path_ + ": cannot be written; is the disk full?"; });
    }
    template <class V>
    void value(const V& v) {
        bytes(&v, sizeof(V));
    }
    void text(const std::string& s) {
        value(std::uint32_t(s.size()));
        bytes(s.data(), s.size());
    }
    void pairs(const std::map<std::string, std::string>& map) {
        value(std::uint32_t(map.size()));
        for (const auto& [key, content] : map) {
            text(key);
            text(content);
        }
    }
    void finish() { value(hash_.value()); }

private:
    std::FILE* file_;
    const std::string& path_;
    ContentHash hash_;
};

/// Reads no more than the file holds, whatever it claims.
class FilmReader {
public:
    FilmReader(std::FILE* file, const std::string& path, std::uint64_t size) : file_(file), path_(path), left_(size) {}

    std::uint64_t left() const { return left_; }

    void bytes(void* data, std::size_t size) {
        need(size);
        require(size == 0 || std::fread(data, 1, size, file_) == size,
                [&] { return path_ + ": cannot be read to its end"; });
        left_ -= size;
        hash_.add_bytes(data, size);
    }
    template <class V>
    V value() {
        V v{};
        bytes(&v, sizeof(V));
        return v;
    }
    std::string text() {
        const auto size = value<std::uint32_t>();
        need(size);
        std::string s(size, '\0');
        bytes(s.data(), size);
        return s;
    }
    std::map<std::string, std::string> pairs() {
        std::map<std::string, std::string> map;
        const auto count = value<std::uint32_t>();
        for (std::uint32_t i = 0; i < count; ++i) {
            std::string key = text();
            map[std::move(key)] = text();
        }
        return map;
    }
    void finish() {
        const std::uint64_t expected = hash_.value();
        require(value<std::uint64_t>() == expected, [&] { return path_ + ": damaged, its checksum does not fit"; });
    }

private:
    void need(std::uint64_t size) const {
        require(size <= left_, [&] {
            return path_ + ": cut short, " + std::to_string(size) + " more bytes belong where " +
                   std::to_string(left_) + " are left";
        });
    }

    std::FILE* file_;
    const std::string& path_;
    std::uint64_t left_;
    ContentHash hash_;
};

/// The camera's and the origin's numbers in the order of the file.
template <class State, class Visit>
void each_film_number(State& state, Visit&& visit) {
    for (auto* v : {&state.camera.eye, &state.camera.target, &state.camera.up})
        for (int c = 0; c < 3; ++c) visit((*v)[c]);
    visit(state.camera.vertical_fov);
    for (int c = 0; c < 3; ++c) visit(state.origin[c]);
}

} // namespace detail

/// Writes a film's state. The file appears whole or not at all.
/// throws lambent::Error when the film does not fit the window or the file cannot be written
template <class T>
void write_film(const std::string& path, const FilmState<T>& state) {
    const Film<T>& film = state.film;
    require(film.width() == state.window.width() && film.height() == state.window.height(),
            [&] { return path + ": the film's size is not its window's"; });
    detail::PendingFile pending(path);
    detail::OpenFile file(std::fopen(pending.name().c_str(), "wb"));
    require(file != nullptr, [&] { return path + ": cannot be opened for writing"; });
    detail::FilmWriter out(file.get(), path);
    out.value(detail::film_magic);
    out.value(detail::film_version);
    out.value(std::uint32_t(sizeof(T)));
    for (const int i : {state.width, state.height, state.window.x0, state.window.y0, state.window.x1, state.window.y1})
        out.value(std::int32_t(i));
    out.value(std::uint32_t(film.planes()));
    out.value(std::uint32_t(film.blocks().size()));
    out.value(film.rejected());
    detail::each_film_number(state, [&](double number) { out.value(number); });
    out.pairs(state.identity);
    out.pairs(state.settings);
    out.value(std::uint32_t(film.stops().empty() ? 0 : 1));
    out.bytes(film.material().data(), film.material().size() * sizeof(std::int32_t));
    out.bytes(film.stops().data(), film.stops().size());
    for (const auto& block : film.blocks()) {
        out.value(block.samples.first);
        out.value(block.samples.level);
        out.bytes(block.sums.data(), block.sums.size() * sizeof(T));
    }
    out.finish();
    const bool closed = std::fclose(file.release()) == 0;
    require(closed, [&] { return path + ": cannot be written; is the disk full?"; });
    pending.commit();
}

/// Reads what write_film() wrote, to the bit.
/// throws lambent::Error on a file that is none of ours, of another version or scalar, cut short, damaged or not in
///         order; takes no more memory than the file's size
template <class T = float>
FilmState<T> read_film(const std::string& path) {
    const std::uint64_t size = detail::file_size(path);
    const detail::OpenFile file(std::fopen(path.c_str(), "rb"));
    require(file != nullptr, [&] { return path + ": cannot be opened for reading"; });
    detail::FilmReader in(file.get(), path, size);
    require(size >= sizeof(detail::film_magic) && in.value<std::array<char, 8>>() == detail::film_magic,
            [&] { return path + ": not a film file"; });
    const auto version = in.value<std::uint32_t>();
    require(version == detail::film_version, [&] {
        return path + ": film file of version " + std::to_string(version) + ", this program knows version " +
               std::to_string(detail::film_version);
    });
    const auto scalar = in.value<std::uint32_t>();
    require(scalar == sizeof(T), [&] {
        return path + ": its numbers have " + std::to_string(scalar) + " bytes, " + std::to_string(sizeof(T)) + " are wanted";
    });

    FilmState<T> state;
    for (int* i : {&state.width, &state.height, &state.window.x0, &state.window.y0, &state.window.x1, &state.window.y1})
        *i = in.value<std::int32_t>();
    const PixelWindow& window = state.window;
    require(!window.empty() && window.inside(state.width, state.height), [&] {
        return path + ": pixels [" + std::to_string(window.x0) + ", " + std::to_string(window.x1) + ") x [" +
               std::to_string(window.y0) + ", " + std::to_string(window.y1) + ") of an image of " +
               std::to_string(state.width) + " x " + std::to_string(state.height);
    });
    const auto plane_bits = in.value<std::uint32_t>();
    const auto blocks = in.value<std::uint32_t>();
    const auto rejected = in.value<std::uint64_t>();
    require(plane_bits <= std::uint32_t(FilmPlanes::statistics),
            [&] { return path + ": unknown planes " + std::to_string(plane_bits); });
    require(blocks <= 64, [&] { return path + ": " + std::to_string(blocks) + " blocks of samples are too many"; });
    const auto planes = FilmPlanes(plane_bits);
    detail::each_film_number(state, [&](double& number) {
        number = in.value<double>();
        require(is_finite(number), [&] { return path + ": the camera or the origin is not a finite number"; });
    });
    state.identity = in.pairs();
    state.settings = in.pairs();

    const std::uint64_t pixels = std::uint64_t(window.width()) * std::uint64_t(window.height());
    require(pixels <= detail::max_film_pixels, [&] { return path + ": " + std::to_string(pixels) + " pixels are too many"; });
    const auto has_stops = in.value<std::uint32_t>();
    require(has_stops <= 1,
            [&] { return path + ": " + std::to_string(has_stops) + " where 0 or 1 says whether pixels stopped"; });
    const bool has_material = contains(planes, FilmPlanes::material);
    const auto channels = std::uint64_t(detail::FilmLayout(planes).channels);
    const std::uint64_t expected =
        (has_material ? 4 * pixels : 0) + has_stops * pixels + blocks * (12 + pixels * channels * sizeof(T)) + 8;
    require(expected == in.left(), [&] {
        return path + ": " + std::to_string(in.left()) + " bytes follow the header where " + std::to_string(blocks) +
               " blocks of " + std::to_string(window.width()) + " x " + std::to_string(window.height()) + " pixels with " +
               std::to_string(channels) + " channels take " + std::to_string(expected);
    });
    std::vector<std::int32_t> material(has_material ? pixels : 0);
    in.bytes(material.data(), material.size() * sizeof(std::int32_t));
    std::vector<typename Film<T>::Stop> stops(has_stops * pixels);
    in.bytes(stops.data(), stops.size());
    std::vector<typename Film<T>::Block> sums(blocks);
    for (auto& block : sums) {
        block.samples.first = in.value<std::uint64_t>();
        block.samples.level = in.value<std::uint32_t>();
        block.sums.resize(pixels * channels);
        in.bytes(block.sums.data(), block.sums.size() * sizeof(T));
    }
    in.finish();
    try {
        state.film = Film<T>::restore(window.width(), window.height(), planes, std::move(sums), std::move(material),
                                      rejected, std::move(stops));
    } catch (const Error& error) {
        fail(path + ": " + error.what());
    }
    return state;
}

} // namespace LAMBENT_ABI
} // namespace lambent
