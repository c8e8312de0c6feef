#include <lambent/io/obj.hpp>
#include <io/notes.hpp>
#include <support/temporary_folder.hpp>
#include <doctest/doctest.h>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>
#include <sys/stat.h>

// Files that somebody made to break a loader. None is stored: each is made here, and beside it stands what happens.

using namespace lambent;
using namespace lambent_test;

namespace {

std::string hostile_refusal(const std::string& text, const LoadOptions& options = {}) {
    try {
        parse_obj(text, "a.obj", options);
    } catch (const Error& error) {
        return error.what();
    }
    return "";
}

bool all_finite(const Scene<float>& scene) {
    for (const Vec3f& p : scene.positions)
        if (!is_finite(p)) return false;
    for (const Vec3f& n : scene.normals)
        if (!is_finite(n)) return false;
    for (const Vec2f& t : scene.texcoords)
        if (!is_finite(t.x) || !is_finite(t.y)) return false;
    return true;
}

std::string repeated(std::string_view text, std::size_t times) {
    std::string all;
    all.reserve(text.size() * times);
    for (std::size_t i = 0; i < times; ++i) all += text;
    return all;
}

std::string number(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.17g", value);
    return text;
}

const std::string hostile_triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

} // namespace

TEST_CASE("hostile OBJ: one line of 100 MB: read, and refused in a short message where it is no statement's value") {
    const TemporaryFolder folder;
    CHECK(load_obj(folder.write("a.obj", std::string(100'000'000, 'x'))).notes.size() == 1);
    const std::string message = hostile_refusal("v " + std::string(10'000'000, '1') + "x");
    CHECK(message.find("a.obj:1: '1111") == 0);
    CHECK(message.size() < 200);
    CHECK(hostile_refusal(hostile_triangle + "f 1 2 " + std::string(10'000'000, '1')).size() < 200);
    CHECK(parse_obj(hostile_triangle + "usemtl " + std::string(10'000'000, 'm'), "a.obj").notes.at(0).size() < 200);
}

