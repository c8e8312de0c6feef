#include <lambent/io/obj.hpp>
#include <io/notes.hpp>
#include <support/temporary_folder.hpp>
#include <doctest/doctest.h>
#include <filesystem>
#include <string>

using namespace lambent;
using lambent_test::noted;
using lambent_test::TemporaryFolder;

namespace {

std::string message_of(const std::string& path) {
    try {
        load_obj(path);
    } catch (const Error& error) {
        return error.what();
    }
    return "";
}

const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

} // namespace

TEST_CASE("OBJ: positions, texture coordinates, normals; v flipped; CRLF, no final newline, odd numbers") {
    const TemporaryFolder folder;
    const Scene<float> scene = load_obj(
        folder.write("a.obj", "# comment\r\nv +1 2. -.5e1\r\nv\t1 0 0\r\n  v 0 1 0 1.0\r\nvt 0.25 0.25\r\nvn 0 0 2\r\n"
                              "f 1/1/1 2//-1 \\\r\n 3/-1"));
    REQUIRE(scene.triangles.size() == 1);
    CHECK(scene.positions[0] == Vec3f(1, 2, -5));
    CHECK(scene.texcoords[0] == Vec2f(0.25f, 0.75f));
    CHECK(scene.texcoords[2] == Vec2f(0.25f, 0.75f));
    CHECK(scene.normals[0] == Vec3f(0, 0, 1));
    CHECK(scene.normals[1] == Vec3f(0, 0, 1));
    CHECK(scene.normals[2] == Vec3f(0));
}

TEST_CASE("OBJ: equal corners share a vertex, different ones do not; negative indices count from here") {
    const TemporaryFolder folder;
    const Scene<float> scene = load_obj(folder.write(
        "a.obj", triangle + "vn 0 0 1\nf 1//1 2//1 3//1\nf 3//1 2//1 1\nf -3 -2 -1\nv 5 5 5\nf -4 -3 -1\n"));
    CHECK(scene.triangles.size() == 4);
    CHECK(scene.positions.size() == 3 + 3 + 1);
    CHECK(scene.positions[scene.triangles[3].x] == Vec3f(0, 0, 0));
    CHECK(scene.positions[scene.triangles[3].z] == Vec3f(5, 5, 5));
    CHECK(scene.triangles[2].x == scene.triangles[1].z);
}

TEST_CASE("OBJ: what is malformed is refused with file and line") {
    const TemporaryFolder folder;
    const auto refusal = [&](const std::string& text) { return message_of(folder.write("bad.obj", text)); };
    for (const char* text :
         {"v 1 2 x\n", "v 1 2 nan\n", "v 1 2 inf\n", "v 1 2 1e999\n", "v 1 2\n", "v 1 2 3.1+e2\n", "v 1 2 0x10\n"}) {
        CAPTURE(text);
        CHECK(refusal("\n" + std::string(text)).find("bad.obj:2: ") != std::string::npos);
    }
    for (const char* face : {"f 1 2 4", "f 0 1 2", "f 1 2 -4", "f 1 2 a", "f 1 2 3b", "f 1 2 3/1/1/1",
                             "f 1 2 99999999999999999999", "f 1 2 /3"}) {
        CAPTURE(face);
        CHECK(refusal(triangle + face).find("bad.obj:4: ") != std::string::npos);
    }
    CHECK(refusal(triangle + "f 1 2 \\\n 9\n").find("bad.obj:4: ") != std::string::npos);
    CHECK(message_of(folder.file("absent.obj")).find("absent.obj") != std::string::npos);
    CHECK(message_of(folder.file("")).find("regular file") != std::string::npos);
    CHECK(load_obj(folder.write("empty.obj", "")).triangles.empty());
}

TEST_CASE("OBJ: faces too short, points and wrong attribute indices are counted in notes") {
    const TemporaryFolder folder;
    const Scene<float> scene =
        load_obj(folder.write("a.obj", triangle + "f 1\nf 1 2\np 1\nl 1 2\nf 1/7 2//9 3\nusemtl nowhere\nf 1 2 3\n"));
    CHECK(scene.triangles.size() == 2);
    CHECK(noted(scene, "2 faces of fewer than three corners"));
    CHECK(noted(scene, "2 point or line elements"));
    CHECK(noted(scene, "2 corners have a texture or normal index out of range"));
    CHECK(noted(scene, "1 materials are used but defined nowhere"));
}

