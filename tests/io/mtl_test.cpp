#include <lambent/io/mtl_surface.hpp>
#include <io/notes.hpp>
#include <support/skip.hpp>
#include <doctest/doctest.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

using namespace lambent;
using namespace lambent_test;
using detail::MtlMap;
using detail::MtlMaterial;
using detail::MtlSurface;

namespace {

struct Library {
    std::map<std::string, MtlMaterial> materials;
    std::vector<std::string> notes;

    bool noted(const std::string& text) const {
        return std::any_of(notes.begin(), notes.end(), [&](const auto& n) { return n.find(text) != n.npos; });
    }
};

Library parse_library(const std::string& text) {
    Library library;
    const std::string name = "a.mtl";
    detail::parse_mtl(detail::ObjLines(text, name), library.materials, library.notes);
    return library;
}

MtlMaterial material_of(const std::string& statements) {
    return parse_library("newmtl m\n" + statements).materials["m"];
}

MtlSurface surface_of_text(const std::string& statements) { return detail::surface_of(material_of(statements)); }

} // namespace

TEST_CASE("MTL: every value of a material") {
    const MtlMaterial m =
        material_of("Ka 1 0 0\nKd .5 .25 .125 # grey\nKs 0.5\nKe 1 2 3\nTf 0.1 0.2 0.3\nNs 10\nNi 1.5\n"
                    "d -halo 0.75\nillum 7\nPr 0.1\nPm 0.2\nPs 0.3\nPc 0.4\nPcr 0.6\naniso 0.7\n"
                    "anisor 0.8\n");
    CHECK(m.ambient == Vec3f(1, 0, 0));
    CHECK(m.diffuse == Vec3f(0.5f, 0.25f, 0.125f));
    CHECK(m.specular == Vec3f(0.5f));
    CHECK(m.emission == Vec3f(1, 2, 3));
    CHECK(m.filter == Vec3f(0.1f, 0.2f, 0.3f));
    CHECK(m.shininess == 10);
    CHECK(m.index == 1.5f);
    CHECK(m.opacity == 0.75f);
    CHECK(m.illumination == 7);
    CHECK(m.roughness == 0.1f);
    CHECK(m.metallic == 0.2f);
    CHECK(m.sheen == 0.3f);
    CHECK(m.clearcoat == 0.4f);
    CHECK(m.clearcoat_roughness == 0.6f);
    CHECK(m.anisotropy == 0.7f);
    CHECK(m.anisotropy_rotation == 0.8f);
    CHECK_FALSE(material_of("Kd 1 1 1").specular);
    CHECK_FALSE(material_of("Ks spectral file.rfl 1").specular);
    CHECK(material_of("Kd xyz 1 1 1").diffuse == Vec3f(0.8f));
}

TEST_CASE("MTL: opacity by d, else by 1 - Tr, in [0, 1]") {
    CHECK(material_of("Tr 0.25").opacity == 0.75f);
    CHECK(material_of("d 0.5\nTr 0.25").opacity == 0.5f);
    CHECK(material_of("Tr 0.25\nd 0.5").opacity == 0.5f);
    CHECK(material_of("Tr 7").opacity == 0);
    CHECK(material_of("d 7").opacity == 1);
    auto twice = parse_library("newmtl a\nd 0.5\nnewmtl b\nTr 1\n").materials;
    CHECK(twice["b"].opacity == 0);
}

TEST_CASE("MTL: textures with their options, before the name and behind it; names with spaces and minus signs") {
    const MtlMaterial m =
        material_of("map_Kd -clamp on -s 2 3 4 -o 0.5 sub\\a wood - 1.png\n"
                    "bump -bm 2 -imfchan r -blendu off bump 01.png  \n"
                    "norm -type sphere n.png\nmap_d -mm 0.25 2 -t 1 1 -boost 3 -texres 256 -cc on a b.png\n"
                    "map_Ks my picture.jpg -bm 1.5 -clamp on\nmap_Ns -odd.png\nmap_Ke a -s.png\n"
                    "map_Pr r.png\nmap_Pm m.png\n");
    CHECK(m.diffuse_map.file == "sub/a wood - 1.png");
    CHECK(m.diffuse_map.clamp);
    CHECK(m.diffuse_map.moved);
    CHECK(m.diffuse_map.scale == Vec2f(2, 3));
    CHECK(m.diffuse_map.offset == Vec2f(0.5f, 0));
    CHECK(m.bump_map.file == "bump 01.png");
    CHECK(m.bump_map.bump == 2);
    CHECK(m.bump_map.channel == 'r');
    CHECK_FALSE(m.bump_map.moved);
    CHECK(m.normal_map.file == "n.png");
    CHECK(m.opacity_map.file == "a b.png");
    CHECK(m.opacity_map.base == 0.25f);
    CHECK(m.opacity_map.gain == 2);
    CHECK(m.opacity_map.moved);
    CHECK(m.specular_map.file == "my picture.jpg");
    CHECK(m.specular_map.bump == 1.5f);
    CHECK(m.specular_map.clamp);
    CHECK(m.shininess_map.file == "-odd.png");
    CHECK(m.emission_map.file == "a -s.png");
    CHECK(m.roughness_map.file == "r.png");
    CHECK(m.metallic_map.file == "m.png");
    CHECK(material_of("map_Bump b.png").bump_map.file == "b.png");
}