TEST_CASE("hostile OBJ: 100,000 concave corners are cut properly, a million that cross are a fan") {
    std::string text, face = "f";
    double area = 0, x0 = 0, y0 = 0;
    const int n = 100'000;
    for (int i = 0; i <= n; ++i) {
        const double angle = 2 * 3.14159265358979323846 * (i % n) / n, r = 1 + 0.9 * ((i % n) * 7919 % 97) / 97.0;
        const double x = r * std::cos(angle), y = r * std::sin(angle);
        if (i > 0) area += (x0 * y - y0 * x) / 2;
        x0 = x, y0 = y;
        if (i < n) text += "v " + number(x) + " " + number(y) + " 0\n";
        if (i < n) face += " " + std::to_string(i + 1);
    }
    const Scene<double> scene = parse_obj<double>(text + face, "a.obj");
    REQUIRE(scene.triangles.size() == n - 2);
    double sum = 0;
    for (const UVec3& t : scene.triangles) {
        const Vec3d &a = scene.positions[t.x], &b = scene.positions[t.y], &c = scene.positions[t.z];
        const double one = cross(b - a, c - a).z / 2;
        REQUIRE(one >= -1e-12);
        sum += one;
    }
    CHECK(sum == doctest::Approx(area).epsilon(1e-9));

    const Scene<float> crossing =
        parse_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1\nv 3 7 0\nf" + repeated(" 1 4 2 5 3", 200'000), "a.obj");
    CHECK(crossing.triangles.size() == 999'998);
}

TEST_CASE("hostile OBJ: polygons without an area, of one place or of one line, give n - 2 triangles") {
    std::string line;
    for (int i = 0; i < 20'000; ++i) line += "v " + std::to_string(i * 7919 % 20'000) + " 1 1\n";
    std::string face = "f";
    for (int i = 1; i <= 20'000; ++i) face += " " + std::to_string(i);
    CHECK(parse_obj(line + face, "a.obj").triangles.size() == 19'998);
    CHECK(parse_obj("v 1 1 1\nf" + repeated(" 1", 100'000), "a.obj").triangles.size() == 99'998);
}

TEST_CASE("hostile OBJ: positions must be finite in the scene's precision; the smallest and largest load") {
    for (const char* x : {"nan", "-nan", "inf", "1e309", "1.#QNAN", "infinity", "NaN(7)"}) {
        CAPTURE(x);
        CHECK(hostile_refusal("v 0 0 0\nv 1 " + std::string(x) + " 0\n").find("a.obj:2: '") == 0);
    }
    CHECK(hostile_refusal("v 1e308 0 0") == "a.obj:1: '1e308' is not a finite number in 32 bits");
    CHECK(hostile_refusal("vt 1e308") != "");
    CHECK(hostile_refusal("vn 0 1e39 0") != "");
    CHECK(hostile_refusal("v 0 0 0 1 1 nan") != "");
    for (const char* x : {"3.4e38", "-3.4e38", "1e-310", "5e-324", "-1e-45", "1e19"}) {
        CAPTURE(x);
        for (const char* y : {"0 0", "3.4e38 3.4e38", "-3.4e38 0", "1e-300 0"}) {
            const std::string text = "v " + std::string(x) + " " + y + "\nv 1 0 0\nv 0 1 0\nv " + x + " 1 1\nvt " + x +
                                     "\nvn " + x + " " + y + "\ns 1\nf 1/1/1 2 3 4\nf 1 2 3\nf 1 4 1\n";
            CHECK(all_finite(parse_obj(text, "a.obj")));
        }
    }
    const Scene<double> wide = parse_obj<double>("v 1e155 0 0\nv -1e155 0 0\nv 0 1e-200 0\ns 1\nf 1 2 3", "a.obj");
    for (const Vec3f& n : wide.normals) CHECK(is_finite(n));
    CHECK(is_finite(parse_obj<double>("v 1e308 0 0\nv -1e308 0 0\nv 0 1e308 0\ns 1\nf 1 2 3 1", "a.obj").positions[0]));
}

TEST_CASE("hostile OBJ: vertex indices beyond what stands before are refused, others ignored, huge ones too") {
    for (const char* face :
         {"f 1 2 4", "f -1 -2 -4", "f 1 2 4294967297", "f 1 2 -4294967295", "f 1 2 9223372036854775808",
          "f 1 2 999999999999999999", "f 1 2 -999999999999999999", "f 1 2 18446744073709551617", "f 1 2 0", "f 1 2 -0",
          "f 1 2 +", "f 1 2 -", "f 1 2 3/x", "f 1 2 3/1e1", "f 1 2 1.0"}) {
        CAPTURE(face);
        CHECK(hostile_refusal(hostile_triangle + face).find("a.obj:5: ") == 0);
    }
    const Scene<float> scene = parse_obj(hostile_triangle + "f 1/999999999999999999 2//-7 3/0/0\n", "a.obj");
    CHECK(scene.triangles.size() == 2);
    CHECK(noted(scene, "4 corners have a texture or normal index out of range, which is ignored, the first in line 5"));
}

TEST_CASE("hostile OBJ: bytes that are no text are refused in numbers, shown escaped, kept in names") {
    const std::string nul("\0", 1);
    CHECK(hostile_refusal("v 1 2" + nul + " 3") == "a.obj:1: '2\\x00' is not a finite number");
    CHECK(hostile_refusal("v 1 2 3\nf 1" + nul + " 1 1").find("a.obj:2: a face's corner '1\\x00'") == 0);
    CHECK(hostile_refusal("v \xc3\x28 1 1") == "a.obj:1: '\\xc3(' is not a finite number");
    CHECK(hostile_refusal("v 1 1\v2 1").find("\\x0b") != std::string::npos);
    const Scene<float> scene = parse_obj(hostile_triangle + nul + nul +
                                             "\n\xff\xfe\x80\nusemtl \xed\xa0\x80\nmtllib a" + nul + "/../b\nf 1 2 3\n",
                                         "a.obj");
    CHECK(scene.materials.size() == 2);
    CHECK(scene.materials[1].name == "\xed\xa0\x80");
    CHECK(noted(scene, "2 lines begin with an unknown word and were skipped, the first in line 5: '\\x00\\x00'"));
    CHECK(noted(scene, "1 material libraries are missing, in line 8: 'a\\x00/../b'"));
}

TEST_CASE("hostile OBJ: backslashes at the end, alone and a million times, and nothing but spaces") {
    CHECK(parse_obj("\\", "a.obj").triangles.empty());
    CHECK(parse_obj(hostile_triangle + "f 1 2 3\\", "a.obj").triangles.size() == 2);
    CHECK(parse_obj(hostile_triangle + "f 1 2 3 " + repeated("\\\n", 1'000'000) + "\nf 1 2 3", "a.obj")
              .triangles.size() == 3);
    CHECK(parse_obj(hostile_triangle + "f 1 2 " + repeated("\\\r\n", 1'000'000) + "3", "a.obj").triangles.size() == 2);
    CHECK(hostile_refusal(hostile_triangle + repeated("\\\n", 1000) + "f 1 2 9\n\n").find("a.obj:5: ") == 0);
    const std::string spaces(10'000'000, ' ');
    CHECK(parse_obj(spaces, "a.obj").triangles.empty());
    CHECK(parse_obj(hostile_triangle + "f" + spaces + "1" + spaces + "2 3" + spaces, "a.obj").triangles.size() == 2);
    CHECK(parse_obj(hostile_triangle + "usemtl" + spaces + "a" + spaces, "a.obj").materials[1].name == "a");
    CHECK(parse_obj(std::string(10'000'000, '\n') + hostile_triangle, "a.obj").triangles.size() == 1);
    CHECK(parse_obj(std::string(10'000'000, '\r'), "a.obj").notes.size() == 1);
}

TEST_CASE("hostile OBJ: a million of anything: materials, corners of one v, unused vn, unknown words; few notes") {
    std::string names, coordinates = hostile_triangle, faces;
    for (int i = 0; i < 1'000'000; ++i) {
        names += "usemtl " + std::to_string(i) + "\n";
        if (i >= 300'000) continue;
        coordinates += "vt 0\n";
        faces += "f 1/" + std::to_string(i + 1) + " 2 3\n";
    }
    const Scene<float> named = parse_obj(hostile_triangle + names, "a.obj");
    CHECK(named.materials.size() == 1'000'001);
    CHECK(named.notes.size() == 1);
    CHECK(parse_obj(coordinates + faces, "a.obj").positions.size() == 300'003);
    CHECK(parse_obj(coordinates + "s 1\n" + faces, "a.obj").positions.size() == 3 + 300'002);
    CHECK(parse_obj(repeated("vn 0 0 1\n", 2'000'000) + hostile_triangle, "a.obj").normals.empty());
    CHECK(hostile_refusal(repeated("vn 0 0 1\n", 11), {.max_vertices = 10}) ==
          "a.obj:11: over the limit of 10 normals");
    CHECK(hostile_refusal(repeated("vt 0\n", 11), {.max_vertices = 10}) != "");
    CHECK(parse_obj(repeated("nonsense\nf\ns x\np 1\nmtllib\n", 300'000), "a.obj").notes.size() == 4);
}

TEST_CASE("hostile OBJ: libraries: the file itself, a folder, a FIFO, a thousand names of one, far too many") {
    const TemporaryFolder folder;
    std::filesystem::create_directory(folder.file("folder"));
    REQUIRE(::mkfifo(folder.file("fifo").c_str(), 0600) == 0);
    std::filesystem::create_symlink("loop", folder.file("loop"));
    const Scene<float> scene = load_obj(
        folder.write("a.obj", "mtllib a.obj\nmtllib folder fifo loop .\nmtllib\nmtllib ..\n" + hostile_triangle));
    CHECK(scene.triangles.size() == 1);
    CHECK(noted(scene, "5 material libraries are missing, the first in line 2: 'folder'"));

    // 10 MB of library, read once, whatever it is called.
    folder.write("big.mtl", "newmtl a\nKd 1 0 0\n" + repeated("# nothing but a comment\n", 400'000));
    std::string text, name = "big.mtl";
    for (int i = 0; i < 1000; ++i) text += "mtllib " + (name = "./" + name) + "\n";
    text += "mtllib" + repeated(" big.mtl", 100'000) + "\n";
    const Scene<float> once = load_obj(folder.write("b.obj", text + "usemtl a\n" + hostile_triangle));
    CHECK(once.materials[0].base_color == Vec3f(1, 0, 0));
    CHECK(once.notes.empty()); // a second reading would define its material twice

    text = "mtllib";
    for (int i = 0; i < 300'000; ++i) text += " " + std::to_string(i);
    CHECK(load_obj(folder.write("c.obj", text)).notes.size() == 1);
}

TEST_CASE("hostile MTL: options without end, spaces without end, a material a million times") {
    std::vector<std::string> notes;
    std::map<std::string, detail::MtlMaterial> materials;
    const std::string name = "a.mtl";
    for (const std::string& line :
         {repeated(" -clamp on", 1'000'000), repeated(" -clamp on", 1'000'000) + " x",
          "x" + repeated(" -clamp on", 1'000'000), repeated(" -o", 1'000'000), std::string(10'000'000, ' '),
          repeated(" -s 1", 300'000) + std::string(5'000'000, ' ') + "x", "x" + repeated(" -", 3'000'000)}) {
        materials.clear();
        detail::parse_mtl(detail::ObjLines("newmtl a\nmap_Kd " + line, name), materials, notes);
        CHECK(materials.size() == 1);
    }
    notes.clear();
    detail::parse_mtl(detail::ObjLines(repeated("newmtl a\nfoo\nmap_Kd -s\n", 300'000), name), materials, notes);
    CHECK(materials.size() == 1);
    CHECK(notes.size() == 2); // foo alone says nothing
}
