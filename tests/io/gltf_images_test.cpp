// Images that are files of their own: read where a surface shows them, and only there.
#include <lambent/core/parallel.hpp>
#include <lambent/io/gltf.hpp>
#include <io/gltf_text.hpp>
#include <io/image_files.hpp>
#include <io/notes.hpp>
#include <support/temporary_folder.hpp>
#include <doctest/doctest.h>
#include <filesystem>
#include <string>
#if __has_include(<sys/inotify.h>)
#include <sys/inotify.h>
#include <unistd.h>
#endif

using namespace lambent;
using namespace lambent_test;

namespace {

/// Counts how often a file is opened.
class OpenCount {
public:
#if __has_include(<sys/inotify.h>)
    explicit OpenCount(const std::string& path) : queue_(inotify_init1(IN_NONBLOCK)) {
        REQUIRE(inotify_add_watch(queue_, path.c_str(), IN_OPEN) >= 0);
    }
    ~OpenCount() { close(queue_); }
    OpenCount(const OpenCount&) = delete;

    bool is(int expected) const {
        // An event without a name is a header alone. Equal ones in a row would be one, so ask after each opening.
        alignas(inotify_event) char events[64 * sizeof(inotify_event)];
        const ssize_t bytes = read(queue_, events, sizeof events);
        return (bytes > 0 ? int(bytes / ssize_t(sizeof(inotify_event))) : 0) == expected;
    }

private:
    int queue_;
#else
    explicit OpenCount(const std::string&) {}
    bool is(int) const { return true; }
#endif
};

/// A document of a triangle whose material is the first of two; each looks up the image of its own file.
std::string two_images(const std::string& shown, const std::string& hidden) {
    GltfBuilder b = square();
    b.floats("VEC2", 4, {0, 0, 1, 0, 0, 1, 1, 1});
    return b.mesh(R"({"attributes":{"POSITION":0,"TEXCOORD_0":1},"mode":5,"material":0})", "",
                  R"(,"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}},)"
                  R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":1}}}],)"
                  R"("textures":[{"source":0},{"source":1}],"images":[{"uri":")" + shown + R"("},{"uri":")" + hidden + R"("}])");
}

std::string one_pixel(char grey) { return png_file(png_header(1, 1, 8, 0), std::string{'\0', grey}); }

} // namespace

TEST_CASE("glTF: an image file that no triangle's material looks up is not opened, whatever is in it") {
    const TemporaryFolder folder;
    std::filesystem::create_directory(folder.file("maps"));
    const std::string shown = folder.write("shown here.png", one_pixel('a'));
    const std::string hidden = folder.write("maps/hidden.png", std::string(1 << 20, 'x'));
    const std::string path = folder.write("scene.gltf", two_images("shown%20here.png", "maps/hidden.png"));
    const OpenCount of_shown(shown), of_hidden(hidden);
    ThreadExecutor threads(2);
    const auto load = [&](ImageLoading images) {
        LoadOptions options;
        options.images = images;
        return load_gltf(path, options, threads);
    };
    const Scene<float> scene = load(ImageLoading::used);
    CHECK(of_shown.is(1));
    CHECK(of_hidden.is(0));
    CHECK(scene.notes.empty());
    if (can_read_images()) {
        REQUIRE(scene.images.size() == 1);
        CHECK(scene.images[0].rgba[0] == 'a');
        CHECK(!scene.materials[1].base_color_texture);
    }
    load(ImageLoading::none);
    CHECK(of_shown.is(0));
    CHECK(of_hidden.is(0));
    const Scene<float> all = load(ImageLoading::all);
    CHECK(of_shown.is(1));
    CHECK(of_hidden.is(1));
    CHECK(noted(all, "scene.gltf: /images/1 (maps/hidden.png): "));
}

TEST_CASE("glTF: an image file that is missing is a note where it is used, and nobody's business where it is not") {
    const TemporaryFolder folder;
    folder.write("there.png", one_pixel('b'));
    folder.write("empty.png", "");
    std::filesystem::create_directory(folder.file("folder.png"));
    const auto load = [&](const std::string& shown, const std::string& hidden, const LoadOptions& options = {}) {
        return load_gltf(folder.write("scene.gltf", two_images(shown, hidden)), options);
    };
    for (const std::string bad : {"absent.png", "empty.png", "folder.png", "../out.png", "data:image/png;base64,AA=="}) {
        INFO(bad);
        CHECK(load("there.png", bad).notes.empty());
        const Scene<float> scene = load(bad, "there.png");
        CHECK(scene.notes.size() == 1);
        CHECK(noted(scene, "texture left out: "));
        CHECK(noted(scene, "scene.gltf: /images/0"));
        CHECK(!scene.materials[0].base_color_texture);
    }
    CHECK(noted(load("absent.png", "there.png"), "/images/0 (absent.png): no such image"));
    CHECK(noted(load("../out.png", "there.png"), "is outside of the folder"));

    LoadOptions small; // all that are named count, as far as they are there
    small.max_bytes = one_pixel('b').size();
    CHECK(load("there.png", "absent.png", small).notes.empty());
    CHECK(noted(load("there.png", "there.png", [] { LoadOptions o; o.max_bytes = 3; return o; }()), "no such image"));
    small.images = ImageLoading::all;
    CHECK(noted(load("there.png", "there.png", small), "/images/1 (there.png): no such image"));
}

TEST_CASE("glTF: images of a document without buffer views, which tinygltf reads like buffers") {
    const TemporaryFolder folder;
    folder.write("there.png", one_pixel('c'));
    const std::string path = folder.write(
        "scene.gltf", R"({"asset":{"version":"2.0"},"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],)"
                      R"("textures":[{"source":0}],"images":[{"uri":"there.png"}]})");
    LoadOptions all;
    all.images = ImageLoading::all;
    const Scene<float> scene = load_gltf(path, all);
    if (!can_read_images()) return;
    REQUIRE(scene.images.size() == 1);
    CHECK(scene.images[0].rgba[0] == 'c');
}
