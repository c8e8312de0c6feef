#include "support/brute_force.hpp"
#include "support/random.hpp"
#include "support/rays.hpp"
#include "support/skip.hpp"
#include <doctest/doctest.h>
#include <filesystem>
#include <lambent/bvh/bvh.hpp>
#include <lambent/io/scene_file.hpp>
#include <string>

using namespace lambent;
using namespace lambent_test;

namespace {

void compare(const std::string& file, std::size_t rays) {
    const std::string path = std::string(LAMBENT_SHARED_DIR) + "/scenes/" + file;
    if (!std::filesystem::exists(path)) return skip("rays against brute force: no scenes/" + file);
    const Scene<float> scene = load_scene<float>(path);
    lambent_test::Mesh<float> mesh;
    mesh.name = file;
    mesh.vertices = scene.positions;
    mesh.faces = scene.triangles;
    std::vector<Corners<float>> all;
    for (std::size_t i = 0; i < mesh.faces.size(); ++i) all.push_back(mesh.triangle(i));
    const PrunedBruteForce<float> oracle(all);
    const auto bvh = BasicBvh<float>::build(triangles(mesh.vertices, mesh.faces));
    const Vec3f center = 0.5f * (bvh.bounds().min + bvh.bounds().max);
    const double extent = 0.5 * double(length(bvh.bounds().max - bvh.bounds().min));

    Random random(11);
    std::size_t hits = 0, different = 0, occlusion = 0;
    for (std::size_t i = 0; i < rays; ++i) {
        const Ray<float> ray = hard_ray(mesh, i, random, extent, center);
        if (is_black(ray.direction)) continue;
        const Hit<float> hit = bvh.intersect(ray);
        const float expected = oracle.nearest(ray);
        if (i % (rays / 40) == 0) CHECK(expected == brute_force<float>(all, ray)); // the boxes leave nothing out
        hits += std::size_t(is_finite(expected));
        different += std::size_t(hit.t != expected || bool(hit) != is_finite(expected));
        occlusion += std::size_t(bvh.occluded(ray) != is_finite(expected));
    }
    INFO(file);
    CHECK(hits > rays / 5);
    CHECK(different == 0);
    CHECK(occlusion == 0);
}

} // namespace

TEST_CASE("G2: hard rays through Sponza equal brute force to the bit") { compare("sponza_crytek/sponza.glb", 60000); }
TEST_CASE("G2: hard rays through Sibenik equal brute force to the bit") { compare("sibenik/sibenik.obj", 60000); }
