#include <lambent/io/obj.hpp>
#include <io/notes.hpp>
#include <support/skip.hpp>
#include <doctest/doctest.h>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

/// The normals at one place, each once.
std::vector<Vec3f> normals_at(const Scene<float>& scene, const Vec3f& place) {
    std::vector<Vec3f> found;
    for (std::size_t i = 0; i < scene.positions.size(); ++i)
        if (scene.positions[i] == place) found.push_back(scene.normals.empty() ? Vec3f(0) : scene.normals[i]);
    return found;
}

bool near(const Vec3f& a, const Vec3f& b) { return max_component(abs(a - b)) < 1e-6f; }

/// Two unit squares that meet at a right angle along x = 0 ... 1: the floor z = 0 and the wall y = 0.
const std::string corner = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1 0 1\nv 0 0 1\n";
const std::string floor_face = "f 1 2 3 4\n", wall_face = "f 2 1 6 5\n";

} // namespace

TEST_CASE("OBJ: without s, or with s off or 0, faces are flat") {
    for (const char* s : {"", "s off\n", "s 0\n", "s\n", "s 1\ns off\n"}) {
        const Scene<float> scene = parse_obj(corner + s + floor_face + wall_face, "a.obj");
        CHECK(scene.normals.empty());
        CHECK(scene.positions.size() == 6);
        CHECK(scene.notes.empty());
    }
}

TEST_CASE("OBJ: a smoothing group shares normals at its v, two groups do not") {
    const Vec3f floor_normal(0, 0, 1), wall_normal(0, 1, 0), edge = normalize(Vec3f(0, 1, 1));
    for (const char* s : {"s 1\n", "s on\n", "s 2147483646\n"}) {
        const Scene<float> one = parse_obj(corner + s + floor_face + wall_face, "a.obj");
        REQUIRE(normals_at(one, {0, 0, 0}).size() == 1);
        CHECK(near(normals_at(one, {0, 0, 0})[0], edge));
        CHECK(near(normals_at(one, {1, 1, 0})[0], floor_normal));
        CHECK(near(normals_at(one, {1, 0, 1})[0], wall_normal));
    }
    const Scene<float> two = parse_obj(corner + "s 1\n" + floor_face + "s 2\n" + wall_face, "a.obj");
    REQUIRE(normals_at(two, {0, 0, 0}).size() == 2);
    CHECK(near(normals_at(two, {0, 0, 0})[0], floor_normal));
    CHECK(near(normals_at(two, {0, 0, 0})[1], wall_normal));
    const Scene<float> half = parse_obj(corner + "s 1\n" + floor_face + "s off\n" + wall_face, "a.obj");
    REQUIRE(normals_at(half, {0, 0, 0}).size() == 2);
    CHECK(near(normals_at(half, {0, 0, 0})[0], floor_normal));
    CHECK(normals_at(half, {0, 0, 0})[1] == Vec3f(0));
}

TEST_CASE("OBJ: a vn outweighs the group, and its face still bends the others' normals") {
    const Scene<float> scene = parse_obj(corner + "vn 1 0 0\ns 1\nf 1//1 2//1 3//1 4//1\n" + wall_face, "a.obj");
    REQUIRE(normals_at(scene, {0, 0, 0}).size() == 2);
    CHECK(normals_at(scene, {0, 0, 0})[0] == Vec3f(1, 0, 0));
    CHECK(near(normals_at(scene, {0, 0, 0})[1], {0, 1, 0}));
}

TEST_CASE("OBJ: a group's normals know nothing of texture seams, however many meet at a v") {
    std::string text = corner;
    for (int i = 0; i < 40; ++i) text += "vt " + std::to_string(i) + " 0\n";
    text += "s off\n";
    for (int i = 1; i <= 20; ++i) text += "f 1/" + std::to_string(i) + " 2 3\n"; // fills the list of v 1
    text += "s 7\n";
    for (int i = 21; i <= 39; i += 2)
        text += "f 1/" + std::to_string(i) + " 2/3 3/4 4/5\nf 2/1 1/" + std::to_string(i + 1) + " 6/2 5/3\n";
    const Scene<float> scene = parse_obj(text, "a.obj");
    std::size_t smooth = 0;
    for (const Vec3f& n : normals_at(scene, {0, 0, 0})) {
        if (n == Vec3f(0)) continue;
        ++smooth;
        CHECK(near(n, normalize(Vec3f(0, 1, 1))));
    }
    CHECK(smooth == 20);
}