TEST_CASE("OBJ: materials from several libraries, with spaces in names, options and backslashes") {
    const TemporaryFolder folder;
    folder.write("my colours.mtl", "newmtl deep red\nKd 0.5 0 0\nKe 1 2 3\n");
    folder.write("b.mtl", "newmtl masked\r\nKd 0.25\r\nmap_Kd -s 1 1 1 -clamp on -o 0.1 sub\\my wood 1.png\r\n"
                          "map_d mask.png\r\nnewmtl glass\r\nd 0.5\r\nillum 7\r\nnewmtl odd\nTr 0.25\nKd 2 -1 0.5");
    const Scene<float> scene =
        load_obj(folder.write("a.obj", "mtllib my colours.mtl\nmtllib absent.mtl b.mtl\n" + triangle +
                                           "usemtl deep red\nf 1 2 3\nusemtl masked  \nf 1 2 3\nusemtl glass\nf 1 2 3\n"
                                           "usemtl odd\nf 1 2 3\nusemtl deep red\nf 3 2 1\n"));
    REQUIRE(scene.materials.size() == 4);
    CHECK(scene.triangle_materials == std::vector<std::uint32_t>{0, 1, 2, 3, 0});
    CHECK(scene.materials[0].base_color == Vec3f(0.5f, 0, 0));
    CHECK(scene.materials[0].emission == Vec3f(1, 2, 3));
    CHECK(scene.materials[1].base_color == Vec3f(0.25f));
    CHECK(!scene.materials[1].base_color_texture);
    CHECK(scene.materials[1].alpha_mode == AlphaMode::opaque);
    CHECK(scene.materials[3].base_color == Vec3f(1, 0, 0.5f));
    CHECK(noted(scene, "1 material libraries are missing, in line 2: 'absent.mtl'"));
    CHECK(noted(scene, "sub/my wood 1.png: no such file"));
    CHECK(noted(scene, "mask.png: no such file"));
    CHECK(scene.materials[2].transmission == 1); // glass has no coverage of its own
    CHECK(scene.materials[2].thickness > 0);
    CHECK(scene.materials[2].alpha_mode == AlphaMode::opaque);
    CHECK(scene.materials[3].alpha == 0.75f);
    CHECK(scene.materials[3].alpha_mode == AlphaMode::blend);
    std::filesystem::create_directory(folder.file("scene"));
    folder.write("scene/c.mtl", "newmtl m\nKd 0 0 0\n");
    folder.write("d.mtl", "newmtl m\nKd 1 1 1\n");
    const std::string text = "usemtl m\n" + triangle + "f 1 2 3\n";
    CHECK(load_obj(folder.write("scene/a.obj", "mtllib c.mtl\n" + text)).materials[0].base_color == Vec3f(0));
    const std::string outside = folder.write("scene/b.obj", "mtllib ../d.mtl\n" + text);
    CHECK(noted(load_obj(outside), "1 material libraries are missing"));
    LoadOptions wider;
    wider.root = folder.file("");
    CHECK(load_obj(outside, wider).materials[0].base_color == Vec3f(1));
}

TEST_CASE("OBJ: limits hold before memory is taken") {
    const TemporaryFolder folder;
    const std::string path = folder.write("a.obj", triangle + "v 1 1 0\nf 1 2 4 3\n");
    CHECK(load_obj(path).triangles.size() == 2);
    CHECK_THROWS_AS(load_obj(path, {.max_triangles = 1}), Error);
    CHECK_THROWS_AS(load_obj(path, {.max_vertices = 3}), Error);
}