TEST_CASE("MTL: what is odd is counted, with its first line; numbers that are none are refused") {
    const Library odd = parse_library("Kd 1 1 1\nnewmtl a\nfoo 1\nfoo 2\nmap_Kd -clamp maybe a.png\nmap_Kd -s x.png\n"
                                      "map_Kd -bm\nnewmtl b\nnewmtl a\n");
    CHECK(odd.noted("a.mtl: 2 lines begin with an unknown word and were skipped, the first in line 3: 'foo'"));
    CHECK(odd.noted("a.mtl: 4 texture options have wrong values and were skipped, the first in line 5: '-clamp'"));
    CHECK(odd.noted("a.mtl: 1 lines before any newmtl were skipped, in line 1: 'Kd'"));
    CHECK(odd.noted("a.mtl: 1 materials are defined more than once, the last definition counts, in line 9: 'a'"));
    CHECK(parse_library("newmtl a\nKa 1 1 1\nsharpness 60\nmap_Ka a.png\ndisp d.png\nillum 2\n").notes.empty());
    for (const char* text : {"Kd x", "Ns nan", "d 1e999", "Ks 1e300", "Pr -", "illum two"}) {
        CAPTURE(text);
        std::string message;
        try {
            material_of(text);
        } catch (const Error& error) {
            message = error.what();
        }
        CHECK(message.find("a.mtl:2: ") != std::string::npos);
    }
}

TEST_CASE("MTL: illum 0 to 2 is Lambert, with a highlight where model 2 has a Ks") {
    const MtlSurface plain = surface_of_text("Kd 0.5 2 -1\nKs 0 0 0\nNs 100\nillum 2\nNi 1");
    CHECK(plain.base_color == Vec3f(0.5f, 1, 0));
    CHECK(plain.specular == 0);
    CHECK(plain.metallic == 0);
    CHECK(plain.transmission == 0);
    CHECK(surface_of_text("Ks 1 1 1\nillum 1").specular == 0);
    for (const Vec3f ks : {Vec3f(0.01f, 0.02f, 0), Vec3f(0.5f), Vec3f(1, 0.5f, 0)}) {
        const MtlSurface shiny = surface_of_text("illum 2\nNs 98\nKs " + std::to_string(ks.x) + " " +
                                                 std::to_string(ks.y) + " " + std::to_string(ks.z));
        const Vec3f f0 = min(0.04f * shiny.specular_color, Vec3f(1)) * shiny.specular; // KHR_materials_specular
        for (int k = 0; k < 3; ++k) CHECK(f0[k] == doctest::Approx(0.08f * ks[k]));
        CHECK(shiny.ior == 1.5f);
        CHECK(std::pow(shiny.roughness, 4.0f) == doctest::Approx(0.02f));
    }
    CHECK(surface_of_text("Ks 0.5 0.5 0.5").specular == 1);
    CHECK(surface_of_text("Ke 4 5 6").emission == Vec3f(4, 5, 6));
    CHECK(detail::roughness_of_exponent(0) == 1);
    CHECK(detail::roughness_of_exponent(1e9f) < 0.01f);
}

