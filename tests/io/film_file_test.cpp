#include "support/random.hpp"
#include <lambent/film/film_pass.hpp>
#include <lambent/io/film_file.hpp>
#include <support/statistics.hpp>
#include <support/temporary_folder.hpp>
#include <doctest/doctest.h>
#include <cstring>
#include <string>

using namespace lambent;
using lambent_test::file_bytes;
using lambent_test::Random;
using lambent_test::TemporaryFolder;

namespace {

FilmState<float> some_state(std::uint64_t begin = 0, std::uint64_t end = 13, FilmPlanes planes = FilmPlanes::features,
                            const ActivePixels& active = {}) {
    FilmPass<float> pass(6, 4, planes, begin, end, active);
    Random random(3);
    for (int p = 0; p < 24; ++p) {
        if (!active.absent() && active.load(p % 6, p / 6) == 0) continue;
        FilmPass<float>::Pixel pixel(pass, p % 6, p / 6);
        for (std::uint64_t i = begin; i < end; ++i) {
            PixelSample<float> s;
            s.radiance = Vec3f(random.uniform_float(), 1e-30f, 1e20f);
            if (p == 3 && i == begin) s.radiance.x = std::numeric_limits<float>::infinity();
            s.hit = p % 3 != 0;
            s.material = 5;
            s.position = Vec3f(-1, 2, random.uniform_float());
            pixel.add(s);
        }
    }
    FilmState<float> state;
    state.film = pass.finish();
    state.width = 20;
    state.height = 10;
    state.window = {3, 2, 9, 6};
    state.camera.eye = {1.0 / 3, -2, 3e10};
    state.camera.target = {4, 5, 6};
    state.camera.vertical_fov = 33;
    state.origin = {1e6, 0.1, 0};
    state.identity = {{"seed", "7"}, {"scene", "a\0b\nüblich"}, {"empty", ""}};
    state.settings = {{"denoise", "best"}};
    return state;
}

/// The message of the error that reading the file throws; empty if none.
std::string refusal(const std::string& path) {
    try {
        read_film<float>(path);
    } catch (const Error& e) {
        return e.what();
    }
    return {};
}

} // namespace

TEST_CASE("film file: everything comes back, to the bit, and equal states are equal files") {
    const TemporaryFolder folder;
    for (const FilmPlanes planes : {FilmPlanes::features, FilmPlanes::radiance, FilmPlanes::material | FilmPlanes::depth}) {
        const FilmState<float> state = some_state(2, 13, planes);
        const std::string path = folder.file("a.film");
        write_film(path, state);
        const FilmState<float> back = read_film<float>(path);
        CHECK(difference(state, back).empty());
        CHECK(back.settings == state.settings);
        CHECK(back.camera.eye == state.camera.eye);
        CHECK(back.camera.target == state.camera.target);
        CHECK(back.camera.up == state.camera.up);
        CHECK(back.camera.vertical_fov == state.camera.vertical_fov);
        CHECK(back.origin == state.origin);
        CHECK(back.film.planes() == planes);
        CHECK(back.film.rejected() == 1);
        CHECK(back.film.material() == state.film.material());
        REQUIRE(back.film.blocks().size() == state.film.blocks().size());
        for (std::size_t i = 0; i < back.film.blocks().size(); ++i) {
            CHECK(back.film.blocks()[i].samples == state.film.blocks()[i].samples);
            CHECK(std::memcmp(back.film.blocks()[i].sums.data(), state.film.blocks()[i].sums.data(),
                              back.film.blocks()[i].sums.size() * sizeof(float)) == 0);
        }
        write_film(folder.file("b.film"), back);
        CHECK(file_bytes(path) == file_bytes(folder.file("b.film")));
    }
    CHECK(folder.count() == 2); // no temporary left
}

TEST_CASE("film file: where pixels stopped comes back; without that it takes no bytes; what cannot be is refused") {
    const TemporaryFolder folder;
    std::vector<std::uint8_t> active(24, 1);
    const ActivePixels view(active.data(), 6, 4);
    const auto size_of = [&](const FilmState<float>& state) {
        write_film(folder.file("a.film"), state);
        return file_bytes(folder.file("a.film")).size();
    };
    const std::size_t whole = size_of(some_state(4, 6, FilmPlanes::features, view));
    CHECK(whole == size_of(some_state(4, 6)));
    active[7] = active[8] = 0;
    FilmState<float> state = some_state(4, 6, FilmPlanes::features, view);
    CHECK(size_of(state) == whole + 24);
    CHECK(read_film<float>(folder.file("a.film")).film.stops() == state.film.stops());
    CHECK(state.film.stops()[7] == 2);
    state.film.merge(some_state(0, 4).film); // to what it is a part of
    CHECK(state.film.sample_count(7) == 4);
    CHECK(state.film.sample_count(6) == 6);
}