TEST_CASE("OBJ: comments, continued lines, unknown words, UTF-16") {
    const Scene<float> scene = parse_obj("\xef\xbb\xbfv 0 0 0 # first\nv 1 0 0\n# C:\\folder\\\nv 0 1 0\nvt 1 1 # one\n"
                                         "foo\nfoo\nf 1 \\\n2 3 # 4\nf 1 2 3\\",
                                         "a.obj");
    CHECK(scene.triangles.size() == 2);
    CHECK(scene.positions.size() == 3);
    CHECK(noted(scene, "a.obj: 2 lines begin with an unknown word and were skipped, the first in line 6: 'foo'"));
    CHECK(parse_obj("g a\no b\nvp 1\ncstype bezier\n", "a.obj").notes.empty());
    CHECK_THROWS_AS(parse_obj("\xff\xfev\0 \0", "a.obj"), Error);
}

TEST_CASE("OBJ: a file read in pieces is the text as a whole, lines longer than a piece included") {
    const TemporaryFolder folder;
    std::string text = "# " + std::string(detail::ObjLines::piece + 7, 'x') + "\r\n";
    for (int i = 0; i < 40000; ++i)
        text +=
            "v " + std::to_string(i) + ".25 " + std::to_string(i % 7) + " 1\n" + (i % 3 == 2 ? "f -1 \\\n-2 -3\n" : "");
    text += "f" + std::string(3 * detail::ObjLines::piece, ' ');
    for (int i = 1; i <= 40000; ++i) text += " " + std::to_string(i);
    for (const char* end : {"", "\n", "\r\n", "\nf 1 2 3"}) {
        const Scene<float> file = load_obj(folder.write("a.obj", text + end)), whole = parse_obj(text + end, "a.obj");
        CHECK(file.positions == whole.positions);
        CHECK(file.triangles == whole.triangles);
        CHECK(whole.triangles.size() == 40000 / 3 + 39998 + (end[0] == '\n' && end[1] == 'f'));
    }
}

TEST_CASE("OBJ: lines that end about the end of a piece") {
    const TemporaryFolder folder;
    for (std::size_t size = detail::ObjLines::piece - 3; size <= detail::ObjLines::piece + 3; ++size)
        for (const char* end : {"\n", "\r\n"}) {
            CAPTURE(size);
            const std::string text = "#" + std::string(size - 1, 'x') + end + triangle + "f 1 2 3";
            CHECK(load_obj(folder.write("a.obj", text)).triangles.size() == 1);
        }
}

TEST_CASE("OBJ: corners of skipped faces make no vertices") {
    const Scene<float> scene = parse_obj(triangle + "v 1e6 0 0\nf 1 2\nf 4\nf 1 2 3\n", "a.obj");
    CHECK(scene.positions.size() == 3);
    CHECK(scene.origin == Vec3d(0));
}

TEST_CASE("OBJ: a v with many texture coordinates is one vertex for each") {
    std::string text = triangle;
    for (int i = 0; i < 100; ++i) text += "vt " + std::to_string(i) + " 0\n";
    for (int round = 0; round < 2; ++round)
        for (int i = 1; i <= 100; ++i) text += "f 1/" + std::to_string(i) + " 2 3\n";
    const Scene<float> scene = parse_obj(text, "a.obj");
    CHECK(scene.positions.size() == 102);
    for (std::size_t i = 0; i < 200; ++i) CHECK(scene.texcoords[scene.triangles[i].x].x == float(i % 100));
}

TEST_CASE("scenes far from the origin keep their bits") {
    const TemporaryFolder folder;
    const Scene<float> far =
        load_obj(folder.write("a.obj", "v 1000000.001 5 -2000000.002\nv 1000001.003 5 -2000000.002\nv "
                                       "1000000.001 6.0004 -2000001\nf 1 2 3\n"));
    const Vec3d expected[3] = {
        {1000000.001, 5, -2000000.002}, {1000001.003, 5, -2000000.002}, {1000000.001, 6.0004, -2000001}};
    for (std::size_t i = 0; i < 3; ++i)
        CHECK(max_component(abs(Vec3d(far.positions[i]) + far.origin - expected[i])) < 1e-6);
    const Scene<float> near = load_obj(folder.write("b.obj", "v 0 0 0\nv 556 0 0\nv 0 548.8 559.2\nf 1 2 3\n"));
    CHECK(near.origin == Vec3d(0));
    const Scene<double> exact = load_obj<double>(folder.file("a.obj"));
    CHECK(max_component(abs(exact.positions[1] + exact.origin - expected[1])) < 1e-9);
}