TEST_CASE("MTL: mirrors, glass, coverage, and the extension for physically based shading") {
    const MtlSurface gold = surface_of_text("Kd 0 0 0\nKs 1 0.8 0.3\nillum 3");
    CHECK(gold.metallic == 1);
    CHECK(gold.base_color == Vec3f(1, 0.8f, 0.3f));
    CHECK(gold.roughness == 0);
    const MtlSurface mixed = surface_of_text("Kd 0.25\nKs 0.25\nNs 0\nillum 5");
    CHECK(mixed.metallic == 0.5f);
    CHECK(mixed.base_color == Vec3f(0.5f));
    CHECK(mixed.roughness == 1);
    CHECK(surface_of_text("Kd 0.5\nKs 0\nillum 3").metallic == 0);

    for (const char* model : {"4", "6", "7", "9"}) {
        const MtlSurface glass =
            surface_of_text("Kd 1 0 0\nNi 1.33\nTf 0.5 0.75 1\nd 0.25\nNs 10\nillum " + std::string(model));
        CHECK(glass.transmission == 1);
        CHECK(glass.ior == 1.33f);
        CHECK(glass.base_color == Vec3f(0.5f, 0.75f, 1));
        CHECK(glass.roughness == 0);
        CHECK(glass.alpha == 1);
    }
    CHECK(surface_of_text("illum 7\nNi 0.2").ior == 1.5f);
    CHECK(surface_of_text("illum 7").base_color == Vec3f(1));
    CHECK(surface_of_text("illum 2\nd 0.25").alpha == 0.25f);

    const MtlSurface physical =
        surface_of_text("Kd 0.5\nKs 1\nNs 10\nillum 3\nPr 0.2\nPm 0.3\nPs 0.4\nPc 0.5\nPcr 0.6\nNi 1.4");
    CHECK(physical.base_color == Vec3f(0.5f));
    CHECK(physical.roughness == 0.2f);
    CHECK(physical.metallic == 0.3f);
    CHECK(physical.ior == 1.4f);
    CHECK(physical.specular_color == Vec3f(1));
    CHECK(physical.sheen_color == Vec3f(0.4f));
    CHECK(physical.clearcoat == 0.5f);
    CHECK(physical.clearcoat_roughness == 0.6f);
    CHECK(surface_of_text("map_Pm m.png\nmap_Pr r.png").metallic == 1);
    CHECK(surface_of_text("Pr 0.25\nillum 7").roughness == 0.25f);
}

TEST_CASE("MTL: values at the ends of their ranges give finite surfaces") {
    for (const char* ks : {"0", "1e-45", "1e-30", "1e-6", "1", "3e38", "-3e38"})
        for (int model = 0; model <= 10; ++model) {
            const MtlSurface s = surface_of_text("Kd " + std::string(ks) + "\nNs " + ks + "\nNi " + ks + "\nTf " + ks +
                                                 "\nKs " + ks + " 0 0\nillum " + std::to_string(model));
            CAPTURE(ks);
            CHECK(is_finite(s.base_color));
            CHECK(is_finite(s.specular_color));
            for (const float x : {s.metallic, s.roughness, s.specular, s.transmission, s.alpha})
                CHECK((x >= 0 && x <= 1));
            CHECK((is_finite(s.ior) && s.ior >= 1));
        }
}

TEST_CASE("MTL: the libraries of the shared scenes") {
    const std::string folder = std::string(LAMBENT_SHARED_DIR) + "/scenes/";
    if (!std::filesystem::exists(folder + "obj_features")) return skip("shared scenes: no obj_features");
    const auto load = [&](const std::string& name) {
        Library library;
        const std::string path = folder + name;
        detail::parse_mtl(detail::ObjLines(path), library.materials, library.notes);
        CAPTURE(name);
        CHECK(library.notes.empty());
        return library.materials;
    };
    auto options = load("obj_features/texture-options-issue-85.mtl");
    CHECK(options.size() == 3);
    CHECK(options["default"].diffuse_map.offset == Vec2f(0.1f, 0));
    CHECK(options["default"].specular_map.scale == Vec2f(0.1f, 0.2f));
    CHECK(options["default"].bump_map.bump == 3);
    CHECK(options["bm2"].bump_map.file == "bumpmap2.jpg");
    CHECK(options["bm2"].bump_map.bump == 1.5f);
    CHECK(options["bm2"].bump_map.channel == 'r');
    CHECK(options["bm2"].shininess_map.gain == 0.3f);
    CHECK(options["bm3"].opacity_map.file == "alpha.jpg");
    CHECK(load("obj_features/pbr-mat-ext.mtl")["pbr"].normal_map.file == "normalmap.tex");
    CHECK(load("obj_features/texture-filename-with-whitespace.mtl")["red"].bump_map.file == "bump 01.png");
    auto sibenik = load("sibenik/sibenik.mtl");
    CHECK(detail::surface_of(sibenik["staklo"]).transmission == 1);
    CHECK(detail::surface_of(sibenik["staklo"]).base_color == Vec3f(0.5f));
    CHECK(detail::surface_of(sibenik["kamen_zid"]).specular == 0);
}