TEST_CASE("OBJ: normals are weighted by angle, so neither size nor cuts of a face matter") {
    // A cube's corner, one of whose sides is fanned into many slivers and another ten times as long.
    std::string text = "v 0 0 0\nv 10 0 0\nv 0 1 0\nv 0 0 1\nv 10 1 0\ns 1\nf 1 3 5 2\nf 1 2 4\n";
    int last = 3;
    for (int i = 1; i < 20; ++i) {
        const double angle = i * 3.14159265358979 / 40;
        text += "v 0 " + std::to_string(std::cos(angle)) + " " + std::to_string(std::sin(angle)) + "\n";
        text += "f 1 " + std::to_string(5 + i) + " " + std::to_string(last) + "\n";
        last = 5 + i;
    }
    text += "f 1 4 " + std::to_string(last) + "\n";
    const Scene<float> scene = parse_obj(text, "a.obj");
    CHECK(max_component(abs(normals_at(scene, {0, 0, 0}).at(0) + normalize(Vec3f(1)))) < 1e-5f);
}

TEST_CASE("OBJ: smoothed normals of a sphere point away from its centre") {
    std::string text = "s 1\n";
    const int rows = 24, columns = 48;
    for (int r = 0; r <= rows; ++r)
        for (int c = 0; c < columns; ++c) {
            const double theta = 3.14159265358979 * r / rows, phi = 2 * 3.14159265358979 * c / columns;
            text += "v " + std::to_string(std::sin(theta) * std::cos(phi)) + " " + std::to_string(std::cos(theta)) +
                    " " + std::to_string(std::sin(theta) * std::sin(phi)) + "\n";
        }
    for (int r = 0; r < rows; ++r)
        for (int c = 0; c < columns; ++c) {
            const int a = r * columns + c + 1, b = r * columns + (c + 1) % columns + 1;
            text += "f " + std::to_string(a) + " " + std::to_string(b) + " " + std::to_string(b + columns) + " " +
                    std::to_string(a + columns) + "\n";
        }
    const Scene<float> scene = parse_obj(text, "a.obj");
    for (std::size_t i = 0; i < scene.positions.size(); ++i) {
        const float y = std::abs(scene.positions[i].y);
        if (y > 0.99f) continue; // the poles' quads have an edge without length
        CHECK(dot(scene.normals[i], normalize(scene.positions[i])) > 0.999f);
    }
}

TEST_CASE("OBJ: odd groups and faces without area") {
    const Scene<float> odd = parse_obj(corner + "s x\ns 1.5\ns -1\ns 9999999999\n" + floor_face, "a.obj");
    CHECK(odd.normals.empty());
    CHECK(noted(odd, "a.obj: 4 smoothing groups are no whole numbers and count as off, the first in line 7: 'x'"));
    const Scene<float> flat = parse_obj(corner + "s 1\nf 1 1 2\nf 1 2 2\nf 3 3 3\nf 1 2 3\nf 3 2 1\n", "a.obj");
    CHECK(normals_at(flat, {0, 0, 0}).at(0) == Vec3f(0));
    for (const Vec3f& n : flat.normals) CHECK(is_finite(n));
}

TEST_CASE("OBJ: smoothing groups of the shared files") {
    const std::string folder = std::string(LAMBENT_SHARED_DIR) + "/scenes/obj_features/";
    if (!std::filesystem::exists(folder)) return skip("shared scenes: no obj_features");
    // The normals that the first file's comments want; it has none for the vn that its faces name.
    const Scene<float> two = load_obj(folder + "smoothing-group-two-squares.obj");
    CHECK(two.positions.size() == 5);
    CHECK(near(normals_at(two, {0, 2, 0}).at(0), {0, 0, 1}));
    const Vec3f bend = normals_at(two, {2, 0, 0}).at(0), far = normals_at(two, {4, 0, -3.255298f}).at(0);
    CHECK(max_component(abs(far - Vec3f(0.852070f, 0, 0.523428f))) < 1e-4f); // of its own triangle
    CHECK((bend.x > 0.3f && bend.x < 0.55f && bend.y == 0 && bend.z > 0.8f));
    CHECK(noted(two, "7 corners have a texture or normal index out of range, which is ignored, the first in line 21"));

    const Scene<float> cube = load_obj(folder + "smoothing-normal.obj");
    CHECK(near(normals_at(cube, {0, 2, 2}).at(0), {0, 0, 1}));                      // v 1: the front alone
    CHECK(near(normals_at(cube, {2, 0, 2}).at(0), normalize(Vec3f(0, -1, 1))));     // v 3: front and bottom
    CHECK(normals_at(cube, {0, 0, 0}).size() == 2);                                 // v 6: smooth bottom, flat back
    CHECK(load_obj(folder + "issue-162-smoothing-group.obj").normals.size() == 24); // has all its vn
}