TEST_CASE("film file: one cut short anywhere is refused, and so is one with any byte changed") {
    const TemporaryFolder folder;
    const std::string path = folder.file("a.film");
    write_film(path, some_state(0, 3));
    const std::string bytes = file_bytes(path);
    Random random(1);
    for (std::size_t length = 0; length < bytes.size(); length += length < 400 ? 1 : 97) {
        INFO("length ", length);
        REQUIRE(refusal(folder.write("cut.film", bytes.substr(0, length))).find("cut.film: ") != std::string::npos);
    }
    REQUIRE(!refusal(folder.write("long.film", bytes + "x")).empty());
    for (std::size_t at = 0; at < bytes.size(); at += at < 400 ? 1 : 61) {
        std::string changed = bytes;
        changed[at] = char(changed[at] ^ (1 << random.below(8)));
        INFO("byte ", at);
        REQUIRE(refusal(folder.write("changed.film", changed)).find("changed.film: ") != std::string::npos);
    }
}

TEST_CASE("film file: what a hostile header claims is refused with its numbers, without the memory") {
    const TemporaryFolder folder;
    const std::string path = folder.file("a.film");
    write_film(path, some_state(0, 3));
    const std::string bytes = file_bytes(path);
    const auto claim = [&](std::size_t at, std::uint32_t value) {
        std::string changed = bytes;
        std::memcpy(&changed[at], &value, 4);
        return refusal(folder.write("h.film", changed));
    };
    CHECK(claim(8, 3).find("version 3") != std::string::npos);
    CHECK(claim(12, 8).find("8 bytes") != std::string::npos);
    std::string huge = bytes; // an image of 65000 x 65000 pixels, all of them in the window
    for (const auto& [at, value] : {std::pair{16, 65000u}, {20, 65000u}, {24, 0u}, {28, 0u}, {32, 65000u}, {36, 65000u}})
        std::memcpy(&huge[std::size_t(at)], &value, 4);
    CHECK(refusal(folder.write("huge.film", huge)).find("65000 x 65000") != std::string::npos);
    CHECK(claim(16, 0xffffffffu).find("image of -1") != std::string::npos);
    CHECK(claim(32, 100).find("image of 20 x 10") != std::string::npos);
    CHECK(claim(40, 1151).find("planes 1151") != std::string::npos);
    CHECK(claim(44, 0xffffffffu).find("4294967295 blocks") != std::string::npos);
    CHECK(claim(44, 3).find("3 blocks") != std::string::npos);
    const std::size_t pairs = 16 + 24 + 16 + 13 * 8;
    CHECK(claim(pairs, 0xffffffffu).find("cut short") != std::string::npos);
    CHECK(claim(60, 0x7ff80000u).find("not a finite number") != std::string::npos);         // the eye, NaN
    CHECK(claim(pairs - 4, 0xfff00000u).find("not a finite number") != std::string::npos);  // the origin, infinite
    CHECK(claim(pairs + 4, 0xfffffff0u).find("4294967280 more bytes") != std::string::npos);

    CHECK(refusal(folder.file("none.film")).find("no such file") != std::string::npos);
    CHECK(refusal(folder.write("other.film", "#?RADIANCE\n and so on")).find("not a film file") != std::string::npos);
    CHECK(refusal(folder.write("empty.film", "")).find("not a film file") != std::string::npos);
    CHECK_THROWS_AS(read_film<double>(path), Error);
    CHECK_THROWS_AS(write_film(folder.file("no/such/folder.film"), some_state()), Error);
}

TEST_CASE("film states of different renders say in what they differ") {
    const FilmState<float> a = some_state();
    CHECK(difference(a, a).empty());
    FilmState<float> b = a;
    b.identity["seed"] = "8";
    CHECK(difference(a, b) == "seed is 7, not 8");
    b = a;
    b.identity.erase("seed");
    CHECK(difference(a, b) == "seed is 7, not given");
    CHECK(difference(b, a) == "seed is not given, not 7");
    b = a;
    b.width = 21;
    CHECK(difference(a, b) == "size is 20 x 10, not 21 x 10");
    b = a;
    b.window.x0 = 2;
    CHECK(difference(a, b) == "crop is 3,2,9,6, not 2,2,9,6");
    b = a;
    b.settings["denoise"] = "none";
    CHECK(difference(a, b).empty());
}
