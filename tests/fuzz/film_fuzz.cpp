// libFuzzer target: .film states, as they are and with the checksum that fits. Must give a film that is written as it
// was read and resolves to finite planes, or an Error. Seeds: films of several planes and blocks.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <lambent/io/film_file.hpp>
#include <string>
#include <sys/mman.h>
#include <unistd.h>
#include <vector>

namespace {

void demand(bool holds) {
    if (!holds) std::abort();
}

/// A file in memory alone, with a name to open it by.
class MemoryFile {
public:
    MemoryFile() : descriptor_(memfd_create("film", 0)) { demand(descriptor_ >= 0); }
    MemoryFile(const MemoryFile&) = delete;
    MemoryFile& operator=(const MemoryFile&) = delete;
    ~MemoryFile() { close(descriptor_); }
    std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

    void set(const std::vector<std::uint8_t>& bytes) const {
        demand(ftruncate(descriptor_, 0) == 0 &&
               pwrite(descriptor_, bytes.data(), bytes.size(), 0) == ssize_t(bytes.size()));
    }

private:
    int descriptor_;
};

/// The checksum at the file's end takes pieces one by one, so their sizes have to be found as the reader finds them.
void stamp(std::vector<std::uint8_t>& bytes) {
    lambent::ContentHash hash;
    std::size_t at = 0;
    const auto take = [&](std::size_t size) {
        if (bytes.size() < 8 || size > bytes.size() - 8 - at) return false;
        hash.add_bytes(bytes.data() + at, size);
        at += size;
        return true;
    };
    const auto number = [&] {
        std::uint32_t n = 0;
        if (at >= 4) std::memcpy(&n, bytes.data() + at - 4, 4);
        return n;
    };
    bool whole = take(8);
    for (int i = 0; i < 2 + 6; ++i) whole = whole && take(4);
    std::uint32_t window[4] = {};
    if (whole) std::memcpy(window, bytes.data() + at - sizeof window, sizeof window);
    whole = whole && take(4);
    const std::uint32_t planes = number();
    whole = whole && take(4);
    const std::uint32_t blocks = number();
    whole = whole && take(8);
    for (int i = 0; i < 13; ++i) whole = whole && take(8);
    for (int map = 0; map < 2; ++map) {
        whole = whole && take(4);
        for (std::uint32_t left = 2 * number(); whole && left > 0; --left) whole = take(4) && take(number());
    }
    const std::uint64_t pixels = std::uint64_t(window[2] - window[0]) * (window[3] - window[1]);
    if (!whole || pixels > bytes.size() || planes > std::uint32_t(lambent::FilmPlanes::statistics)) return;
    const auto channels = std::size_t(lambent::detail::FilmLayout(lambent::FilmPlanes(planes)).channels);
    whole = take(lambent::contains(lambent::FilmPlanes(planes), lambent::FilmPlanes::material) ? 4 * pixels : 0);
    for (std::uint32_t i = 0; whole && i < blocks; ++i)
        whole = take(8) && take(4) && take(pixels * channels * sizeof(float));
    if (!whole || at + 8 != bytes.size()) return;
    const std::uint64_t value = hash.value();
    std::memcpy(bytes.data() + at, &value, 8);
}

void check_film(const MemoryFile& file) {
    using namespace lambent;
    try {
        const FilmState<float> state = read_film(file.path());
        demand(state.window.inside(state.width, state.height) && !state.window.empty());
        demand(difference(state, state).empty());
        for (const SampleRange& range : state.film.ranges()) demand(range.begin < range.end);
        const PixelData<float> frame = state.film.resolve(state.origin);
        for (int y = 0; y < frame.height; ++y)
            for (int x = 0; x < frame.width; ++x) {
                demand(is_finite(frame.radiance.view().load(x, y)) && is_finite(frame.variance.view().load(x, y)));
                if (!frame.position.view().absent()) demand(is_finite(frame.position.view().load(x, y)));
                if (!frame.depth.view().absent()) demand(is_finite(frame.depth.view().load(x, y)));
            }
        static const std::string again = "/dev/shm/lambent_film_fuzz_" + std::to_string(getpid());
        write_film(again, state);
        const std::string written = detail::read_file(again);
        demand(written == detail::read_file(file.path()) ||
               state.identity.size() + state.settings.size() > 0); // order of pairs
        demand(difference(state, read_film(again)).empty());
        unlink(again.c_str());
    } catch (const Error&) {
    }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const MemoryFile file;
    std::vector<std::uint8_t> bytes(data, data + size);
    file.set(bytes);
    check_film(file);
    stamp(bytes);
    file.set(bytes);
    check_film(file);
    return 0;
}
